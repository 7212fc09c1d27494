//! CREATE's level files: objects by name, numbers as numbers or as small expressions.
//!
//! A level loads as its deterministic variant: the ranges of random shifts in `rnd` are
//! not applied. CREATE hands the agent a sample of tools at every episode; here it places
//! a box, unless the task is saved and edited.

use serde::Deserialize;
use serde::de::IgnoredAny;
use serde_json::{Map, Value as Json};

use super::expression::{Value, evaluate};
use crate::physics::ToolKind;
use crate::task::schema::{
    BallSpec, Form, Goal, GoalShape, Marker, Placeable, Region, Rules, STANDARD_RADIUS, Task, ToolSpec, VERSION,
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
    #[serde(default, rename = "rnd")]
    _rnd: IgnoredAny,
}

/// The task of a level.
///
/// # Errors
/// At the first object or rule this program lacks, and at the first number that cannot
/// be read.
pub(in crate::task) fn level_task(level: LevelFile) -> Result<Task, ValidationError> {
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
    if truth(&level.place_walls, "place_walls")? {
        objects.tools.extend(edge_walls());
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
    Ok(Task {
        version: VERSION,
        ball: target(&level)?,
        marker,
        balls: objects.balls.into_iter().map(|(_, ball)| ball).collect(),
        tools: objects.tools,
        placeable: Placeable { kind: ToolKind::Box, form: Form::default() },
        subgoals: regions(&level.target_sec_goals, "target_sec_goals")?,
        goal: goal(&level)?,
        rules: rules(&level)?,
        description: format!("CREATE's level {}.", level.name),
        name: level.name,
    })
}

fn target(level: &LevelFile) -> Result<BallSpec, ValidationError> {
    let radius = match &level.target_ball_radius {
        _ if truth(&level.ball_is_basket, "ball_is_basket")? => BASKETBALL_RADIUS,
        Some(radius) => number(radius, "target_ball_radius")?,
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
            *field = number(value, path)?;
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
    /// With the index in the level's list.
    balls: Vec<(usize, BallSpec)>,
    tools: Vec<ToolSpec>,
}

impl Objects {
    /// Names, default sizes and materials are CREATE's.
    fn add(&mut self, object: &Map<String, Json>, path: &str) -> Result<(), ValidationError> {
        let mut object = Object::new(object, path)?;
        match object.name {
            "floor" | "wall" => {
                let kind = if object.name == "wall" { ToolKind::Wall } else { ToolKind::Floor };
                let length = object.number("length")?.unwrap_or(16.0);
                let elasticity = object.number("elasticity")?;
                object.expect_friction_one()?;
                object.expect_solid()?;
                self.add_segment(object, kind, length, elasticity)
            }
            "long_floor" => self.add_segment(object, ToolKind::Floor, 24.0, None),
            "medium_floor" => self.add_segment(object, ToolKind::Floor, 16.0, None),
            "short_floor" => self.add_segment(object, ToolKind::Floor, 8.0, None),
            "very_short_floor" => self.add_segment(object, ToolKind::Floor, 4.0, None),
            "wall_elastic" => self.add_segment(object, ToolKind::Wall, 16.0, Some(0.8)),
            "bucket" => {
                let size = object.number("size")?.unwrap_or(10.0);
                let angle = object.number("angle")?.unwrap_or(std::f32::consts::FRAC_PI_4);
                let form = Form { size: Some(size), angle: Some(angle), ..Form::default() };
                self.add_tool(object, ToolKind::Bucket, form)
            }
            "fixed_square" => {
                let size = object.number("size")?.unwrap_or(10.0);
                let (angle, elasticity) = (object.number("angle")?, object.number("elasticity")?);
                object.expect_friction_one()?;
                let form = Form { size: Some(size), angle, elasticity, ..Form::default() };
                self.add_tool(object, ToolKind::Square, form)
            }
            "fixed_box" => {
                let size = object.number("size")?.unwrap_or(10.0);
                let (elasticity, friction) = (object.number("elasticity")?, object.number("friction")?);
                let form = Form { size: Some(size), elasticity, friction, ..Form::default() };
                self.add_tool(object, ToolKind::Box, form)
            }
            "marker_ball" | "target_ball" => {
                let radius = object.number("radius")?.unwrap_or(STANDARD_RADIUS);
                self.add_ball(object, |ball| BallSpec { radius, ..ball })
            }
            "basket_ball" => self.add_ball(object, |ball| BallSpec { radius: BASKETBALL_RADIUS, ..ball }),
            "ball" => {
                let (mass, radius) = (object.required("mass")?, object.required("radius")?);
                let elasticity = object.number("elasticity")?.unwrap_or(1.0);
                let friction = object.number("friction")?.unwrap_or(1.0);
                self.add_ball(object, |ball| BallSpec { mass, radius, elasticity, friction, ..ball })
            }
            "box" => Err(object.lacking("`box` is a box that moves (a tool is `fixed_box`)")),
            name => Err(object.lacking(&format!("`{name}`"))),
        }
    }

    fn add_segment(
        &mut self,
        mut object: Object,
        kind: ToolKind,
        length: f32,
        elasticity: Option<f32>,
    ) -> Result<(), ValidationError> {
        let thickness = object.number("thickness")?.unwrap_or(2.0);
        // CREATE divides as integers: a thickness of 1 leaves no rounding at all.
        let radius = (thickness / 2.0).floor();
        let form = Form { size: Some(length), radius: Some(radius), elasticity, ..Form::default() };
        self.add_tool(object, kind, form)
    }

    fn add_tool(&mut self, mut object: Object, kind: ToolKind, form: Form) -> Result<(), ValidationError> {
        let position = object.position()?;
        object.finish()?;
        self.tools.push(ToolSpec { kind, position, form });
        Ok(())
    }

    fn add_ball(&mut self, mut object: Object, change: impl Fn(BallSpec) -> BallSpec) -> Result<(), ValidationError> {
        let position = object.position()?;
        object.finish()?;
        let index = self.balls.len() + self.tools.len();
        self.balls.push((index, change(BallSpec::at(position))));
        Ok(())
    }

    /// CREATE takes the first object of a marker level for its marker.
    fn take_marker(&mut self) -> Result<BallSpec, ValidationError> {
        match self.balls.first() {
            Some((0, _)) => Ok(self.balls.remove(0).1),
            _ => Err(ValidationError::new("env[0]", "must be the marker ball: move it to the first place")),
        }
    }
}

/// An object of a level whose properties are taken one by one.
struct Object<'a> {
    path: &'a str,
    name: &'a str,
    properties: Map<String, Json>,
}

impl<'a> Object<'a> {
    fn new(object: &'a Map<String, Json>, path: &'a str) -> Result<Self, ValidationError> {
        let name = object.get("name").and_then(Json::as_str);
        let name =
            name.ok_or_else(|| ValidationError::new(format_args!("{path}.name"), "must be the name of an object"))?;
        let mut properties = object.clone();
        // Looks, and the handle of random shifts, do not matter here.
        for unused in ["name", "color", "id"] {
            properties.shift_remove(unused);
        }
        Ok(Self { path, name, properties })
    }

    fn at(&self, property: &str) -> String {
        format!("{}.{property}", self.path)
    }

    fn number(&mut self, property: &str) -> Result<Option<f32>, ValidationError> {
        let value = self.properties.shift_remove(property);
        value.map(|value| number(&value, &self.at(property))).transpose()
    }

    fn required(&mut self, property: &str) -> Result<f32, ValidationError> {
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

fn number(json: &Json, path: &str) -> Result<f32, ValidationError> {
    match value(json, path)? {
        Value::Number(number) => Ok(number as f32),
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
