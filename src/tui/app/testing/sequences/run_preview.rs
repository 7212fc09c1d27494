//! The preview of the selected run or group.

use super::run_list::colour_of;
use super::*;
use crate::tui::testing::run_summary;
use crate::tui::view::{Grouping, RunDetails};
use mge_run::Practised;

fn preview(view: ViewModel) -> String {
    let (mut app, _) = app(view);
    press(&mut app, "5");
    text(&shot(&mut app, 200, 60))
}

#[test]
fn files_are_listed_with_their_sizes_and_the_log_ends_with_its_latest_line() {
    let files = [("config.json", Some(5_000)), ("log.jsonl", Some(123_456)), ("a.bin", Some(23_000_000)), ("b", None)];
    let mut view = typical();
    view.details = Some(Arc::new(RunDetails {
        path: view.runs[1].path.clone(),
        files: files.map(|(name, bytes)| (name.to_owned(), bytes)).to_vec(),
        log: (1..=60).map(|line| format!("line {line}.")).collect(),
    }));
    let screen = preview(view.clone());
    for shown in ["config.json", " 5000 B", " 123 kB", " 23 MB", " folder", "line 59.", "line 60."] {
        assert!(screen.contains(shown), "`{shown}` is not on\n{screen}");
    }
    check(view, "5 down", &[], "the files are being read");
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
    view.groups = Arc::new(Grouping::new(&view.runs, &Grouping::default(), None));
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
fn practice_that_ended_before_the_last_stage_says_so() {
    let practised = |reached: &[u32]| {
        let practised = Practised { rollouts: vec![75; reached.len()], reached: reached.to_vec(), actions: 1165 };
        let mut view = typical();
        change_run(&mut view, 1, |run| run.practised = Some(practised));
        preview(view)
    };
    let one = practised(&[56]);
    assert!(one.contains("subgoal 1 reached by 56 of 75") && one.contains("no later stage practised"), "{one}");
    let both = practised(&[56, 20]);
    assert!(both.contains("the goal reached by 20 of 75") && !both.contains("no later stage practised"), "{both}");
}

#[test]
fn only_groups_on_the_task_of_the_selected_one_are_compared() {
    let mut view = grouped();
    for place in 3..6 {
        change_run(&mut view, place, |run| {
            Arc::make_mut(&mut Arc::make_mut(&mut run.config).task).name = "task4".to_owned();
        });
    }
    view.groups = Arc::new(Grouping::new(&view.runs, &Grouping::default(), None));
    let screen = preview(view);
    assert!(screen.contains("task4: DDPG") && !screen.contains("listed, on"), "{screen}");
}
