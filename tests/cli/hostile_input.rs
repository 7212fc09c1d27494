//! Hostile conditions: closed or full outputs, text with terminal control sequences, endless lines, runs that were
//! tampered with.

use std::fs::{self, File};
use std::io::Read;
use std::path::Path;
use std::process::{Output, Stdio};

use crate::program::{command, fail, mge, succeed, text};
use serde_json::{Value, json};

/// Runs the program with `input` on its standard input.
fn run_with_input(folder: &Path, arguments: &[&str], mut input: impl Read) -> Output {
    let mut child = command(folder, arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let mut stdin = child.stdin.take().unwrap();
    // The program may end before it has read everything.
    let _ = std::io::copy(&mut input, &mut stdin);
    drop(stdin);
    child.wait_with_output().unwrap()
}

/// A finished run of two episodes.
fn train(folder: &Path) {
    let line = "train task1 --set ddpg.hidden=4 --method ddpg --episodes 2 --quiet --out run";
    succeed(mge(folder, line.split(' ')));
}

#[test]
fn empty_environment_variables_count_as_none() {
    let folder = tempfile::tempdir().unwrap();
    succeed(command(&folder, ["tasks", "--json"]).env("MGE_NOTIFY", "").output().unwrap());
    fs::write(folder.path().join("s.mge"), "method ddpg\nepisodes 1\ntrain").unwrap();
    succeed(command(&folder, ["script", "s.mge"]).env("MGE_RUNS", "").output().unwrap());
    assert!(folder.path().join("runs").is_dir(), "the default");
}

#[test]
fn actions_after_the_end_of_an_episode_are_told() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("a.json"), format!("[{}]", vec!["[0.9, 0.9]"; 25].join(", "))).unwrap();
    let output = mge(folder.path(), ["play", "task1", "--actions", "a.json"]);
    let played = text(&output.stdout).lines().count();
    let told = format!("the episode ended after {played} actions: {} actions not played", 25 - played);
    assert!(played < 25 && text(&output.stderr).contains(&told), "{}", text(&output.stderr));
}

#[test]
fn a_closed_output_ends_quietly_and_a_full_one_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    train(folder.path());
    let commands: [&[&str]; 8] = [
        &["tasks"],
        &["tasks", "--json"],
        &["tasks", "check", "task1"],
        &["man"],
        &["--help"],
        &["clusters", "task1", "--model", "uniform"],
        &["evaluate", "run"],
        &["export", "run", "--out", "actor.safetensors"],
    ];
    for arguments in commands {
        let full = File::options().write(true).open("/dev/full").expect("Linux has /dev/full");
        let output = command(&folder, arguments).stdout(full).output().unwrap();
        fail(output, "cannot write to standard output: No space left on device");

        let mut child = command(&folder, arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        assert_eq!((output.status.code(), text(&output.stderr).as_str()), (Some(0), ""), "{arguments:?}");
    }
}

/// Clears the screen, sets the title, writes to the clipboard, and hides the following text.
const ESCAPES: &str = "\u{1b}[2J\u{1b}]0;owned\u{7}\u{1b}]52;c;eA==\u{7}\u{9b}8m\u{202e}";

#[test]
fn escapes_in_names_and_texts_never_reach_the_terminal() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let hostile = |name: &str, text: &str| fs::write(path.join(name), text.replace("ESC", ESCAPES)).unwrap();
    let quoted = serde_json::to_string(ESCAPES).unwrap();
    hostile("task.json", &format!("{{\"version\": 1, {quoted}: 1}}"));
    hostile("kind.json", &format!("{{\"version\": 1, \"name\": \"x\", \"placeable\": {{\"type\": {quoted}}}}}"));
    hostile("order.json", &format!("{{\"version\": 1, \"name\": \"x\", \"order\": [{quoted}]}}"));
    let recorded = include_str!("../data/create/levels.jsonl").lines().next().unwrap();
    let mut level: serde_json::Value = serde_json::from_str(recorded).unwrap();
    level["goal"][ESCAPES] = true.into();
    hostile("levels.jsonl", &format!("{level}\n"));
    hostile("script.mge", "ESC\n");
    hostile("sweep.json", &format!("{{\"task\": [\"task1\"], {quoted}: [1]}}"));
    let name = format!("no{ESCAPES}file");
    let commands: [&[&str]; 11] = [
        &["tasks", "check", "task.json"],
        &["tasks", "check", "kind.json"],
        &["tasks", "check", "order.json"],
        &["play", "--levels", "levels.jsonl"],
        &["tasks", "check", &name],
        &["script", "script.mge"],
        &["sweep", "sweep.json"],
        &["train", "task1", "--model", &name, "--quiet"],
        &["resume", &name],
        &["train", &name],
        &["train", "task1", "--episodes", &name],
    ];
    for arguments in commands {
        let output = mge(path, arguments);
        assert!(!output.status.success(), "{arguments:?}");
        let message = String::from_utf8(output.stderr).expect("messages are UTF-8");
        assert!(message.contains("\\u{"), "{arguments:?}: {message:?}");
        let is_raw = |c: char| c.is_control() && c != '\n' || c == '\u{202e}';
        assert!(!message.contains(is_raw), "{arguments:?}: {message:?}");
    }
    let scene = format!("{{\"ball\": {{{quoted}: 1}}}}\n");
    fail(run_with_input(path, &["simulate"], scene.as_bytes()), "\\u{1b}");
}

#[test]
fn messages_shorten_long_text() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let long = "x".repeat(2 << 20);
    fs::write(path.join("script.mge"), format!("{long}\n")).unwrap();
    fs::write(path.join("key.json"), format!("{{\"{long}\": 1}}")).unwrap();
    fs::write(path.join("sweep.json"), format!("{{\"task\": [\"task1\"], \"method\": [\"{long}\"]}}")).unwrap();
    fs::write(path.join("axis.json"), format!("{{\"task\": [\"task1\"], \"{long}\": [1]}}")).unwrap();
    fail(mge(path, ["script", "script.mge"]), "script.mge:1");
    fail(mge(path, ["train", "key.json"]), "key.json:1");
    fail(mge(path, ["sweep", "sweep.json"]), "sweep.json:1");
    fail(mge(path, ["sweep", "axis.json"]), "axis.json:1");
    let scene = format!("{{\"id\": \"a\", \"{long}\": 1}}\n");
    fail(run_with_input(path, &["simulate"], scene.as_bytes()), "stdin:1");
    let request = format!("{{\"command\": \"{long}\"}}\n{{\"command\": \"close\"}}\n");
    let answers = succeed(run_with_input(path, &["env", "serve", "task1"], request.as_bytes()));
    assert!(answers.len() < 3000, "{} bytes", answers.len());
}

#[test]
fn a_line_without_an_end_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    for arguments in [&["simulate"][..], &["env", "serve", "task1"]] {
        let endless = std::io::repeat(b' ').take(64 << 20);
        let output = run_with_input(folder.path(), arguments, endless);
        fail(output, "stdin:1: line: is longer than 16 MB");
    }
}

#[test]
fn the_task_of_a_run_is_checked_like_any_other() {
    let folder = tempfile::tempdir().unwrap();
    train(folder.path());
    let file = folder.path().join("run/config.json");
    let saved: Value = serde_json::from_slice(&fs::read(&file).unwrap()).unwrap();
    for (pointer, value, expected) in [
        ("/config/task/ball/radius", json!(-5), "ball.radius: is -5"),
        ("/config/task/ball/radius", json!(1e38), "ball.radius: is"),
        ("/config/task/rules/gravity/1", json!(1e38), "rules.gravity: is"),
        ("/config/task/rules/steps_per_action", json!(4_294_967_295u32), "rules.steps_per_action: is 4294967295"),
        ("/config/task/name", json!("../../x"), "name: must be"),
        ("/config/guidance/horizon", json!(u64::MAX), "guidance.horizon: is"),
    ] {
        let mut hostile = saved.clone();
        *hostile.pointer_mut(pointer).unwrap() = value;
        fs::write(&file, hostile.to_string()).unwrap();
        for arguments in [&["resume", "run", "--quiet"][..], &["evaluate", "run"], &["export", "run", "--out", "a"]] {
            fail(mge(&folder, arguments), expected);
        }
    }
}
