//! The workbench over real sessions: the runs and tasks it shows are consistent.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use super::super::App;
use super::{press, shot, text};
use crate::tui::effect::Effect;
use crate::tui::view::{Level, SessionWorkspace, Workspace};
use crate::tui::widgets::theme::{Depth, Marker, Palette, Theme};
use mge_run::RunDirectory;
use mge_trainer::RunConfig;
use mge_workbench::{Command, Session, command};

/// A workbench on a task, after these commands and the jobs they start.
fn workbench(task: &str, folder: &Path, lines: &[&str]) -> App {
    let mut session = Session::on_task(task, folder.to_owned()).unwrap();
    for line in lines {
        session.apply(Command::parse(line).unwrap().unwrap()).unwrap();
    }
    session.wait(|_| {}).unwrap();
    let theme = Theme::new(Palette::Dark, Depth::True, Marker::Braille);
    App::new(Box::new(SessionWorkspace::new(session)), theme)
}

/// Commands that train a very short run.
const SHORT: [&str; 4] = ["method ddpg", "episodes 3", "set ddpg.hidden 8", "train"];

/// Lets time pass and returns the screen.
fn seen(app: &mut App) -> String {
    app.tick(Duration::from_millis(300));
    text(&shot(app, 200, 50))
}

#[test]
fn a_past_episode_is_predicted_by_the_model_of_its_own_task() {
    let folder = tempfile::tempdir().unwrap();
    drop(workbench("task1", folder.path(), &SHORT));
    let mut app = workbench("task4", folder.path(), &[]);
    press(&mut app, "5");
    wait_until(&mut app, |app| seen(app).contains("task1-ddpg-seed0"));
    press(&mut app, "enter");
    wait_until(&mut app, |app| app.subject.run().is_some_and(|run| run.done > 0));
    press(&mut app, "1 g home");
    wait_until(&mut app, |app| seen(app).contains("task1 · episode 1 of task1-ddpg-seed0"));
    wait_until(&mut app, |app| !seen(app).contains("no prediction"));
    press(&mut app, "esc");
    assert!(seen(&mut app).contains("task4 · no tool placed"));
}

#[test]
fn a_refused_start_of_a_training_changes_no_setting() {
    let folder = tempfile::tempdir().unwrap();
    let mut app = workbench("task1", folder.path(), &SHORT);
    let (before, lines) = (app.workspace.view().settings.clone(), app.workspace.view().log_total);
    press(&mut app, "t down 5 0 down down 7 up up up right up t a s k 1 - d d p g - s e e d 0 enter");
    assert!(seen(&mut app).contains("already holds a run"), "{}", seen(&mut app));
    press(&mut app, "esc");
    assert_eq!(app.workspace.view().settings, before);
    assert_eq!(app.workspace.view().log_total, lines, "no command was carried out");
}

#[test]
fn another_task_is_opened_while_a_past_episode_is_predicted() {
    let folder = tempfile::tempdir().unwrap();
    let mut app = workbench("task5", folder.path(), &SHORT);
    press(&mut app, "pageup g");
    wait_until(&mut app, |app| seen(app).contains("task5 · episode 3") && app.subject.past_episode() == Some(3));
    app.carry_out(vec![Effect::apply(command::Task("task1".to_owned()))]);
    let screen = seen(&mut app);
    assert!(screen.contains("task5 · episode 3"), "the episode has its own task\n{screen}");
    wait_until(&mut app, |app| !seen(app).contains("no prediction"));
    press(&mut app, "tab right");
    assert!(seen(&mut app).contains("task1 · no tool placed"), "the edited task is shown");
    app.carry_out(vec![Effect::apply(command::Undo)]);
}

#[test]
fn a_finished_run_shows_its_last_episode() {
    let folder = tempfile::tempdir().unwrap();
    let mut app = workbench("task1", folder.path(), &SHORT);
    wait_until(&mut app, |app| seen(app).contains("task1 · episode 3 of task1-ddpg-seed0"));
}

#[test]
fn a_run_keeps_its_place_in_the_list_when_it_is_opened() {
    let folder = tempfile::tempdir().unwrap();
    let config = RunConfig::new(Arc::new(mge_task::load("task1").unwrap()));
    for name in ["a", "b", "c"] {
        RunDirectory::create(folder.path().join(name), &config).unwrap();
    }
    let mut workspace = SessionWorkspace::new(Session::on_task("task1", folder.path().to_owned()).unwrap());
    let names = |workspace: &SessionWorkspace| {
        workspace.view().runs.iter().map(|run| run.name.clone()).collect::<Vec<_>>().concat()
    };
    while names(&workspace) != "abc" {
        workspace.poll();
        std::thread::yield_now();
    }
    workspace.apply(Command::parse(&format!("open {}", folder.path().join("a").display())).unwrap().unwrap()).unwrap();
    assert_eq!(
        (names(&workspace).as_str(), workspace.view().watched.as_ref().unwrap().run.name.as_str()),
        ("abc", "a")
    );
}

#[test]
fn past_episodes_have_the_nearest_agent_and_a_greedy_episode_is_shown_once() {
    let folder = tempfile::tempdir().unwrap();
    let lines = [&["set checkpoints.periodic_every 1"][..], &SHORT].concat();
    let mut app = workbench("task1", folder.path(), &lines);
    let wait_for = |app: &mut App, wanted: &str| {
        wait_until(app, |app| app.subject.facts().concat().contains(wanted));
        assert!(app.subject.agent_view(0).is_ok());
    };
    // The last episode was played by the agent of the checkpoint before it.
    wait_for(&mut app, "agent of episode 2");
    press(&mut app, "4 left left");
    wait_until(&mut app, |app| app.subject.past_episode() == Some(2));
    wait_for(&mut app, "agent of episode 1");
    assert!(seen(&mut app).contains("epsilon 0.00"));
    press(&mut app, "5 v");
    wait_until(&mut app, |app| app.subject.past_episode().is_none());
    press(&mut app, "1");
    wait_for(&mut app, "agent of episode 3");
    assert!(seen(&mut app).contains("the greedy policy of task1-ddpg-seed0"));
    press(&mut app, "home");
    wait_until(&mut app, |app| app.subject.past_episode() == Some(1));
    app.carry_out(vec![Effect::apply(command::Seed(5))]);
    app.show_greedy();
    assert_eq!(app.subject.past_episode(), Some(1), "it was shown already");
}

#[test]
fn a_command_shows_at_once_and_a_refused_placement_is_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    let mut app = workbench("task1", folder.path(), &[]);
    press(&mut app, "P enter enter");
    assert!(seen(&mut app).contains("! not placed"));
    press(&mut app, "esc : t a s k space t a s k 4 enter");
    assert!(text(&shot(&mut app, 200, 50)).contains("task4 · no tool placed"));
    press(&mut app, ": t a s k space n o w h e r e enter");
    let screen = text(&shot(&mut app, 200, 50));
    assert!(screen.contains(": task nowhere") && screen.contains("there is no task `nowhere`"), "{screen}");
    press(&mut app, "esc 7 down enter");
    assert_eq!(app.message(), "there are no action clusters: `clusters` computes them");
}

/// Lets time pass until a condition holds.
fn wait_until(app: &mut App, condition: impl Fn(&mut App) -> bool) {
    for _ in 0..2000 {
        if condition(app) {
            return;
        }
        seen(app);
        std::thread::sleep(Duration::from_millis(5));
    }
    panic!("the condition does not hold\n{}", seen(app));
}

#[test]
fn a_command_on_a_run_that_is_not_watched_logs_its_own_outcome_alone() {
    let folder = tempfile::tempdir().unwrap();
    let config = RunConfig::new(Arc::new(mge_task::load("task1").unwrap()));
    RunDirectory::create(folder.path().join("other"), &config).unwrap();
    let mut app = workbench("task1", folder.path(), &SHORT);
    press(&mut app, "5");
    wait_until(&mut app, |app| seen(app).contains("other"));
    let before = app.workspace.view().log.len();
    press(&mut app, "/ o t h e r enter x");
    let log: Vec<&str> = app.workspace.view().log[before..].iter().map(|line| &*line.text).collect();
    assert!(log.len() == 1 && log[0].starts_with("other is not being trained"), "{log:?}");
    assert_eq!(app.subject.run().unwrap().name, "task1-ddpg-seed0", "it is still watched");
}

#[test]
fn a_failure_in_the_background_is_reported_logged_and_shown() {
    let folder = tempfile::tempdir().unwrap();
    let mut app = workbench("task1", folder.path(), &["set prior nowhere.safetensors"]);
    press(&mut app, "c");
    wait_until(&mut app, |app| app.message().contains("action clusters: "));
    assert!(seen(&mut app).contains("failed: "));
    press(&mut app, "u");
    let log = |app: &App| app.workspace.view().log.last().cloned().unwrap();
    assert_eq!((log(&app).level, log(&app).text), (Level::Error, app.message()));
    (0..3000).for_each(|_| app.workspace.log(Level::Info, String::new()));
    assert_eq!(app.workspace.view().log.len(), 2000);
}

#[test]
fn figures_notes_and_models_are_up_to_date() {
    let folder = tempfile::tempdir().unwrap();
    let mut app = workbench("task1", folder.path(), &SHORT);
    let apply = |app: &mut App, line: &str| _ = app.workspace.apply(Command::parse(line).unwrap().unwrap()).unwrap();
    let figure = format!("figure scene {}", folder.path().join("scene.png").display());
    for _ in 0..2 {
        let lines = app.workspace.view().log_total;
        apply(&mut app, &figure);
        wait_until(&mut app, |app| app.workspace.view().log_total > lines);
    }
    assert_eq!(app.workspace.view().figures.len(), 1);
    let run = app.workspace.view().runs[0].path.display().to_string();
    apply(&mut app, &format!("note {run} for the paper"));
    wait_until(&mut app, |app| app.workspace.view().runs[0].note == "for the paper");
    let about = |app: &App| app.workspace.view().models.iter().map(|model| model.about.clone()).collect::<Vec<_>>();
    wait_until(&mut app, |app| !about(app).is_empty());
    let before = about(&app);
    apply(&mut app, "task create/Push");
    // The descriptions for another task.
    wait_until(&mut app, |app| about(app) != before);
}
