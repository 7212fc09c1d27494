//! Time of one action (40 physics steps) in the environment: `cargo bench --bench env`.
//!
//! Small is a falling ball beside one tool, middle the size of the shipped tasks, full a
//! screen of tools and three balls. The agent places tools at random as it goes; over
//! episodes are reset, which is counted in.

use std::sync::Arc;

use divan::Bencher;
use divan::counter::ItemsCount;
use mge::env::{Action, Environment};
use mge::physics::ToolKind;
use mge::task::{self, BallSpec, Form, Task, ToolSpec};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Actions in one measured call.
const ACTIONS: usize = 100;

fn main() {
    divan::main();
}

/// An environment and the stream of actions it is given.
struct Player {
    environment: Environment,
    rng: ChaCha8Rng,
}

impl Player {
    fn new(scene: &str) -> Self {
        Self { environment: Environment::new(Arc::new(scene_task(scene))), rng: ChaCha8Rng::seed_from_u64(0) }
    }

    fn play(&mut self) -> f32 {
        let mut total = 0.0;
        for _ in 0..ACTIONS {
            let action: Action = [0; 2].map(|_| self.rng.gen_range(-1.0..1.0));
            let step = self.environment.step(action).expect("an episode that is over is reset");
            total += step.reward;
            if step.end.is_some() {
                self.environment.reset(&mut self.rng);
            }
        }
        total
    }
}

fn scene_task(scene: &str) -> Task {
    let mut task = task::load("task5").expect("a shipped task");
    match scene {
        "small" => {
            task.tools.truncate(1);
            task.subgoals.clear();
        }
        "full" => {
            task.balls = vec![BallSpec::at([-0.3, 0.9]), BallSpec::at([0.1, 0.9])];
            task.tools = grid();
        }
        _ => {}
    }
    task
}

/// Five rows of tools of every type.
fn grid() -> Vec<ToolSpec> {
    let cells = (0..5).flat_map(|row| (0..5).map(move |column| (row, column)));
    cells
        .map(|(row, column)| {
            let kind = ToolKind::ALL[(row + column) % ToolKind::ALL.len()];
            let position = [0.4 * column as f32 - 0.8, 0.3 * row as f32 - 0.8];
            ToolSpec { kind, position, form: Form { size: Some(4.0), ..Form::default() } }
        })
        .collect()
}

#[divan::bench(args = ["small", "middle", "full"], threads = [1, 2])]
fn env_action(bencher: Bencher, scene: &str) {
    bencher.with_inputs(|| Player::new(scene)).input_counter(|_| ItemsCount::new(ACTIONS)).bench_refs(Player::play);
}
