//! The numbers of a tool that users can change, and which tools have them.

use super::Form;
use mge_base::by_name;
use mge_base::validation::{ValidationError, in_range};
use mge_physics::{Tool, ToolKind};

/// A number of a tool, by its name in task files. Angles are in degrees here, in radians in files.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Property {
    /// Polygons: centre to corner; box: side; circle: radius; segments: length. Units.
    #[default]
    Size,
    /// Rotation, counter-clockwise.
    Angle,
    /// Half the thickness of a segment, in units.
    Radius,
    /// Elasticity.
    Elasticity,
    /// Friction coefficient.
    Friction,
    /// Cannon: momentum it gives. Fan: force it exerts.
    Force,
    /// Belt and ladder: speed in units/s.
    Velocity,
    /// Constrained hinge and see-saw: largest angle of the plank.
    MaxAngle,
    /// See-saw: 1 if the weight is on the right, the left end up; otherwise 0.
    OnLeft,
    /// See-saw: mass of the weight.
    BallMass,
    /// Planks: if it exceeds 1, the excess is the fraction of its velocity and spin that a ball in contact loses in
    /// every step.
    RollFriction,
}

/// Properties and their new values.
pub type Values = Vec<(Property, f64)>;

/// A row of [`PROPERTIES`].
struct Row {
    unit: &'static str,
    /// Change per key press.
    step: f64,
    belongs_to: fn(ToolKind) -> bool,
    /// The allowed range, for properties whose unit differs from that of [`Tool::check`].
    range: Option<[f64; 2]>,
    /// Reads it from a tool and writes it to a form, both in the units of files.
    of: fn(&Tool) -> f64,
    set: fn(&mut Form, f64),
}

/// The unit of angles, which files have in radians.
const DEGREES: &str = "degrees";

/// The row of a field of [`Form`], which is the named field of a [`Tool`].
macro_rules! number {
    ($name:ident: $field:ident) => {
        Row {
            unit: "",
            step: 0.1,
            belongs_to: |_| true,
            range: None,
            of: |tool| tool.$field,
            set: |form, value| form.$name = Some(value),
        }
    };
}

/// Every property, in the order of [`Property`].
static PROPERTIES: [Row; 11] = {
    use ToolKind::{Circle, SeeSaw};
    const ON_LEFT: Row = Row {
        of: |tool| f64::from(u8::from(tool.on_left)),
        set: |form, value| form.on_left = Some(value >= 0.5),
        ..number!(size: size)
    };
    [
        Row { unit: "units", step: 0.5, belongs_to: ToolKind::has_size, ..number!(size: size) },
        Row {
            unit: DEGREES,
            step: 15.0,
            belongs_to: |kind| kind != Circle && !kind.is_hinged(),
            range: Some([-360.0, 360.0]),
            ..number!(angle: angle)
        },
        Row { unit: "units", step: 0.5, belongs_to: ToolKind::is_segment, ..number!(radius: radius) },
        Row { belongs_to: |kind| !kind.is_sensor(), ..number!(elasticity: elasticity) },
        Row { belongs_to: |kind| !kind.is_sensor(), ..number!(friction: friction) },
        Row { step: 10.0, belongs_to: ToolKind::has_force, ..number!(force: force) },
        Row { unit: "units/s", step: 1.0, belongs_to: ToolKind::has_velocity, ..number!(vel: velocity) },
        Row {
            unit: DEGREES,
            step: 15.0,
            belongs_to: ToolKind::has_max_angle,
            range: Some([0.0, 90.0]),
            ..number!(max_angle: max_angle)
        },
        Row { step: 1.0, belongs_to: |kind| kind == SeeSaw, range: Some([0.0, 1.0]), ..ON_LEFT },
        Row { step: 1.0, belongs_to: |kind| kind == SeeSaw, ..number!(ball_mass: weight) },
        Row { step: 0.05, belongs_to: ToolKind::is_hinged, ..number!(roll_friction: roll_friction) },
    ]
};

/// Computed as in CREATE's catalogue, so that its tools are reproduced exactly.
fn radians(degrees: f64) -> f64 {
    degrees * std::f64::consts::PI / 180.0
}

/// Rounds to six decimals, which removes the rounding errors of conversions and sums.
fn rounded(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}

impl Property {
    fn row(self) -> &'static Row {
        &PROPERTIES[self as usize]
    }

    /// Its unit; empty for plain numbers.
    pub fn unit(self) -> &'static str {
        self.row().unit
    }

    /// The properties of tools of a type, in their order.
    pub fn of_kind(kind: ToolKind) -> impl DoubleEndedIterator<Item = Self> + Clone {
        Self::ALL.into_iter().filter(move |property| (property.row().belongs_to)(kind))
    }

    /// Its value.
    pub fn of(self, tool: &Tool) -> f64 {
        let value = (self.row().of)(tool);
        rounded(if self.row().unit == DEGREES { value.to_degrees() } else { value })
    }

    /// Its value after some steps; angles wrap around.
    pub fn stepped(self, tool: &Tool, steps: f64) -> f64 {
        let value = self.of(tool) + steps * self.row().step;
        match self {
            Self::Angle => rounded(value.rem_euclid(360.0)),
            Self::OnLeft => value.clamp(0.0, 1.0),
            Self::Size => rounded(value.max(0.5)),
            _ => rounded(value),
        }
    }

    /// The properties of a tool that differ from its type's defaults.
    pub fn unusual(tool: &Tool) -> Values {
        let usual = Tool::new(tool.kind, tool.position);
        let values = Self::of_kind(tool.kind).map(|property| (property, property.of(tool)));
        values.filter(|(property, value)| *value != property.of(&usual)).collect()
    }
}

by_name!(Property, "property", {
    Size = "size", Angle = "angle", Radius = "radius", Elasticity = "elasticity", Friction = "friction", Force = "force",
    Velocity = "vel", MaxAngle = "max_angle", OnLeft = "on_left", BallMass = "ball_mass", RollFriction = "roll_friction"
});

impl Form {
    /// The form with these properties replaced, for a tool of a type.
    ///
    /// # Errors
    /// When a tool of the type has no such property, or a value with a range here is outside it. Other values are
    /// checked with the task.
    pub fn with(mut self, kind: ToolKind, values: &[(Property, f64)]) -> Result<Self, ValidationError> {
        for &(property, value) in values {
            if Property::of_kind(kind).all(|own| own != property) {
                let own: Vec<&str> = Property::of_kind(kind).map(Property::name).collect();
                let message = format_args!("a {kind} has none: it has {}", own.join(", "));
                return Err(ValidationError::new(property, message));
            }
            if let Some([low, high]) = property.row().range {
                in_range(value, property, low, high)?;
            }
            (property.row().set)(&mut self, if property.row().unit == DEGREES { radians(value) } else { value });
        }
        Ok(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mge_physics::{NO_OP, catalogue_tool};

    #[test]
    fn properties_are_read_back_as_set_for_every_type() {
        for kind in ToolKind::ALL {
            for property in Property::of_kind(kind) {
                let tool = Tool::new(kind, [0.0; 2]);
                let value = property.stepped(&tool, if property.of(&tool) > 1.0 { -1.0 } else { 1.0 });
                let changed = Form::default().with(kind, &[(property, value)]).unwrap().apply(tool);
                assert_eq!(property.of(&changed), value, "{kind} {property}");
                assert_ne!(changed, tool, "{kind} {property}");
                assert_eq!(Property::unusual(&changed), [(property, value)], "{kind} {property}");
                assert_eq!(property.name().parse(), Ok(property));
            }
        }
    }

    #[test]
    fn every_catalogue_tool_is_its_type_with_its_unusual_properties() {
        for number in 0..NO_OP {
            let tool = catalogue_tool(number).unwrap();
            let form = Form::default().with(tool.kind, &Property::unusual(tool)).unwrap();
            form.check(tool.kind).unwrap();
            let made = form.apply(Tool::new(tool.kind, tool.position));
            assert_eq!((made.angle, made.max_angle), (tool.angle, tool.max_angle), "{number}");
            let values = |tool: &Tool| Property::of_kind(tool.kind).map(|own| own.of(tool)).collect::<Vec<_>>();
            assert_eq!(values(&made), values(tool), "{number}");
        }
    }

    #[test]
    fn missing_properties_and_angles_out_of_range_are_refused() {
        let said = |kind, property, value| Form::default().with(kind, &[(property, value)]).unwrap_err().to_string();
        let circle = said(ToolKind::Circle, Property::Angle, 45.0);
        assert_eq!(circle, "angle: a circle has none: it has size, elasticity, friction");
        assert!(said(ToolKind::Fan, Property::Angle, f64::NAN).starts_with("angle: is NaN"));
        let plank = said(ToolKind::SeeSaw, Property::MaxAngle, 100.0);
        assert_eq!(plank, "max_angle: is 100, but must be a number from 0 to 90");
        let unknown = "elastcity".parse::<Property>().unwrap_err();
        assert!(unknown.ends_with("did you mean `elasticity`?"), "{unknown}");
    }

    #[test]
    fn angles_wrap_around() {
        let mut tool = Tool::new(ToolKind::Ramp, [0.0; 2]);
        assert_eq!(Property::Angle.stepped(&tool, -1.0), 345.0);
        tool.angle = radians(345.0);
        assert_eq!(Property::Angle.stepped(&tool, 1.0), 0.0);
    }
}
