//! Recorded scenes of tools and moving bodies, and their simulation.

use std::collections::BTreeMap;
use std::io::{BufRead, Write};

use serde::{Deserialize, Serialize};

use super::lines::{Lines, LinesError};
use super::recorded::Recorded;
use mge_base::validation::{ValidationError, Within, in_range};
use mge_physics::{Ball, BallState, GRAVITY, MAX_OBJECTS, Motion, ObjectId, Touch, World};

/// Largest number of physics steps of a scene.
const MAX_STEPS: u32 = 100_000;

/// One body's motion as a row: x, y, vx, vy, angle, angular velocity.
pub(super) type Row = [f64; 6];

/// Tools and bodies with their initial states, to be simulated for some steps. The recorded results (contacts, the
/// rest of the trajectories) are ignored.
#[derive(Debug, Clone, Deserialize)]
struct RecordedScene {
    id: String,
    tools: Vec<Recorded>,
    /// The first body: a `ball` in scenes with balls only, otherwise a `mover`.
    ball: Option<Recorded>,
    mover: Option<Recorded>,
    #[serde(default)]
    others: Vec<Recorded>,
    steps: u32,
    traj: Vec<Row>,
    /// Trajectories of the other bodies, by name, of which only the first rows are used.
    #[serde(default)]
    parts: BTreeMap<String, Vec<Row>>,
}

/// The motion of a scene's bodies.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Trajectory {
    /// Name of the scene.
    id: String,
    /// The first body's start and its state after every step.
    traj: Vec<Row>,
    /// The trajectory of every other body, by name.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    parts: BTreeMap<String, Vec<Row>>,
    /// The first step, from 1, in which the first body touched a tool.
    first_contact: Option<u32>,
    /// Tool type, body, tool, first and last step of every sequence of steps in which a cannon, funnel or bucket
    /// moved a body.
    events: Vec<(String, String, String, u32, u32)>,
    /// The first step, from 1, in which a bucket captured the first body.
    captured_step: Option<u32>,
    /// The first step, from 1, after which each body was asleep, by name.
    sleep_steps: BTreeMap<String, u32>,
}

impl RecordedScene {
    /// The world at its start; the first body has index 0.
    ///
    /// # Errors
    /// When a number is out of range or a ball starts inside a tool.
    fn world(&self) -> Result<World, ValidationError> {
        for (name, count) in [("tools", self.tools.len()), ("others", self.others.len())] {
            if count > MAX_OBJECTS {
                let message = format_args!("has {count} entries; at most {MAX_OBJECTS} are allowed");
                return Err(ValidationError::new(name, message));
            }
        }
        let mut world = World::new(GRAVITY);
        for (index, tool) in self.tools.iter().enumerate() {
            let tool = tool.tool().within(format_args!("tools[{index}]"))?;
            world.add_tool(tool);
        }
        let (name, first) = match (&self.ball, &self.mover) {
            (Some(ball), None) => ("ball", ball),
            (None, Some(mover)) => ("mover", mover),
            (None, None) => return Err(ValidationError::new("ball", "is missing: a scene has a `ball` or a `mover`")),
            (Some(_), Some(_)) => {
                return Err(ValidationError::new("mover", "cannot be given together with `ball`: remove one"));
            }
        };
        add_body(&mut world, first, name, "traj", &self.traj)?;
        for (index, other) in self.others.iter().enumerate() {
            let name = format!("mover{}", index + 1);
            let rows = self.parts.get(&name).map_or(&[][..], Vec::as_slice);
            add_body(&mut world, other, &format!("others[{index}]"), &format!("parts.{name}"), rows)?;
        }
        Ok(world)
    }

    /// Runs the scene to its end.
    ///
    /// # Errors
    /// When the scene is invalid, or the number of steps is 0 or too large.
    fn simulate(&self) -> Result<Trajectory, ValidationError> {
        if !(1..=MAX_STEPS).contains(&self.steps) {
            return Err(ValidationError::new("steps", format_args!("is {}, but must be 1 to {MAX_STEPS}", self.steps)));
        }
        let mut world = self.world()?;
        let mut trajectory = Trajectory {
            id: self.id.clone(),
            traj: vec![row(world.motion(0))],
            parts: parts(&world).map(|(name, motion, _)| (name, vec![row(motion)])).collect(),
            first_contact: None,
            events: Vec::new(),
            captured_step: None,
            sleep_steps: BTreeMap::new(),
        };
        for step in 1..=self.steps {
            world.step();
            trajectory.record(&world, step);
        }
        Ok(trajectory)
    }
}

/// Every body except the first: name, motion, whether it is asleep.
fn parts(world: &World) -> impl Iterator<Item = (String, Motion, bool)> {
    let movers =
        (1..world.ball_count()).map(|ball| (format!("mover{ball}"), world.motion(ball), world.is_asleep(ball)));
    let planks = (0..world.tools().len()).flat_map(|tool| {
        let (plank, weight) = world.plank(tool);
        let sleeps = world.is_plank_asleep(tool);
        let named = move |part: &str, motion: Motion| (format!("tool{tool}.{part}"), motion, sleeps);
        [plank.map(|motion| named("plank", motion)), weight.map(|motion| named("weight", motion))]
    });
    movers.chain(planks.flatten())
}

impl Trajectory {
    fn record(&mut self, world: &World, step: u32) {
        self.traj.push(row(world.motion(0)));
        if world.is_asleep(0) {
            self.sleep_steps.entry("mover0".to_owned()).or_insert(step);
        }
        for (name, motion, sleeps) in parts(world) {
            if sleeps {
                self.sleep_steps.entry(name.clone()).or_insert(step);
            }
            self.parts.entry(name).or_default().push(row(motion));
        }
        if world.touches.iter().any(|touch| touch.ball == 0 && matches!(touch.object, ObjectId::Tool(_))) {
            self.first_contact.get_or_insert(step);
        }
        if world.is_captured(0) {
            self.captured_step.get_or_insert(step);
        }
        for &Touch { ball, object } in &world.moved {
            if let ObjectId::Tool(tool) = object {
                self.record_move(world, ball, tool, step);
            }
        }
    }

    fn record_move(&mut self, world: &World, ball: usize, tool: usize, step: u32) {
        let kind = world.tools().nth(tool).map_or("", |tool| tool.kind.name());
        let (body, tool) = (format!("mover{ball}"), format!("tool{tool}"));
        let continues =
            |event: &&mut (String, String, String, u32, u32)| event.1 == body && event.2 == tool && event.4 + 1 == step;
        match self.events.iter_mut().find(continues) {
            Some(event) => event.4 = step,
            None => self.events.push((kind.to_owned(), body, tool, step, step)),
        }
    }
}

/// Adds a moving body, a ball with a radius or a box with a size, with its first row; `path` and `rows` are the JSON
/// paths of the two.
fn add_body(
    world: &mut World,
    body: &Recorded,
    path: &str,
    rows: &str,
    trajectory: &[Row],
) -> Result<(), ValidationError> {
    let start = trajectory.first().ok_or_else(|| ValidationError::new(rows, "has no rows"))?;
    for (column, value) in start.iter().enumerate() {
        in_range(*value, format_args!("{rows}[0][{column}]"), -1000.0, 1000.0)?;
    }
    let [x, y, vx, vy, angle, angular_velocity] = *start;
    let motion = Motion { position: [x, y], velocity: [vx, vy], angle, angular_velocity };
    // The position is that of the first row.
    let is_box = body.shape.as_deref() == Some("box");
    let ball = if is_box { body.moving_box([0.0; 2]).within(path)?.material() } else { body.ball([0.0; 2]).material() };
    ball.check().within(path)?;
    if is_box {
        world.add_box(ball, motion);
    } else {
        check_clear(world, ball, motion, rows)?;
        world.add_ball(ball, motion);
    }
    Ok(())
}

/// Checks that the ball does not start inside a solid, fixed tool.
fn check_clear(world: &World, ball: Ball, motion: Motion, rows: &str) -> Result<(), ValidationError> {
    let centre = BallState::from(motion).position;
    match world.tools().enumerate().find(|(_, tool)| tool.holds_start(centre, ball.radius)) {
        None => Ok(()),
        Some((index, tool)) => {
            let message = format_args!("the ball starts inside tools[{index}] ({}): move one of them", tool.kind);
            Err(ValidationError::new(format_args!("{rows}[0]"), message))
        }
    }
}

/// A body's motion as a row.
pub(super) fn row(motion: Motion) -> Row {
    let Motion { position: [x, y], velocity: [vx, vy], angle, angular_velocity } = motion;
    [x, y, vx, vy, angle, angular_velocity]
}

/// Reads scenes, one per line, and writes their trajectories, one per line.
///
/// # Errors
/// At the first line that is not a valid scene.
pub fn simulate(input: impl BufRead, output: impl Write) -> Result<(), LinesError> {
    Lines::new(input, "stdin").answer(output, |scene: RecordedScene| scene.simulate())
}
