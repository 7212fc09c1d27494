//! Invented but realistic data.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::actions::StageActions;
use crate::*;
use mge_guidance::Cluster;
use mge_physics::ToolKind;
use mge_stats::Estimate;
use mge_task::{Form, ToolSpec, shipped};

fn stream(n: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    rng.set_stream(n);
    rng
}

pub fn statistics() -> Statistics {
    Statistics {
        centre: "Interquartile mean".to_owned(),
        interval: "95 % stratified bootstrap interval (2000 resamples)".to_owned(),
        seeds: 5,
        fewest_seeds: None,
    }
}

fn estimate(value: f64, half: f64) -> Estimate {
    Estimate { value, lower: (value - half).max(0.0), upper: value + half }
}

/// A ball in free fall that bounces off the tool's bounding circle.
fn flight(rng: &mut ChaCha8Rng, radius: f32) -> Vec<[f32; 2]> {
    let angle = rng.gen_range(0.0..std::f32::consts::TAU);
    let mut p = [0.55 * angle.cos(), 0.55 * angle.sin()];
    let aim = rng.gen_range(-0.5..0.5f32);
    let speed = rng.gen_range(0.3..0.7);
    let mut v = [-speed * (angle + aim).cos(), -speed * (angle + aim).sin()];
    let mut path = vec![p];
    for _ in 0..40 {
        v[1] -= 0.05 / 30.0;
        p = [p[0] + v[0] / 30.0, p[1] + v[1] / 30.0];
        let d = p[0].hypot(p[1]);
        if d < radius && p[0] * v[0] + p[1] * v[1] < 0.0 {
            let n = [p[0] / d, p[1] / d];
            let normal = v[0] * n[0] + v[1] * n[1];
            v = [v[0] - 1.5 * normal * n[0], v[1] - 1.5 * normal * n[1]];
        }
        path.push(p);
    }
    path
}

pub fn launches() -> Launches {
    let tool = |kind: ToolKind| {
        let mut rng = stream(kind as u64);
        let size = if kind.is_segment() { 20.0 } else { kind.default_size() };
        let tool = ToolSpec { kind, position: [0.0, 0.0], form: Form { size: Some(size), ..Form::default() } };
        let [w, h] = tool.tool().half_extents();
        let radius = (w.min(h) + 4.0) / 42.0;
        let trajectories = (0..40).map(|_| flight(&mut rng, radius)).collect();
        ToolLaunches { tool, ball_radius: 4.0, trajectories, observations: 1000 }
    };
    Launches { tools: ToolKind::PAPER.map(tool).to_vec() }
}

pub fn relative() -> RelativeFrames {
    let task = shipped().swap_remove(5);
    let placed = vec![[-0.3, 0.2]];
    let start = task.ball.position;
    let ball = |t: f32| [start[0] + 0.25 * t, start[1] - 0.12 * t * t];
    let instant = |time: f32| {
        let origin = ball(time);
        let objects = task.tools.iter().map(|tool| tool.position).chain(placed.clone());
        let edges = objects
            .map(|object| {
                let distance = (object[0] - origin[0]).hypot(object[1] - origin[1]);
                Edge { object, active: distance < 0.6 }
            })
            .collect();
        let trail = (0..=40).map(|n| ball(time * n as f32 / 40.0)).collect();
        Instant { time, ball: origin, trail, placed: placed.clone(), edges }
    };
    RelativeFrames { instants: [0.0, 1.33, 2.2].map(instant).to_vec(), task, cutoff: 12.0 }
}

pub fn tasks() -> TaskGrid {
    TaskGrid { tasks: shipped() }
}

pub fn actions() -> ActionSamples {
    let mut rng = stream(20);
    let mut stage = |target: [f32; 2]| {
        let cluster = |rng: &mut ChaCha8Rng| Cluster {
            mean: [target[0] + rng.gen_range(-0.25..0.25), target[1] + rng.gen_range(-0.5..0.1)],
            std: [rng.gen_range(0.02..0.12), rng.gen_range(0.02..0.12)],
            weight: 1.0 / 3.0,
            count: 100,
        };
        let clusters: Vec<Cluster> = (0..3).map(|_| cluster(&mut rng)).collect();
        let mut normal = || (0..12).map(|_| rng.gen_range(-0.5..0.5f32)).sum::<f32>();
        let samples = (0..150)
            .map(|n| std::array::from_fn(|axis| clusters[n % 3].mean[axis] + clusters[n % 3].std[axis] * normal()))
            .collect();
        StageActions { samples, clusters }
    };
    let tasks = shipped().into_iter().map(|task| {
        let stages = task.stages().iter().map(|region| stage(region.position)).collect();
        TaskActions { task, stages }
    });
    ActionSamples { tasks: tasks.collect() }
}

pub fn hits() -> HitBars {
    let goals = [342.0, 52.0, 77.0, 40.0, 77.0, 65.0];
    let random = [8.0, 0.0, 3.0, 0.0, 0.0, 0.0];
    let tasks = shipped().into_iter().zip(goals.iter().zip(random)).map(|(task, (&goal, random))| {
        let subgoals = |first: f64, last: f64| {
            let count = task.subgoals.len() as f64;
            (0..task.subgoals.len())
                .map(|n| estimate((first + (last - first) * (n as f64 / count)).round(), 0.05 * first))
                .collect::<Vec<_>>()
        };
        let guided = PolicyHits {
            policy: "guided".to_owned(),
            goal: estimate(goal, 0.1 * goal),
            subgoals: subgoals(850.0, goal),
        };
        let random = PolicyHits {
            policy: "random".to_owned(),
            goal: estimate(random, 2.0 * random.min(1.0)),
            subgoals: subgoals(120.0, random),
        };
        TaskHits { task: task.name.clone(), policies: vec![guided, random] }
    });
    HitBars {
        episodes: 1000,
        statistics: Statistics { centre: "Mean".to_owned(), seeds: 3, ..statistics() },
        tasks: tasks.collect(),
    }
}

fn curve(label: &str, episodes: usize, top: f64, slope: f64, rng: &mut ChaCha8Rng) -> Curve {
    let x: Vec<f64> = (0..episodes).step_by(5).map(|n| n as f64).collect();
    let mut noise = 0.0;
    let y: Vec<f64> = x
        .iter()
        .map(|x| {
            noise = 0.9 * noise + rng.gen_range(-0.015..0.015);
            if *x < 15.0 {
                f64::NAN
            } else {
                (top / (1.0 + (-(x - slope) / 250.0).exp()) + noise + 6.0 / x).clamp(0.0, 1.0)
            }
        })
        .collect();
    let low = y.iter().map(|y| (y - 0.12_f64).clamp(0.0, 1.0)).collect();
    let high = y.iter().map(|y| (y + 0.1_f64).clamp(0.0, 1.0)).collect();
    Curve { label: label.to_owned(), x, y, low, high }
}

pub fn curves() -> LearningCurves {
    let mut rng = stream(30);
    let panels = shipped().into_iter().enumerate().map(|(n, task)| {
        let guided =
            curve("DDPG-MGE, \u{3b5} 0.5 linear", 3000, 0.9 - 0.1 * n as f64, 700.0 + 150.0 * n as f64, &mut rng);
        let low = curve("DDPG-MGE, \u{3b5} 0.1", 3000, 0.8 - 0.1 * n as f64, 1200.0 + 100.0 * n as f64, &mut rng);
        let mut plain = curve("DDPG", 3000, if n % 2 == 0 { 0.6 } else { 0.02 }, 1500.0, &mut rng);
        plain.y[300..330].fill(f64::NAN);
        CurvePanel { task: task.name.clone(), curves: vec![plain, low, guided] }
    });
    LearningCurves { window: 100, statistics: statistics(), panels: panels.collect(), ..LearningCurves::default() }
}

pub fn methods() -> MethodScores {
    let mut rng = stream(35);
    let names = ["DDPG", "DDPG-MGE, epsilon 0.1", "DDPG-MGE, epsilon 0.5 to 0", "DDPG, uniform exploration"];
    let mut panel = |task: String, count: usize| ScorePanel {
        task,
        methods: names
            .iter()
            .map(|name| {
                let value = rng.gen_range(0.05..0.8);
                let runs = (0..count).map(|_| (value + rng.gen_range(-0.2..0.2f64)).clamp(0.0, 1.0)).collect();
                MethodScore { label: (*name).to_owned(), estimate: estimate(value, 0.1), runs }
            })
            .collect(),
    };
    let mut panels: Vec<ScorePanel> = shipped().into_iter().map(|task| panel(task.name, 5)).collect();
    panels.push(panel("All tasks".to_owned(), 0));
    let measure = "area under the curve".to_owned();
    MethodScores { measure, statistics: statistics(), panels, ..MethodScores::default() }
}

pub fn moment() -> Moment {
    let task = shipped().swap_remove(2);
    let mover = Mover { position: [0.5, 0.5], radius: 4.0, angle: Some(0.3) };
    Moment {
        time: 2.5,
        ball: task.ball.position,
        movers: vec![mover, Mover { position: [-0.5, 0.5], angle: None, ..mover }],
        placed: vec![task.placeable.tool([0.2, -0.4])],
        reached: 1,
        task,
    }
}

/// Every figure with its file name.
pub fn all() -> Vec<(&'static str, Box<dyn Figure>)> {
    vec![
        ("launches", Box::new(launches())),
        ("relative", Box::new(relative())),
        ("tasks", Box::new(tasks())),
        ("actions", Box::new(actions())),
        ("hits", Box::new(hits())),
        ("curves", Box::new(curves())),
        ("greedy", Box::new(LearningCurves { measure: Success::Greedy, ..curves() })),
        ("methods", Box::new(methods())),
        ("moment", Box::new(moment())),
    ]
}
