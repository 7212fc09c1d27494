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

/// Defines [`Form`] by its properties, each with the field of [`Tool`] that it sets, and what [`ToolSpec`] and
/// [`Placeable`] are read from. A flattened [`Form`] would lose the path and the line of errors.
macro_rules! form {
    ($($(#[$doc:meta])* $property:ident: $type:ty => $of_tool:ident,)*) => {
        /// The optional numbers of a tool; missing ones are CREATE's defaults for the type.
        #[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
        pub struct Form {
            $($(#[$doc])* #[serde(skip_serializing_if = "Option::is_none")] pub $property: Option<$type>,)*
        }

        impl Form {
            /// The tool with these numbers applied.
            pub fn apply(&self, mut tool: Tool) -> Tool {
                $(tool.$of_tool = self.$property.unwrap_or(tool.$of_tool);)*
                tool
            }
        }

        form!(@read ToolSpec from ToolFields { position: [f32; 2] } $($property: $type)*);
        form!(@read Placeable from PlaceableFields {} $($property: $type)*);
    };
    (@read $name:ident from $fields:ident { $($own:ident: $of_own:ty)? } $($property:ident: $type:ty)*) => {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct $fields {
            r#type: ToolKind,
            $($own: $of_own,)?
            $($property: Option<$type>,)*
        }

        impl From<$fields> for $name {
            fn from(fields: $fields) -> Self {
                let form = Form { $($property: fields.$property),* };
                Self { kind: fields.r#type, $($own: fields.$own,)? form }
            }
        }
    };
}

form! {
    /// Polygons: centre to corner; box: side; circle: radius; segments: length. Units.
    size: f64 => size,
    /// Rotation in radians, counter-clockwise.
    angle: f64 => angle,
    /// Half the thickness of a segment, in units.
    radius: f64 => radius,
    /// Elasticity.
    elasticity: f64 => elasticity,
    /// Friction coefficient.
    friction: f64 => friction,
    /// Cannon: momentum it gives. Fan: force it exerts.
    force: f64 => force,
    /// Belt and ladder: speed in units/s.
    vel: f64 => velocity,
    /// Constrained hinge and see-saw: largest angle of the plank, in radians.
    max_angle: f64 => max_angle,
    /// See-saw: the weight is on the right, the left end up.
    on_left: bool => on_left,
    /// See-saw: mass of the weight.
    ball_mass: f64 => weight,
    /// Planks: if it exceeds 1, the excess is the fraction of its velocity and spin that a ball in contact loses in
    /// every step.
    roll_friction: f64 => roll_friction,
}
