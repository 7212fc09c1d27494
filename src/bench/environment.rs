//! The environment under random play.

use std::sync::Arc;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::env::Environment;
use crate::task;

pub(super) fn action() -> Box<dyn FnMut()> {
    // A test parses every shipped task.
    let task = task::load("task5").expect("shipped tasks are valid");
    let mut environment = Environment::new(Arc::new(task));
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    Box::new(move || {
        let action = [rng.gen_range(-1.0..=1.0), rng.gen_range(-1.0..=1.0)];
        if environment.step(action).map_or(true, |step| step.end.is_some()) {
            environment.reset(&mut rng);
        }
    })
}
