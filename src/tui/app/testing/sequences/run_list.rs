//! The list of runs: columns, order, states, and the room it gets.

use ratatui::style::Color;

use super::super::wanted;
use super::*;
use crate::tui::testing::run_summary;
use crate::tui::view::{Grouping, RunSummary};

/// Finished runs, the latest last.
fn numbered(count: usize) -> ViewModel {
    let runs = (0..count).map(|number| Arc::new(run_summary(&format!("run-{number:03}"))));
    ViewModel { runs: runs.collect(), ..empty() }
}

/// The colour of the first place on the screen with these words.
pub(super) fn colour_of(app: &mut App, size: (u16, u16), words: &str) -> Color {
    let screen = shot(app, size.0, size.1);
    let shown = text(&screen);
    let found = shown.lines().enumerate().find(|(_, line)| line.contains(words));
    let (row, line) = found.unwrap_or_else(|| panic!("`{words}` is not on\n{shown}"));
    let column = line.split(words).next().unwrap_or_default().chars().count();
    screen[(column as u16, row as u16)].fg
}

#[test]
fn a_single_run_is_named_in_questions_and_reports() {
    check(typical(), "5 down X", &[], "delete 1 run?");
    check(grouped(), "5 X", &[], "runs?");
}

#[test]
fn a_run_from_elsewhere_is_opened_by_its_path() {
    check(typical(), "5 O", &[], "open FOLDER");
    check(typical(), "5 O x enter", &["open x"], "");
}

#[test]
fn an_empty_list_says_that_the_folder_is_being_read() {
    check(ViewModel { damaged: vec!["a: no".into()], ..grouped() }, "5", &[], "1 damaged: 8 tells why");
    check(ViewModel { runs_unread: 3, ..empty() }, "5", &[], "The runs in this folder are being read.");
}

#[test]
fn a_group_whose_runs_all_wait_is_queued() {
    let mut view = grouped();
    for place in 3..6 {
        change_run(&mut view, place, |run| (run.state, run.queued) = (RunState::NotStarted, true));
    }
    let (mut app, _) = app(view);
    press(&mut app, "5");
    let screen = text(&shot(&mut app, 120, 40));
    assert!(screen.contains("3 queued"), "{screen}");
    let mut view = grouped();
    change_run(&mut view, 3, |run| (run.state, run.active) = (RunState::Running, true));
    change_run(&mut view, 4, |run| (run.state, run.active) = (RunState::Paused, true));
    check(view, "5", &[], "1 of 3 running");
}

#[test]
fn the_column_of_states_has_room_for_them() {
    let mut view = grouped();
    change_run(&mut view, 1, |run| run.state = RunState::NotStarted);
    check(view, "5", &[], "1 not started ");
}

#[test]
fn a_group_and_its_runs_are_shown_in_the_same_state() {
    let mut view = grouped();
    (3..6).for_each(|place| change_run(&mut view, place, |run| run.success = Some(0.9)));
    check(view.clone(), "5", &[], "seeds 0, 1, 2: success 90 %");
    check(view.clone(), "5", &[], " 90 % ");
    // The groups are those of before a run was deleted.
    view.runs.remove(5);
    check(view, "5", &[], "seeds 0, 1: success 90 %");
}

#[test]
fn states_have_their_colours() {
    let run = |name: &str, state: RunState| Arc::new(RunSummary { state, ..run_summary(name) });
    let runs = vec![
        run("a", RunState::Finished),
        run("b", RunState::Running),
        run("c", RunState::Paused),
        run("d", RunState::Failed("no reason".into())),
        // The selected row has no colours.
        run("e", RunState::Interrupted),
    ];
    let (mut app, _) = app(ViewModel { runs, ..empty() });
    press(&mut app, "5");
    let states = [
        ("finished", app.theme.good),
        ("running", app.theme.accent),
        ("paused", app.theme.warn),
        ("failed", app.theme.bad),
    ];
    for (word, colour) in states {
        assert_eq!(colour_of(&mut app, (100, 40), word), colour, "{word}");
    }
}

#[test]
fn a_long_reason_for_a_failure_leaves_room_for_the_list() {
    let mut view = numbered(8);
    change_run(&mut view, 7, |run| run.state = RunState::Failed("no reason ".repeat(60)));
    let (mut app, _) = app(view);
    press(&mut app, "5");
    let screen = text(&shot(&mut app, 60, 20));
    assert!(screen.contains("failed: no reason") && screen.contains("run-000 "), "{screen}");
}

#[test]
fn only_the_curves_of_runs_near_the_selected_one_are_requested() {
    let (mut app, _) = app(numbered(200));
    wanted();
    press(&mut app, "5");
    let curves = wanted().into_iter().find(|what| what.starts_with("curves of")).unwrap();
    assert!(curves.contains("run-199 run-198 ") && curves.contains("run-150"), "{curves}");
    assert!(!curves.contains("run-100"), "{curves}");
}

#[test]
fn more_than_a_number_excludes_the_number() {
    let run = |name: &str, done: u64| Arc::new(RunSummary { done, ..run_summary(name) });
    let view = ViewModel { runs: vec![run("a", 100), run("b", 50), run("c", 10)], ..empty() };
    check(view, "5 / d o n e > 5 0 enter s end enter", &["open runs/a"], "with `done>50`");
}

#[test]
fn a_renamed_run_is_found_by_its_folder_which_its_card_names() {
    let mut view = grouped();
    change_run(&mut view, 4, |run| run.name = "best".into());
    check(view.clone(), "5 / p l a i n - 1 enter", &[], "best (runs/plain-1): task1");
    check(view.clone(), "5 / n a m e = b e s t enter enter", &["open runs/plain-1"], "");
    change_run(&mut view, 4, |run| run.name = "5".into());
    check(view.clone(), "5 / n a m e = 5 enter enter", &["open runs/plain-1"], "");
    change_run(&mut view, 4, |run| run.name = "best".into());
    change_run(&mut view, 4, |run| run.elsewhere = true);
    check(view.clone(), "5", &[], "DDPG (3, 1 elsewhere)");
    (3..6).for_each(|place| change_run(&mut view, place, |run| run.elsewhere = true));
    check(view.clone(), "5", &[], "DDPG (3, elsewhere)");
    check(view, "5 / n a m e = b e s t enter", &[], "best (elsewhere)");
}

#[test]
fn runs_are_found_by_cost_and_speed_once_their_curves_are_read() {
    wanted();
    check(grouped(), "5 / d u r a t i o n > 1 4 0 enter enter", &["open runs/guided-0"], "");
    let all = wanted().into_iter().any(|what| what.contains("guided-0") && what.contains("plain-2"));
    assert!(all, "also those that the filter hides");
    check(grouped(), "5 / s p e e d > 2 0 enter", &[], "No run matches this filter");
    let mut view = grouped();
    change_run(&mut view, 1, |run| run.curves = Arc::default());
    check(view, "5 / s p e e d > 2 0 enter", &[], "not known of 1, whose logs are not read");
}

#[test]
fn selection_and_folding_stay_with_their_runs_when_labels_change() {
    let mut view = grouped();
    let (mut app, asked) = app(view.clone());
    // The second group is unfolded, and its second run is selected.
    press(&mut app, "5 down tab down down");
    for index in 3..6 {
        change_run(&mut view, index, |run| Arc::make_mut(&mut run.config).ddpg.gamma = 0.5);
    }
    let copy = |view: &mut ViewModel, name: &str, change: fn(&mut mge_trainer::RunConfig)| {
        let mut run = RunSummary::clone(&view.runs[3]);
        (run.name, run.path) = (name.into(), format!("runs/{name}").into());
        change(Arc::make_mut(&mut run.config));
        view.runs.push(Arc::new(run));
    };
    copy(&mut view, "plain-3", |config| config.seed = 3);
    view.groups = Arc::new(Grouping::new(&view.runs, &Grouping::default()));
    let label = &view.groups.of(&view.runs[3].path).unwrap().label;
    assert_ne!(*label, grouped().groups.of(&view.runs[3].path).unwrap().label);
    bring(&mut app, view.clone());
    press(&mut app, "enter");
    assert_eq!(*asked.borrow(), ["open runs/guided-1"]);
    let screen = text(&shot(&mut app, 120, 40));
    assert!(screen.contains("guided-0") && !screen.contains("plain-0"), "{screen}");
    // A selected group of which one run is left is that run.
    press(&mut app, "home");
    view.runs.retain(|run| !["plain-1", "plain-2", "plain-3"].contains(&&*run.name));
    copy(&mut view, "other", |config| config.ddpg.gamma = 0.7);
    view.groups = Arc::new(Grouping::new(&view.runs, &Grouping::default()));
    bring(&mut app, view);
    press(&mut app, "enter");
    assert_eq!(asked.borrow().last().unwrap(), "open runs/plain-0");
}

#[test]
fn large_numbers_of_episodes_are_shortened_rather_than_cut() {
    let mut view = grouped();
    for index in 0..6 {
        change_run(&mut view, index, |run| {
            Arc::make_mut(&mut run.config).episodes = if index < 3 { 30_000 } else { 300_000 };
            run.done = 1281;
        });
    }
    check(view.clone(), "5", &[], " 3843/90000 ");
    check(view, "5", &[], " 3843/900k ");
}

#[test]
fn a_run_with_a_changed_epsilon_is_told_from_the_others_of_its_group() {
    let mut view = grouped();
    change_run(&mut view, 4, |run| run.changed = Some("episode 20: epsilon is now 0.1".into()));
    view.groups = Arc::new(Grouping::new(&view.runs, &Grouping::default()));
    check(view.clone(), "5", &[], "(3, 1 changed)");
    check(view.clone(), "5", &[], "seeds 0, 1, 2, changed:");
    check(view.clone(), "5 tab", &[], "plain-1 (changed)");
    check(view.clone(), "5 tab down down", &[], "epsilon is now 0.1");
    check(view, "5", &[], "(3 seeds, 1 changed)");
}
