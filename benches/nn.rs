//! The timed work of the networks: a training step and a large prediction of the paper's graph
//! network, and one DDPG update. Run with `cargo bench --bench nn`, pinned to one core for figures
//! that compare (`taskset -c 0`).

use std::{sync::Arc, time::Instant};

use dfdx::prelude::*;
use mge::nn::{Activation, InitScheme, Matrix, Mlp, MlpShape, Optimiser, OptimiserKind, matrix, rows};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

const NODE: usize = 10;
const EDGE: usize = 21;
const HIDDEN: usize = 64;
const EMBED: usize = 20;
const LAYERS: usize = 17;
const BATCH: usize = 128;
const OBS: usize = 160;
const ACT: usize = 2;

fn main() {
    let mut arguments = std::env::args().skip_while(|a| a != "--median");
    match arguments.next() {
        Some(_) => medians(arguments.next().as_deref()),
        None => divan::main(),
    }
}

/// One JSON line a work item (or the one given): the median of five groups, as the time of a call.
fn medians(only: Option<&str>) {
    let report = |work: &str, calls: usize, call: &mut dyn FnMut()| {
        if only.is_some_and(|only| only != work) {
            return;
        }
        (0..calls / 4 + 5).for_each(|_| call());
        let mut groups: Vec<f64> = (0..5)
            .map(|_| {
                let start = Instant::now();
                (0..calls).for_each(|_| call());
                start.elapsed().as_secs_f64() * 1e3 / calls as f64
            })
            .collect();
        groups.sort_by(f64::total_cmp);
        let (ms, threads) = (groups[2], rayon::current_num_threads());
        println!(r#"{{"peer":"mge","work":"{work}","ms":{ms:.4},"threads":{threads}}}"#);
    };
    let mut graph = Graph::new();
    report("gnn_train_step", 100, &mut || graph.train_step());
    let (e, x) = (random(4096, EDGE).as_vec(), random(4096, NODE).as_vec());
    report("gnn_forward_4096", 10, &mut || graph.predict(&e, &x));
    let mut ddpg = Ddpg::new();
    report("ddpg_update", 300, &mut || ddpg.update());
}

#[divan::bench]
fn gnn_train_step(bencher: divan::Bencher) {
    let mut graph = Graph::new();
    bencher.bench_local(|| graph.train_step());
}

#[divan::bench]
fn gnn_forward_4096(bencher: divan::Bencher) {
    let mut graph = Graph::new();
    let (e, x) = (random(4096, EDGE).as_vec(), random(4096, NODE).as_vec());
    bencher.bench_local(|| graph.predict(&e, &x));
}

#[divan::bench]
fn ddpg_update(bencher: divan::Bencher) {
    let mut ddpg = Ddpg::new();
    bencher.bench_local(|| ddpg.update());
}

fn random(rows: usize, columns: usize) -> Matrix {
    let mut rng = ChaCha8Rng::seed_from_u64((rows * columns) as u64);
    let values = (0..rows * columns).map(|_| rng.gen_range(-1.0..1.0)).collect();
    matrix(&Cpu::default(), values, rows, columns)
}

fn network(shape: MlpShape) -> Mlp {
    Mlp::new(shape, InitScheme::FanIn, &mut ChaCha8Rng::seed_from_u64(0)).unwrap()
}

/// Two edge functions, node function and decoder of appendix A.1.
struct Graph {
    edges: [Mlp; 2],
    node: Mlp,
    decoder: Mlp,
    optimiser: Optimiser,
    e: [Matrix; 2],
    receivers: [Arc<[usize]>; 2],
    x: Matrix,
    y: Matrix,
    buffers: [Vec<f32>; 4],
}

impl Graph {
    fn new() -> Self {
        let deep = |inputs| network(MlpShape::uniform(inputs, HIDDEN, EMBED, LAYERS, Activation::Tanh));
        let (edges, node) = ([deep(EDGE), deep(EDGE)], deep(EMBED + NODE));
        let decoder = network(MlpShape::uniform(EMBED, HIDDEN, 2, 2, Activation::Tanh));
        let nets = [&edges[0], &edges[1], &node, &decoder];
        Self {
            optimiser: Optimiser::new(OptimiserKind::Adam, &nets),
            edges,
            node,
            decoder,
            e: [random(BATCH / 2, EDGE), random(BATCH / 2, EDGE)],
            receivers: [(0..BATCH / 2).collect(), (BATCH / 2..BATCH).collect()],
            x: random(BATCH, NODE),
            y: random(BATCH, 2),
            buffers: Default::default(),
        }
    }

    fn train_step(&mut self) {
        let message = |i: usize| {
            let m = self.edges[i].forward_data(self.e[i].leaky_trace());
            rows::scatter_sum(m, self.receivers[i].clone(), BATCH)
        };
        let sum = message(0) + message(1);
        let node = self.node.forward(rows::concat_columns(sum, self.x.clone()));
        let out = self.decoder.forward(node);
        let mut grads = (out - self.y.clone()).square().mean().backward();
        let [e0, e1] = &mut self.edges;
        let nets = &mut [e0, e1, &mut self.node, &mut self.decoder];
        self.optimiser.update(nets, &mut grads, 1e-4).unwrap();
    }

    fn predict(&mut self, e: &[f32], x: &[f32]) {
        let [message, joined, node, out] = &mut self.buffers;
        let rows = x.len() / NODE;
        self.edges[0].predict_into(e, rows, message);
        joined.clear();
        for (m, x) in message.chunks_exact(EMBED).zip(x.chunks_exact(NODE)) {
            joined.extend_from_slice(m);
            joined.extend_from_slice(x);
        }
        self.node.predict_into(joined, rows, node);
        self.decoder.predict_into(node, rows, out);
    }
}

struct Ddpg {
    actor: Mlp,
    critic: Mlp,
    actor_target: Mlp,
    critic_target: Mlp,
    actor_optimiser: Optimiser,
    critic_optimiser: Optimiser,
    s: Matrix,
    a: Matrix,
    s2: Matrix,
    r: Matrix,
}

impl Ddpg {
    fn new() -> Self {
        let relu = |inputs, outputs| MlpShape::uniform(inputs, 64, outputs, 3, Activation::Relu);
        let actor = network(relu(OBS, ACT).with_output(Activation::Tanh));
        let critic = network(relu(OBS + ACT, 1));
        Self {
            actor_optimiser: Optimiser::new(OptimiserKind::Adam, &[&actor]),
            critic_optimiser: Optimiser::new(OptimiserKind::Adam, &[&critic]),
            actor_target: actor.clone(),
            critic_target: critic.clone(),
            actor,
            critic,
            s: random(BATCH, OBS),
            a: random(BATCH, ACT),
            s2: random(BATCH, OBS),
            r: random(BATCH, 1),
        }
    }

    fn update(&mut self) {
        let next_action = self.actor_target.forward(self.s2.clone());
        let next_q = self.critic_target.forward_beside(&self.s2, next_action);
        let target = self.r.clone() + next_q * 0.99;

        let q = self.critic.forward_beside(&self.s, self.a.leaky_trace());
        let mut grads = (q - target).square().mean().backward();
        self.critic_optimiser.update(&mut [&mut self.critic], &mut grads, 1e-4).unwrap();

        let action = self.actor.forward_data(self.s.leaky_trace());
        let q = self.critic.forward_frozen_beside(&self.s, action);
        let mut grads = (-q).mean().backward();
        self.actor_optimiser.update(&mut [&mut self.actor], &mut grads, 1e-4).unwrap();

        self.actor_target.soft_update(&self.actor, 0.005);
        self.critic_target.soft_update(&self.critic, 0.005);
    }
}
