//! The objects of a level by name, with CREATE's sizes and materials.

use std::f64::consts::FRAC_PI_4;

use serde_json::{Map, Value as Json};

use super::value::{boolean, number, pair};
use crate::{BallSpec, BoxSpec, Form, Part, STANDARD_RADIUS, ToolSpec};
use mge_base::validation::ValidationError;
use mge_physics::{Tool, ToolKind};

/// Radius of the basketball that replaces the target ball, in units.
pub(super) const BASKETBALL_RADIUS: f32 = 3.5;

/// The objects of a level, by their type in a task.
#[derive(Default)]
pub(super) struct Objects {
    pub balls: Vec<BallSpec>,
    pub boxes: Vec<BoxSpec>,
    pub tools: Vec<ToolSpec>,
    /// The name of each object in random shifts, and its part, in the order of the level.
    pub named: Vec<(String, Part)>,
}

/// A tool of CREATE by its name in level files, with its sizes and materials there.
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

/// A tool with the default material of its type.
const fn named(name: &'static str, kind: ToolKind, size: f64, properties: &'static [&'static str]) -> Named {
    Named { name, kind, size, change: |_| {}, properties }
}

/// Names, default sizes and materials are CREATE's.
const NAMED: &[Named] = &[
    named("floor", ToolKind::Floor, 16.0, SEGMENT),
    named("long_floor", ToolKind::Floor, 24.0, &["thickness"]),
    named("medium_floor", ToolKind::Floor, 16.0, &["thickness"]),
    named("short_floor", ToolKind::Floor, 8.0, &["thickness"]),
    named("very_short_floor", ToolKind::Floor, 4.0, &["thickness"]),
    named("wall", ToolKind::Wall, 16.0, SEGMENT),
    Named { change: |tool| tool.elasticity = 0.8, ..named("wall_elastic", ToolKind::Wall, 16.0, &["thickness"]) },
    named("ramp", ToolKind::Ramp, 16.0, RAMP),
    named("trampoline", ToolKind::Trampoline, 16.0, &["elasticity"]),
    Named { change: |tool| tool.angle = FRAC_PI_4, ..named("bucket", ToolKind::Bucket, 10.0, &["size", "angle"]) },
    Named { change: |tool| tool.angle = FRAC_PI_4, ..named("funnel", ToolKind::Funnel, 10.0, &["size", "angle"]) },
    named("fixed_triangle", ToolKind::Triangle, 10.0, POLYGON),
    named("fixed_square", ToolKind::Square, 10.0, POLYGON),
    named("fixed_pentagon", ToolKind::Pentagon, 10.0, POLYGON),
    named("fixed_hexagon", ToolKind::Hexagon, 10.0, POLYGON),
    named("fixed_box", ToolKind::Box, 10.0, &["size", "friction", "elasticity"]),
    named("fixed_circle", ToolKind::Circle, 5.0, &["radius", "elasticity"]),
    named("hinge_ramp", ToolKind::Hinge, 24.0, &["length", "friction"]),
    named("see_saw", ToolKind::SeeSaw, 24.0, &["length", "friction", "max_angle", "on_left", "ball_mass"]),
    named("cannon", ToolKind::Cannon, 10.0, &["angle", "force"]),
    named("fan", ToolKind::Fan, 10.0, &["angle", "force"]),
    named("belt", ToolKind::Belt, 20.0, &["length", "vel"]),
    Named { change: |tool| tool.velocity = -4.0, ..named("right_belt", ToolKind::Belt, 20.0, &["length", "vel"]) },
    named("ladder", ToolKind::Ladder, 20.0, &["length", "vel"]),
    Named { change: |tool| tool.velocity = -4.0, ..named("down_ladder", ToolKind::Ladder, 20.0, &["vel"]) },
    named("fast_ladder", ToolKind::Ladder, 15.0, &["length", "vel"]),
];

impl Objects {
    /// Adds an object; `path` names it in errors.
    pub fn add(&mut self, object: &Map<String, Json>, path: &str) -> Result<(), ValidationError> {
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
                    // CREATE uses integer division: a thickness of 1 gives no rounding at all.
                    let thickness = object.number("thickness")?.unwrap_or(2.0);
                    tool.radius = (thickness / 2.0).floor();
                }
                "on_left" => tool.on_left = boolean(&object.properties.shift_remove("on_left"), &object.at("on_left"))?,
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

    /// Removes and returns the marker: in a marker level, CREATE uses the first object.
    pub fn take_marker(&mut self) -> Result<BallSpec, ValidationError> {
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

/// An object of a level; its properties are removed as they are read.
struct Object<'a> {
    path: &'a str,
    name: &'a str,
    /// Its name in random shifts: the object's name, with its id if it has one.
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
        // These are already read or do not matter here.
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

    /// In CREATE a separate rule slows rolling balls if a segment's friction is above 1.
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
        match boolean(&self.properties.shift_remove("sensor"), &self.at("sensor"))? {
            false => Ok(()),
            true => {
                Err(ValidationError::new(self.at("sensor"), format_args!("is true, but a {} is solid here", self.name)))
            }
        }
    }

    fn lacking(&self, what: &str) -> ValidationError {
        let message =
            format_args!("{what} is not an object that this program supports: remove it or use another level");
        ValidationError::new(self.at("name"), message)
    }

    /// Rejects remaining properties, which CREATE's object does not have either.
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
