//! Python programs read runs: TensorBoard's reader and the NumPy snippet of docs/python.md.
//! The tests need a Python with the packages of `tests/python/requirements.txt`, named by `MGE_PYTHON`;
//! without it they are skipped. The tests of the Python package are in `python/tests/`.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::program::{mge, succeed};

/// The Python interpreter to test with, if any.
fn python() -> Option<PathBuf> {
    let python = std::env::var_os("MGE_PYTHON").map(PathBuf::from);
    if python.is_none() {
        eprintln!("skipped: set MGE_PYTHON to a Python with the packages of tests/python/requirements.txt");
    }
    python
}

/// Runs a script of `tests/python`, which must succeed. Returns its output.
fn check(python: &Path, script: &str, argument: &Path) -> String {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python").join(script);
    succeed(Command::new(python).arg(script).arg(argument).output().expect("Python starts"))
}

/// A short training with updates.
fn train(folder: &Path) {
    let line = "train task1 --episodes 40 --model true --quiet --out run --set ddpg.warmup_steps=50 \
        --set ddpg.hidden=16 --set evaluation.every=10";
    succeed(mge(folder, line.split_whitespace()));
}

#[test]
fn tensorboard_reads_the_values_of_a_run() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().unwrap();
    train(folder.path());
    let said = check(&python, "check_tensorboard.py", &folder.path().join("run"));
    assert!(said.contains("values agree"), "{said}");
}

#[test]
fn the_snippet_in_the_docs_computes_the_actions_of_the_actor() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().unwrap();
    train(folder.path());
    succeed(mge(&folder, ["export", "run", "--out", "actor.safetensors"]));
    let episodes = succeed(mge(&folder, ["evaluate", "run", "--episodes", "2", "--observations"]));
    std::fs::write(folder.path().join("episodes.jsonl"), episodes).unwrap();
    let said = check(&python, "check_actor.py", folder.path());
    assert!(said.contains("actions agree"), "{said}");
}
