//! Times the program's own work, one line of JSON for each item:
//!
//! ```sh
//! cargo bench --bench work -- [--only WORK,...] [--threads N]
//! ```
//!
//! The shapes are fixed to those of the paper's networks, so that times can be compared between versions and with other
//! programs; the default model has a few more features.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "the report of a benchmark")]

mod agent;
mod environment;
mod networks;

use std::time::Instant;

use clap::Parser as _;

use mge::task::level_names;

/// Times the program's own work, one line of JSON for each item.
#[derive(Debug, clap::Parser)]
struct Arguments {
    /// Only the work whose names begin like these, comma-separated
    #[arg(long, value_name = "WORK", value_delimiter = ',')]
    only: Vec<String>,
    /// Number of threads
    #[arg(long, default_value_t = 1)]
    threads: usize,
    /// Ignored: cargo gives it to every benchmark.
    #[arg(long, hide = true)]
    bench: bool,
}

/// Does the work once.
type Call = Box<dyn FnMut()>;

/// A piece of work that can be timed.
struct Work {
    name: String,
    /// What one call does.
    note: &'static str,
    /// Number of calls timed together as a group.
    calls: u32,
    prepare: Box<dyn Fn() -> Call + Sync>,
}

impl Work {
    fn new(name: &str, calls: u32, prepare: impl Fn() -> Call + Sync + 'static, note: &'static str) -> Self {
        Self { name: name.to_owned(), note, calls, prepare: Box::new(prepare) }
    }

    /// Milliseconds per call in the current rayon pool: the median of five groups. Work that is not parallel itself
    /// runs on every thread independently; the time is then the mean over the threads divided by their number.
    fn measure(&self, threads: usize) -> f64 {
        if threads == 1 || self.name.starts_with("gnn") {
            return self.time_alone();
        }
        let times = rayon::broadcast(|_| self.time_alone());
        times.iter().sum::<f64>() / (threads * threads) as f64
    }

    fn time_alone(&self) -> f64 {
        let mut call = (self.prepare)();
        self.group(&mut *call, self.calls / 4 + 5);
        let mut times: Vec<f64> = (0..5).map(|_| self.group(&mut *call, self.calls)).collect();
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    }

    /// Mean milliseconds per call over a group of calls.
    fn group(&self, call: &mut dyn FnMut(), calls: u32) -> f64 {
        let start = Instant::now();
        (0..calls).for_each(|_| call());
        start.elapsed().as_secs_f64() * 1e3 / f64::from(calls)
    }
}

/// All work items.
fn works() -> Vec<Work> {
    let mut works = vec![
        Work::new(
            "gnn_train_step",
            100,
            networks::train_step,
            "forward, backward and Adam on 128 single-tool observations, 64 for each edge type, 17 layers",
        ),
        Work::new(
            "gnn_forward_4096",
            20,
            networks::forward,
            "prediction of 4096 edges of one type and 4096 nodes, 17 layers",
        ),
        Work::new(
            "ddpg_update",
            300,
            agent::update,
            "critic step, actor step, soft updates; observation 160, 3 x 64, batch 128",
        ),
        Work::new(
            "ddpg_env_step",
            300,
            agent::environment_step,
            "act, noise, store, sample, one update on an environment that costs nothing",
        ),
        Work::new(
            "env_action",
            5000,
            environment::middle,
            "one action of 40 physics steps in a shipped task under random play, resets included",
        ),
        Work::new("env_action_small", 5000, environment::small, "the same with one tool beside the ball"),
        Work::new("env_action_full", 5000, environment::full, "the same with three balls over a screen of 25 tools"),
    ];
    let note = "one action of 40 physics steps on a level of CREATE, with its observation: any of 40 tools anywhere, \
                resets included";
    works.extend(
        level_names().map(|name| Work::new(&format!("level_{name}"), 1000, move || environment::level(name), note)),
    );
    works
}

fn main() {
    mge::keep_freed_blocks();
    let Arguments { only, threads, .. } = Arguments::parse();
    let works = works();
    let begins = |work: &Work, only: &String| work.name.starts_with(only);
    if let Some(unknown) = only.iter().find(|only| !works.iter().any(|work| begins(work, only))) {
        let known: Vec<&str> = works.iter().map(|work| work.name.as_str()).collect();
        eprintln!("--only {unknown}: use {}", known.join(", "));
        std::process::exit(2);
    }
    let threads = threads.max(1);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    for work in works.iter().filter(|work| only.is_empty() || only.iter().any(|only| begins(work, only))) {
        let ms = pool.install(|| work.measure(threads));
        let (name, note) = (&work.name, work.note);
        println!("{}", serde_json::json!({"peer": "mge", "work": name, "ms": ms, "threads": threads, "note": note}));
    }
}
