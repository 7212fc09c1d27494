//! Ways to leave the workbench.

use super::*;

#[test]
fn leaving_asks_only_if_something_would_be_lost() {
    let leaving = |view: ViewModel, keys: &str| {
        let (mut app, _) = app(view);
        press(&mut app, keys);
        app.is_leaving()
    };
    assert!(leaving(empty(), "q"));
    assert!(leaving(failed(), "q"));
    assert!(!leaving(typical(), "q"));
    assert!(!leaving(typical(), "q esc"));
    assert!(leaving(typical(), "q y"));
    assert!(leaving(empty(), "e ctrl-c"), "from within a layer, too");
    check(typical(), "q", &[], "y   keep a checkpoint, stop and leave without saving");
    check(typical(), "q", &[], "The task task1 is edited and not saved");
    check(typical(), "q", &[], "b   leave it training in the background without saving");
    let saved = "save my-task1.json";
    check(typical(), "q s", &[saved], "");
    assert!(leaving(typical(), "q s"));
    let mut named = typical();
    named.file = Some("mine.json".into());
    check(named, "q s", &["save mine.json"], "");
    let proposed = ViewModel { proposed: typical().proposed, ..empty() };
    check(proposed, "q", &[], "1 proposal for task1, not accepted yet, would be lost.");
    check(ViewModel { proposing: Some((1, 3)), ..empty() }, "q", &[], "The search for subgoals ends without a result.");
    check(empty(), "3 up q", &[], "The schedule you have drawn is not in use");
}

#[test]
fn leaving_can_wait_until_all_runs_are_done() {
    let mut view = typical();
    (view.dirty, view.proposed) = (false, Vec::new());
    check(view.clone(), "q w", &[], "leaving when all runs are done");
    check(typical(), "q w", &[], "all runs are done, after a question about what is paused or not saved");
    let (mut busy, _) = app(view.clone());
    press(&mut busy, "q w");
    assert_eq!(busy.leaving, QuitState::WhenIdle);
    press(&mut busy, "q esc");
    assert_eq!(busy.leaving, QuitState::WhenIdle, "a question that is closed changes nothing");
    press(&mut busy, "q w");
    assert_eq!(busy.leaving, QuitState::No);
    assert!(busy.message().contains("staying when all runs are done"));
    change_run(&mut view, 1, |run| (run.active, run.state) = (false, RunState::Finished));
    let (mut idle, _) = app(view);
    idle.leaving = QuitState::WhenIdle;
    idle.tick(std::time::Duration::ZERO);
    assert!(idle.is_leaving());
    let (mut edited, _) = app(failed());
    press(&mut edited, "3 up");
    edited.leaving = QuitState::WhenIdle;
    edited.tick(std::time::Duration::ZERO);
    assert!(!edited.is_leaving() && !edited.layers.is_empty(), "unsaved edits are asked about");
}

#[test]
fn an_open_question_delays_leaving_until_it_is_answered() {
    let mut view = typical();
    (view.dirty, view.proposed) = (false, Vec::new());
    let (mut app, _) = app(view.clone());
    press(&mut app, "q w 5 x");
    change_run(&mut view, 1, |run| (run.active, run.state) = (false, RunState::Finished));
    bring(&mut app, view);
    assert!(!app.is_leaving() && app.layers.len() == 1);
    press(&mut app, "esc");
    assert!(app.is_leaving());
}

#[test]
fn a_queued_run_is_shown_as_queued_and_leaving_lists_all_runs() {
    let mut view = typical();
    change_run(&mut view, 0, |run| run.queued = true);
    check(view.clone(), "5 / s t a t e : q u e u e d enter enter", &["open runs/old"], "old");
    check(view.clone(), "q", &[], "old was waiting for a core");
    check(view, "q", &[], "task1-ddpg-mge-seed0 was being trained when you asked.");
}

#[test]
fn trainings_can_go_on_in_the_background() {
    let (mut app, _) = app(typical());
    press(&mut app, "q");
    assert!(text(&shot(&mut app, 120, 40)).contains("leave it training in the background"));
    press(&mut app, "b");
    assert!(app.is_leaving());
    assert_eq!(app.background.clone(), [std::path::PathBuf::from("runs/task1-ddpg-mge-seed0")]);
    let (mut app, _) = super::app(typical());
    press(&mut app, "q y");
    assert!(app.is_leaving() && app.background.clone().is_empty());
}

#[test]
fn the_quit_command_asks_too_and_repeated_keys_ask_once() {
    check(typical(), ": q u i t enter", &[], "leave the workbench?");
    let (mut app, _) = app(typical());
    press(&mut app, "q q ctrl-c ctrl-c q");
    assert_eq!(app.layers.len(), 1);
    let mut ended = typical();
    change_run(&mut ended, 1, |run| (run.active, run.state) = (false, RunState::Finished));
    bring(&mut app, ended);
    assert_eq!(app.layers.len(), 1, "the end of a run answers no question");
    press(&mut app, "enter");
    assert!(!app.is_leaving() && app.layers.is_empty());
}

#[test]
fn a_paused_run_does_not_go_on_in_the_background() {
    let mut view = typical();
    change_run(&mut view, 1, |run| run.state = RunState::Paused);
    let (mut alone, _) = app(view.clone());
    press(&mut alone, "q");
    let screen = text(&shot(&mut alone, 120, 40));
    assert!(screen.contains("was paused when") && !screen.contains("in the background"), "{screen}");
    change_run(&mut view, 0, |run| (run.active, run.state) = (true, RunState::Running));
    let (mut app, _) = app(view);
    press(&mut app, "q b");
    assert_eq!(app.background.clone(), [std::path::PathBuf::from("runs/old")]);
}
