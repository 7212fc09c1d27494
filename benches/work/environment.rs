//! The environment under random play, including resets.

use std::sync::Arc;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use mge_env::{Choice, Environment, uniform_action};
use mge_physics::{ACTION_SET, ToolKind, ToolSplit};
use mge_task::{self as task, BallSpec, Form, Task, ToolSpec};

/// A falling ball beside one tool.
pub fn small() -> Box<dyn FnMut()> {
    let mut task = middle_task();
    task.tools.truncate(1);
    task.subgoals.clear();
    play(task)
}

/// One of the shipped tasks.
pub fn middle() -> Box<dyn FnMut()> {
    play(middle_task())
}

/// A scene full of tools of every type, with three balls.
pub fn full() -> Box<dyn FnMut()> {
    let mut task = middle_task();
    task.balls = vec![BallSpec::at([-0.3, 0.9]), BallSpec::at([0.1, 0.9])];
    let cells = (0..5).flat_map(|row| (0..5).map(move |column| (row, column)));
    task.tools = cells
        .map(|(row, column)| ToolSpec {
            kind: ToolKind::PAPER[(row + column) % ToolKind::PAPER.len()],
            position: [0.4 * column as f32 - 0.8, 0.3 * row as f32 - 0.8],
            form: Form { size: Some(4.0), ..Form::default() },
        })
        .collect();
    play(task)
}

/// A level of CREATE, with a new action set for every episode.
pub fn level(name: &str) -> Box<dyn FnMut()> {
    // A test loads every level.
    let task = task::load(&format!("create/{name}")).expect("levels are valid");
    let mut environment = Environment::new(Arc::new(task)).with_tools(ToolSplit::Train);
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    environment.reset(&mut rng);
    Box::new(move || {
        let action = Choice { tool: rng.gen_range(0..ACTION_SET), place: uniform_action(&mut rng) };
        if environment.step(action).map_or(true, |step| step.end.is_some()) {
            environment.reset(&mut rng);
        }
    })
}

fn middle_task() -> Task {
    // A test parses every shipped task.
    task::load("task5").expect("shipped tasks are valid")
}

fn play(task: Task) -> Box<dyn FnMut()> {
    let mut environment = Environment::new(Arc::new(task));
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    Box::new(move || {
        if environment.step(uniform_action(&mut rng)).map_or(true, |step| step.end.is_some()) {
            environment.reset(&mut rng);
        }
    })
}
