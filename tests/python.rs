//! Python programs read runs: TensorBoard's reader and the NumPy snippet of docs/python.md.
//! The tests need a Python with the packages of `tests/python/requirements.txt`, named by `MGE_PYTHON`;
//! without it they are skipped. The tests of the Python package are in `python/tests/`.

// Skipped tests print a note.
#![allow(clippy::print_stderr)]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const MGE: &str = env!("CARGO_BIN_EXE_mge");

/// The Python interpreter to test with, if any.
fn python() -> Option<PathBuf> {
    let python = std::env::var_os("MGE_PYTHON").map(PathBuf::from);
    if python.is_none() {
        eprintln!("skipped: set MGE_PYTHON to a Python with the packages of tests/python/requirements.txt");
    }
    python
}

fn text(output: &Output) -> String {
    format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr))
}

fn mge(arguments: &[&str]) -> Vec<u8> {
    let output = Command::new(MGE).args(arguments).output().expect("the program starts");
    assert!(output.status.success(), "{}", text(&output));
    output.stdout
}

/// Runs a script of `tests/python`, which must succeed. Returns its output.
fn check(python: &Path, script: &str, argument: &Path) -> String {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python").join(script);
    let output = Command::new(python).arg(script).arg(argument).output().expect("Python starts");
    assert!(output.status.success(), "{}", text(&output));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// A short training with updates.
fn run(folder: &Path) -> PathBuf {
    let run = folder.join("run");
    let path = run.display().to_string();
    let settings = ["ddpg.warmup_steps=50", "ddpg.hidden=16", "evaluation.every=10"];
    let mut arguments = vec!["train", "task1", "--episodes", "40", "--model", "true", "--quiet", "--out", &path];
    settings.iter().for_each(|setting| arguments.extend(["--set", setting]));
    mge(&arguments);
    run
}

#[test]
fn tensorboard_reads_the_values_of_a_run() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().unwrap();
    let said = check(&python, "check_tensorboard.py", &run(folder.path()));
    assert!(said.contains("values agree"), "{said}");
}

#[test]
fn the_snippet_in_the_docs_computes_the_actions_of_the_actor() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().unwrap();
    let run = run(folder.path()).display().to_string();
    let actor = folder.path().join("actor.safetensors").display().to_string();
    mge(&["export", &run, "--out", &actor]);
    let episodes = mge(&["evaluate", &run, "--episodes", "2", "--observations"]);
    std::fs::write(folder.path().join("episodes.jsonl"), episodes).unwrap();
    let said = check(&python, "check_actor.py", folder.path());
    assert!(said.contains("actions agree"), "{said}");
}
