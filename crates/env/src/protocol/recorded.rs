//! Tools in the format of the recordings made in CREATE.

use serde::Deserialize;

use mge_base::validation::ValidationError;
use mge_physics::{Tool, ToolKind, to_units};
use mge_task::{Form, read_with_form};

/// A tool of a recording. Its position is `pos_norm` if present, which is exact, while `pos` is rounded. Corners, end
/// points and joints are computed, not read.
#[derive(Debug, Clone, Deserialize)]
#[serde(from = "Fields")]
pub(super) struct RecordedTool {
    /// Its type.
    pub kind: ToolKind,
    pos: Option<[f64; 2]>,
    pos_norm: Option<[f64; 2]>,
    length: Option<f64>,
    thickness: Option<f64>,
    sensor: Option<bool>,
    /// Its number in the catalogue.
    pub tool_id: Option<usize>,
    /// Its name in a level.
    pub name: Option<String>,
    form: Form,
}

read_with_form!(RecordedTool from Fields {
    pos: Option<[f64; 2]>,
    pos_norm: Option<[f64; 2]>,
    length: Option<f64>,
    thickness: Option<f64>,
    sensor: Option<bool>,
    tool_id: Option<usize>,
    name: Option<String>,
} ignoring { variant create_type shape vertices a b plank weight joints role dynamic split kind });

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
        let Self { kind, length, thickness, form, .. } = *self;
        let measure = kind.measure();
        let misplaced = [
            ("length", length.is_some() && measure != "length"),
            ("size", form.size.is_some() && (measure == "radius" || length.is_some())),
            ("thickness", thickness.is_some() && !kind.is_segment()),
        ];
        if let Some((name, _)) = misplaced.iter().find(|(_, is_misplaced)| *is_misplaced) {
            return Err(ValidationError::new(name, format_args!("does not belong to a {kind}: remove it")));
        }
        // Other shapes have sharp corners; recordings may give their radius as 0.
        let rounding = form.radius.or(thickness.map(|thickness| (thickness / 2.0).floor()));
        let rounding = rounding.filter(|radius| kind.is_segment() || *radius != 0.0);
        let (size, radius) = if measure == "radius" { (form.radius, None) } else { (length.or(form.size), rounding) };
        if size.is_none() && kind.has_size() {
            return Err(ValidationError::new(measure, format_args!("is missing: a {kind} needs it")));
        }
        let form = Form { size, radius, ..form };
        form.check(kind).map_err(|problem| match problem.path.as_str() {
            "size" => ValidationError { path: measure.to_owned(), ..problem },
            _ => problem,
        })?;
        if self.sensor.is_some_and(|sensor| sensor != kind.is_sensor()) {
            let message = format_args!("must be {} for a {kind}: remove it", kind.is_sensor());
            return Err(ValidationError::new("sensor", message));
        }
        let tool = form.apply(Tool::new(kind, position));
        tool.check()?;
        Ok(tool)
    }
}
