//! Runs that were begun in another session.

use super::*;
use mge_run::{EpisodeRecord, LoggedEvent};

#[test]
fn past_events_of_an_opened_run_are_read_but_not_reported() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a");
    run(&mut session(folder.path()), &format!("train {}\nwait", quoted(&path)));
    let mut session = session(folder.path());
    let otherwise = folder.path().join("../").join(folder.path().file_name().unwrap()).join("a");
    let report = apply(&mut session, &format!("open {}", quoted(&otherwise))).unwrap();
    assert_eq!(report, format!("opened {}", path.display()), "as the list of runs calls it");
    let mut events = 0;
    session.wait(|notice| events += usize::from(matches!(notice, Notice::Run { .. }))).unwrap();
    assert_eq!((events, session.run().unwrap().history().records.len()), (0, 3));
    let script = session.to_script();
    assert!(script.contains(&format!("open {}", quoted(&path))), "{script}");
    drop(session);
    let session = Session::on_run(&path).unwrap();
    assert_eq!((session.runs().len(), session.run().unwrap().history().records.len()), (1, 3));
    assert!(session.to_script().contains("open "), "{}", session.to_script());
}

#[test]
fn many_episodes_of_a_run_are_thinned_evenly() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a");
    run(&mut session(folder.path()), &format!("train {}\nwait", quoted(&path)));
    let log = path.join("events.jsonl");
    let finished = |episode| Event::EpisodeFinished(EpisodeRecord { episode, ..EpisodeRecord::default() });
    let line = |episode| serde_json::to_string(&LoggedEvent { time: 0.0, event: finished(episode) }).unwrap() + "\n";
    let text: String = (4..=40_000).map(line).collect();
    std::fs::write(&log, std::fs::read_to_string(&log).unwrap() + &text).unwrap();
    let mut session = session(folder.path());
    apply(&mut session, &format!("open {}", quoted(&path))).unwrap();
    session.wait(|_| ()).unwrap();
    for session in [session, Session::on_run(&path).unwrap()] {
        let run = session.run().unwrap();
        assert_eq!((run.episodes(), run.history().records.last().unwrap().episode), (40_000, 40_000));
        assert!((8_000..=16_384).contains(&run.history().records.len()), "{}", run.history().records.len());
        assert!(run.history().records.iter().all(|record| record.episode.is_multiple_of(4)));
    }
}

#[test]
fn a_run_of_another_session_is_controlled_through_its_folder() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run");
    let mut owner = Session::new(mge_task::load("task1").unwrap(), folder.path().to_owned());
    for line in ["method ddpg", "episodes 1000000", "set ddpg.hidden 4"] {
        apply(&mut owner, line).unwrap();
    }
    apply(&mut owner, &format!("train {}", quoted(&path))).unwrap();
    let wait = |owner: &mut Session, until: &dyn Fn(&RunView) -> bool| {
        while !until(owner.run().unwrap()) {
            owner.poll();
            std::thread::yield_now();
        }
    };
    wait(&mut owner, &|run| run.history().records.len() > 2);
    let mut other = Session::on_run(&path).unwrap();
    let error = apply(&mut other, "continue").unwrap_err();
    assert!(error.contains(&std::process::id().to_string()), "names this process: {error}");
    apply(&mut other, "pause").unwrap();
    wait(&mut owner, &|run| run.state() == RunState::Paused);
    apply(&mut other, "epsilon 0.25").unwrap();
    other.poll();
    let wanted = owner.run().unwrap().history().records.len() + 10;
    apply(&mut other, &format!("resume until {wanted}")).unwrap();
    wait(&mut owner, &|run| run.history().records.len() >= wanted && run.state() == RunState::Paused);
    assert_eq!(owner.run().unwrap().history().records.len(), wanted);
    drop(other);
    owner.poll();
    assert!(owner.run().unwrap().is_active(), "a session that only opened the run does not end it");
    let mut other = Session::on_run(&path).unwrap();
    assert_eq!(other.run().unwrap().state(), RunState::Paused);
    apply(&mut other, "stop").unwrap();
    wait(&mut owner, &|run| !run.is_active());
    assert_eq!(owner.run().unwrap().state(), RunState::Stopped("on request".to_owned()));
    let script = owner.to_script();
    assert!(script.contains("epsilon 0.25") && script.contains("stop"), "other processes are recorded too: {script}");
    assert!(apply(&mut other, "pause").unwrap_err().contains("not being trained"));
}

#[test]
fn a_run_whose_folder_is_gone_fails_with_a_notice_and_leaves_the_list() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run");
    let mut session = session(folder.path());
    apply(&mut session, "episodes 1000000").unwrap();
    apply(&mut session, &format!("train {}", quoted(&path))).unwrap();
    while session.run().unwrap().episodes() == 0 {
        session.poll();
    }
    let delete = format!("delete {}", quoted(&path));
    assert!(apply(&mut session, &delete).unwrap_err().contains("is being trained"));
    std::fs::rename(&path, folder.path().join("moved")).unwrap();
    let mut failures = Vec::new();
    while session.run().unwrap().is_active() {
        failures.extend(session.poll().into_iter().filter_map(|notice| match notice {
            Notice::Run { event: Event::Failed { reason, .. }, .. } => Some(reason),
            _ => None,
        }));
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    assert!(matches!(&failures[..], [reason] if reason.contains("was moved or deleted")), "{failures:?}");
    assert!(apply(&mut session, &delete).unwrap().ends_with("run is no longer listed: its folder is gone"));
    assert!(session.runs().is_empty() && session.run().is_none());

    // The moved run recorded its failure; continued without its checkpoints, it fails again, before its first event.
    let moved = folder.path().join("moved");
    run(&mut session, &format!("open {}\nwait", quoted(&moved)));
    assert!(matches!(session.run().unwrap().state(), RunState::Failed(_)));
    std::fs::create_dir_all(moved.join("checkpoint/last")).unwrap();
    for entry in std::fs::read_dir(moved.join("checkpoint")).unwrap() {
        std::fs::write(entry.unwrap().path().join("manifest.json"), "damaged").unwrap();
    }
    apply(&mut session, "continue").unwrap();
    let error = session.wait(|_| ()).unwrap_err().to_string();
    assert!(error.contains("manifest.json"), "{error}");
}

#[test]
fn an_opened_run_with_a_damaged_log_is_damaged() {
    let folder = tempfile::tempdir().unwrap();
    let path = quoted(&folder.path().join("run"));
    let mut session = Session::new(mge_task::load("task1").unwrap(), folder.path().to_owned());
    for line in ["method ddpg", "set ddpg.hidden 4", "episodes 3", &format!("train {path}")] {
        apply(&mut session, line).unwrap();
    }
    session.wait(|_| ()).unwrap();
    assert!(!session.run().unwrap().is_damaged());
    let log = folder.path().join("run/events.jsonl");
    let text = std::fs::read_to_string(&log).unwrap();
    std::fs::write(&log, text.replacen("\"type\"", "\"tipe\"", 2)).unwrap();
    let mut other = Session::new(mge_task::load("task1").unwrap(), folder.path().to_owned());
    apply(&mut other, &format!("open {path}")).unwrap();
    // Its end may be reported as a failure.
    let _ = other.wait(|_| ());
    assert!(other.run().unwrap().is_damaged());
}

#[test]
fn a_finished_run_is_extended_to_the_episodes_set() {
    let folder = tempfile::tempdir().unwrap();
    let path = quoted(&folder.path().join("run"));
    let play = |session: &mut Session, lines: &[&str]| {
        let script = Script::parse(&lines.join("\n"), "s", &[]).unwrap();
        script.run(session, |_| {}).unwrap();
    };
    let mut session = Session::new(mge_task::load("task1").unwrap(), folder.path().to_owned());
    let train = format!("train {path}");
    play(&mut session, &["method ddpg", "set ddpg.hidden 4", "episodes 3", &train, "wait", "expect episodes = 3"]);
    let log = || std::fs::read(folder.path().join("run/events.jsonl")).unwrap();
    let before = log();
    let refusal = "run is finished after 3 episodes: `episodes N` sets more, and `continue` then trains them; \
                   `until` only pauses";
    assert_eq!(apply(&mut session, "continue").unwrap_err(), refusal);
    assert_eq!(log(), before, "nothing is written");
    play(&mut session, &["episodes 5", "continue", "wait", "expect episodes = 5", "episodes 4"]);
    assert!(apply(&mut session, "continue").unwrap_err().contains("finished after 5 episodes"));
    assert_eq!(session.run().unwrap().state(), RunState::Finished);
    // One that was ended by its success says so, and that the rule ends.
    let second = quoted(&folder.path().join("second"));
    let rule = ["episodes 200", "set stop.success 0", &format!("train {second}"), "wait", "expect episodes = 100"];
    play(&mut session, &rule);
    session.setup.extends_to = None;
    let refusal = apply(&mut session, "continue").unwrap_err();
    assert!(
        refusal.contains("after 100 episodes of 200, by its `stop.success`, which ends if it goes on: `episodes N`")
    );
    let report = apply(&mut session, "episodes 101").and_then(|_| apply(&mut session, "continue"));
    assert!(report.is_err(), "fewer than it was to have");
    play(&mut session, &["episodes 200"]);
    let report = apply(&mut session, "continue").unwrap();
    assert!(report.starts_with("extended to 200 episodes whatever its success (`stop.success` ends), "));
    drop(session);
    // Without an explicit number, the run is not extended.
    let mut other = Session::on_run(&folder.path().join("run")).unwrap();
    assert!(apply(&mut other, "continue").unwrap_err().contains("finished after 5 episodes"));
}
