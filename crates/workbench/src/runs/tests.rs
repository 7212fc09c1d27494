//! Runs of a session: queueing, control, deletion, recording and replay.

use super::*;
use crate::{Notice, Script};
use mge_run::Event;
use std::num::NonZeroUsize;

fn session(folder: &Path, lines: &[&str]) -> Session {
    let mut session = Session::new(mge_task::load("task1").unwrap(), folder.to_owned());
    session.runs.cores = NonZeroUsize::new(1);
    apply(&mut session, &["method ddpg", "episodes 3", "set ddpg.hidden 8"]);
    apply(&mut session, lines);
    session
}

/// Runs the lines as a script, which waits for the results.
fn apply(session: &mut Session, lines: &[&str]) {
    play(session, lines).unwrap_or_else(|error| panic!("{lines:?}: {error}"));
}

fn play(session: &mut Session, lines: &[&str]) -> Result<(), String> {
    let script = Script::parse(&lines.join("\n"), "s", &[]).unwrap();
    script.run(session, |_| {}).map_err(|error| error.to_string())
}

fn quoted(path: &Path) -> String {
    shell_words::quote(&path.display().to_string()).into_owned()
}

fn try_line(session: &mut Session, line: &str) -> Result<String, String> {
    session.apply(Command::parse(line).unwrap().unwrap()).map_err(|error| error.to_string())
}

#[test]
fn runs_beyond_the_number_of_cores_are_queued_and_all_trained() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = session(folder.path(), &["train", "seed 1", "train", "seed 2", "train"]);
    assert_eq!(session.runs().iter().filter(|run| run.is_queued()).count(), 2);
    let error = try_line(&mut session, "pause").unwrap_err();
    assert!(error.contains("waits for a free core"), "{error}");
    assert_eq!(try_line(&mut session, "stop").unwrap(), "task1-ddpg-seed2 is taken out of the queue");
    apply(&mut session, &["wait"]);
    let states: Vec<RunState> = session.runs().iter().map(RunView::state).collect();
    assert_eq!(states, [RunState::Finished, RunState::Finished, RunState::NotStarted]);
    apply(&mut session, &["watch 3", "continue", "wait", "expect episodes = 3"]);
}

#[test]
fn a_paused_run_frees_its_core_and_can_be_resumed_later() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = session(folder.path(), &["train until 1", "train", "wait", "expect episodes = 3"]);
    apply(&mut session, &["watch 1", "expect episodes = 1", "resume", "wait", "expect episodes = 3"]);
    assert_eq!(try_line(&mut session, "watch 3").unwrap_err(), "the session has no run 3");
}

#[test]
fn a_run_is_deleted_only_when_no_process_trains_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run");
    let shown = quoted(&path);
    let mut session = session(folder.path(), &[&format!("train {shown} until 1"), "wait"]);
    let error = try_line(&mut session, &format!("delete {shown}")).unwrap_err();
    assert_eq!(error, "run is paused: `stop` it first, or `resume` it");
    apply(&mut session, &["stop", "wait"]);
    let other = RunDirectory::open(&path).unwrap();
    let lock = other.lock().unwrap();
    assert!(try_line(&mut session, &format!("delete {shown}")).is_err(), "another process works on it");
    drop(lock);
    apply(&mut session, &[&format!("delete {shown}")]);
    assert!(!path.exists() && session.runs().is_empty() && session.run().is_none());
    assert!(try_line(&mut session, &format!("delete {shown}")).is_err());
    apply(&mut session, &["restore"]);
    assert!(path.exists());
    assert_eq!(session.runs().iter().map(|run| run.number).collect::<Vec<_>>(), [0], "it has its number again");
    apply(&mut session, &["watch 1", "wait", "expect episodes = 1"]);
    assert_eq!(try_line(&mut session, "restore").unwrap_err(), "there is nothing to restore");
}

#[test]
fn a_model_that_does_not_exist_is_refused_at_once_and_one_that_is_gone_before_the_run() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = session(folder.path(), &["method ddpg-mge", "model bucket-box"]);
    let refused = try_line(&mut session, "model larned").unwrap_err();
    assert_eq!(
        refused,
        "unknown model `larned`: use one of trained, learned, rapier, true, uniform, bucket-box, square-floor, \
         box-wall-floor: did you mean `learned`?; or name the file of a model"
    );
    assert!(try_line(&mut session, "model nothing/there.safetensors").unwrap_err().contains("does not exist"));
    assert_eq!(session.config().prior.place(), "bucket-box", "nothing has changed");
    let (run, file) = (folder.path().join("run"), folder.path().join("mine.safetensors"));
    mge_dynamics::shipped("bucket-box").unwrap().save(&file).unwrap();
    apply(&mut session, &[&format!("model {}", quoted(&file))]);
    std::fs::remove_file(&file).unwrap();
    assert!(try_line(&mut session, &format!("train {}", quoted(&run))).unwrap_err().contains("mine"));
    assert!(!run.exists());
}

#[test]
fn a_run_is_renamed_and_named_by_its_folder_in_commands() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = session(folder.path(), &["train", "wait"]);
    let report = try_line(&mut session, "rename task1-ddpg-seed0 the best").unwrap();
    assert_eq!(report, "task1-ddpg-seed0 is the best now");
    assert_eq!(session.run().unwrap().name, "the best");
    assert!(try_line(&mut session, "rename task1-ddpg-seed0 a/b").unwrap_err().contains("a name has at most"));
    assert!(session.to_script().contains("rename '%1' 'the best'"), "{}", session.to_script());
    for line in ["open 'the best'", "delete 'the best'", "note 'the best' x", "figure learning a.png runs='the best'"] {
        let error = try_line(&mut session, line).unwrap_err();
        assert!(
            error.starts_with("the best does not exist: the run in ") && error.contains("task1-ddpg-seed0"),
            "{error}"
        );
    }
    assert_eq!(RunView::open(&folder.path().join("task1-ddpg-seed0")).unwrap().name, "the best", "for other programs");
    apply(&mut session, &["seed 1", "train", "wait"]);
    std::fs::create_dir(folder.path().join("the best")).unwrap();
    let report = try_line(&mut session, "rename task1-ddpg-seed0 the best").unwrap();
    assert!(report.contains(" is the best now, a name that ") && report.ends_with("the best has, too"), "{report}");
    apply(&mut session, &["rename task1-ddpg-seed0 ''", "watch 1"]);
    assert_eq!(session.run().unwrap().name, "task1-ddpg-seed0");
}

#[test]
fn of_several_seeds_one_that_is_trained_is_watched() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = session(folder.path(), &[]);
    try_line(&mut session, "episodes 100000").unwrap();
    try_line(&mut session, "train seeds 3").unwrap();
    assert!(session.run().unwrap().number == 0 && session.runs()[2].is_queued());
}

#[test]
fn a_finished_run_without_checkpoints_does_not_start_over() {
    let folder = tempfile::tempdir().unwrap();
    let run = folder.path().join("run");
    let mut session = session(folder.path(), &[&format!("train {}", quoted(&run)), "wait", "episodes 5"]);
    std::fs::remove_dir_all(run.join("checkpoint")).unwrap();
    let error = try_line(&mut session, &format!("continue {}", quoted(&run))).unwrap_err();
    assert!(error.contains("no checkpoint"), "{error}");
    assert_eq!(mge_run::RunHistory::read(&mge_run::RunDirectory::open(&run).unwrap()).unwrap().records.len(), 3);
}

#[test]
fn a_threshold_without_clusters_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = session(folder.path(), &["train until 1"]);
    let report = try_line(&mut session, "epsilon 0.5").unwrap();
    assert!(report.contains("no action clusters") && report.contains("`guide`"), "{report}");
    apply(&mut session, &["stop", "wait"]);
}

#[test]
fn a_figure_records_the_seeds_of_all_runs_shown() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = session(folder.path(), &["train", "wait", "seed 7", "train", "wait", "seed 9"]);
    let mut seeds = |kind: &str| {
        let path = folder.path().join(format!("{kind}.png"));
        apply(&mut session, &[&format!("figure {kind} {}", path.display())]);
        crate::tests::text_of_png(&path, "Seed")
    };
    assert_eq!(seeds("learning"), "0 7");
    assert_eq!(seeds("scene"), "9");
}

#[test]
fn planning_has_no_policy_to_play() {
    let folder = tempfile::tempdir().unwrap();
    let lines = ["method planning", "model true", "set planner.rollouts 8", "episodes 1", "train", "wait"];
    let mut session = session(folder.path(), &lines);
    let error = play(&mut session, &["evaluate"]).unwrap_err();
    assert!(error.contains("learns no policy"), "{error}");
}

#[test]
fn no_command_waits_for_the_work_it_starts() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| quoted(&folder.path().join(name));
    let mut first = session(folder.path(), &[]);
    for run in ["a", "b", "c"] {
        apply(&mut first, &[&format!("train {}", path(run)), "wait"]);
    }
    let mut session = session(folder.path(), &["model true", "episodes 4", &format!("open {}", path("a"))]);
    let gate = session.gate.clone();
    let held = gate.lock().unwrap();
    let begun = [
        "clusters".to_owned(),
        format!("clusters {}", path("clusters.json")),
        "propose 1".to_owned(),
        "evaluate".to_owned(),
        format!("figure scene {}", path("new/scene.svg")),
        format!("open {}", path("b")),
        format!("continue {}", path("c")),
        format!("model train box {} 1000", path("box.safetensors")),
    ];
    for line in &begun {
        try_line(&mut session, line).unwrap_or_else(|error| panic!("{line}: {error}"));
        session.poll();
        let command = Command::parse(line).unwrap().unwrap();
        assert!(session.job(|begun| *begun == command).is_some(), "{line}: {:?}", session.jobs);
    }
    assert!(try_line(&mut session, "wait").unwrap().contains("running or queued"));
    let written = ["clusters.json", "new/scene.svg", "new/scene.csv"];
    assert!(written.iter().all(|name| !folder.path().join(name).exists()));
    assert!(try_line(&mut session, "model stop").is_ok());
    drop(held);
    session.wait(|_| {}).unwrap();
    assert!(written.iter().all(|name| folder.path().join(name).exists()));
    assert_eq!(session.proposed().len(), 1, "proposed in the background");
    let states: Vec<(String, usize)> =
        session.runs().iter().map(|run| (run.name.clone(), run.history().records.len())).collect();
    assert_eq!(states, [("a".to_owned(), 3), ("b".to_owned(), 3), ("c".to_owned(), 4)]);
}

#[test]
fn clusters_for_a_file_are_written_even_if_the_task_changes() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("clusters.json");
    let mut session = session(folder.path(), &["model true"]);
    let gate = session.gate.clone();
    let held = gate.lock().unwrap();
    try_line(&mut session, &format!("clusters {}", quoted(&file))).unwrap();
    try_line(&mut session, "goal size 5").unwrap();
    assert!(session.clusters_are_outdated());
    try_line(&mut session, "clusters").unwrap();
    try_line(&mut session, "task task2").unwrap();
    drop(held);
    session.wait(|_| {}).unwrap();
    let saved = std::fs::read_to_string(&file).unwrap();
    assert!(saved.contains("task1"), "{saved:.200}");
    assert!(session.prior().is_none(), "clusters of another task");
}

#[test]
fn a_wait_fails_with_the_computation_it_waits_for() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = session(folder.path(), &[]);
    let error = play(&mut session, &["model true", "clusters", "wait", "model uniform", "propose", "wait"]);
    assert!(error.as_ref().is_err_and(|error| error.starts_with("s:6: ")), "{error:?}");
    // Commands in between do not lose the failure.
    try_line(&mut session, "propose").unwrap();
    while session.jobs.iter().any(|_| true) {
        try_line(&mut session, "expect subgoals >= 0").unwrap();
    }
    assert!(session.wait(|_| {}).is_err());
    assert!(session.wait(|_| {}).is_ok(), "it is reported once");
}

#[test]
fn queued_runs_are_trained_in_order() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = session(folder.path(), &["train until 1", "wait", "stop", "wait"]);
    apply(&mut session, &["seed 1", "train", "seed 2", "train", "watch 1", "continue", "seed 3", "train"]);
    let mut began = Vec::new();
    let note = |notice: &Notice| {
        if let Notice::Run { run, event: Event::Started { .. } } = notice {
            began.push(*run);
        }
    };
    session.wait(note).unwrap();
    assert_eq!(began, [1, 2, 0, 3]);
}

#[test]
fn only_deleting_the_current_run_clears_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| quoted(&folder.path().join(name));
    let trains = ["a", "b", "c"].map(|name| format!("train {} until 1", path(name)));
    let mut session = session(folder.path(), &[]);
    for train in &trains {
        apply(&mut session, &[train, "wait", "stop", "wait"]);
    }
    apply(&mut session, &["watch 2", &format!("delete {}", path("a"))]);
    assert_eq!(session.run().map(|run| &*run.name), Some("b"), "another was deleted");
    apply(&mut session, &[&format!("delete {}", path("b"))]);
    assert!(session.run().is_none());
    assert_eq!(session.runs().iter().map(|run| &*run.name).collect::<Vec<_>>(), ["c"]);
    apply(&mut session, &["watch 3"]);
}

#[test]
fn runs_deleted_together_are_restored_together_also_by_a_later_session() {
    let folder = tempfile::tempdir().unwrap();
    let [a, b] = ["a", "b"].map(|name| folder.path().join(name));
    let mut session =
        session(folder.path(), &[&format!("train {}", quoted(&a)), &format!("train {}", quoted(&b)), "wait"]);
    let delete = format!("delete {} {}", quoted(&a), quoted(&b));
    assert!(try_line(&mut session, &delete).unwrap().starts_with("moved 2 runs to the trash"));
    assert!(!a.exists() && !b.exists());
    assert_eq!(try_line(&mut session, "restore").unwrap(), "restored 2 runs");
    assert!(a.exists() && b.exists());
    try_line(&mut session, &delete).unwrap();
    let mut later = Session::new(mge_task::load("task1").unwrap(), folder.path().to_owned());
    assert_eq!(try_line(&mut later, "restore").unwrap(), "restored 2 runs");
    assert_eq!(try_line(&mut session, "restore").unwrap_err(), "there is nothing to restore", "they are back already");
    try_line(&mut session, &delete).unwrap();
    try_line(&mut later, &format!("restore {}", quoted(&a))).unwrap();
    assert_eq!(try_line(&mut session, "restore").unwrap(), format!("restored {}", b.display()), "the rest of them");
}

/// The metrics of a run, as bytes.
fn metrics(folder: &Path, run: &str) -> Vec<u8> {
    std::fs::read(folder.join(run).join("metrics.csv")).unwrap()
}

/// Replays the recorded session in another folder, which is returned.
fn replay(session: &Session, folder: &Path) -> tempfile::TempDir {
    let elsewhere = tempfile::tempdir().unwrap();
    let script = session.to_script().replace(&quoted(folder), &quoted(elsewhere.path()));
    let mut second = Session::new(mge_task::load("task1").unwrap(), elsewhere.path().to_owned());
    play(&mut second, &[&script]).unwrap_or_else(|error| panic!("{error}\n{script}"));
    elsewhere
}

#[test]
fn a_recorded_stop_ends_the_run_at_the_same_episode() {
    let folder = tempfile::tempdir().unwrap();
    let train = format!("train {} until 2", quoted(&folder.path().join("a")));
    let session = session(folder.path(), &[&train, "wait", "stop", "wait"]);
    assert!(session.to_script().ends_with("until 2\nwait\nstop\nwait\n"), "{}", session.to_script());
    let elsewhere = replay(&session, folder.path());
    assert_eq!(metrics(elsewhere.path(), "a"), metrics(folder.path(), "a"));
    let state = RunDirectory::open(elsewhere.path().join("a")).unwrap().status().unwrap().state;
    assert_eq!(state, RunState::Stopped("on request".to_owned()));
}

#[test]
fn concurrent_runs_are_recorded_each_with_its_own_changes() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| quoted(&folder.path().join(name));
    let mut session = session(folder.path(), &["episodes 5"]);
    session.runs.cores = NonZeroUsize::new(2);
    let (a, b) = (format!("train {} until 2", path("a")), format!("train {} until 3", path("b")));
    apply(&mut session, &[&a, "seed 1", &b, "wait", "watch 1", "epsilon 0.2", "resume", "watch 2", "stop", "wait"]);
    let script = session.to_script();
    assert!(script.contains("/a until 2\nwait\nseed 1\n") && script.contains("/b until 3\nwait\n"), "{script}");
    let elsewhere = replay(&session, folder.path());
    for run in ["a", "b"] {
        assert_eq!(metrics(elsewhere.path(), run), metrics(folder.path(), run), "{run}: {script}");
    }
    let lines = |run| metrics(folder.path(), run).split(|byte| *byte == b'\n').filter(|line| !line.is_empty()).count();
    assert_eq!((lines("a"), lines("b")), (6, 4), "with the heading");
}

#[test]
fn a_recorded_session_keeps_a_run_paused_and_creates_the_folders_of_its_figures() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| quoted(&folder.path().join(name));
    let train = format!("train {} until 2", path("a"));
    let figure = format!("figure learning {}", path("figures/a.svg"));
    let session = session(folder.path(), &[&train, "wait", &figure]);
    let elsewhere = replay(&session, folder.path());
    assert_eq!(metrics(elsewhere.path(), "a"), metrics(folder.path(), "a"), "{}", session.to_script());
    assert!(elsewhere.path().join("figures/a.svg").exists());
    let text = String::from_utf8(metrics(folder.path(), "a")).unwrap();
    assert_eq!(text.lines().count(), 3, "two episodes: {text}");
}

#[test]
fn a_run_taken_out_of_the_queue_is_not_trained_in_the_replay() {
    let folder = tempfile::tempdir().unwrap();
    let [a, b] = ["a", "b"].map(|name| format!("train {}", quoted(&folder.path().join(name))));
    let session = session(folder.path(), &[&a, "seed 1", &b, "stop", "wait"]);
    let elsewhere = replay(&session, folder.path());
    assert_eq!(metrics(elsewhere.path(), "a"), metrics(folder.path(), "a"));
    let run = RunView::read(&elsewhere.path().join("b")).unwrap();
    assert_eq!((run.episodes(), run.state()), (0, RunState::Stopped("on request".to_owned())));
}

#[test]
fn an_unreadable_run_opened_twice_is_not_recorded() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = session(folder.path(), &[]);
    let path = folder.path().join("run");
    RunDirectory::create(&path, session.config()).unwrap();
    std::fs::create_dir(path.join("events.jsonl")).unwrap();
    for _ in 0..2 {
        try_line(&mut session, &format!("open {}", quoted(&path))).unwrap();
    }
    assert!(session.wait(|_| {}).is_err());
    try_line(&mut session, &format!("open {}", quoted(&path))).unwrap();
    apply(&mut session, &["expect episodes = 0", "epsilon 0.3"]);
    let script = session.to_script();
    assert!(!script.lines().any(|line| line.starts_with("open ") || line.starts_with("watch ")), "{script}");
    assert!(script.ends_with("set ddpg.hidden 8\nepsilon 0.3\n"), "{script}");
    // The script numbers its runs without it.
    let train = |name: &str| format!("train {}", quoted(&folder.path().join(name)));
    apply(&mut session, &["episodes 3", &train("a"), "seed 1", &train("b"), "wait", "watch 2", "expect episodes = 3"]);
    let script = session.to_script();
    assert!(script.ends_with("watch 1\nexpect episodes = 3\n"), "{script}");
    replay(&session, folder.path());
}

#[test]
fn a_change_after_continuing_is_replayed_at_its_episode() {
    let folder = tempfile::tempdir().unwrap();
    let train = format!("train {} until 2", quoted(&folder.path().join("a")));
    let mut session = session(folder.path(), &["episodes 8", &train, "wait", "stop", "wait"]);
    apply(&mut session, &["continue until 4", "wait", "epsilon 0.2", "resume", "wait"]);
    let script = session.to_script();
    assert!(script.contains("continue until 4\nwait\nepsilon 0.2\nresume\nwait\n"), "{script}");
    let elsewhere = replay(&session, folder.path());
    assert_eq!(metrics(elsewhere.path(), "a"), metrics(folder.path(), "a"), "{script}");
}

#[test]
fn a_run_for_each_seed_is_started_and_recorded() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = Session::new(mge_task::load("task1").unwrap(), folder.path().to_owned());
    let play = |session: &mut Session, text: &str| {
        Script::parse(text, "s", &[]).unwrap().run(session, |_| {}).unwrap();
    };
    play(&mut session, "method ddpg\nset ddpg.hidden 4\nepisodes 2\nseed 7\ntrain seeds 3\nwait\n");
    let seeds: Vec<u64> = session.runs().iter().map(|run| run.config().seed).collect();
    assert_eq!((seeds, session.config().seed), (vec![7, 8, 9], 7));
    assert!(session.runs().iter().all(|run| run.history().records.len() == 2));
    let elsewhere = tempfile::tempdir().unwrap();
    let mut second = Session::new(mge_task::load("task1").unwrap(), elsewhere.path().to_owned());
    play(&mut second, &session.to_script());
    let names = |session: &Session| session.runs().iter().map(|run| run.name.clone()).collect::<Vec<_>>();
    assert_eq!(names(&second), names(&session), "{}", session.to_script());
    let metrics = |folder: &Path| std::fs::read(folder.join("task1-ddpg-seed9/metrics.csv")).unwrap();
    assert_eq!(metrics(elsewhere.path()), metrics(folder.path()));
    // A name alone is that of a run in the folder for runs, as in the dialog and for forks.
    play(&mut session, "train alone\ntrain together seeds 2\nwait\n");
    for name in ["alone", "together-seed7", "together-seed8"] {
        assert!(folder.path().join(name).join("metrics.csv").exists(), "{name}");
    }
    // Runs in a folder of their own name are beside it, where the folder's runs are listed.
    play(&mut session, &format!("train {}/ seeds 2\nwait\n", folder.path().join("named").display()));
    assert!(["named-seed7", "named-seed8"].iter().all(|name| folder.path().join(name).join("metrics.csv").exists()));
}
