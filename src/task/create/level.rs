//! CREATE's level files: objects by name, numbers as numbers or as small expressions.
//!
//! A level is loaded as its deterministic variant, or with the random shifts of `rnd`, drawn
//! at every reset. CREATE hands the agent a sample of tools at every episode; the environment
//! does too if it is asked to, and else places a box.

use std::f64::consts::FRAC_PI_4;

use serde::Deserialize;
use serde_json::{Map, Value as Json};

use super::expression::{Value, evaluate};
use crate::physics::{Tool, ToolKind};
use crate::task::{
    BallSpec, BoxSpec, Form, Goal, GoalShape, Marker, Offset, Part, Placeable, Region, Rules, STANDARD_RADIUS, Shift,
    Task, ToolSpec, VERSION,
};
use crate::validation::ValidationError;

/// Radius of CREATE's subgoals, in units.
const SUBSTANDARD_RADIUS: f32 = 3.0;
/// Radius of the basketball that stands in for the target ball, in units.
const BASKETBALL_RADIUS: f32 = 3.5;
/// Half the side of the basket, in units.
const BASKET_HALF_SIDE: f32 = 5.0;
/// The target has moved once it is this far from its start (normalised, over the root of 8).
const MOVE_THRESHOLD: f32 = 0.03;

/// A level file as CREATE reads it.
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
/// At the first object or rule this program lacks, and at the first number that cannot
/// be read.
pub(in crate::task) fn level_task(level: LevelFile, is_random: bool) -> Result<Task, ValidationError> {
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
            must_hit: truth(&level.marker_must_hit, "marker_must_hit")?,
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
    if truth(&level.place_walls, "place_walls")? {
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
        _ if truth(&level.ball_is_basket, "ball_is_basket")? => BASKETBALL_RADIUS,
        Some(radius) => number(radius, "target_ball_radius")? as f32,
        None => STANDARD_RADIUS,
    };
    Ok(BallSpec { radius, ..BallSpec::at(pair(&level.target, "target")?) })
}

fn goal(level: &LevelFile) -> Result<Goal, ValidationError> {
    let (shape, radius) = if truth(&level.goal_is_basket, "goal_is_basket")? {
        (GoalShape::Basket, BASKET_HALF_SIDE)
    } else if truth(&level.moving_goal, "moving_goal")? {
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

/// The walls at the sides and the floor at the top that a level may ask for.
fn edge_walls() -> [ToolSpec; 3] {
    let edge = |kind, position| ToolSpec { kind, position, form: Form { size: Some(90.0), ..Form::default() } };
    [edge(ToolKind::Wall, [1.0, 0.0]), edge(ToolKind::Wall, [-1.0, 0.0]), edge(ToolKind::Floor, [0.0, 1.0])]
}

/// The objects of a level, by what they become here.
#[derive(Default)]
struct Objects {
    balls: Vec<BallSpec>,
    boxes: Vec<BoxSpec>,
    tools: Vec<ToolSpec>,
    /// What random shifts call each, and what it is, in the order of the level.
    named: Vec<(String, Part)>,
}

/// A tool of CREATE by its name in level files, with the sizes and materials it has there.
struct Named {
    name: &'static str,
    kind: ToolKind,
    size: f64,
    change: fn(&mut Tool),
    /// Properties that a level may set.
    properties: &'static [&'static str],
}

const SEGMENT: &[&str] = &["length", "friction", "elasticity", "sensor", "thickness"];
const RAMP: &[&str] = &["length", "angle", "friction", "elasticity", "thickness"];
const POLYGON: &[&str] = &["size", "angle", "friction", "elasticity"];

/// Names, default sizes and materials are CREATE's.
const NAMED: &[Named] = &[
    Named { name: "floor", kind: ToolKind::Floor, size: 16.0, change: |_| {}, properties: SEGMENT },
    Named { name: "long_floor", kind: ToolKind::Floor, size: 24.0, change: |_| {}, properties: &["thickness"] },
    Named { name: "medium_floor", kind: ToolKind::Floor, size: 16.0, change: |_| {}, properties: &["thickness"] },
    Named { name: "short_floor", kind: ToolKind::Floor, size: 8.0, change: |_| {}, properties: &["thickness"] },
    Named { name: "very_short_floor", kind: ToolKind::Floor, size: 4.0, change: |_| {}, properties: &["thickness"] },
    Named { name: "wall", kind: ToolKind::Wall, size: 16.0, change: |_| {}, properties: SEGMENT },
    Named {
        name: "wall_elastic",
        kind: ToolKind::Wall,
        size: 16.0,
        change: |tool| tool.elasticity = 0.8,
        properties: &["thickness"],
    },
    Named { name: "ramp", kind: ToolKind::Ramp, size: 16.0, change: |_| {}, properties: RAMP },
    Named { name: "trampoline", kind: ToolKind::Trampoline, size: 16.0, change: |_| {}, properties: &["elasticity"] },
    Named {
        name: "bucket",
        kind: ToolKind::Bucket,
        size: 10.0,
        change: |tool| tool.angle = FRAC_PI_4,
        properties: &["size", "angle"],
    },
    Named {
        name: "funnel",
        kind: ToolKind::Funnel,
        size: 10.0,
        change: |tool| tool.angle = FRAC_PI_4,
        properties: &["size", "angle"],
    },
    Named { name: "fixed_triangle", kind: ToolKind::Triangle, size: 10.0, change: |_| {}, properties: POLYGON },
    Named { name: "fixed_square", kind: ToolKind::Square, size: 10.0, change: |_| {}, properties: POLYGON },
    Named { name: "fixed_pentagon", kind: ToolKind::Pentagon, size: 10.0, change: |_| {}, properties: POLYGON },
    Named { name: "fixed_hexagon", kind: ToolKind::Hexagon, size: 10.0, change: |_| {}, properties: POLYGON },
    Named {
        name: "fixed_box",
        kind: ToolKind::Box,
        size: 10.0,
        change: |_| {},
        properties: &["size", "friction", "elasticity"],
    },
    Named {
        name: "fixed_circle",
        kind: ToolKind::Circle,
        size: 5.0,
        change: |_| {},
        properties: &["radius", "elasticity"],
    },
    Named {
        name: "hinge_ramp",
        kind: ToolKind::Hinge,
        size: 24.0,
        change: |_| {},
        properties: &["length", "friction"],
    },
    Named {
        name: "see_saw",
        kind: ToolKind::SeeSaw,
        size: 24.0,
        change: |_| {},
        properties: &["length", "friction", "max_angle", "on_left", "ball_mass"],
    },
    Named { name: "cannon", kind: ToolKind::Cannon, size: 10.0, change: |_| {}, properties: &["angle", "force"] },
    Named { name: "fan", kind: ToolKind::Fan, size: 10.0, change: |_| {}, properties: &["angle", "force"] },
    Named { name: "belt", kind: ToolKind::Belt, size: 20.0, change: |_| {}, properties: &["length", "vel"] },
    Named {
        name: "right_belt",
        kind: ToolKind::Belt,
        size: 20.0,
        change: |tool| tool.velocity = -4.0,
        properties: &["length", "vel"],
    },
    Named { name: "ladder", kind: ToolKind::Ladder, size: 20.0, change: |_| {}, properties: &["length", "vel"] },
    Named {
        name: "down_ladder",
        kind: ToolKind::Ladder,
        size: 20.0,
        change: |tool| tool.velocity = -4.0,
        properties: &["vel"],
    },
    Named { name: "fast_ladder", kind: ToolKind::Ladder, size: 15.0, change: |_| {}, properties: &["length", "vel"] },
];

impl Objects {
    fn add(&mut self, object: &Map<String, Json>, path: &str) -> Result<(), ValidationError> {
        let mut object = Object::new(object, path)?;
        let handle = object.handle.clone();
        let part = match object.name {
            "marker_ball" | "target_ball" => {
                let radius = object.number("radius")?.map_or(STANDARD_RADIUS, |radius| radius as f32);
                self.add_ball(object, |ball| BallSpec { radius, ..ball })?
            }
            "basket_ball" => self.add_ball(object, |ball| BallSpec { radius: BASKETBALL_RADIUS, ..ball })?,
            "ball" => {
                let [mass, radius] = [object.required("mass")?, object.required("radius")?].map(|value| value as f32);
                let elasticity = object.number("elasticity")?.unwrap_or(1.0) as f32;
                let friction = object.number("friction")?.unwrap_or(1.0) as f32;
                self.add_ball(object, |ball| BallSpec { mass, radius, elasticity, friction, ..ball })?
            }
            "box" => {
                let mut number =
                    |name: &str, usual: f64| object.number(name).map(|value| value.unwrap_or(usual) as f32);
                let (size, mass) = (number("size", 5.0)?, number("mass", 10.0)?);
                let (elasticity, friction) = (number("elasticity", 1.0)?, number("friction", 1.0)?);
                let position = object.position()?;
                object.finish()?;
                self.boxes.push(BoxSpec { position, velocity: [0.0; 2], size, mass, elasticity, friction });
                Part::Box(self.boxes.len() - 1)
            }
            name => match NAMED.iter().find(|named| named.name == name) {
                Some(named) => self.add_tool(object, named)?,
                None => return Err(object.lacking(&format!("`{name}`"))),
            },
        };
        self.named.push((handle, part));
        Ok(())
    }

    fn add_tool(&mut self, mut object: Object, named: &Named) -> Result<Part, ValidationError> {
        let position = object.position()?;
        let mut tool = Tool::new(named.kind, [0.0; 2]).with_size(named.size);
        (named.change)(&mut tool);
        for property in named.properties {
            match *property {
                "sensor" => object.expect_solid()?,
                "friction" if named.kind.is_hinged() => {
                    tool.roll_friction = object.number("friction")?.unwrap_or(tool.roll_friction);
                }
                "friction" if named.kind != ToolKind::Box => object.expect_friction_one()?,
                "thickness" => {
                    // CREATE divides as integers: a thickness of 1 leaves no rounding at all.
                    let thickness = object.number("thickness")?.unwrap_or(2.0);
                    tool.radius = (thickness / 2.0).floor();
                }
                "on_left" => tool.on_left = truth(&object.properties.shift_remove("on_left"), &object.at("on_left"))?,
                name => {
                    let field = match name {
                        "length" | "size" | "radius" => &mut tool.size,
                        "angle" => &mut tool.angle,
                        "elasticity" => &mut tool.elasticity,
                        "friction" => &mut tool.friction,
                        "force" => &mut tool.force,
                        "vel" => &mut tool.velocity,
                        "max_angle" => &mut tool.max_angle,
                        _ => &mut tool.weight,
                    };
                    *field = object.number(name)?.unwrap_or(*field);
                }
            }
        }
        object.finish()?;
        self.tools.push(ToolSpec { kind: named.kind, position, form: Form::of(&tool) });
        Ok(Part::Tool(self.tools.len() - 1))
    }

    fn add_ball(&mut self, mut object: Object, change: impl Fn(BallSpec) -> BallSpec) -> Result<Part, ValidationError> {
        let position = object.position()?;
        object.finish()?;
        self.balls.push(change(BallSpec::at(position)));
        Ok(Part::Ball(self.balls.len() - 1))
    }

    /// CREATE takes the first object of a marker level for its marker.
    fn take_marker(&mut self) -> Result<BallSpec, ValidationError> {
        match self.named.first_mut() {
            Some((_, first)) if *first == Part::Ball(0) => *first = Part::Marker,
            _ => return Err(ValidationError::new("env[0]", "must be the marker ball: move it to the first place")),
        }
        for (_, part) in &mut self.named {
            if let Part::Ball(index) = part {
                *index -= 1;
            }
        }
        Ok(self.balls.remove(0))
    }
}

/// An object of a level whose properties are taken one by one.
struct Object<'a> {
    path: &'a str,
    name: &'a str,
    /// What random shifts call it: its name, with its id if it has one.
    handle: String,
    properties: Map<String, Json>,
}

impl<'a> Object<'a> {
    fn new(object: &'a Map<String, Json>, path: &'a str) -> Result<Self, ValidationError> {
        let name = object.get("name").and_then(Json::as_str);
        let name =
            name.ok_or_else(|| ValidationError::new(format_args!("{path}.name"), "must be the name of an object"))?;
        let mut properties = object.clone();
        let handle = match object.get("id") {
            Some(id) => format!("{name}:{id}"),
            None => name.to_owned(),
        };
        // Looks do not matter here.
        for unused in ["name", "color", "id"] {
            properties.shift_remove(unused);
        }
        Ok(Self { path, name, handle, properties })
    }

    fn at(&self, property: &str) -> String {
        format!("{}.{property}", self.path)
    }

    fn number(&mut self, property: &str) -> Result<Option<f64>, ValidationError> {
        let value = self.properties.shift_remove(property);
        value.map(|value| number(&value, &self.at(property))).transpose()
    }

    fn required(&mut self, property: &str) -> Result<f64, ValidationError> {
        let missing = ValidationError::new(self.at(property), format_args!("is missing: a {} needs it", self.name));
        self.number(property)?.ok_or(missing)
    }

    fn position(&mut self) -> Result<[f32; 2], ValidationError> {
        let path = self.at("pos");
        let value = self.properties.shift_remove("pos");
        pair(&value.ok_or_else(|| ValidationError::new(&path, "is missing"))?, &path)
    }

    /// In CREATE a segment's friction above 1 brakes rolling balls by a rule of its own.
    fn expect_friction_one(&mut self) -> Result<(), ValidationError> {
        match self.number("friction")? {
            None | Some(1.0) => Ok(()),
            Some(friction) => {
                let message = format_args!("is {friction}, but a {} always has friction 1", self.name);
                Err(ValidationError::new(self.at("friction"), message))
            }
        }
    }

    fn expect_solid(&mut self) -> Result<(), ValidationError> {
        match truth(&self.properties.shift_remove("sensor"), &self.at("sensor"))? {
            false => Ok(()),
            true => {
                Err(ValidationError::new(self.at("sensor"), format_args!("is true, but a {} is solid here", self.name)))
            }
        }
    }

    fn lacking(&self, what: &str) -> ValidationError {
        let message = format_args!("{what}, an object this program does not have: remove it or use another level");
        ValidationError::new(self.at("name"), message)
    }

    /// What is left over is a property that CREATE's object does not have either.
    fn finish(self) -> Result<(), ValidationError> {
        match self.properties.keys().next() {
            None => Ok(()),
            Some(property) => Err(ValidationError::new(
                self.at(property),
                format_args!("is not a property of a {}: remove it", self.name),
            )),
        }
    }
}

/// The random shifts of a level: objects by name, with their id if they have one, and a pair
/// of ranges, or a choice. Names of which there is none are CREATE's way to switch one off.
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
                let pair = |choice: &Value| match choice {
                    Value::List(pair) => match pair[..] {
                        [Value::Number(x), Value::Number(y)] => Ok([x as f32, y as f32]),
                        _ => Err(ValidationError::new(&path, "must be a choice of pairs of numbers")),
                    },
                    _ => Err(ValidationError::new(&path, "must be a choice of pairs of numbers")),
                };
                Offset::OneOf(choices.iter().map(pair).collect::<Result<_, _>>()?)
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
        |(index, value)| Ok(Region { position: pair(value, &format!("{path}[{index}]"))?, radius: SUBSTANDARD_RADIUS });
    values.iter().enumerate().map(region).collect()
}

fn pair(json: &Json, path: &str) -> Result<[f32; 2], ValidationError> {
    match value(json, path)? {
        Value::List(values) => match values[..] {
            [Value::Number(x), Value::Number(y)] => Ok([x as f32, y as f32]),
            _ => Err(ValidationError::new(path, "must be two numbers, [x, y]")),
        },
        _ => Err(ValidationError::new(path, "must be two numbers, [x, y]")),
    }
}

fn number(json: &Json, path: &str) -> Result<f64, ValidationError> {
    match value(json, path)? {
        Value::Number(number) => Ok(number),
        _ => Err(ValidationError::new(path, "must be a number")),
    }
}

fn truth(json: &Option<Json>, path: &str) -> Result<bool, ValidationError> {
    match json.as_ref().map(|json| value(json, path)).transpose()? {
        None => Ok(false),
        Some(Value::Truth(truth)) => Ok(truth),
        Some(_) => Err(ValidationError::new(path, "must be true or false")),
    }
}

fn value(json: &Json, path: &str) -> Result<Value, ValidationError> {
    match json {
        Json::String(text) => evaluate(text).map_err(|message| ValidationError::new(path, message)),
        Json::Bool(truth) => Ok(Value::Truth(*truth)),
        Json::Number(number) => Ok(Value::Number(number.as_f64().unwrap_or(f64::NAN))),
        Json::Array(values) => {
            let values = values.iter().enumerate().map(|(index, item)| value(item, &format!("{path}[{index}]")));
            Ok(Value::List(values.collect::<Result<_, _>>()?))
        }
        Json::Null | Json::Object(_) => Err(ValidationError::new(path, "must be a number, a list or an expression")),
    }
}
