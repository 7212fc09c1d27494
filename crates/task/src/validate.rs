//! Validation of tasks beyond their schema.

use super::{BallSpec, Form, GoalShape, Offset, Part, Region, Shift, Task, VERSION};
use mge_base::text::is_unsafe;
use mge_base::validation::{Range, Setting, ValidationError, Within, check_each, check_settings, in_range};
use mge_physics::{MAX_OBJECTS, START_OVERLAP, Tool, ToolKind, to_units};

/// Longest name of a task, in characters.
const MAX_NAME_LENGTH: usize = 100;

impl Task {
    /// Checks that the task is playable: every number in range, no overlaps at the start.
    ///
    /// # Errors
    /// The first reason why it is not.
    pub fn validate(&self) -> Result<(), ValidationError> {
        if self.version != VERSION {
            let message = format!("is {}, but this program reads version {VERSION}", self.version);
            return problem("version", message);
        }
        check_name(&self.name)?;
        let marker_subgoals = self.marker.as_ref().map_or(0, |marker| marker.subgoals.len());
        for (list, count) in [
            ("tools", self.tools.len()),
            ("balls", self.balls.len()),
            ("boxes", self.boxes.len()),
            ("shifts", self.shifts.len()),
            ("subgoals", self.subgoals.len()),
            ("marker.subgoals", marker_subgoals),
        ] {
            if count > MAX_OBJECTS {
                return problem(list, format!("has {count} entries; at most {MAX_OBJECTS} are allowed"));
            }
        }
        ball(&self.ball).within("ball")?;
        if let Some(marker) = &self.marker {
            ball(&marker.ball).within("marker.ball")?;
            in_range(marker.move_threshold, "marker.move_threshold", 0.0, 1.0)?;
            check_each(&marker.subgoals, "marker.subgoals", on_screen)?;
        }
        check_each(&self.balls, "balls", ball)?;
        check_each(&self.boxes, "boxes", |moving| {
            position(moving.position)?;
            velocity(moving.velocity)?;
            in_range(moving.size, "size", 0.2, 84.0)?;
            moving.material().check()
        })?;
        check_each(&self.tools, "tools", |tool| position(tool.position).and_then(|()| tool.form.check(tool.kind)))?;
        self.placeable.form.check(self.placeable.kind).within("placeable")?;
        check_each(&self.subgoals, "subgoals", on_screen)?;
        on_screen(&self.goal.region()).within("goal")?;
        check_settings(&self.rules, &RULES).within("rules")?;
        order(self)?;
        check_each(&self.shifts, "shifts", |shift| shifted(self, shift))?;
        clear_start(self)
    }
}

/// Checks the name of a task, which becomes part of file names.
///
/// # Errors
/// When it is not allowed.
pub fn check_name(name: &str) -> Result<(), ValidationError> {
    let is_other = |c: char| !c.is_ascii() && !c.is_whitespace() && !is_unsafe(c);
    let is_allowed = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c) || is_other(c);
    if !(1..=MAX_NAME_LENGTH).contains(&name.len()) || name.starts_with('.') || !name.chars().all(is_allowed) {
        return problem(
            "name",
            "must be letters, digits, `-`, `_` or `.`, up to 100 bytes of them, and not begin with `.`",
        );
    }
    Ok(())
}

/// Checks that the order names existing parts, each once, and tools in the order of their list.
fn order(task: &Task) -> Result<(), ValidationError> {
    listed(task, &task.order, "order")?;
    let tool = |part: &Part| if let Part::Tool(index) = *part { Some(index) } else { None };
    let tools: Vec<usize> = task.order.iter().filter_map(tool).collect();
    if !tools.is_empty() && !tools.into_iter().eq(0..task.tools.len()) {
        return problem("order", "must name all tools in the order of their list, or none");
    }
    Ok(())
}

/// Checks that these parts exist, and that none is named twice.
fn listed(task: &Task, parts: &[Part], path: &str) -> Result<(), ValidationError> {
    let known: Vec<Part> = task.default_parts().collect();
    for (i, part) in parts.iter().enumerate() {
        if !known.contains(part) {
            return problem(&format!("{path}[{i}]"), "is not a part of the scene");
        }
        if parts[..i].contains(part) {
            return problem(&format!("{path}[{i}]"), "is listed twice: name each part once");
        }
    }
    Ok(())
}

fn shifted(task: &Task, shift: &Shift) -> Result<(), ValidationError> {
    listed(task, &shift.parts, "parts")?;
    let offset = |value: &f32| in_range(*value, ".", -2.0, 2.0);
    match &shift.by {
        Offset::Uniform { x, y } => {
            for (axis, range) in [("by.uniform.x", x), ("by.uniform.y", y)] {
                check_each(range, axis, offset)?;
                if range[0] > range[1] {
                    return problem(axis, "must be two numbers, the lower first");
                }
            }
            Ok(())
        }
        Offset::OneOf(choices) if choices.is_empty() || choices.len() > MAX_OBJECTS => {
            problem("by.one_of", "must be 1 to 64 offsets")
        }
        Offset::OneOf(choices) => check_each(choices, "by.one_of", |choice| choice.iter().try_for_each(offset)),
    }
}

/// The numeric rules of a task.
pub const RULES: [Setting; 13] = [
    Setting::count("max_actions", 1, 1000, "actions after which the episode is truncated"),
    Setting::count("steps_per_action", 1, 10_000, "physics steps after each action"),
    Setting { path: "gravity", range: Range::Numbers(-1000.0, 1000.0), about: "gravity in units per second squared" },
    Setting::number("rewards.goal", -1e6, 1e6, "reward of the goal"),
    Setting::number("rewards.subgoal", -1e6, 1e6, "reward of each subgoal"),
    Setting::number("rewards.step", -1e6, 1e6, "reward of every action"),
    Setting::number("rewards.blocked", -1e6, 1e6, "reward of a blocked or invalid placement"),
    Setting::number("rewards.target_moved", -1e6, 1e6, "reward of setting the target in motion (marker levels)"),
    Setting::number("rewards.cost_per_tool", -1e6, 1e6, "taken off other rewards for every tool placed"),
    Setting::number("overlap_threshold", 0.0, 4.0, "a tool this near one placed earlier is blocked, normalised"),
    Setting::number("min_speed", 0.0, 1000.0, "a slower ball (units/s) stands still"),
    Setting::count("still_actions", 1, u32::MAX as u64, "actions that end in standstill after which the episode ends"),
    Setting::number("start_noise", 0.0, 1.0, "half width of the uniform noise on the ball's start, normalised"),
];

/// Checks that no ball starts inside a tool or another ball.
fn clear_start(task: &Task) -> Result<(), ValidationError> {
    let mut balls = vec![("ball".to_owned(), task.ball)];
    balls.extend(task.marker.as_ref().map(|marker| ("marker.ball".to_owned(), marker.ball)));
    if task.goal.shape == GoalShape::Ball {
        let ball = BallSpec { radius: task.goal.radius, ..BallSpec::at(task.goal.position) };
        balls.push(("goal".to_owned(), ball));
    }
    balls.extend(task.balls.iter().enumerate().map(|(i, ball)| (format!("balls[{i}]"), *ball)));
    for (n, (path, ball)) in balls.iter().enumerate() {
        let path = || format!("{path}.position");
        for (i, tool) in task.tools.iter().enumerate() {
            if tool.tool().holds_start(to_units(ball.position), ball.radius) {
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

fn ball(ball: &BallSpec) -> Result<(), ValidationError> {
    position(ball.position)?;
    velocity(ball.velocity)?;
    ball.material().check()
}

fn velocity(velocity: [f32; 2]) -> Result<(), ValidationError> {
    check_each(&velocity, "velocity", |value| in_range(*value, ".", -1000.0, 1000.0))
}

impl Form {
    /// Checks that all properties apply to a tool of this type and are in range.
    ///
    /// # Errors
    /// The first that is not allowed.
    pub fn check(&self, kind: ToolKind) -> Result<(), ValidationError> {
        use ToolKind::{Ramp, SeeSaw};
        let fitting = [
            ("radius", self.radius.is_some(), kind.is_segment()),
            ("force", self.force.is_some(), kind.has_force()),
            ("vel", self.vel.is_some(), kind.has_velocity()),
            ("max_angle", self.max_angle.is_some(), kind.has_max_angle()),
            ("on_left", self.on_left.is_some(), kind == SeeSaw),
            ("ball_mass", self.ball_mass.is_some(), kind == SeeSaw),
            // CREATE sets it for ramps too.
            ("roll_friction", self.roll_friction.is_some(), kind.is_hinged() || kind == Ramp),
        ];
        if let Some((name, ..)) = fitting.into_iter().find(|(_, is_there, fits)| *is_there && !fits) {
            return Err(ValidationError::new(name, format_args!("does not belong to a {kind}: remove it")));
        }
        // The names in files are those of [`Tool::check`].
        self.apply(Tool::new(kind, [0.0; 2])).check()
    }
}

/// Checks a region that a ball has to reach, which is on the screen.
fn on_screen(region: &Region) -> Result<(), ValidationError> {
    check_each(&region.position, "position", |value| in_range(*value, ".", -1.0, 1.0))?;
    in_range(region.radius, "radius", 0.1, 42.0)
}

/// Levels place walls slightly outside the screen, hence the margin.
fn position(position: [f32; 2]) -> Result<(), ValidationError> {
    check_each(&position, "position", |value| in_range(*value, ".", -1.5, 1.5))
}

fn problem(path: &str, message: impl Into<String>) -> Result<(), ValidationError> {
    Err(ValidationError::new(path, message.into()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load;
    use mge_physics::SCREEN;

    /// A task with a ball of radius 4 and another object at a distance from it, in units.
    fn with(change: impl Fn(&mut Task, [f32; 2]), distance: f32) -> Result<(), ValidationError> {
        let mut task = load("task1").unwrap();
        task.subgoals.clear();
        task.tools.clear();
        (task.ball.position, task.ball.radius) = ([0.0, 0.0], 4.0);
        task.goal.position = [0.8, -0.8];
        change(&mut task, [2.0 * distance / SCREEN, 0.0]);
        task.validate()
    }

    #[test]
    fn balls_may_touch_but_not_overlap() {
        let ball = |task: &mut Task, position| task.balls.push(BallSpec { radius: 3.0, ..BallSpec::at(position) });
        with(ball, 7.0 - 0.5 * START_OVERLAP).unwrap();
        let error = with(ball, 7.0 - 1.5 * START_OVERLAP).unwrap_err().to_string();
        assert_eq!(error, "balls[0].position: overlaps ball: move one of them");
    }

    #[test]
    fn subgoals_and_goal_are_on_the_screen() {
        let subgoal = |x| {
            move |task: &mut Task, _| {
                task.subgoals =
                    vec![Region { position: [0.0, 0.5], radius: 4.0 }, Region { position: [x, 0.5], radius: 4.0 }]
            }
        };
        with(subgoal(-1.0), 0.0).unwrap();
        let error = with(subgoal(1.2), 0.0).unwrap_err().to_string();
        assert_eq!(error, "subgoals[1].position[0]: is 1.2, but must be a number from -1 to 1");
    }

    #[test]
    fn a_goal_ball_has_the_goal_radius() {
        let goal = |task: &mut Task, position| {
            (task.goal.shape, task.goal.position, task.goal.radius) = (GoalShape::Ball, position, 2.0);
        };
        with(goal, 6.0).unwrap();
        assert!(
            with(goal, 6.0 - 1.5 * START_OVERLAP).unwrap_err().to_string().starts_with("goal.position: overlaps ball")
        );
    }

    #[test]
    fn a_shift_names_each_part_once() {
        let shifted = |parts: &[Part]| {
            let shift = Shift { parts: parts.to_vec(), by: Offset::OneOf(vec![[0.1, 0.0]]) };
            with(|task, _| task.shifts.push(shift.clone()), 30.0)
        };
        shifted(&[Part::Target, Part::Goal]).unwrap();
        let error = shifted(&[Part::Target, Part::Target]).unwrap_err().to_string();
        assert_eq!(error, "shifts[0].parts[1]: is listed twice: name each part once");
    }

    #[test]
    fn only_segments_are_rounded() {
        let tool = |kind| {
            move |task: &mut Task, position| {
                let form = Form { radius: Some(1.0), ..Form::default() };
                task.tools.push(crate::ToolSpec { kind, position, form });
            }
        };
        with(tool(ToolKind::Wall), 30.0).unwrap();
        let error = with(tool(ToolKind::Box), 30.0).unwrap_err().to_string();
        assert!(error.contains("does not belong to a box"), "{error}");
    }
}
