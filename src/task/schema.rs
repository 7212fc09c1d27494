//! What a task file says.

use rand::Rng;
use rand::seq::SliceRandom;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::physics::{Ball, BallState, GRAVITY, Motion, MovingBox, STEPS_PER_ACTION, Tool, ToolKind, exact, to_units};

/// The version of the format this program writes.
pub const VERSION: u32 = 1;
/// Radius of CREATE's balls and stars, and of regions unless a task says otherwise, in units.
pub const STANDARD_RADIUS: f32 = 4.0;

/// A puzzle: scene, placeable tool, subgoals, goal and rules. What is read is checked: no file
/// makes a task that cannot be played.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
// Derives `Task::deserialize` without the check, on which the trait's is built.
#[serde(deny_unknown_fields, remote = "Self")]
pub struct Task {
    /// Format version, [`VERSION`].
    pub version: u32,
    /// Short name, as on the command line.
    pub name: String,
    /// One sentence for people.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub description: String,
    /// The target ball.
    pub ball: BallSpec,
    /// A second ball that must set the target ball in motion (CREATE's marker levels).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub marker: Option<Marker>,
    /// Other balls that move.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub balls: Vec<BallSpec>,
    /// Boxes that move.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub boxes: Vec<BoxSpec>,
    /// Tools that belong to the scene.
    #[serde(default)]
    pub tools: Vec<ToolSpec>,
    /// The tool the agent places.
    pub placeable: Placeable,
    /// Regions the ball must reach before the goal, in order.
    #[serde(default)]
    pub subgoals: Vec<Region>,
    /// The final goal.
    pub goal: Goal,
    /// Limits, rewards and termination.
    #[serde(default)]
    pub rules: Rules,
    /// The order in which the parts are put into the world, where it is not the usual one:
    /// target, marker, goal, balls, boxes, subgoals, those of the marker, tools. Contacts that
    /// act on one ball at the same time are solved in an order that depends on it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub order: Vec<Part>,
    /// Random shifts of parts, drawn anew for every episode.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub shifts: Vec<Shift>,
}

/// A part of a scene; tools, balls, boxes and subgoals by their place in the task's lists.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Part {
    /// The target ball.
    Target,
    /// The marker ball.
    Marker,
    /// The goal.
    Goal,
    /// One of the other balls.
    Ball(usize),
    /// One of the boxes.
    Box(usize),
    /// One of the tools.
    Tool(usize),
    /// One of the target's subgoals.
    Subgoal(usize),
    /// One of the marker's subgoals.
    MarkerSubgoal(usize),
}

/// A random shift that parts have in common, normalised.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shift {
    /// What is shifted.
    pub parts: Vec<Part>,
    /// By how much.
    pub by: Offset,
}

/// How a shift is drawn.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Offset {
    /// Uniformly between two numbers, for x and for y.
    Uniform { x: [f32; 2], y: [f32; 2] },
    /// One of these.
    OneOf(Vec<[f32; 2]>),
}

/// A box that moves, and its start.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoxSpec {
    /// Normalised start of the centre.
    pub position: [f32; 2],
    /// Start velocity in units/s.
    #[serde(default)]
    pub velocity: [f32; 2],
    /// Side in units.
    #[serde(default = "default_side")]
    pub size: f32,
    /// Mass.
    #[serde(default = "default_mass")]
    pub mass: f32,
    /// Elasticity.
    #[serde(default = "one")]
    pub elasticity: f32,
    /// Friction coefficient.
    #[serde(default = "one")]
    pub friction: f32,
}

impl BoxSpec {
    /// What the box is made of.
    pub fn material(&self) -> MovingBox {
        let Self { size, mass, elasticity, friction, .. } = *self;
        MovingBox { size, mass, elasticity, friction }
    }

    /// How it starts, in units, in the precision of the physics.
    pub fn motion(&self) -> Motion {
        Motion { velocity: self.velocity.map(exact), ..Motion::at_rest(to_units(self.position.map(exact))) }
    }
}

impl<'de> Deserialize<'de> for Task {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let task = Self::deserialize(deserializer)?;
        task.validate().map_err(D::Error::custom)?;
        Ok(task)
    }
}

impl Serialize for Task {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Self::serialize(self, serializer)
    }
}

/// A ball and its start.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BallSpec {
    /// Normalised start of the centre.
    pub position: [f32; 2],
    /// Start velocity in units/s.
    #[serde(default)]
    pub velocity: [f32; 2],
    /// Radius in units.
    #[serde(default = "default_radius")]
    pub radius: f32,
    /// Mass.
    #[serde(default = "default_mass")]
    pub mass: f32,
    /// Elasticity.
    #[serde(default = "one")]
    pub elasticity: f32,
    /// Friction coefficient.
    #[serde(default = "one")]
    pub friction: f32,
}

/// A marker ball and when it counts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Marker {
    /// The marker ball.
    pub ball: BallSpec,
    /// The target has moved once it is farther than this from its start, normalised
    /// and divided by the square root of 8.
    #[serde(default = "default_move_threshold")]
    pub move_threshold: f32,
    /// The move counts only once the marker has touched the target.
    #[serde(default)]
    pub must_hit: bool,
    /// Regions the marker ball is rewarded for touching at the end of an action, each
    /// once, in any order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub subgoals: Vec<Region>,
}

/// A static tool of the scene.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(from = "ToolFields")]
pub struct ToolSpec {
    /// Type.
    #[serde(rename = "type")]
    pub kind: ToolKind,
    /// Normalised centre.
    pub position: [f32; 2],
    /// Shape and material.
    #[serde(flatten)]
    pub form: Form,
}

/// The tool the agent places, without a place.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(from = "PlaceableFields")]
pub struct Placeable {
    /// Type.
    #[serde(rename = "type")]
    pub kind: ToolKind,
    /// Shape and material.
    #[serde(flatten)]
    pub form: Form,
}

/// The optional numbers of a tool; what is missing is CREATE's value for the type.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Form {
    /// Polygons: centre to corner; box: side; circle: radius; segments: length. Units.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size: Option<f64>,
    /// Rotation in radians, counter-clockwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub angle: Option<f64>,
    /// Half the thickness of a segment, in units.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius: Option<f64>,
    /// Elasticity.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub elasticity: Option<f64>,
    /// Friction coefficient.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction: Option<f64>,
    /// Cannon: momentum it gives. Fan: force it exerts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force: Option<f64>,
    /// Belt and ladder: speed in units/s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vel: Option<f64>,
    /// Constrained hinge and see-saw: how far the plank turns, in radians.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_angle: Option<f64>,
    /// See-saw: the weight is on the right, the left end up.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub on_left: Option<bool>,
    /// See-saw: mass of the weight.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ball_mass: Option<f64>,
    /// Planks: from 1 to 2, brakes balls by this less 1 in every step.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub roll_friction: Option<f64>,
}

/// [`ToolSpec`] as it is read. Reading a flattened [`Form`] would lose the path and the
/// line of a mistake.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ToolFields {
    #[serde(rename = "type")]
    kind: ToolKind,
    position: [f32; 2],
    size: Option<f64>,
    angle: Option<f64>,
    radius: Option<f64>,
    elasticity: Option<f64>,
    friction: Option<f64>,
    force: Option<f64>,
    vel: Option<f64>,
    max_angle: Option<f64>,
    on_left: Option<bool>,
    ball_mass: Option<f64>,
    roll_friction: Option<f64>,
}

impl From<ToolFields> for ToolSpec {
    fn from(fields: ToolFields) -> Self {
        let ToolFields { kind, position, size, angle, radius, elasticity, friction, .. } = fields;
        let ToolFields { force, vel, max_angle, on_left, ball_mass, roll_friction, .. } = fields;
        let form = Form {
            size,
            angle,
            radius,
            elasticity,
            friction,
            force,
            vel,
            max_angle,
            on_left,
            ball_mass,
            roll_friction,
        };
        Self { kind, position, form }
    }
}

/// [`Placeable`] as it is read.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PlaceableFields {
    #[serde(rename = "type")]
    kind: ToolKind,
    size: Option<f64>,
    angle: Option<f64>,
    radius: Option<f64>,
    elasticity: Option<f64>,
    friction: Option<f64>,
    force: Option<f64>,
    vel: Option<f64>,
    max_angle: Option<f64>,
    on_left: Option<bool>,
    ball_mass: Option<f64>,
    roll_friction: Option<f64>,
}

impl From<PlaceableFields> for Placeable {
    fn from(fields: PlaceableFields) -> Self {
        let PlaceableFields { kind, size, angle, radius, elasticity, friction, .. } = fields;
        let PlaceableFields { force, vel, max_angle, on_left, ball_mass, roll_friction, .. } = fields;
        let form = Form {
            size,
            angle,
            radius,
            elasticity,
            friction,
            force,
            vel,
            max_angle,
            on_left,
            ball_mass,
            roll_friction,
        };
        Self { kind, form }
    }
}

/// A circular region the ball must touch.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Region {
    /// Normalised centre.
    pub position: [f32; 2],
    /// Radius in units.
    #[serde(default = "default_radius")]
    pub radius: f32,
}

/// The final goal.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Goal {
    /// Normalised centre.
    pub position: [f32; 2],
    /// Centre to edge (circle, ball), to vertex (star) or to side (basket), in units.
    #[serde(default = "default_radius")]
    pub radius: f32,
    /// What it is made of.
    #[serde(default)]
    pub shape: GoalShape,
}

/// CREATE's kinds of goal, and the circle of our tasks.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum GoalShape {
    /// A disc that notices the ball.
    #[default]
    Circle,
    /// A five-pointed star; the engine keeps its convex hull, a pentagon.
    Star,
    /// A ball that moves.
    Ball,
    /// An axis-aligned square that notices the ball.
    Basket,
}

/// Limits, rewards and termination of an episode. The default is that of our tasks;
/// CREATE's own levels are loaded with CREATE's rules.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Rules {
    /// Actions after which the episode is truncated.
    pub max_actions: u32,
    /// Physics steps after each action.
    pub steps_per_action: u32,
    /// Gravity in units per second squared.
    pub gravity: [f32; 2],
    /// Reward terms.
    pub rewards: Rewards,
    /// A placement at most this far (normalised) from a tool placed earlier is blocked.
    pub overlap_threshold: f32,
    /// When a subgoal counts as reached.
    pub subgoal_check: SubgoalCheck,
    /// Subgoals count in their order only, and the goal after all of them.
    pub in_order: bool,
    /// Reaching the goal terminates the episode.
    pub goal_ends_episode: bool,
    /// A captured target ball terminates the episode like one that stands still.
    pub capture_is_standstill: bool,
    /// A ball slower than this (units/s) stands still.
    pub min_speed: f32,
    /// Actions that end in standstill after which the episode terminates.
    pub still_actions: u32,
    /// Half width of the uniform noise on the ball's start, normalised.
    pub start_noise: f32,
}

/// Reward terms of one action; those that apply are added up.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Rewards {
    /// The goal is reached.
    pub goal: f32,
    /// Each subgoal reached.
    pub subgoal: f32,
    /// Every action.
    pub step: f32,
    /// The placement was blocked or invalid.
    pub blocked: f32,
    /// The target ball was set in motion (marker levels).
    pub target_moved: f32,
    /// Taken off the goal's and a subgoal's reward for every tool placed so far.
    pub cost_per_tool: f32,
}

/// When a subgoal counts as reached.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SubgoalCheck {
    /// The ball touches it in any physics step.
    AnyStep,
    /// The ball touches it at the end of an action, as in CREATE.
    ActionEnd,
}

impl Default for Rules {
    fn default() -> Self {
        Self {
            max_actions: 20,
            steps_per_action: STEPS_PER_ACTION,
            gravity: GRAVITY,
            rewards: Rewards::default(),
            overlap_threshold: 0.3,
            subgoal_check: SubgoalCheck::AnyStep,
            in_order: true,
            goal_ends_episode: true,
            capture_is_standstill: true,
            min_speed: 0.05,
            still_actions: 2,
            start_noise: 0.0,
        }
    }
}

impl Default for Rewards {
    fn default() -> Self {
        Self { goal: 10.0, subgoal: 2.0, step: 0.01, blocked: -0.01, target_moved: 0.0, cost_per_tool: 0.0 }
    }
}

impl Rules {
    /// The rules of CREATE's own levels. The action after the last allowed one ends the
    /// episode there, hence 31 actions.
    pub fn of_create() -> Self {
        Self {
            max_actions: 31,
            rewards: Rewards { target_moved: 1.0, cost_per_tool: 0.1, ..Rewards::default() },
            subgoal_check: SubgoalCheck::ActionEnd,
            in_order: false,
            goal_ends_episode: false,
            capture_is_standstill: false,
            ..Self::default()
        }
    }
}

impl BallSpec {
    /// A ball of CREATE's standard size and material, at rest.
    pub fn at(position: [f32; 2]) -> Self {
        Self { position, velocity: [0.0; 2], radius: STANDARD_RADIUS, mass: 10.0, elasticity: 1.0, friction: 1.0 }
    }

    /// What the ball is made of.
    pub fn material(&self) -> Ball {
        Ball { radius: self.radius, mass: self.mass, elasticity: self.elasticity, friction: self.friction }
    }

    /// How it starts, in units, in the precision of the physics.
    pub fn motion(&self) -> Motion {
        Motion { velocity: self.velocity.map(exact), ..Motion::at_rest(to_units(self.position.map(exact))) }
    }

    /// How it starts, in units.
    pub fn start(&self) -> BallState {
        BallState { velocity: self.velocity, ..BallState::at_rest(to_units(self.position)) }
    }
}

impl Form {
    /// The tool with these numbers in place of its own.
    pub fn apply(&self, mut tool: Tool) -> Tool {
        for (given, field) in [
            (self.size, &mut tool.size),
            (self.angle, &mut tool.angle),
            (self.radius, &mut tool.radius),
            (self.elasticity, &mut tool.elasticity),
            (self.friction, &mut tool.friction),
            (self.force, &mut tool.force),
            (self.vel, &mut tool.velocity),
            (self.max_angle, &mut tool.max_angle),
            (self.ball_mass, &mut tool.weight),
            (self.roll_friction, &mut tool.roll_friction),
        ] {
            *field = given.unwrap_or(*field);
        }
        tool.on_left = self.on_left.unwrap_or(tool.on_left);
        tool
    }
}

impl Form {
    /// The numbers of a tool.
    pub fn of(tool: &Tool) -> Self {
        let usual = Tool::new(tool.kind, tool.position);
        let given = |value: f64, usual: f64| (value != usual).then_some(value);
        Self {
            size: Some(tool.size),
            angle: given(tool.angle, usual.angle),
            radius: given(tool.radius, usual.radius),
            elasticity: given(tool.elasticity, usual.elasticity),
            friction: given(tool.friction, usual.friction),
            force: given(tool.force, usual.force),
            vel: given(tool.velocity, usual.velocity),
            max_angle: given(tool.max_angle, usual.max_angle),
            on_left: (tool.on_left != usual.on_left).then_some(tool.on_left),
            ball_mass: given(tool.weight, usual.weight),
            roll_friction: given(tool.roll_friction, usual.roll_friction),
        }
    }
}

impl ToolSpec {
    /// The tool in units.
    pub fn tool(&self) -> Tool {
        self.form.apply(Tool::new(self.kind, to_units(self.position.map(exact))))
    }
}

impl Placeable {
    /// The tool, placed at a normalised position.
    pub fn tool(&self, position: [f32; 2]) -> Tool {
        self.form.apply(Tool::new(self.kind, to_units(position.map(f64::from))))
    }
}

impl Goal {
    /// The goal as the region a rollout must reach.
    pub fn region(&self) -> Region {
        Region { position: self.position, radius: self.radius }
    }
}

impl Task {
    /// Subgoals in order, then the goal: the stages of guidance.
    pub fn stages(&self) -> Vec<Region> {
        self.subgoals.iter().copied().chain([self.goal.region()]).collect()
    }

    /// Number of [stages](Self::stages): the subgoals and the goal.
    pub fn stage_count(&self) -> usize {
        self.subgoals.len() + 1
    }

    /// The scene's parts in the order in which they are put into the world.
    pub fn parts(&self) -> Vec<Part> {
        let marker_subgoals = self.marker.as_ref().map_or(0, |marker| marker.subgoals.len());
        let usual = [Part::Target]
            .into_iter()
            .chain(self.marker.is_some().then_some(Part::Marker))
            .chain([Part::Goal])
            .chain((0..self.balls.len()).map(Part::Ball))
            .chain((0..self.boxes.len()).map(Part::Box))
            .chain((0..self.subgoals.len()).map(Part::Subgoal))
            .chain((0..marker_subgoals).map(Part::MarkerSubgoal))
            .chain((0..self.tools.len()).map(Part::Tool));
        let mut parts = self.order.clone();
        let missing: Vec<Part> = usual.filter(|part| !parts.contains(part)).collect();
        parts.extend(missing);
        parts
    }

    /// Takes a tool or subgoal that is gone out of the random shifts; those after it move up.
    pub(super) fn forget(&mut self, gone: Part) {
        for shift in &mut self.shifts {
            shift.parts.retain(|part| *part != gone);
            for part in &mut shift.parts {
                match (part, gone) {
                    (Part::Tool(index), Part::Tool(gone)) | (Part::Subgoal(index), Part::Subgoal(gone))
                        if *index > gone =>
                    {
                        *index -= 1;
                    }
                    _ => {}
                }
            }
        }
    }

    /// Draws its random shifts, in their order, normalised.
    pub fn draw_shifts(&self, rng: &mut impl Rng) -> Vec<[f32; 2]> {
        let draw = |shift: &Shift| match &shift.by {
            Offset::Uniform { x, y } => [x, y].map(|[low, high]| rng.gen_range(*low..=*high)),
            Offset::OneOf(choices) => choices.choose(rng).copied().unwrap_or_default(),
        };
        self.shifts.iter().map(draw).collect()
    }

    /// The task with its random shifts carried out; those without an offset go nowhere.
    pub fn shifted(&self, offsets: &[[f32; 2]]) -> Self {
        let mut task = self.clone();
        for (shift, [x, y]) in std::mem::take(&mut task.shifts).into_iter().zip(offsets) {
            for part in shift.parts {
                if let Some(position) = task.position_mut(part) {
                    *position = [position[0] + x, position[1] + y];
                }
            }
        }
        task
    }

    fn position_mut(&mut self, part: Part) -> Option<&mut [f32; 2]> {
        match part {
            Part::Target => Some(&mut self.ball.position),
            Part::Marker => self.marker.as_mut().map(|marker| &mut marker.ball.position),
            Part::Goal => Some(&mut self.goal.position),
            Part::Ball(index) => self.balls.get_mut(index).map(|ball| &mut ball.position),
            Part::Box(index) => self.boxes.get_mut(index).map(|moving| &mut moving.position),
            Part::Tool(index) => self.tools.get_mut(index).map(|tool| &mut tool.position),
            Part::Subgoal(index) => self.subgoals.get_mut(index).map(|region| &mut region.position),
            Part::MarkerSubgoal(index) => self
                .marker
                .as_mut()
                .and_then(|marker| marker.subgoals.get_mut(index))
                .map(|region| &mut region.position),
        }
    }

    /// The tool types of the scene and of the agent, each once, in canonical order:
    /// the tool set a dynamics model of this task must know.
    pub fn tool_set(&self) -> Vec<ToolKind> {
        let used = |kind: &ToolKind| self.placeable.kind == *kind || self.tools.iter().any(|tool| tool.kind == *kind);
        ToolKind::ALL.into_iter().filter(used).collect()
    }
}

fn default_radius() -> f32 {
    STANDARD_RADIUS
}

fn default_mass() -> f32 {
    10.0
}

fn default_side() -> f32 {
    5.0
}

fn one() -> f32 {
    1.0
}

fn default_move_threshold() -> f32 {
    0.03
}
