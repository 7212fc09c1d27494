//! A recorded session repeats everything: the same runs, files and deletions, whatever the methods and commands.
//!
//! What a recording repeats, and where, is decided in `crates/workbench/src/journal.rs` and by `script_role` of
//! each command.

use std::collections::BTreeMap;
use std::path::Path;

use crate::program::{mge, succeed};

/// Settings with which all methods train in a moment, and refine their clusters on the way.
const QUICK: &str = "task task1
model true
set ddpg.hidden 8
set ddpg.warmup_steps 10
set guidance.model_rollouts 60
set guidance.most_model_rollouts 60
set guidance.environment_rollouts 8
set practice.rollouts 4
set planner.rollouts 8
set refinement.every 2
set refinement.least 1
set evaluation.every 3
set checkpoints.last_every 5
episodes 8
";

/// What a session leaves behind: all files with their bytes. Without the recording itself, the logs of text and for
/// TensorBoard, and of the event log everything that depends on time or on pauses.
fn left(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(place) = folders.pop() {
        for entry in std::fs::read_dir(place).unwrap() {
            let path = entry.unwrap().path();
            let name = path.strip_prefix(folder).unwrap().display().to_string();
            if path.is_dir() {
                folders.push(path);
            } else if name.ends_with("events.jsonl") {
                files.insert(name, effects(&std::fs::read_to_string(path).unwrap()));
            } else if !["log.txt", "lock", ".mge"].iter().any(|end| name.ends_with(end))
                && !["tensorboard", "control.jsonl"].iter().any(|part| name.contains(part))
            {
                files.insert(name, std::fs::read(path).unwrap());
            }
        }
    }
    files
}

/// The events that say what happened to a training, without their times.
fn effects(log: &str) -> Vec<u8> {
    let kinds = ["episode_finished", "evaluated", "schedule_changed", "clusters_changed", "needs_changed", "finished"];
    let mut kept = String::new();
    for line in log.lines() {
        let mut event: serde_json::Value = serde_json::from_str(line).unwrap();
        event.as_object_mut().unwrap().remove("time");
        if kinds.contains(&event["type"].as_str().unwrap()) {
            kept += &format!("{event}\n");
        }
    }
    kept.into_bytes()
}

/// Plays a script, then its recording in another folder, and checks that both leave the same behind. `prepare` makes
/// what is there before. Returns the recording and the files.
#[track_caller]
fn check(script: &str, prepare: impl Fn(&Path)) -> (String, BTreeMap<String, Vec<u8>>) {
    let folder = tempfile::tempdir().unwrap();
    let [first, second] = ["first", "second"].map(|name| folder.path().join(name));
    for place in [&first, &second] {
        std::fs::create_dir(place).unwrap();
        prepare(place);
    }
    let recording = folder.path().join("recorded.mge");
    std::fs::write(folder.path().join("script.mge"), format!("{QUICK}{script}record ../recorded.mge\n")).unwrap();
    succeed(mge(&first, ["script", "../script.mge", "--quiet"]));
    let recorded = std::fs::read_to_string(&recording).unwrap();
    let output = mge(&second, ["script", "../recorded.mge", "--quiet"]);
    assert!(output.status.success(), "{}\n{recorded}", String::from_utf8_lossy(&output.stderr));
    let [expected, found] = [&first, &second].map(|place| left(place));
    assert_eq!(found.keys().collect::<Vec<_>>(), expected.keys().collect::<Vec<_>>(), "{recorded}");
    for (name, bytes) in &expected {
        assert!(found[name] == *bytes, "{name} differs\n{recorded}");
    }
    (recorded, expected)
}

#[test]
fn every_method_is_repeated_with_its_interventions() {
    let methods = [
        "ddpg",
        "ddpg-mge",
        "ddpg-uniform",
        "ddpg-mge-true",
        "planning",
        "ddpg-mge-adaptive",
        "ddpg-uniform-adaptive",
        "ddpg-adaptive",
        "open-loop",
    ];
    let train = |method: &&str| format!("method {method}\ntrain until 3\nwait\nepsilon 0.3\nresume\nwait\n");
    let (recorded, files) = check(&methods.iter().map(train).collect::<String>(), |_| ());
    assert!(!recorded.contains("guide"), "{recorded}");
    assert_eq!(recorded.matches("resume\n").count(), methods.len(), "{recorded}");
    let events = &files["runs/task1-ddpg-mge-adaptive-seed0/events.jsonl"];
    let refined = String::from_utf8_lossy(events).matches("clusters_changed").count();
    assert!(refined > 2, "only {refined} refinements to be told from `guide`");
}

#[test]
fn the_default_method_is_repeated_without_inventing_commands() {
    let (recorded, _) = check("train\nwait\n", |_| ());
    assert!(recorded.ends_with("train\nwait\n"), "{recorded}");
}

#[test]
fn every_command_is_repeated() {
    let script = "
subgoal move 1 0.05 0.2
goal size 6
undo
redo
tool add ramp -0.5 0.5 10 angle=30
tool set 2 angle=45
save edited.json
place 0.2 0.3
reset
task task2
set guidance.model_rollouts 600
propose 1
wait
expect proposals = 1
proposal move 1 0.25 0.5
proposal accept
set guidance.model_rollouts 60
task task1
clusters
wait
expect clusters >= 0
figure scene scene.svg
figure clusters clusters.svg
clusters clusters.json
method ddpg-mge
train until 2
wait
guide
figure learning early.svg
epsilon 0.2
seed 4
resume until 5
wait
evaluate
note runs/task1-ddpg-mge-seed0 'holds, but late'
figure learning learning.svg
expect episodes = 5
stop
wait
continue
wait
fork 1 ddpg.gamma=0.9 until 6
wait
epsilon 0.1
stop
wait
delete runs/task1-ddpg-mge-seed0-at1
restore runs/task1-ddpg-mge-seed0-at1
note runs/task1-ddpg-mge-seed0-at1 'back'
delete runs/task1-ddpg-mge-seed0-at1
train seeds 2
wait
watch 3
delete runs/task1-ddpg-mge-seed5
seed 5
train
wait
open before
expect episodes >= 1
note before 'seen'
evaluate
delete before
out elsewhere
train
wait
set ddpg.gamma 0.9
figure learning %1.svg
model train box m.safetensors 1
wait
quit
";
    // `quit` ends the script before the recording.
    let script = script.replace("quit\n", "");
    let before = |folder: &Path| {
        let settings = ["--episodes", "2", "--method", "ddpg", "--set", "ddpg.hidden=4", "--quiet", "--out", "before"];
        succeed(mge(folder, [&["train", "task1"], &settings[..]].concat()));
    };
    let (recorded, files) = check(&script, before);
    assert!(files.keys().any(|name| name.starts_with("elsewhere/")), "{recorded}");
    assert!(
        recorded.contains("\nrestore '%2'") && recorded.contains("\nnote '%2' back"),
        "deleted runs keep their numbers: {recorded}"
    );
    for gone in ["runs/task1-ddpg-mge-seed0-at1/", "before/"] {
        assert!(!files.keys().any(|name| name.starts_with(gone)), "{gone}: {recorded}");
    }
    let note = String::from_utf8_lossy(&files["runs/task1-ddpg-mge-seed0/notes.json"]).into_owned();
    assert!(note.contains("holds, but late") && note.contains("late"), "{note}");
}

#[test]
fn runs_under_way_at_the_same_time_are_shown_as_they_were() {
    let script = "method ddpg-mge-adaptive
train until 2
seed 1
train until 5
wait
figure learning both.svg
watch 1
resume
wait
figure learning one.svg
watch 2
epsilon 0.1
watch 1
clusters
wait
set refinement.every 0
seed 2
train until 4
wait
guide
clusters
wait
figure learning three.svg
resume
watch 2
resume
wait
figure learning all.svg
";
    check(script, |_| ());
}

#[test]
fn a_schedule_of_a_training_and_that_of_the_next_run_are_kept_apart() {
    let script = "method ddpg-mge
train until 2
wait
epsilon 0.9
set epsilon 0.4
resume
wait
train
wait
";
    let (recorded, files) = check(script, |_| ());
    let config = String::from_utf8_lossy(&files["runs/task1-ddpg-mge-seed0-run2/config.json"]).into_owned();
    assert!(config.contains("\"epsilon\": \"0.4\""), "{recorded}");
}

#[test]
fn the_folder_for_runs_is_repeated() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::write(here.join("s.mge"), format!("{QUICK}method ddpg\ntrain\nwait\nrecord recorded.mge\n")).unwrap();
    succeed(mge(here, ["script", "s.mge", "--quiet", "--runs", "mine"]));
    std::fs::remove_dir_all(here.join("mine")).unwrap();
    succeed(mge(here, ["script", "recorded.mge", "--quiet"]));
    assert!(here.join("mine/task1-ddpg-seed0").is_dir() && !here.join("runs").exists());
}
