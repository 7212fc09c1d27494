//! Levels recorded in CREATE with all numbers resolved.

use serde::de::Error;
use serde::{Deserialize, Deserializer};
use serde_json::Value;

use super::lines::Ignored;
use super::recorded::RecordedTool;
use mge_base::validation::ValidationError;
use mge_physics::{PHYSICS_DT, Tool, ToolKind, to_normalised};
use mge_task::{
    BallSpec, BoxSpec, Form, Goal, GoalShape, Marker, Part, Placeable, Region, Rewards, Rules, STANDARD_RADIUS, Task,
    ToolSpec, VERSION,
};

/// A recorded level: a task without the tool that the agent places.
#[expect(dead_code, reason = "the ignored fields are never read")]
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
    kind: Ignored,
    random_shifts: Ignored,
}

#[expect(dead_code, reason = "the ignored fields are never read")]
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
    reward_no_op: Ignored,
    reward_invalid: Ignored,
}

/// A ball, a box, a goal or a subgoal of a level. Its position is `pos_norm` if present, which is exact, while `pos`
/// is rounded. Corners are computed, not read.
#[expect(dead_code, reason = "the ignored fields are never read")]
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
    role: Ignored,
    dynamic: Ignored,
    moment: Ignored,
    shape: Ignored,
    vertices: Ignored,
    sensor: Ignored,
}

/// An object of a level that is neither target, marker, goal nor subgoal.
#[derive(Debug, Clone)]
enum Fixed {
    /// A moving ball.
    Ball(Object),
    /// A moving box.
    Box(Object),
    /// A tool.
    Tool(Box<RecordedTool>),
}

impl<'de> Deserialize<'de> for Fixed {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let value = Value::deserialize(deserializer)?;
        let object = match value["type"].as_str() {
            Some("ball") => Object::deserialize(value).map(Self::Ball),
            Some("box") if value["dynamic"] == true => Object::deserialize(value).map(Self::Box),
            _ => RecordedTool::deserialize(value).map(|tool| Self::Tool(Box::new(tool))),
        };
        object.map_err(D::Error::custom)
    }
}

impl RecordedLevel {
    /// The task in which the agent places `tool`, or the tools of an action set if None.
    ///
    /// # Errors
    /// When the level has an object or a rule that this program does not support, or does not give a valid task.
    pub fn task(&self, tool: Option<&RecordedTool>) -> Result<Task, ValidationError> {
        if self.rules.goal_must_wait_for_marker != self.marker.is_some() {
            let message = "must be true if the level has a marker ball, and false if not";
            return Err(ValidationError::new("rules.goal_must_wait_for_marker", message));
        }
        if self.marker.is_none() && !self.marker_subgoals.is_empty() {
            return Err(ValidationError::new("marker_subgoals", "needs a marker ball"));
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
            marker: self.marker.as_ref().map(|marker| self.marker(marker)).transpose()?,
            balls: Vec::new(),
            boxes: Vec::new(),
            tools: Vec::new(),
            placeable: Placeable { kind: placeable.kind, form: Form::of(&placeable) },
            subgoals: regions(&self.subgoals, "subgoals")?,
            goal: self.goal.goal().map_err(|problem| problem.within("goal"))?,
            rules: self.rules.rules().map_err(|problem| problem.within("rules"))?,
            order: Vec::new(),
            shifts: Vec::new(),
        };
        let mut parts = Vec::new();
        for (i, fixed) in self.fixed.iter().enumerate() {
            let part = fixed.add_to(&mut task).map_err(|problem| problem.within(format_args!("fixed[{i}]")))?;
            parts.push((fixed.name(), part));
        }
        task.order = self.ordered(parts)?;
        task.validate()?;
        Ok(task)
    }

    fn marker(&self, marker: &Object) -> Result<Marker, ValidationError> {
        Ok(Marker {
            ball: marker.ball().map_err(|problem| problem.within("marker"))?,
            move_threshold: self.rules.move_threshold,
            must_hit: self.rules.marker_must_hit,
            subgoals: regions(&self.marker_subgoals, "marker_subgoals")?,
        })
    }

    /// The parts in the recorded order, if there is one.
    fn ordered(&self, fixed: Vec<(Option<&str>, Part)>) -> Result<Vec<Part>, ValidationError> {
        // In a marker level, CREATE uses the first object as the marker.
        let marker = self.marker.iter().map(|marker| (marker.name.as_deref().or(Some("env0")), Part::Marker));
        let parts: Vec<_> = [(Some("target"), Part::Target), (Some("goal"), Part::Goal)]
            .into_iter()
            .chain(named(&self.subgoals, Part::Subgoal))
            .chain(named(&self.marker_subgoals, Part::MarkerSubgoal))
            .chain(marker)
            .chain(fixed)
            .collect();
        let part = |(i, name): (usize, &String)| {
            let found = parts.iter().find(|(other, _)| *other == Some(name));
            let message = || format!("`{name}` is not an object of the level");
            found.map(|(_, part)| *part).ok_or_else(|| ValidationError::new(format_args!("order[{i}]"), message()))
        };
        self.order.iter().enumerate().map(part).collect()
    }
}

impl Fixed {
    fn add_to(&self, task: &mut Task) -> Result<Part, ValidationError> {
        Ok(match self {
            Self::Ball(object) => {
                task.balls.push(object.ball()?);
                Part::Ball(task.balls.len() - 1)
            }
            Self::Box(object) => {
                task.boxes.push(object.moving_box()?);
                Part::Box(task.boxes.len() - 1)
            }
            Self::Tool(tool) => {
                let tool = tool.tool()?;
                let position = to_normalised(tool.position).map(|p| p as f32);
                task.tools.push(ToolSpec { kind: tool.kind, position, form: Form::of(&tool) });
                Part::Tool(task.tools.len() - 1)
            }
        })
    }

    fn name(&self) -> Option<&str> {
        match self {
            Self::Ball(object) | Self::Box(object) => object.name.as_deref(),
            Self::Tool(tool) => tool.name.as_deref(),
        }
    }
}

/// The names of the objects of a list, and their parts.
fn named(objects: &[Object], part: fn(usize) -> Part) -> impl Iterator<Item = (Option<&str>, Part)> {
    objects.iter().enumerate().map(move |(i, object)| (object.name.as_deref(), part(i)))
}

fn regions(objects: &[Object], path: &str) -> Result<Vec<Region>, ValidationError> {
    let region =
        |(i, object): (usize, &Object)| object.region().map_err(|problem| problem.within(format_args!("{path}[{i}]")));
    objects.iter().enumerate().map(region).collect()
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

    /// The radius or the size, whichever such an object has. Neither may be given for another object, except as 0.
    fn measure(&self, own: &str) -> Result<Option<f32>, ValidationError> {
        let measures = [("radius", self.radius), ("size", self.size)];
        if let Some((name, _)) = measures.iter().find(|(name, value)| *name != own && value.unwrap_or(0.0) != 0.0) {
            return Err(ValidationError::new(name, format_args!("does not belong to a {}: remove it", self.kind)));
        }
        Ok(measures.into_iter().find(|(name, _)| *name == own).and_then(|(_, value)| value))
    }

    fn ball(&self) -> Result<BallSpec, ValidationError> {
        let usual = BallSpec::at(self.position()?);
        Ok(BallSpec {
            radius: self.measure("radius")?.unwrap_or(usual.radius),
            mass: self.mass.unwrap_or(usual.mass),
            elasticity: self.elasticity.unwrap_or(usual.elasticity),
            friction: self.friction.unwrap_or(usual.friction),
            ..usual
        })
    }

    fn region(&self) -> Result<Region, ValidationError> {
        let radius = self.measure("radius")?.ok_or_else(|| ValidationError::new("radius", "is missing"))?;
        Ok(Region { position: self.position()?, radius })
    }

    fn goal(&self) -> Result<Goal, ValidationError> {
        let (shape, measure) = match self.kind.as_str() {
            "goal_star" => (GoalShape::Star, self.measure("none")?),
            "goal_ball" => (GoalShape::Ball, self.measure("radius")?),
            "basket" => (GoalShape::Basket, Some(self.measure("size")?.unwrap_or(10.0) / 2.0)),
            other => {
                let message = format_args!("`{other}` is not an object that this program supports");
                return Err(ValidationError::new("type", message));
            }
        };
        Ok(Goal { position: self.position()?, radius: measure.unwrap_or(STANDARD_RADIUS), shape })
    }

    fn moving_box(&self) -> Result<BoxSpec, ValidationError> {
        let missing = |name: &str| ValidationError::new(name, "is missing");
        Ok(BoxSpec {
            position: self.position()?,
            velocity: [0.0; 2],
            size: self.measure("size")?.ok_or_else(|| missing("size"))?,
            mass: self.mass.ok_or_else(|| missing("mass"))?,
            elasticity: self.elasticity.unwrap_or(1.0),
            friction: self.friction.unwrap_or(1.0),
        })
    }
}
