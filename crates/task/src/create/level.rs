//! CREATE's level files: objects by name, numbers as numbers or as expressions.
//!
//! A level is loaded as its deterministic variant, or with the random shifts of `rnd`, drawn at every reset. In
//! CREATE the agent gets a sample of tools in every episode; the environment does the same if it is asked to, and
//! otherwise places a box.

use serde::Deserialize;
use serde_json::{Map, Value as Json};

use super::expression::Value;
use super::objects::{BASKETBALL_RADIUS, Objects};
use super::value::{as_pair, boolean, number, pair, value};
use crate::{
    BallSpec, Form, Goal, GoalShape, Marker, Offset, Part, Placeable, Region, Rules, STANDARD_RADIUS, Shift, Task,
    ToolSpec, VERSION,
};
use mge_base::validation::ValidationError;
use mge_physics::ToolKind;

/// Radius of CREATE's subgoals, in units.
const SUBGOAL_RADIUS: f32 = 3.0;
/// Half the side of the basket, in units.
const BASKET_HALF_SIDE: f32 = 5.0;
/// The target counts as moved once it is this far from its start (normalised, divided by the square root of 8).
const MOVE_THRESHOLD: f32 = 0.03;

/// A level file in CREATE's format.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct LevelFile {
    name: String,
    target: Json,
    goal: Json,
    env: Vec<Map<String, Json>>,
    lvl_type: Option<String>,
    reward: Option<String>,
    target_ball_radius: Option<Json>,
    max_num_steps: Option<u32>,
    overlap_thresh: Option<Json>,
    sec_goal_reward: Option<Json>,
    target_reward: Option<Json>,
    place_walls: Option<Json>,
    moving_goal: Option<Json>,
    marker_must_hit: Option<Json>,
    goal_is_basket: Option<Json>,
    ball_is_basket: Option<Json>,
    #[serde(default)]
    target_sec_goals: Vec<Json>,
    #[serde(default)]
    marker_sec_goals: Vec<Json>,
    #[serde(default)]
    rnd: Map<String, Json>,
}

/// The task of a level.
///
/// # Errors
/// At the first object or rule that this program does not support, or the first number that cannot be read.
pub(crate) fn level_task(level: LevelFile, is_random: bool) -> Result<Task, ValidationError> {
    let is_marker_level = match level.lvl_type.as_deref() {
        None => false,
        Some("marker") => true,
        Some(other) => {
            return Err(ValidationError::new("lvl_type", format_args!("is `{other}`, but only `marker` is known")));
        }
    };
    if let Some(reward) = level.reward.as_deref().filter(|reward| *reward != "sparse") {
        return Err(ValidationError::new(
            "reward",
            format_args!("is `{reward}`, but only `sparse` rewards are supported"),
        ));
    }
    let mut objects = Objects::default();
    for (index, object) in level.env.iter().enumerate() {
        objects.add(object, &format!("env[{index}]"))?;
    }
    let marker = if is_marker_level {
        Some(Marker {
            ball: objects.take_marker()?,
            move_threshold: MOVE_THRESHOLD,
            must_hit: boolean(&level.marker_must_hit, "marker_must_hit")?,
            subgoals: regions(&level.marker_sec_goals, "marker_sec_goals")?,
        })
    } else if !level.marker_sec_goals.is_empty() {
        return Err(ValidationError::new("marker_sec_goals", "needs a marker: set `lvl_type` to `marker`"));
    } else {
        None
    };
    let subgoals = regions(&level.target_sec_goals, "target_sec_goals")?;
    let marker_subgoals = marker.as_ref().map_or(0, |marker| marker.subgoals.len());
    let mut order: Vec<Part> = objects.named.iter().map(|(_, part)| *part).collect();
    order.extend((0..marker_subgoals).map(Part::MarkerSubgoal));
    order.extend((0..subgoals.len()).map(Part::Subgoal));
    if boolean(&level.place_walls, "place_walls")? {
        order.extend((0..3).map(|index| Part::Tool(objects.tools.len() + index)));
        objects.tools.extend(edge_walls());
    }
    order.extend([Part::Target, Part::Goal]);
    let shifts = if is_random { shifts(&level.rnd, &objects.named)? } else { Vec::new() };
    Ok(Task {
        version: VERSION,
        ball: target(&level)?,
        marker,
        balls: objects.balls,
        boxes: objects.boxes,
        tools: objects.tools,
        placeable: Placeable { kind: ToolKind::Box, form: Form::default() },
        subgoals,
        search_actions: 0,
        goal: goal(&level)?,
        rules: rules(&level)?,
        order,
        shifts,
        description: format!("CREATE's level {}.", level.name),
        name: if is_random { format!("{}-random", level.name) } else { level.name },
    })
}

fn target(level: &LevelFile) -> Result<BallSpec, ValidationError> {
    let radius = match &level.target_ball_radius {
        _ if boolean(&level.ball_is_basket, "ball_is_basket")? => BASKETBALL_RADIUS,
        Some(radius) => number(radius, "target_ball_radius")? as f32,
        None => STANDARD_RADIUS,
    };
    Ok(BallSpec { radius, ..BallSpec::at(pair(&level.target, "target")?) })
}

fn goal(level: &LevelFile) -> Result<Goal, ValidationError> {
    let (shape, radius) = if boolean(&level.goal_is_basket, "goal_is_basket")? {
        (GoalShape::Basket, BASKET_HALF_SIDE)
    } else if boolean(&level.moving_goal, "moving_goal")? {
        (GoalShape::Ball, STANDARD_RADIUS)
    } else {
        (GoalShape::Star, STANDARD_RADIUS)
    };
    Ok(Goal { position: pair(&level.goal, "goal")?, radius, shape })
}

fn rules(level: &LevelFile) -> Result<Rules, ValidationError> {
    let mut rules = Rules::of_create();
    if let Some(steps) = level.max_num_steps {
        rules.max_actions = steps.saturating_add(1);
    }
    for (value, path, field) in [
        (&level.overlap_thresh, "overlap_thresh", &mut rules.overlap_threshold),
        (&level.sec_goal_reward, "sec_goal_reward", &mut rules.rewards.subgoal),
        (&level.target_reward, "target_reward", &mut rules.rewards.target_moved),
    ] {
        if let Some(value) = value {
            *field = number(value, path)? as f32;
        }
    }
    Ok(rules)
}

/// The two side walls and the top floor that a level may request.
fn edge_walls() -> [ToolSpec; 3] {
    let edge = |kind, position| ToolSpec { kind, position, form: Form { size: Some(90.0), ..Form::default() } };
    [edge(ToolKind::Wall, [1.0, 0.0]), edge(ToolKind::Wall, [-1.0, 0.0]), edge(ToolKind::Floor, [0.0, 1.0])]
}

/// The random shifts of a level: object names, with their id if they have one, each with a pair of ranges or a
/// choice. CREATE switches a shift off by using a name that does not exist.
fn shifts(rnd: &Map<String, Json>, named: &[(String, Part)]) -> Result<Vec<Shift>, ValidationError> {
    let mut shifts = Vec::new();
    for (names, by) in rnd {
        let path = format!("rnd.{names}");
        let parts = names.split(',').flat_map(|name| {
            let name = name.trim();
            let own = match name {
                "target" => Some(Part::Target),
                "goal" => Some(Part::Goal),
                _ => None,
            };
            own.into_iter().chain(named.iter().filter(move |(other, _)| other == name).map(|(_, part)| *part))
        });
        let parts: Vec<Part> = parts.collect();
        let by = match value(by, &path)? {
            Value::List(axes) => match &axes[..] {
                [x, y] => Offset::Uniform { x: interval(x, &path)?, y: interval(y, &path)? },
                _ => return Err(ValidationError::new(path, "must be two numbers or ranges, [x, y]")),
            },
            Value::Choice(choices) => {
                let pairs: Option<_> = choices.iter().map(as_pair).collect();
                Offset::OneOf(pairs.ok_or_else(|| ValidationError::new(&path, "must be a choice of pairs of numbers"))?)
            }
            _ => return Err(ValidationError::new(path, "must be two numbers or ranges, [x, y], or a choice")),
        };
        if !parts.is_empty() {
            shifts.push(Shift { parts, by });
        }
    }
    Ok(shifts)
}

fn interval(value: &Value, path: &str) -> Result<[f32; 2], ValidationError> {
    match value {
        Value::Number(number) => Ok([*number as f32; 2]),
        Value::Uniform(low, high) => Ok([*low as f32, *high as f32]),
        _ => Err(ValidationError::new(path, "must be two numbers or ranges, [x, y]")),
    }
}

fn regions(values: &[Json], path: &str) -> Result<Vec<Region>, ValidationError> {
    let region =
        |(index, value)| Ok(Region { position: pair(value, &format!("{path}[{index}]"))?, radius: SUBGOAL_RADIUS });
    values.iter().enumerate().map(region).collect()
}
