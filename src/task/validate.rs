//! What a task must satisfy beyond its schema.

use super::schema::{BallSpec, Form, GoalShape, Task, VERSION};
use crate::physics::{Tool, to_units};

/// More objects than this in a scene are refused.
const MAX_OBJECTS: usize = 64;

/// Something a task says that cannot be played, with the place in the file.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{path}: {message}")]
pub struct Problem {
    /// JSON path, such as `tools[1].size`.
    pub path: String,
    /// What is wrong and what to do.
    pub message: String,
}

/// The first reason why the task cannot be played.
pub(super) fn validate(task: &Task) -> Result<(), Problem> {
    if task.version != VERSION {
        let message = format!("is {}, but this program reads version {VERSION}", task.version);
        return problem("version", message);
    }
    if task.name.is_empty() || !task.name.chars().all(|c| c.is_ascii_alphanumeric() || "-_.".contains(c)) {
        return problem("name", "must be letters, digits, `-`, `_` or `.`");
    }
    for (list, count) in [("tools", task.tools.len()), ("subgoals", task.subgoals.len())] {
        if count > MAX_OBJECTS {
            return problem(list, format!("has {count} entries; at most {MAX_OBJECTS} are allowed"));
        }
    }
    ball(&task.ball, "ball")?;
    if let Some(marker) = &task.marker {
        ball(&marker.ball, "marker.ball")?;
        number(marker.move_threshold, "marker.move_threshold", 0.0, 1.0)?;
    }
    for (i, tool) in task.tools.iter().enumerate() {
        position(tool.position, &format!("tools[{i}].position"))?;
        form(&tool.form, tool.kind.is_segment(), &format!("tools[{i}]"))?;
    }
    form(&task.placeable.form, task.placeable.kind.is_segment(), "placeable")?;
    for (i, region) in task.subgoals.iter().enumerate() {
        position(region.position, &format!("subgoals[{i}].position"))?;
        number(region.radius, &format!("subgoals[{i}].radius"), 0.1, 42.0)?;
    }
    position(task.goal.position, "goal.position")?;
    number(task.goal.radius, "goal.radius", 0.1, 42.0)?;
    rules(task)?;
    clear_start(task)
}

fn rules(task: &Task) -> Result<(), Problem> {
    let rules = &task.rules;
    if !(1..=1000).contains(&rules.max_actions) {
        return problem("rules.max_actions", "must be 1 to 1000");
    }
    if !(1..=10_000).contains(&rules.steps_per_action) {
        return problem("rules.steps_per_action", "must be 1 to 10000");
    }
    for (axis, gravity) in rules.gravity.iter().enumerate() {
        number(*gravity, &format!("rules.gravity[{axis}]"), -1000.0, 1000.0)?;
    }
    let rewards = &rules.rewards;
    for (name, value) in [
        ("goal", rewards.goal),
        ("subgoal", rewards.subgoal),
        ("step", rewards.step),
        ("blocked", rewards.blocked),
        ("target_moved", rewards.target_moved),
        ("cost_per_tool", rewards.cost_per_tool),
    ] {
        number(value, &format!("rules.rewards.{name}"), -1e6, 1e6)?;
    }
    number(rules.overlap_threshold, "rules.overlap_threshold", 0.0, 4.0)?;
    number(rules.min_speed, "rules.min_speed", 0.0, 1000.0)?;
    number(rules.start_noise, "rules.start_noise", 0.0, 1.0)?;
    if rules.still_actions == 0 {
        return problem("rules.still_actions", "must be at least 1");
    }
    Ok(())
}

/// No ball may start inside a tool or another ball.
fn clear_start(task: &Task) -> Result<(), Problem> {
    let mut balls = vec![("ball", task.ball)];
    balls.extend(task.marker.map(|marker| ("marker.ball", marker.ball)));
    if task.goal.shape == GoalShape::Ball {
        balls.push(("goal", BallSpec { radius: task.goal.radius, ..BallSpec::at(task.goal.position) }));
    }
    for (n, (path, ball)) in balls.iter().enumerate() {
        let path = || format!("{path}.position");
        for (i, tool) in task.tools.iter().enumerate() {
            if penetration(&tool.tool(), ball) > START_OVERLAP {
                return problem(
                    &path(),
                    format!("the ball starts inside tools[{i}] ({}): move one of them", tool.kind),
                );
            }
        }
        for (other_path, other) in &balls[..n] {
            let (a, b) = (to_units(ball.position), to_units(other.position));
            if (a[0] - b[0]).hypot(a[1] - b[1]) < ball.radius + other.radius - START_OVERLAP {
                return problem(&path(), format!("overlaps {other_path}: move one of them"));
            }
        }
    }
    Ok(())
}

/// A resting ball may sink this far into what it lies on, in units.
const START_OVERLAP: f32 = 0.5;

fn penetration(tool: &Tool, ball: &BallSpec) -> f32 {
    ball.radius - tool.surface(to_units(ball.position)).0
}

fn ball(ball: &BallSpec, path: &str) -> Result<(), Problem> {
    position(ball.position, &format!("{path}.position"))?;
    for (axis, velocity) in ball.velocity.iter().enumerate() {
        number(*velocity, &format!("{path}.velocity[{axis}]"), -1000.0, 1000.0)?;
    }
    number(ball.radius, &format!("{path}.radius"), 0.1, 42.0)?;
    number(ball.mass, &format!("{path}.mass"), 1e-3, 1e6)?;
    number(ball.elasticity, &format!("{path}.elasticity"), 0.0, 1.0)?;
    number(ball.friction, &format!("{path}.friction"), 0.0, 100.0)
}

fn form(form: &Form, is_segment: bool, path: &str) -> Result<(), Problem> {
    for (name, value, low, high) in [
        ("size", form.size, 0.1, 200.0),
        ("angle", form.angle, -1000.0, 1000.0),
        ("radius", form.radius, 0.0, 20.0),
        ("elasticity", form.elasticity, 0.0, 1.0),
        ("friction", form.friction, 0.0, 100.0),
    ] {
        if let Some(value) = value {
            number(value, &format!("{path}.{name}"), low, high)?;
        }
    }
    if form.radius.is_some() && !is_segment {
        return problem(&format!("{path}.radius"), "only walls and floors have a radius: remove it");
    }
    Ok(())
}

/// Levels place walls just outside the screen, hence the margin.
fn position(position: [f32; 2], path: &str) -> Result<(), Problem> {
    position.iter().enumerate().try_for_each(|(axis, value)| number(*value, &format!("{path}[{axis}]"), -1.5, 1.5))
}

fn number(value: f32, path: &str, low: f32, high: f32) -> Result<(), Problem> {
    if value.is_finite() && (low..=high).contains(&value) {
        return Ok(());
    }
    problem(path, format!("is {value}, but must be a number from {low} to {high}"))
}

fn problem(path: &str, message: impl Into<String>) -> Result<(), Problem> {
    Err(Problem { path: path.to_owned(), message: message.into() })
}
