//! Levels recorded in CREATE with all numbers resolved.

use serde::Deserialize;

use super::recorded::Recorded;
use mge_base::validation::{ValidationError, Within};
use mge_physics::{ToolKind, to_normalised};
use mge_task::{BallSpec, Form, Marker, Part, Placeable, Region, Rewards, Rules, Task, ToolSpec};

/// A recorded level: a task without the tool that the agent places.
#[derive(Debug, Clone, Deserialize)]
pub(super) struct RecordedLevel {
    /// Name of the level.
    #[serde(rename = "level")]
    pub name: String,
    rules: RecordedRules,
    target: Recorded,
    marker: Option<Recorded>,
    goal: Recorded,
    subgoals: Vec<Recorded>,
    #[serde(default)]
    marker_subgoals: Vec<Recorded>,
    fixed: Vec<Recorded>,
    /// Names of all objects in the order in which they are added to the world.
    #[serde(default)]
    order: Vec<String>,
}

#[derive(Debug, Clone, Deserialize)]
struct RecordedRules {
    max_steps: u32,
    physics_steps_per_action: u32,
    gravity: [f32; 2],
    min_velocity: f32,
    overlap_threshold: f32,
    move_threshold: f32,
    #[serde(default)]
    marker_must_hit: bool,
    reward_step: f32,
    reward_blocked: f32,
    reward_goal: f32,
    reward_subgoal: f32,
    reward_target_moved: f32,
    cost_per_placed_tool: f32,
}

impl RecordedLevel {
    /// The task in which the agent places `tool`, or the tools of an action set if None.
    ///
    /// # Errors
    /// When the level has an object that this program does not support, or does not give a valid task.
    pub fn task(&self, tool: Option<&Recorded>) -> Result<Task, ValidationError> {
        let usual = Ok((ToolKind::Box, Form::default()));
        let (kind, form) = tool.map_or(usual, Recorded::form).within("tool")?;
        let mut task = Task {
            name: self.name.clone(),
            ball: ball(&self.target).within("target")?,
            marker: self.marker.as_ref().map(|marker| self.marker(marker)).transpose()?,
            placeable: Placeable { kind, form },
            subgoals: regions(&self.subgoals, "subgoals")?,
            goal: self.goal.goal().within("goal")?,
            rules: self.rules.rules(),
            ..Task::default()
        };
        let mut parts = Vec::new();
        for (i, fixed) in self.fixed.iter().enumerate() {
            let part = add_fixed(&mut task, fixed).within(format_args!("fixed[{i}]"))?;
            parts.push((fixed.name.as_deref(), part));
        }
        task.order = self.ordered(parts)?;
        task.validate()?;
        Ok(task)
    }

    fn marker(&self, marker: &Recorded) -> Result<Marker, ValidationError> {
        Ok(Marker {
            ball: ball(marker).within("marker")?,
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

/// Adds an object that is neither target, marker, goal nor subgoal.
fn add_fixed(task: &mut Task, object: &Recorded) -> Result<Part, ValidationError> {
    Ok(match object.r#type.as_str() {
        "ball" => {
            task.balls.push(ball(object)?);
            Part::Ball(task.balls.len() - 1)
        }
        "box" if object.dynamic == Some(true) => {
            task.boxes.push(object.moving_box(object.position()?)?);
            Part::Box(task.boxes.len() - 1)
        }
        _ => {
            let (kind, form) = object.form()?;
            let position = to_normalised(object.tool()?.position).map(|p| p as f32);
            task.tools.push(ToolSpec { kind, position, form });
            Part::Tool(task.tools.len() - 1)
        }
    })
}

fn ball(object: &Recorded) -> Result<BallSpec, ValidationError> {
    Ok(object.ball(object.position()?))
}

/// The names of the objects of a list, and their parts.
fn named(objects: &[Recorded], part: fn(usize) -> Part) -> impl Iterator<Item = (Option<&str>, Part)> {
    objects.iter().enumerate().map(move |(i, object)| (object.name.as_deref(), part(i)))
}

fn regions(objects: &[Recorded], path: &str) -> Result<Vec<Region>, ValidationError> {
    let region = |(i, object): (usize, &Recorded)| object.region().within(format_args!("{path}[{i}]"));
    objects.iter().enumerate().map(region).collect()
}

impl RecordedRules {
    fn rules(&self) -> Rules {
        Rules {
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
        }
    }
}
