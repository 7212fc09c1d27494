//! Task-agnostic launches: one tool, and a ball launched at it at various angles and
//! velocities (paper, section 5.2 and figure 1).

use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use sha2::{Digest, Sha256};

use super::variety::Variety;
use mge_base::stop::{Stop, Stopped};
use mge_base::streams::Stream;
use mge_env::tool_features;
use mge_physics::{Ball, BallState, GRAVITY, PHYSICS_DT, SCREEN, STEPS_PER_ACTION, Tool, ToolKind, World};

/// One observation of a tool's dynamics: one interaction with the environment, 40
/// physics steps long.
#[derive(Debug, Clone, PartialEq)]
pub struct Launch {
    /// The only tool of the scene.
    pub tool: Tool,
    /// The ball before the first and after each of the 40 physics steps, in units.
    pub states: Vec<BallState>,
}

/// The disjoint parts of a seed's launches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Split {
    /// Launches that a model learns from.
    Training,
    /// Launches that measure its error during training.
    Validation,
    /// Launches that measure its error after training.
    Test,
}

/// Largest launch speed, in units/s. A ball that falls through the whole screen reaches 18.
const MAX_SPEED: f32 = 16.0;
/// Latest time at which the ball reaches its aim, in seconds: within the observed interval.
const MAX_LEAD: f32 = 1.0;

/// `count` launches at tools of one type, each from its own random stream.
///
/// # Errors
/// When `stop` is requested.
pub fn collect(
    kind: ToolKind,
    variety: Variety,
    count: usize,
    split: Split,
    seed: u64,
    stop: &Stop,
) -> Result<Vec<Launch>, Stopped> {
    let launch = |index: usize| {
        stop.check()?;
        let stream = Stream::Launch { split: split as u64, kind: kind.index() as u64, index: index as u64 };
        Ok(launch(kind, variety, &mut stream.of(seed)))
    };
    (0..count).into_par_iter().map(launch).collect()
}

/// SHA-256 of all numbers of the launches, as hexadecimal digits; includes the tools' properties if
/// `properties`.
pub fn data_hash<'a>(launches: impl IntoIterator<Item = &'a Launch>, properties: bool) -> String {
    let mut hash = Sha256::new();
    for launch in launches {
        let tool = &launch.tool;
        hash.update([tool.kind.index() as u8]);
        hash.update(tool.position[0].to_le_bytes());
        hash.update(tool.position[1].to_le_bytes());
        hash.update((tool.size as f32).to_le_bytes());
        if properties {
            tool_features(Some(tool)).iter().for_each(|number| hash.update(number.to_le_bytes()));
        }
        for state in &launch.states {
            let [x, y] = state.position;
            let [vx, vy] = state.velocity;
            for number in [x, y, vx, vy, state.angular_velocity] {
                hash.update(number.to_le_bytes());
            }
        }
    }
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

fn launch(kind: ToolKind, variety: Variety, rng: &mut ChaCha8Rng) -> Launch {
    let centre = f64::from(SCREEN / 2.0);
    loop {
        let tool = variety.draw(kind, rng).at([centre; 2]);
        let start = start(&tool, rng);
        let (distance, _) = tool.surface(start.position);
        if distance > Ball::default().radius {
            return Launch { tool, states: simulate(tool, start) };
        }
    }
}

/// Initial state of a ball aimed at a point on or near the tool: most fall or are thrown down at it,
/// some come from any direction, some roll or slide along its surface, some fly freely. Balls aimed
/// past the tool graze or miss it.
fn start(tool: &Tool, rng: &mut impl Rng) -> BallState {
    let radius = Ball::default().radius;
    let reach = tool.half_extents().map(|half| half + 1.1 * radius);
    let aim: [f32; 2] = std::array::from_fn(|axis| tool.centre()[axis] + rng.gen_range(-reach[axis]..reach[axis]));
    let spin = if rng.gen_bool(0.5) { 0.0 } else { rng.gen_range(-MAX_SPEED..MAX_SPEED) / 2.0 / radius };
    let speed = rng.gen_range(0.0..MAX_SPEED);
    let down = -std::f32::consts::FRAC_PI_2;
    let draw: f32 = rng.r#gen();
    let angle = match draw {
        _ if draw < 0.2 => down,
        _ if draw < 0.55 => down + rng.gen_range(-1.3..1.3),
        _ if draw < 0.75 => rng.gen_range(0.0..std::f32::consts::TAU),
        _ if draw < 0.87 => return rolling(tool, aim, spin, rng),
        _ => return flying(tool, spin, rng),
    };
    let velocity = [angle.cos() * speed, angle.sin() * speed];
    let lead = rng.gen_range(0.0..MAX_LEAD);
    // Go back in time from the aim, under gravity.
    BallState {
        position: std::array::from_fn(|axis| aim[axis] - velocity[axis] * lead + GRAVITY[axis] * lead * lead / 2.0),
        velocity: std::array::from_fn(|axis| velocity[axis] - GRAVITY[axis] * lead),
        angle: 0.0,
        angular_velocity: spin,
    }
}

/// A ball beside the tool, so far away that it mostly flies freely, often straight down.
fn flying(tool: &Tool, spin: f32, rng: &mut impl Rng) -> BallState {
    let side = if rng.gen_bool(0.5) { -1.0 } else { 1.0 };
    let away = tool.half_extents()[0] + rng.gen_range(10.0..30.0);
    let fall = -rng.gen_range(0.0..MAX_SPEED);
    let velocity = match rng.r#gen::<f32>() {
        draw if draw < 0.4 => [0.0, fall],
        _ => [rng.gen_range(-MAX_SPEED..MAX_SPEED) / 2.0, fall + rng.gen_range(0.0..MAX_SPEED)],
    };
    BallState {
        position: [tool.centre()[0] + side * away, tool.centre()[1]],
        velocity,
        angle: 0.0,
        angular_velocity: spin,
    }
}

/// A slow ball at the surface nearest to `aim`.
fn rolling(tool: &Tool, aim: [f32; 2], spin: f32, rng: &mut impl Rng) -> BallState {
    let radius = Ball::default().radius;
    let (distance, normal) = tool.surface(aim);
    let gap = rng.gen_range(0.0..0.5);
    let (along, into) = (rng.gen_range(-8.0..8.0), rng.gen_range(-1.5..0.5));
    BallState {
        position: std::array::from_fn(|axis| aim[axis] + (radius + gap - distance) * normal[axis]),
        velocity: [normal[0] * into - normal[1] * along, normal[1] * into + normal[0] * along],
        angle: 0.0,
        angular_velocity: if rng.gen_bool(0.5) { -along / radius } else { spin },
    }
}

fn simulate(tool: Tool, start: BallState) -> Vec<BallState> {
    let mut world = World::new(GRAVITY);
    world.add_tool(tool);
    let ball = world.add_ball(Ball::default(), start);
    let mut states = vec![start];
    for _ in 0..STEPS_PER_ACTION {
        world.step();
        states.push(world.ball(ball));
    }
    states
}

/// Gap between the ball's surface and the tool's, in units.
pub(super) fn gap(tool: &Tool, ball: &BallState) -> f32 {
    tool.surface(ball.position).0 - Ball::default().radius
}

/// Whether anything but gravity acted on the ball between the first and the last state.
pub(super) fn is_deflected(states: &[BallState]) -> bool {
    states.windows(2).any(|pair| {
        (0..2).any(|axis| {
            let change = pair[1].velocity[axis] - pair[0].velocity[axis] - GRAVITY[axis] * PHYSICS_DT;
            change.abs() > 1e-3
        })
    })
}
