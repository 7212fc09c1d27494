//! The preview of the selected run or group.

use super::run_list::colour_of;
use super::*;
use crate::tui::testing::run_summary;
use crate::tui::view::Grouping;
use mge_run::Practised;

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
    let screen = preview(view);
    assert!(screen.contains("ddpg.gamma 0.5"), "{screen}");
    assert_eq!(screen.matches("episodes 3000").count(), 1, "{screen}");
}

#[test]
fn a_note_stands_out_from_the_hint_to_write_one() {
    let noted = |note: &str| {
        let mut view = typical();
        change_run(&mut view, 1, |run| run.note = note.to_owned());
        let (mut app, _) = app(view);
        press(&mut app, "5");
        app
    };
    let mut without = noted("");
    assert_eq!(colour_of(&mut without, (200, 60), "writes a note"), without.theme.dim);
    let mut with = noted("it holds");
    assert_ne!(colour_of(&mut with, (200, 60), "it holds"), with.theme.dim);
    let mut long = noted(&"it holds ".repeat(200));
    let screen = text(&shot(&mut long, 120, 40));
    assert!(screen.contains("it holds") && screen.contains(" more lines"), "{screen}");
}

#[test]
fn the_rollouts_of_practice_are_counted_by_stage() {
    let mut view = typical();
    let practised = Practised { rollouts: vec![75, 75], reached: vec![56, 20], actions: 1165 };
    change_run(&mut view, 1, |run| run.practised = Some(practised));
    let screen = preview(view);
    assert!(screen.contains("subgoal 1 56 of 75, goal 20 of 75, 1165 actions"), "{screen}");
}
