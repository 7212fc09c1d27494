//! Recorded scenes: static tools and one ball, and their simulation to trajectories.

use std::io::{BufRead, Write};

use serde::de::{IgnoredAny, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use super::lines::{LinesError, for_each_line, write_line};
use crate::physics::{Ball, BallState, GRAVITY, MAX_OBJECTS, ObjectId, START_OVERLAP, Tool, ToolKind, World, to_units};
use crate::validation::{ValidationError, in_range};

/// The longest trajectory of a scene, in physics steps.
const MAX_STEPS: u32 = 100_000;

/// One ball's motion as a row: x, y, vx, vy, angle, angular velocity.
pub(super) type Row = [f32; 6];

/// Static tools and one ball with its first state, to be simulated for some steps.
/// What the recording measured (contacts, the rest of the trajectory) is ignored.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Scene {
    id: String,
    tools: Vec<SceneTool>,
    ball: SceneBall,
    steps: u32,
    #[serde(rename = "traj", deserialize_with = "first_row")]
    start: Row,
    #[serde(default, rename = "kind")]
    _kind: IgnoredAny,
    #[serde(default, rename = "start")]
    _start: IgnoredAny,
    #[serde(default, rename = "first_contact")]
    _first_contact: IgnoredAny,
    #[serde(default, rename = "contacts")]
    _contacts: IgnoredAny,
    #[serde(default, rename = "captured_step")]
    _captured_step: IgnoredAny,
    #[serde(default, rename = "sleep_step")]
    _sleep_step: IgnoredAny,
}

/// A tool of a recording. Its place is `pos_norm` where there is one: that is the exact
/// value, `pos` is rounded. Corners and end points are computed, not read.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct SceneTool {
    #[serde(rename = "type")]
    kind: ToolKind,
    pos: Option<[f32; 2]>,
    pos_norm: Option<[f32; 2]>,
    size: Option<f32>,
    length: Option<f32>,
    angle: Option<f32>,
    radius: Option<f32>,
    elasticity: Option<f32>,
    friction: Option<f32>,
    #[serde(default)]
    sensor: bool,
    #[serde(default, rename = "variant")]
    _variant: IgnoredAny,
    #[serde(default, rename = "shape")]
    _shape: IgnoredAny,
    #[serde(default, rename = "vertices")]
    _vertices: IgnoredAny,
    #[serde(default, rename = "a")]
    _a: IgnoredAny,
    #[serde(default, rename = "b")]
    _b: IgnoredAny,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct SceneBall {
    radius: f32,
    mass: f32,
    elasticity: f32,
    friction: f32,
}

/// The motion of a scene's ball.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Trajectory {
    /// Name of the scene.
    id: String,
    /// The ball's start and its state after every step.
    traj: Vec<Row>,
    /// The first step that found the ball touching a tool, from 1.
    first_contact: Option<u32>,
    /// The first step after which a bucket had captured the ball, from 1.
    captured_step: Option<u32>,
}

impl Scene {
    /// The world at its start; the ball has index 0.
    ///
    /// # Errors
    /// When a number is out of range or the ball starts inside a tool.
    fn world(&self) -> Result<World, ValidationError> {
        if self.tools.len() > MAX_OBJECTS {
            let message = format_args!("has {} entries; at most {MAX_OBJECTS} are allowed", self.tools.len());
            return Err(ValidationError::new("tools", message));
        }
        let (ball, state) = self.ball()?;
        let mut world = World::new(GRAVITY);
        world.add_ball(ball, state);
        for (index, tool) in self.tools.iter().enumerate() {
            let tool = tool.tool().map_err(|problem| problem.within(format_args!("tools[{index}]")))?;
            if ball.radius - tool.surface(state.position).0 > START_OVERLAP {
                let message = format_args!("the ball starts inside tools[{index}] ({}): move one of them", tool.kind);
                return Err(ValidationError::new("traj[0]", message));
            }
            world.add_tool(tool);
        }
        Ok(world)
    }

    /// Runs the scene to its end.
    ///
    /// # Errors
    /// When the scene cannot be built or asks for no steps or too many.
    fn simulate(&self) -> Result<Trajectory, ValidationError> {
        if !(1..=MAX_STEPS).contains(&self.steps) {
            return Err(ValidationError::new("steps", format_args!("is {}, but must be 1 to {MAX_STEPS}", self.steps)));
        }
        let mut world = self.world()?;
        let mut trajectory = Trajectory {
            id: self.id.clone(),
            traj: vec![row(world.ball(0))],
            first_contact: None,
            captured_step: None,
        };
        for step in 1..=self.steps {
            world.step();
            trajectory.traj.push(row(world.ball(0)));
            if world.touches().iter().any(|touch| matches!(touch.object, ObjectId::Tool(_))) {
                trajectory.first_contact.get_or_insert(step);
            }
            if world.is_captured(0) {
                trajectory.captured_step.get_or_insert(step);
            }
        }
        Ok(trajectory)
    }

    fn ball(&self) -> Result<(Ball, BallState), ValidationError> {
        let SceneBall { radius, mass, elasticity, friction } = self.ball;
        let ball = Ball { radius, mass, elasticity, friction };
        ball.check().map_err(|problem| problem.within("ball"))?;
        let [x, y, vx, vy, angle, angular_velocity] = self.start;
        for (column, value) in self.start.iter().enumerate() {
            in_range(*value, format_args!("traj[0][{column}]"), -1000.0, 1000.0)?;
        }
        Ok((ball, BallState { position: [x, y], velocity: [vx, vy], angle, angular_velocity }))
    }
}

impl SceneTool {
    fn tool(&self) -> Result<Tool, ValidationError> {
        let place = self.pos_norm.map(to_units).or(self.pos);
        let mut tool = Tool::new(self.kind, place.ok_or_else(|| ValidationError::new("pos_norm", "is missing"))?);
        let (name, size) = if self.kind.is_segment() { ("length", self.length) } else { ("size", self.size) };
        tool.size =
            size.ok_or_else(|| ValidationError::new(name, format_args!("is missing: a {} needs it", self.kind)))?;
        tool.angle = self.angle.unwrap_or(tool.angle);
        tool.radius = self.radius.unwrap_or(tool.radius);
        tool.elasticity = self.elasticity.unwrap_or(tool.elasticity);
        tool.friction = self.friction.unwrap_or(tool.friction);
        if self.sensor {
            return Err(ValidationError::new("sensor", "is true, but the tools of a scene are solid: remove it"));
        }
        tool.check().map_err(|problem| match problem.path.as_str() {
            "size" => ValidationError { path: name.to_owned(), ..problem },
            _ => problem,
        })?;
        Ok(tool)
    }
}

/// A ball's motion as a row.
pub(super) fn row(state: BallState) -> Row {
    let BallState { position: [x, y], velocity: [vx, vy], angle, angular_velocity } = state;
    [x, y, vx, vy, angle, angular_velocity]
}

/// The first row of a trajectory; the others are skipped.
fn first_row<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Row, D::Error> {
    struct FirstRow;

    impl<'de> Visitor<'de> for FirstRow {
        type Value = Row;

        fn expecting(&self, formatter: &mut std::fmt::Formatter) -> std::fmt::Result {
            formatter.write_str("a list of rows [x, y, vx, vy, angle, angular velocity], at least the first")
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut rows: A) -> Result<Row, A::Error> {
            let first = rows.next_element()?.ok_or_else(|| serde::de::Error::invalid_length(0, &self))?;
            while rows.next_element::<IgnoredAny>()?.is_some() {}
            Ok(first)
        }
    }

    deserializer.deserialize_seq(FirstRow)
}

/// Reads scenes, one a line, and writes their trajectories, one a line.
///
/// # Errors
/// At the first line that is not a scene that can be simulated, with its number.
pub fn simulate(input: impl BufRead, mut output: impl Write) -> Result<(), LinesError> {
    for_each_line(input, "stdin", |scene: Scene| {
        write_line(&mut output, &scene.simulate()?)?;
        Ok(())
    })?;
    output.flush().map_err(LinesError::Write)
}
