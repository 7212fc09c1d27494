//! Tools of a scene and the tool that is placed.

use serde::{Deserialize, Serialize};

use mge_physics::{Tool, ToolKind, exact, to_units};

/// A static tool of the scene.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(from = "ToolFields")]
pub struct ToolSpec {
    /// Type.
    #[serde(rename = "type")]
    pub kind: ToolKind,
    /// Normalised centre.
    pub position: [f32; 2],
    /// Shape and material.
    #[serde(flatten)]
    pub form: Form,
}

impl ToolSpec {
    /// The tool in units.
    pub fn tool(&self) -> Tool {
        self.form.apply(Tool::new(self.kind, to_units(self.position.map(exact))))
    }
}

/// The tool that the agent places, without a position.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(from = "PlaceableFields")]
pub struct Placeable {
    /// Type.
    #[serde(rename = "type")]
    pub kind: ToolKind,
    /// Shape and material.
    #[serde(flatten)]
    pub form: Form,
}

impl Placeable {
    /// The tool at a normalised position.
    pub fn tool(&self, position: [f32; 2]) -> Tool {
        self.form.apply(Tool::new(self.kind, to_units(position.map(f64::from))))
    }
}

/// The optional numbers of a tool; missing ones are CREATE's defaults for the type.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Form {
    /// Polygons: centre to corner; box: side; circle: radius; segments: length. Units.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size: Option<f64>,
    /// Rotation in radians, counter-clockwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub angle: Option<f64>,
    /// Half the thickness of a segment, in units.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius: Option<f64>,
    /// Elasticity.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub elasticity: Option<f64>,
    /// Friction coefficient.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction: Option<f64>,
    /// Cannon: momentum it gives. Fan: force it exerts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force: Option<f64>,
    /// Belt and ladder: speed in units/s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vel: Option<f64>,
    /// Constrained hinge and see-saw: largest angle of the plank, in radians.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_angle: Option<f64>,
    /// See-saw: the weight is on the right, the left end up.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub on_left: Option<bool>,
    /// See-saw: mass of the weight.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ball_mass: Option<f64>,
    /// Planks: if it exceeds 1, the excess is the fraction of its velocity and spin that a ball in contact loses in
    /// every step.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub roll_friction: Option<f64>,
}

impl Form {
    /// The tool with these numbers applied.
    pub fn apply(&self, mut tool: Tool) -> Tool {
        for (given, field) in [
            (self.size, &mut tool.size),
            (self.angle, &mut tool.angle),
            (self.radius, &mut tool.radius),
            (self.elasticity, &mut tool.elasticity),
            (self.friction, &mut tool.friction),
            (self.force, &mut tool.force),
            (self.vel, &mut tool.velocity),
            (self.max_angle, &mut tool.max_angle),
            (self.ball_mass, &mut tool.weight),
            (self.roll_friction, &mut tool.roll_friction),
        ] {
            *field = given.unwrap_or(*field);
        }
        tool.on_left = self.on_left.unwrap_or(tool.on_left);
        tool
    }
}

/// Deserialises a struct with a [`Form`]. A flattened [`Form`] would lose the path and the line of errors.
macro_rules! read_with_form {
    ($name:ident from $fields:ident { $($own:ident: $type:ty)? }) => {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct $fields {
            r#type: ToolKind,
            $($own: $type,)?
            size: Option<f64>,
            angle: Option<f64>,
            radius: Option<f64>,
            elasticity: Option<f64>,
            friction: Option<f64>,
            force: Option<f64>,
            vel: Option<f64>,
            max_angle: Option<f64>,
            on_left: Option<bool>,
            ball_mass: Option<f64>,
            roll_friction: Option<f64>,
        }

        impl From<$fields> for $name {
            fn from(fields: $fields) -> Self {
                let form = Form {
                    size: fields.size,
                    angle: fields.angle,
                    radius: fields.radius,
                    elasticity: fields.elasticity,
                    friction: fields.friction,
                    force: fields.force,
                    vel: fields.vel,
                    max_angle: fields.max_angle,
                    on_left: fields.on_left,
                    ball_mass: fields.ball_mass,
                    roll_friction: fields.roll_friction,
                };
                Self { kind: fields.r#type, $($own: fields.$own,)? form }
            }
        }
    };
}

read_with_form!(ToolSpec from ToolFields { position: [f32; 2] });
read_with_form!(Placeable from PlaceableFields {});
