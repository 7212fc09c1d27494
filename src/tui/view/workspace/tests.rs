//! The workspace of a real session: what it reports, and when its view changes.

use std::thread;

use super::*;
use crate::tui::view::RunSummary;
use mge_run::{EpisodeRecord, RunDirectory, RunState, RunWriter};
use mge_trainer::RunConfig;
use mge_workbench::PriorState;

/// Commands that start a training which does not end by itself.
const LONG: [&str; 4] = ["method ddpg", "episodes 1000000", "set ddpg.hidden 8", "train"];

/// The workspace of a session on task 1 after these commands.
fn workspace(folder: &Path, lines: &[&str]) -> SessionWorkspace {
    let mut workspace = SessionWorkspace::new(Session::on_task("task1", folder.to_owned()).unwrap());
    lines.iter().for_each(|line| apply(&mut workspace, line));
    workspace
}

fn apply(workspace: &mut SessionWorkspace, line: &str) {
    workspace.apply(parsed(line)).unwrap();
}

fn parsed(line: &str) -> Command {
    Command::parse(line).unwrap().unwrap()
}

fn poll_until(workspace: &mut SessionWorkspace, condition: impl Fn(&SessionWorkspace) -> bool) {
    let since = Instant::now();
    while !condition(workspace) {
        assert!(since.elapsed() < Duration::from_secs(60), "{:?}", workspace.view.log);
        workspace.poll();
        thread::sleep(Duration::from_millis(5));
    }
}

/// Makes the folder of a run that has not begun.
fn make(folder: &Path, name: &str) -> RunDirectory {
    let config = RunConfig::new(Arc::new(mge_task::load("task1").unwrap()));
    RunDirectory::create(folder.join(name), &config).unwrap()
}

fn names(workspace: &SessionWorkspace) -> Vec<&str> {
    workspace.view.runs.iter().map(|run| &*run.name).collect()
}

fn latest(workspace: &SessionWorkspace) -> &LogLine {
    workspace.view.log.last().unwrap()
}

#[test]
fn notices_are_logged_with_their_severity() {
    let folder = tempfile::tempdir().unwrap();
    let mut workspace = workspace(folder.path(), &[]);
    for (event, level) in [
        (Event::Paused { episode: 3 }, Level::Info),
        (Event::Finished { episode: 3 }, Level::Good),
        (Event::Stopped { episode: 3, reason: "on request".to_owned() }, Level::Warning),
        (Event::Failed { episode: 3, reason: "the disk is full".to_owned() }, Level::Error),
    ] {
        let text = event.to_string();
        workspace.take_notice(&Notice::Run { run: 0, event });
        assert!(latest(&workspace).level == level && latest(&workspace).text.ends_with(&text), "{text}");
    }
    workspace.take_notice(&Notice::Warning("epsilon 0.1 cripples it".to_owned()));
    assert_eq!((latest(&workspace).level, &*latest(&workspace).text), (Level::Warning, "epsilon 0.1 cripples it"));
    assert!(is_frequent(&Notice::Changed));
}

#[test]
fn the_outcomes_of_background_commands_are_logged_and_shown() {
    let folder = tempfile::tempdir().unwrap();
    let mut workspace = workspace(folder.path(), &[]);
    let note = |workspace: &mut SessionWorkspace, line: &str, outcome: Result<&str, &str>| {
        let outcome = outcome.map(str::to_owned).map_err(str::to_owned);
        workspace.take_notice(&Notice::Finished { command: parsed(line), outcome });
    };
    note(&mut workspace, "clusters", Ok("the clusters are there"));
    assert_eq!(latest(&workspace).text, "the clusters are there", "no training could take them over");
    note(&mut workspace, "figure scene scene.png", Err("the disk is full"));
    assert!(workspace.view.figures.is_empty());
}

#[test]
fn damaged_runs_are_counted_and_each_is_logged_once() {
    let folder = tempfile::tempdir().unwrap();
    let config = make(folder.path(), "damaged").config_path();
    make(folder.path(), "good");
    std::fs::create_dir(folder.path().join("no run")).unwrap();
    std::fs::write(&config, "{").unwrap();
    let mut workspace = workspace(folder.path(), &LONG);
    let logged = |workspace: &SessionWorkspace| {
        workspace.view.log.iter().filter(|line| line.text.contains("config.json")).count()
    };
    for _ in 0..2 {
        poll_until(&mut workspace, |workspace| workspace.view.damaged.len() == 1 && logged(workspace) == 1);
    }
    assert!(latest(&workspace).text.contains("damaged"), "{:?}", latest(&workspace));
    assert_eq!(workspace.view.runs.iter().filter(|run| run.name == "good").count(), 1);
}

#[test]
fn a_training_shows_its_speed_and_its_latest_episode() {
    let folder = tempfile::tempdir().unwrap();
    let mut workspace = workspace(folder.path(), &LONG);
    workspace.request_live();
    poll_until(&mut workspace, |workspace| {
        let view = workspace.view();
        view.watched.as_ref().is_some_and(|watched| watched.live.is_some() && watched.run.rate().is_some())
    });
    assert!(workspace.view.runs[0].preparing.is_none() && workspace.view.runs[0].done > 0);
    assert!(workspace.view.log.iter().all(|line| !line.text.is_empty()));
    workspace.take_notice(&Notice::Finished { command: parsed("clusters"), outcome: Ok("there".to_owned()) });
    assert_eq!(latest(&workspace).text, "there; `guide` gives them to the running training");
}

#[test]
fn a_session_at_rest_has_no_news() {
    let folder = tempfile::tempdir().unwrap();
    let mut workspace = workspace(folder.path(), &[]);
    let (since, mut changed) = (Instant::now(), Instant::now());
    while changed.elapsed() < Duration::from_millis(700) {
        assert!(since.elapsed() < Duration::from_secs(20));
        if workspace.poll() {
            changed = Instant::now();
        }
        thread::sleep(Duration::from_millis(5));
    }
    let hand = workspace.view.hand.clone();
    workspace.refresh();
    assert!(Arc::ptr_eq(&hand.trace, &workspace.view.hand.trace), "it is the same episode");
    assert!(Arc::ptr_eq(workspace.view.hand.env.task(), &workspace.view.task));
}

#[test]
fn an_episode_of_hand_play_begins_again_with_the_seed_set() {
    let folder = tempfile::tempdir().unwrap();
    let mut task = mge_task::load("task1").unwrap();
    task.rules.start_noise = 0.05;
    let mut workspace = SessionWorkspace::new(Session::new(task, folder.path().to_owned()));
    let before = workspace.view.hand.env.snapshot().ball();
    apply(&mut workspace, "seed 1");
    apply(&mut workspace, "reset");
    assert_ne!(workspace.view.hand.env.snapshot().ball(), before);
}

#[test]
fn a_model_is_loaded_once_for_each_source_and_task() {
    let folder = tempfile::tempdir().unwrap();
    let mut workspace = workspace(folder.path(), &["model true"]);
    let [task, other] = ["task1", "task4"].map(|name| Arc::new(mge_task::load(name).unwrap()));
    let model_for = |workspace: &mut SessionWorkspace, task: &Arc<Task>| loop {
        workspace.poll();
        match workspace.model_for(task) {
            Some(model) => break model,
            None => thread::yield_now(),
        }
    };
    let first = model_for(&mut workspace, &task).unwrap();
    assert!(Arc::ptr_eq(&first.model, &model_for(&mut workspace, &task).unwrap().model));
    assert!(Arc::ptr_eq(&model_for(&mut workspace, &other).unwrap().task, &other));
    apply(&mut workspace, "model uniform");
    assert!(model_for(&mut workspace, &other).is_err(), "uniform exploration predicts nothing");
}

#[test]
fn runs_that_are_not_open_are_read_when_they_are_viewed() {
    let folder = tempfile::tempdir().unwrap();
    let [open, other] = ["a", "b"].map(|name| make(folder.path(), name));
    let mut writer = RunWriter::open(&other, 0).unwrap();
    writer.record(&Event::EpisodeFinished(EpisodeRecord { episode: 1, ..EpisodeRecord::default() })).unwrap();
    drop(writer);
    let mut workspace = workspace(folder.path(), &[]);
    poll_until(&mut workspace, |workspace| names(workspace) == ["a", "b"]);
    apply(&mut workspace, &format!("open {}", open.path().display()));
    workspace.request_curves(vec![open.path().to_owned(), other.path().to_owned()]);
    poll_until(&mut workspace, |workspace| workspace.view.runs[1].curves.last_episode() == 1);
}

#[test]
fn what_another_process_does_to_an_opened_run_is_seen() {
    let folder = tempfile::tempdir().unwrap();
    let lines = ["method ddpg-uniform", "episodes 2", "set ddpg.hidden 8", "train"];
    let mut workspace = workspace(folder.path(), &lines);
    let is_over = |run: &RunSummary| run.state == RunState::Finished && !run.active;
    poll_until(&mut workspace, |workspace| is_over(&workspace.view.runs[0]));
    let run = RunDirectory::open(workspace.view.runs[0].path.clone()).unwrap();
    run.change_notes(|notes| notes.name = "renamed".to_owned()).unwrap();
    poll_until(&mut workspace, |workspace| names(workspace) == ["renamed"]);
    run.replace_config(&RunConfig::of(&run).unwrap().extended(5)).unwrap();
    poll_until(&mut workspace, |workspace| workspace.view.runs[0].episodes() == 5);
    assert_eq!(workspace.view.watched.as_ref().unwrap().run.episodes(), 5);
    std::fs::remove_dir_all(run.path()).unwrap();
    poll_until(&mut workspace, |workspace| workspace.view.runs.is_empty() && workspace.view.watched.is_none());
}

#[test]
fn a_renamed_run_has_its_name_in_the_title_of_its_episodes() {
    let folder = tempfile::tempdir().unwrap();
    let mut workspace = workspace(folder.path(), &LONG);
    workspace.request_live();
    poll_until(&mut workspace, |workspace| workspace.view.watched.as_ref().is_some_and(|it| it.live.is_some()));
    let path = workspace.view.runs[0].path.display().to_string();
    apply(&mut workspace, &format!("rename {} other", shell_words::quote(&path)));
    let watched = workspace.view.watched.clone().unwrap();
    let title = watched.live.unwrap().episode.title(&watched.run.name);
    assert!(title.ends_with(" of other"), "{title}");
}

#[test]
fn runs_are_listed_in_the_order_in_which_they_were_made_and_a_new_one_at_once() {
    let folder = tempfile::tempdir().unwrap();
    make(folder.path(), "z");
    let mut workspace = workspace(folder.path(), &[]);
    poll_until(&mut workspace, |workspace| names(workspace) == ["z"]);
    LONG.iter().for_each(|line| apply(&mut workspace, line));
    assert_eq!(names(&workspace), ["z", "task1-ddpg-seed0"]);
    // A later scan finds both.
    make(folder.path(), "zz");
    poll_until(&mut workspace, |workspace| names(workspace).contains(&"zz"));
    assert_eq!(names(&workspace), ["z", "task1-ddpg-seed0", "zz"]);
}

#[test]
fn outdated_clusters_are_computed_again_a_moment_after_the_latest_command() {
    let folder = tempfile::tempdir().unwrap();
    let lines = ["model true", "set guidance.model_rollouts 50", "set guidance.environment_rollouts 5", "clusters"];
    let mut workspace = workspace(folder.path(), &lines);
    let is_fresh = |workspace: &SessionWorkspace| workspace.view.prior_state == PriorState::Fresh;
    poll_until(&mut workspace, is_fresh);
    apply(&mut workspace, "set guidance.model_rollouts 60");
    workspace.poll();
    assert_eq!(workspace.view.prior_state, PriorState::Stale);
    poll_until(&mut workspace, is_fresh);
}

#[test]
fn what_a_run_does_before_its_first_episode_is_shown() {
    let folder = tempfile::tempdir().unwrap();
    let lines = ["model true", "set guidance.model_rollouts 50000", "train"];
    let mut workspace = workspace(folder.path(), &lines);
    poll_until(&mut workspace, |workspace| {
        let preparing = workspace.view.runs[0].preparing.as_deref();
        preparing.is_some_and(|text| text.starts_with("clusters, stage 1 of 2"))
    });
}
