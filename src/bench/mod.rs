//! The work timed by `mge bench` and `benches/work.rs`. Its shapes are fixed to those of the paper's
//! networks, so that times can be compared between versions and with other programs; the default
//! model has a few more features.

mod agent;
mod environment;
mod networks;

use std::time::Instant;

use serde::Serialize;

/// A piece of work that can be timed.
#[derive(Debug, Clone, Copy)]
pub struct Work {
    /// Its name.
    pub name: &'static str,
    /// What one call does.
    pub note: &'static str,
    /// Number of calls timed together as a group.
    calls: u32,
    prepare: fn() -> Box<dyn FnMut()>,
}

/// All work items.
pub const WORKS: &[Work] = &[
    Work {
        name: "gnn_train_step",
        note: "forward, backward and Adam on 128 single-tool observations, 64 for each edge type, 17 layers",
        calls: 100,
        prepare: networks::train_step,
    },
    Work {
        name: "gnn_forward_4096",
        note: "prediction of 4096 edges of one type and 4096 nodes, 17 layers",
        calls: 20,
        prepare: networks::forward,
    },
    Work {
        name: "ddpg_update",
        note: "critic step, actor step, soft updates; observation 160, 3 x 64, batch 128",
        calls: 300,
        prepare: agent::update,
    },
    Work {
        name: "ddpg_env_step",
        note: "act, noise, store, sample, one update on an environment that costs nothing",
        calls: 300,
        prepare: agent::environment_step,
    },
    Work {
        name: "env_action",
        note: "one action of 40 physics steps in a shipped task under random play, resets included",
        calls: 5000,
        prepare: environment::middle,
    },
    Work {
        name: "env_action_small",
        note: "the same with one tool beside the ball",
        calls: 5000,
        prepare: environment::small,
    },
    Work {
        name: "env_action_full",
        note: "the same with three balls over a screen of 25 tools",
        calls: 5000,
        prepare: environment::full,
    },
    level("level_Basket", || environment::level("Basket")),
    level("level_Belt", || environment::level("Belt")),
    level("level_Buckets", || environment::level("Buckets")),
    level("level_Cannon", || environment::level("Cannon")),
    level("level_Collide", || environment::level("Collide")),
    level("level_Funnel", || environment::level("Funnel")),
    level("level_GoalTest", || environment::level("GoalTest")),
    level("level_Ladder", || environment::level("Ladder")),
    level("level_Moving", || environment::level("Moving")),
    level("level_Navigate", || environment::level("Navigate")),
    level("level_Obstacle", || environment::level("Obstacle")),
    level("level_Push", || environment::level("Push")),
    level("level_Seesaw", || environment::level("Seesaw")),
];

/// The work of an action on a level of CREATE.
const fn level(name: &'static str, prepare: fn() -> Box<dyn FnMut()>) -> Work {
    let note = "one action of 40 physics steps on a level of CREATE, with its observation: any of 40 tools anywhere, \
                resets included";
    Work { name, note, calls: 1000, prepare }
}

/// One measurement, as a line of JSON.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Measurement {
    /// Always `mge`.
    pub peer: &'static str,
    /// The work's name.
    pub work: &'static str,
    /// Milliseconds per call: the median of five groups. With several threads, the mean over them divided
    /// by their number.
    pub ms: f64,
    /// Number of threads.
    pub threads: usize,
    /// What one call does.
    pub note: &'static str,
}

impl std::fmt::Display for Work {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name)
    }
}

impl Work {
    /// Prepares the work; each call of the closure does it once.
    pub fn prepare(&self) -> Box<dyn FnMut()> {
        (self.prepare)()
    }

    /// Times the work in the current rayon pool. Work that is not parallel itself runs on every thread
    /// independently.
    pub fn measure(&self) -> Measurement {
        let threads = rayon::current_num_threads();
        let shared = self.name.starts_with("gnn");
        let ms = if shared || threads == 1 { self.time_alone() } else { self.time_side_by_side(threads) };
        Measurement { peer: "mge", work: self.name, ms, threads, note: self.note }
    }

    fn time_alone(&self) -> f64 {
        let mut call = self.prepare();
        self.group(&mut *call, self.calls / 4 + 5);
        median((0..5).map(|_| self.group(&mut *call, self.calls)).collect())
    }

    fn time_side_by_side(&self, threads: usize) -> f64 {
        let times = rayon::broadcast(|_| self.time_alone());
        times.iter().sum::<f64>() / (threads * threads) as f64
    }

    /// Mean milliseconds per call over a group of calls.
    fn group(&self, call: &mut dyn FnMut(), calls: u32) -> f64 {
        let start = Instant::now();
        (0..calls).for_each(|_| call());
        start.elapsed().as_secs_f64() * 1e3 / f64::from(calls)
    }
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

#[cfg(test)]
mod tests {
    #[test]
    fn all_work_can_be_done_repeatedly() {
        for work in super::WORKS {
            let mut call = work.prepare();
            (0..3).for_each(|_| call());
        }
    }

    #[test]
    fn every_level_is_timed() {
        let levels = mge_task::level_names().map(|name| format!("level_{name}"));
        let timed = super::WORKS.iter().map(|work| work.name.to_owned());
        assert_eq!(levels.collect::<Vec<_>>(), timed.filter(|name| name.starts_with("level_")).collect::<Vec<_>>());
    }
}
