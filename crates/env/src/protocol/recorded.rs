//! Objects in the format of the recordings made in CREATE.

use serde::Deserialize;
use serde::de::IgnoredAny;

use mge_base::validation::ValidationError;
use mge_physics::{Tool, ToolKind, to_units};
use mge_task::Form;

/// A tool of a recording. Its position is `pos_norm` if present, which is exact, while `pos` is rounded. Corners, end
/// points and joints are computed, not read.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RecordedTool {
    #[serde(rename = "type")]
    pub kind: ToolKind,
    pos: Option<[f64; 2]>,
    pos_norm: Option<[f64; 2]>,
    size: Option<f64>,
    length: Option<f64>,
    angle: Option<f64>,
    radius: Option<f64>,
    thickness: Option<f64>,
    elasticity: Option<f64>,
    friction: Option<f64>,
    force: Option<f64>,
    vel: Option<f64>,
    max_angle: Option<f64>,
    on_left: Option<bool>,
    ball_mass: Option<f64>,
    roll_friction: Option<f64>,
    sensor: Option<bool>,
    /// Its number in the catalogue.
    pub tool_id: Option<usize>,
    #[serde(default, rename = "variant")]
    _variant: IgnoredAny,
    #[serde(default, rename = "create_type")]
    _create_type: IgnoredAny,
    #[serde(default, rename = "shape")]
    _shape: IgnoredAny,
    #[serde(default, rename = "vertices")]
    _vertices: IgnoredAny,
    #[serde(default, rename = "a")]
    _a: IgnoredAny,
    #[serde(default, rename = "b")]
    _b: IgnoredAny,
    #[serde(default, rename = "plank")]
    _plank: IgnoredAny,
    #[serde(default, rename = "weight")]
    _weight: IgnoredAny,
    #[serde(default, rename = "joints")]
    _joints: IgnoredAny,
    #[serde(default, rename = "name")]
    _name: IgnoredAny,
    #[serde(default, rename = "role")]
    _role: IgnoredAny,
    #[serde(default, rename = "dynamic")]
    _dynamic: IgnoredAny,
    #[serde(default, rename = "split")]
    _split: IgnoredAny,
    #[serde(default, rename = "kind")]
    _kind: IgnoredAny,
}

impl RecordedTool {
    /// The tool at its recorded position.
    ///
    /// # Errors
    /// When the position or the size is missing, or a number is out of range.
    pub fn tool(&self) -> Result<Tool, ValidationError> {
        let place = self.pos_norm.map(to_units).or(self.pos);
        self.tool_at(place.ok_or_else(|| ValidationError::new("pos_norm", "is missing"))?)
    }

    /// The tool at another position, in units.
    ///
    /// # Errors
    /// When the size is missing or a number is out of range.
    pub fn tool_at(&self, position: [f64; 2]) -> Result<Tool, ValidationError> {
        let kind = self.kind;
        let name = kind.measure();
        let does_not_belong =
            |name: &str| Err(ValidationError::new(name, format_args!("does not belong to a {kind}: remove it")));
        if self.length.is_some() && (name != "length" || self.size.is_some()) {
            return does_not_belong(if name == "length" { "size" } else { "length" });
        }
        if self.thickness.is_some() && !kind.is_segment() {
            return does_not_belong("thickness");
        }
        if self.size.is_some() && name == "radius" {
            return does_not_belong("size");
        }
        let size = match name {
            "length" => self.length.or(self.size),
            "radius" => self.radius,
            _ => self.size,
        };
        if size.is_none() && kind.has_size() {
            return Err(ValidationError::new(name, format_args!("is missing: a {kind} needs it")));
        }
        let thickness = self.thickness.map(|thickness| (thickness / 2.0).floor());
        let form = Form {
            size,
            // Other shapes have sharp corners; recordings may give their radius as 0.
            radius: match name {
                "radius" => None,
                _ => self.radius.or(thickness).filter(|radius| kind.is_segment() || *radius != 0.0),
            },
            angle: self.angle,
            elasticity: self.elasticity,
            friction: self.friction,
            force: self.force,
            vel: self.vel,
            max_angle: self.max_angle,
            on_left: self.on_left,
            ball_mass: self.ball_mass,
            roll_friction: self.roll_friction,
        };
        form.check(kind).map_err(|problem| match problem.path.as_str() {
            "size" => ValidationError { path: name.to_owned(), ..problem },
            _ => problem,
        })?;
        let tool = form.apply(Tool::new(kind, position));
        if self.sensor.is_some_and(|sensor| sensor != self.kind.is_sensor()) {
            let message = format_args!("must be {} for a {}: remove it", self.kind.is_sensor(), self.kind);
            return Err(ValidationError::new("sensor", message));
        }
        tool.check()?;
        Ok(tool)
    }
}
