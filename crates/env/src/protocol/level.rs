//! Levels recorded in CREATE with all numbers resolved.

use serde::de::{Error, IgnoredAny};
use serde::{Deserialize, Deserializer};
use serde_json::Value;

use super::recorded::RecordedTool;
use mge_base::validation::ValidationError;
use mge_physics::{PHYSICS_DT, Tool, ToolKind, to_normalised};
use mge_task::{
    BallSpec, BoxSpec, Form, Goal, GoalShape, Marker, Part, Placeable, Region, Rewards, Rules, STANDARD_RADIUS, Task,
    ToolSpec, VERSION,
};

/// A recorded level: a task without the tool that the agent places.
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
    #[serde(default)]
    marker_subgoals: Vec<Object>,
    fixed: Vec<Fixed>,
    /// Names of all objects in the order in which they are added to the world.
    #[serde(default)]
    order: Vec<String>,
    #[serde(default, rename = "kind")]
    _kind: IgnoredAny,
    #[serde(default, rename = "random_shifts")]
    _random_shifts: IgnoredAny,
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
    #[serde(default)]
    marker_must_hit: bool,
    reward_step: f32,
    reward_blocked: f32,
    reward_goal: f32,
    reward_subgoal: f32,
    reward_target_moved: f32,
    cost_per_placed_tool: f32,
    #[serde(default, rename = "reward_no_op")]
    _reward_no_op: IgnoredAny,
    #[serde(default, rename = "reward_invalid")]
    _reward_invalid: IgnoredAny,
}

/// A ball, a box, a goal or a subgoal of a level. Its position is `pos_norm` if present, which is exact, while `pos`
/// is rounded. Corners are computed, not read.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Object {
    #[serde(rename = "type")]
    kind: String,
    name: Option<String>,
    pos: Option<[f32; 2]>,
    pos_norm: Option<[f32; 2]>,
    mass: Option<f32>,
    radius: Option<f32>,
    size: Option<f32>,
    elasticity: Option<f32>,
    friction: Option<f32>,
    #[serde(default, rename = "role")]
    _role: IgnoredAny,
    #[serde(default, rename = "dynamic")]
    _dynamic: IgnoredAny,
    #[serde(default, rename = "moment")]
    _moment: IgnoredAny,
    #[serde(default, rename = "shape")]
    _shape: IgnoredAny,
    #[serde(default, rename = "vertices")]
    _vertices: IgnoredAny,
    #[serde(default, rename = "sensor")]
    _sensor: IgnoredAny,
}

/// An object of a level that is neither target, marker, goal nor subgoal.
#[derive(Debug, Clone)]
enum Fixed {
    /// A moving ball or box.
    Moving(Object),
    /// A tool, with its name in the level.
    Tool(Box<RecordedTool>, Option<String>),
}

impl<'de> Deserialize<'de> for Fixed {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let value = Value::deserialize(deserializer)?;
        let is_ball = value["type"] == "ball";
        if is_ball || value["type"] == "box" && value["dynamic"] == true {
            return Object::deserialize(value).map(Self::Moving).map_err(D::Error::custom);
        }
        let name = value["name"].as_str().map(str::to_owned);
        let tool = RecordedTool::deserialize(value).map_err(D::Error::custom)?;
        Ok(Self::Tool(Box::new(tool), name))
    }
}

impl RecordedLevel {
    /// The task in which the agent places `tool`, or the tools of an action set if None.
    ///
    /// # Errors
    /// When the level has an object or a rule that this program does not support, or does not give a valid task.
    pub fn task(&self, tool: Option<&RecordedTool>) -> Result<Task, ValidationError> {
        let list = |objects: &[Object], path: &str| -> Result<Vec<Region>, ValidationError> {
            let region = |(i, object): (usize, &Object)| {
                object.region().map_err(|problem| problem.within(format_args!("{path}[{i}]")))
            };
            objects.iter().enumerate().map(region).collect()
        };
        let mut marker = self.marker.as_ref().map(|marker| self.marker(marker)).transpose()?;
        if self.rules.goal_must_wait_for_marker != marker.is_some() {
            let message = "must be true if the level has a marker ball, and false if not";
            return Err(ValidationError::new("rules.goal_must_wait_for_marker", message));
        }
        match &mut marker {
            Some(marker) => marker.subgoals = list(&self.marker_subgoals, "marker_subgoals")?,
            None if self.marker_subgoals.is_empty() => {}
            None => return Err(ValidationError::new("marker_subgoals", "needs a marker ball")),
        }
        let placeable = match tool {
            Some(tool) => tool.tool_at([0.0; 2]).map_err(|problem| problem.within("tool"))?,
            None => Tool::new(ToolKind::Box, [0.0; 2]),
        };
        let mut task = Task {
            version: VERSION,
            name: self.name.clone(),
            description: String::new(),
            ball: self.target.ball().map_err(|problem| problem.within("target"))?,
            marker,
            balls: Vec::new(),
            boxes: Vec::new(),
            tools: Vec::new(),
            placeable: Placeable { kind: placeable.kind, form: Form::of(&placeable) },
            subgoals: list(&self.subgoals, "subgoals")?,
            goal: self.goal.goal().map_err(|problem| problem.within("goal"))?,
            rules: self.rules.rules().map_err(|problem| problem.within("rules"))?,
            order: Vec::new(),
            shifts: Vec::new(),
        };
        self.add_objects(&mut task)?;
        task.validate()?;
        Ok(task)
    }

    /// Adds the other objects, and the order of all objects if the recording has it.
    fn add_objects(&self, task: &mut Task) -> Result<(), ValidationError> {
        let mut parts: Vec<(&str, Part)> = vec![("target", Part::Target), ("goal", Part::Goal)];
        let named = |object: &'_ Object| object.name.clone().unwrap_or_default();
        let subgoals: Vec<String> = self.subgoals.iter().map(named).collect();
        let marker_subgoals: Vec<String> = self.marker_subgoals.iter().map(named).collect();
        // In a marker level, CREATE uses the first object as the marker.
        let marker = self.marker.as_ref().map(|marker| marker.name.clone().unwrap_or_else(|| "env0".to_owned()));
        parts.extend(subgoals.iter().enumerate().map(|(i, name)| (name.as_str(), Part::Subgoal(i))));
        parts.extend(marker_subgoals.iter().enumerate().map(|(i, name)| (name.as_str(), Part::MarkerSubgoal(i))));
        parts.extend(marker.iter().map(|name| (name.as_str(), Part::Marker)));
        for (i, fixed) in self.fixed.iter().enumerate() {
            let place = |problem: ValidationError| problem.within(format_args!("fixed[{i}]"));
            let (name, part) = match fixed {
                Fixed::Moving(object) if object.kind == "ball" => {
                    task.balls.push(object.ball().map_err(place)?);
                    (object.name.as_deref(), Part::Ball(task.balls.len() - 1))
                }
                Fixed::Moving(object) => {
                    task.boxes.push(object.moving_box().map_err(place)?);
                    (object.name.as_deref(), Part::Box(task.boxes.len() - 1))
                }
                Fixed::Tool(tool, name) => {
                    let tool = tool.tool().map_err(place)?;
                    let position = to_normalised(tool.position).map(|p| p as f32);
                    task.tools.push(ToolSpec { kind: tool.kind, position, form: Form::of(&tool) });
                    (name.as_deref(), Part::Tool(task.tools.len() - 1))
                }
            };
            parts.extend(name.map(|name| (name, part)));
        }
        for (i, name) in self.order.iter().enumerate() {
            let part = parts.iter().find(|(other, _)| other == name);
            let unknown = || {
                ValidationError::new(format_args!("order[{i}]"), format_args!("`{name}` is not an object of the level"))
            };
            task.order.push(part.ok_or_else(unknown)?.1);
        }
        Ok(())
    }

    fn marker(&self, marker: &Object) -> Result<Marker, ValidationError> {
        let ball = marker.ball().map_err(|problem| problem.within("marker"))?;
        Ok(Marker {
            ball,
            move_threshold: self.rules.move_threshold,
            must_hit: self.rules.marker_must_hit,
            subgoals: Vec::new(),
        })
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

impl Object {
    fn position(&self) -> Result<[f32; 2], ValidationError> {
        let place = self.pos_norm.or(self.pos.map(to_normalised));
        place.ok_or_else(|| ValidationError::new("pos_norm", "is missing"))
    }

    /// Rejects a size that does not apply to the object; 0 counts as absent.
    fn without(&self, name: &str, measure: Option<f32>) -> Result<(), ValidationError> {
        match measure {
            None | Some(0.0) => Ok(()),
            Some(_) => Err(ValidationError::new(name, format_args!("does not belong to a {}: remove it", self.kind))),
        }
    }

    fn ball(&self) -> Result<BallSpec, ValidationError> {
        self.without("size", self.size)?;
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
        self.without("size", self.size)?;
        let radius = self.radius.ok_or_else(|| ValidationError::new("radius", "is missing"))?;
        Ok(Region { position: self.position()?, radius })
    }

    fn goal(&self) -> Result<Goal, ValidationError> {
        match self.kind.as_str() {
            "goal_ball" => self.without("size", self.size)?,
            "goal_star" => self.without("radius", self.radius).and(self.without("size", self.size))?,
            _ => self.without("radius", self.radius)?,
        }
        let (shape, radius) = match self.kind.as_str() {
            "goal_star" => (GoalShape::Star, STANDARD_RADIUS),
            "goal_ball" => (GoalShape::Ball, self.radius.unwrap_or(STANDARD_RADIUS)),
            "basket" => (GoalShape::Basket, self.size.unwrap_or(10.0) / 2.0),
            other => return Err(self.lacking(other)),
        };
        Ok(Goal { position: self.position()?, radius, shape })
    }

    fn moving_box(&self) -> Result<BoxSpec, ValidationError> {
        let missing = |name: &str| ValidationError::new(name, "is missing");
        self.without("radius", self.radius)?;
        Ok(BoxSpec {
            position: self.position()?,
            velocity: [0.0; 2],
            size: self.size.ok_or_else(|| missing("size"))?,
            mass: self.mass.ok_or_else(|| missing("mass"))?,
            elasticity: self.elasticity.unwrap_or(1.0),
            friction: self.friction.unwrap_or(1.0),
        })
    }

    fn lacking(&self, name: &str) -> ValidationError {
        ValidationError::new("type", format_args!("`{name}` is not an object that this program supports"))
    }
}
