//! Every parser of the program, and the whole workbench, as a function of bytes: part of the library when it is built
//! for its tests or for fuzzing. None may panic, and a parser must read back what it prints.

use std::io::sink;
use std::path::Path;
use std::sync::{Arc, LazyLock};

use crate::tui::interface;
use mge_agent::{self as agent, Ddpg, Learner, ReplayBuffer};
use mge_dynamics::Model;
use mge_env::Environment;
use mge_env::protocol;
use mge_experiments::puzzles::Index;
use mge_experiments::sweep::Sweep;
use mge_guidance::EpsilonSchedule;
use mge_nn as nn;
use mge_physics::ToolSplit;
use mge_run::{RunDirectory, read_events};
use mge_task::{self as task, Task};
use mge_trainer::Control;
use mge_workbench::{Command, Script};

/// A parser as a function of bytes.
type Target = fn(&[u8]);

/// The targets. Each has the name of its corpus.
pub const TARGETS: [(&str, Target); 14] = [
    ("task", task),
    ("script", script),
    ("command", command),
    ("sweep", sweep),
    ("epsilon", epsilon),
    ("model", model),
    ("checkpoint", checkpoint),
    ("events", events),
    ("requests", requests),
    ("index", index),
    ("catalogue", catalogue),
    ("env_serve", env_serve),
    ("simulate", simulate),
    ("interface", interface),
];

/// Runs one target on one input.
///
/// # Panics
/// When there is no such target, or the target finds a fault.
pub fn run(target: &str, input: &[u8]) {
    let (_, parse) = TARGETS.iter().find(|(name, _)| *name == target).expect("a target of the table");
    parse(input);
}

/// An input as text; empty if it is not UTF-8.
fn text(input: &[u8]) -> &str {
    std::str::from_utf8(input).unwrap_or_default()
}

/// Tasks: every accepted one can be played and saved.
fn task(input: &[u8]) {
    let Ok(task) = task::parse(text(input), "fuzz") else { return };
    let saved = task::to_json(&task);
    assert_eq!(task::parse(&saved, "saved").expect("a saved task is valid"), task);
    let steps = task.rules.steps_per_action;
    let mut env = Environment::new(Arc::new(task));
    if steps <= 100 {
        let step = env.step([0.1, 0.2]).expect("the first action is never refused");
        assert!(step.observation.iter().all(|value| value.is_finite()));
    }
}

fn script(input: &[u8]) {
    // The script is only parsed; its commands are not executed.
    let _ = Script::parse(text(input), "fuzz", &[]);
}

fn command(input: &[u8]) {
    let Ok(Some(command)) = Command::parse(text(input)) else { return };
    let printed = command.to_string();
    let again = Command::parse(&printed).expect("a printed command is read").expect("not a comment");
    assert_eq!(again.to_string(), printed);
}

fn sweep(input: &[u8]) {
    let _ = Sweep::parse(input, "fuzz");
}

fn epsilon(input: &[u8]) {
    let Ok(schedule) = text(input).parse::<EpsilonSchedule>() else { return };
    assert_eq!(schedule.to_string().parse(), Ok(schedule.clone()));
    for episode in [0, 1, 1000, u32::MAX] {
        assert!((0.0..=1.0).contains(&schedule.threshold(episode)));
    }
    schedule.to_points(u32::MAX, 9);
}

fn model(input: &[u8]) {
    let Ok(model) = Model::from_bytes(input, "fuzz") else { return };
    let saved = model.to_file().to_bytes();
    assert_eq!(Model::from_bytes(&saved, "saved").expect("a saved model is read").to_file().to_bytes(), saved);
}

/// The parts of a run's checkpoint.
fn checkpoint(input: &[u8]) {
    let _ = nn::TensorFile::from_bytes(input);
    let _ = Ddpg::load(input);
    let _ = Learner::load(&agent::SavedLearner { networks: input.to_vec(), replay: Vec::new() });
    if let Ok(replay) = ReplayBuffer::from_bytes(input) {
        assert_eq!(ReplayBuffer::from_bytes(&replay.to_bytes()), Ok(replay));
    }
}

/// The event log, which is read from a file.
fn events(input: &[u8]) {
    let file = tempfile::NamedTempFile::new().expect("a temporary file");
    std::fs::write(file.path(), input).expect("it can be written");
    let _ = read_events(file.path());
}

/// The requests of other processes to a training, which are read from a file.
fn requests(input: &[u8]) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let run = RunDirectory::create(folder.path(), &0).expect("a run");
    let mut reader = run.requests();
    std::fs::write(run.requests_path(), input).expect("it can be written");
    let (requests, problems) = reader.poll::<Control>().expect("it can be read");
    let lines = input.split(|byte| *byte == b'\n').filter(|line| !line.is_empty()).count();
    assert!(requests.len() + problems.len() <= lines);
}

/// The index of generated puzzles.
fn index(input: &[u8]) {
    let Ok(index) = Index::parse(input, Path::new("fuzz")) else { return };
    let folder = tempfile::tempdir().expect("a temporary folder");
    index.save(&folder.path().into()).expect("it can be written");
    assert_eq!(Index::load(folder.path()).expect("a saved index is read"), Some(index));
}

/// The tool catalogue of a recording.
fn catalogue(input: &[u8]) {
    let _ = protocol::Catalogue::read(input, "fuzz");
}

static TASK: LazyLock<Arc<Task>> = LazyLock::new(|| Arc::new(task::load("task2").expect("shipped tasks are valid")));

fn env_serve(input: &[u8]) {
    let _ = protocol::serve(Environment::new(TASK.clone()), 0, input, sink());
    let _ = protocol::serve(Environment::new(TASK.clone()).with_tools(ToolSplit::All), 0, input, sink());
}

fn simulate(input: &[u8]) {
    let _ = protocol::simulate(input, sink());
}

#[cfg(test)]
#[path = "tests.rs"]
mod tests;
