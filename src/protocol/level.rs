//! Levels that were recorded in CREATE with every number resolved.

use serde::Deserialize;
use serde::de::IgnoredAny;

use crate::physics::{PHYSICS_DT, ToolKind, to_normalised};
use crate::task::{
    BallSpec, Form, Goal, GoalShape, Marker, Placeable, Region, Rewards, Rules, STANDARD_RADIUS, Task, ToolSpec,
    VERSION,
};
use crate::validation::ValidationError;

/// A recorded level: all of a task but the tool that the agent places.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RecordedLevel {
    /// Name of the level.
    #[serde(rename = "level")]
    pub name: String,
    rules: RecordedRules,
    target: Object,
    marker: Option<Object>,
    goal: Object,
    subgoals: Vec<Object>,
    fixed: Vec<Object>,
    #[serde(default, rename = "kind")]
    _kind: IgnoredAny,
}

/// The tool of a recorded episode.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RecordedTool {
    #[serde(rename = "type")]
    kind: ToolKind,
    size: Option<f32>,
    length: Option<f32>,
    angle: Option<f32>,
    radius: Option<f32>,
    thickness: Option<f32>,
    elasticity: Option<f32>,
    friction: Option<f32>,
    #[serde(default, rename = "variant")]
    _variant: IgnoredAny,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct RecordedRules {
    max_steps: u32,
    physics_steps_per_action: u32,
    physics_steps_per_second: f32,
    gravity: [f32; 2],
    min_velocity: f32,
    overlap_threshold: f32,
    move_threshold: f32,
    goal_must_wait_for_marker: bool,
    reward_step: f32,
    reward_blocked: f32,
    reward_goal: f32,
    reward_subgoal: f32,
    reward_target_moved: f32,
    cost_per_placed_tool: f32,
    #[serde(default, rename = "reward_invalid")]
    _reward_invalid: IgnoredAny,
}

/// Any object of a level. Its place is `pos_norm` where there is one: that is the exact
/// value, `pos` is rounded. Corners and end points are computed, not read.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Object {
    #[serde(rename = "type")]
    kind: String,
    pos: Option<[f32; 2]>,
    pos_norm: Option<[f32; 2]>,
    mass: Option<f32>,
    radius: Option<f32>,
    size: Option<f32>,
    length: Option<f32>,
    angle: Option<f32>,
    elasticity: Option<f32>,
    friction: Option<f32>,
    #[serde(default, rename = "role")]
    _role: IgnoredAny,
    #[serde(default, rename = "dynamic")]
    _dynamic: IgnoredAny,
    #[serde(default, rename = "moment")]
    _moment: IgnoredAny,
    #[serde(default, rename = "thickness")]
    _thickness: IgnoredAny,
    #[serde(default, rename = "shape")]
    _shape: IgnoredAny,
    #[serde(default, rename = "variant")]
    _variant: IgnoredAny,
    #[serde(default, rename = "vertices")]
    _vertices: IgnoredAny,
    #[serde(default, rename = "a")]
    _a: IgnoredAny,
    #[serde(default, rename = "b")]
    _b: IgnoredAny,
    #[serde(default, rename = "sensor")]
    _sensor: IgnoredAny,
}

impl RecordedLevel {
    /// The task in which the agent places `tool`.
    ///
    /// # Errors
    /// When the level has an object or a rule this program lacks, or makes no valid task.
    pub fn task(&self, tool: &RecordedTool) -> Result<Task, ValidationError> {
        let list = |objects: &[Object], path: &str| -> Result<Vec<Region>, ValidationError> {
            let region = |(i, object): (usize, &Object)| {
                object.region().map_err(|problem| problem.within(format_args!("{path}[{i}]")))
            };
            objects.iter().enumerate().map(region).collect()
        };
        let marker = self.marker.as_ref().map(|marker| self.marker(marker)).transpose()?;
        if self.rules.goal_must_wait_for_marker != marker.is_some() {
            let message = "must be true if the level has a marker ball, and false if not";
            return Err(ValidationError::new("rules.goal_must_wait_for_marker", message));
        }
        let mut task = Task {
            version: VERSION,
            name: self.name.clone(),
            description: String::new(),
            ball: self.target.ball().map_err(|problem| problem.within("target"))?,
            marker,
            balls: Vec::new(),
            tools: Vec::new(),
            placeable: tool.placeable()?,
            subgoals: list(&self.subgoals, "subgoals")?,
            goal: self.goal.goal().map_err(|problem| problem.within("goal"))?,
            rules: self.rules.rules().map_err(|problem| problem.within("rules"))?,
        };
        for (i, object) in self.fixed.iter().enumerate() {
            let place = |problem: ValidationError| problem.within(format_args!("fixed[{i}]"));
            if object.kind == "ball" {
                task.balls.push(object.ball().map_err(place)?);
            } else {
                task.tools.push(object.tool().map_err(place)?);
            }
        }
        task.validate()?;
        Ok(task)
    }

    fn marker(&self, marker: &Object) -> Result<Marker, ValidationError> {
        let ball = marker.ball().map_err(|problem| problem.within("marker"))?;
        Ok(Marker { ball, move_threshold: self.rules.move_threshold, must_hit: false, subgoals: Vec::new() })
    }
}

impl RecordedRules {
    fn rules(&self) -> Result<Rules, ValidationError> {
        if (self.physics_steps_per_second * PHYSICS_DT - 1.0).abs() > 1e-6 {
            let message = format_args!("is {}, but the physics runs at 30", self.physics_steps_per_second);
            return Err(ValidationError::new("physics_steps_per_second", message));
        }
        Ok(Rules {
            max_actions: self.max_steps.saturating_add(1),
            steps_per_action: self.physics_steps_per_action,
            gravity: self.gravity,
            overlap_threshold: self.overlap_threshold,
            min_speed: self.min_velocity,
            rewards: Rewards {
                goal: self.reward_goal,
                subgoal: self.reward_subgoal,
                step: self.reward_step,
                blocked: self.reward_blocked,
                target_moved: self.reward_target_moved,
                cost_per_tool: self.cost_per_placed_tool,
            },
            ..Rules::of_create()
        })
    }
}

impl RecordedTool {
    fn placeable(&self) -> Result<Placeable, ValidationError> {
        let size = if self.kind.is_segment() { self.length.or(self.size) } else { self.size };
        let radius = self.radius.or(self.thickness.map(|thickness| (thickness / 2.0).floor()));
        let form = Form {
            size: Some(size.ok_or_else(|| ValidationError::new("tool.size", "is missing"))?),
            angle: self.angle,
            radius: radius.filter(|_| self.kind.is_segment()),
            elasticity: self.elasticity,
            friction: self.friction,
        };
        Ok(Placeable { kind: self.kind, form })
    }
}

impl Object {
    fn position(&self) -> Result<[f32; 2], ValidationError> {
        let place = self.pos_norm.or(self.pos.map(to_normalised));
        place.ok_or_else(|| ValidationError::new("pos_norm", "is missing"))
    }

    fn ball(&self) -> Result<BallSpec, ValidationError> {
        let usual = BallSpec::at(self.position()?);
        Ok(BallSpec {
            radius: self.radius.unwrap_or(usual.radius),
            mass: self.mass.unwrap_or(usual.mass),
            elasticity: self.elasticity.unwrap_or(usual.elasticity),
            friction: self.friction.unwrap_or(usual.friction),
            ..usual
        })
    }

    fn region(&self) -> Result<Region, ValidationError> {
        let radius = self.radius.ok_or_else(|| ValidationError::new("radius", "is missing"))?;
        Ok(Region { position: self.position()?, radius })
    }

    fn goal(&self) -> Result<Goal, ValidationError> {
        let (shape, radius) = match self.kind.as_str() {
            "goal_star" => (GoalShape::Star, STANDARD_RADIUS),
            "goal_ball" => (GoalShape::Ball, self.radius.unwrap_or(STANDARD_RADIUS)),
            "basket" => (GoalShape::Basket, self.size.unwrap_or(10.0) / 2.0),
            other => return Err(self.lacking(other)),
        };
        Ok(Goal { position: self.position()?, radius, shape })
    }

    fn tool(&self) -> Result<ToolSpec, ValidationError> {
        let kind: ToolKind = self.kind.parse().map_err(|_| self.lacking(&self.kind))?;
        let (name, size) = if kind.is_segment() { ("length", self.length) } else { ("size", self.size) };
        let form = Form {
            size: Some(size.ok_or_else(|| ValidationError::new(name, "is missing"))?),
            angle: self.angle,
            radius: self.radius.filter(|_| kind.is_segment()),
            elasticity: self.elasticity,
            friction: self.friction,
        };
        Ok(ToolSpec { kind, position: self.position()?, form })
    }

    fn lacking(&self, name: &str) -> ValidationError {
        ValidationError::new("type", format_args!("`{name}`, an object this program does not have"))
    }
}
