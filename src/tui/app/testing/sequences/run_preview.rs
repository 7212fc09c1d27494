//! The preview of the selected run or group.

use super::*;
use crate::tui::testing::run_summary;
use crate::tui::view::Grouping;

fn preview(view: ViewModel) -> String {
    let (mut app, _) = app(view);
    press(&mut app, "5");
    text(&shot(&mut app, 200, 60))
}

#[test]
fn each_setting_of_a_run_is_listed_once() {
    let run = |name: &str, episodes: u32, gamma: f32| {
        let mut run = run_summary(name);
        let config = Arc::make_mut(&mut run.config);
        (config.episodes, config.ddpg.gamma) = (episodes, gamma);
        Arc::new(run)
    };
    let mut view = ViewModel { runs: vec![run("a", 1000, 0.9), run("b", 3000, 0.5)], ..empty() };
    view.groups = Arc::new(Grouping::new(&view.runs, &Grouping::default()));
    change_run(&mut view, 0, |run| run.state = RunState::Running);
    change_run(&mut view, 0, |run| run.expected = Some(0.1));
    let screen = preview(view);
    assert!(screen.contains("ddpg.gamma 0.5"), "{screen}");
    let heading = screen.lines().find(|line| line.contains("ddpg.gamma success")).unwrap_or_default();
    assert!(heading.contains("episodes time left"), "the list shows it, too: {screen}");
    assert_eq!(screen.matches("episodes 3000").count(), 1, "{screen}");
}

#[test]
fn the_epsilon_of_a_run_is_the_one_in_force() {
    let mut view = typical();
    change_run(&mut view, 1, |run| Arc::make_mut(&mut run.config).epsilon = "0.125".parse().unwrap());
    let screen = preview(view);
    assert!(screen.contains("epsilon 0.125"), "{screen}");
}

#[test]
fn a_note_comes_before_the_settings() {
    let mut view = typical();
    change_run(&mut view, 1, |run| run.note = "it holds ".repeat(200));
    let (mut app, _) = app(view);
    press(&mut app, "5");
    let screen = text(&shot(&mut app, 120, 40));
    assert!(screen.contains("it holds") && screen.contains(" more lines: +"), "{screen}");
    press(&mut app, "+");
    let whole = text(&shot(&mut app, 120, 40));
    assert!(whole.matches("it holds").count() > screen.matches("it holds").count(), "{whole}");
}
