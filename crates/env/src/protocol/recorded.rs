//! The objects of CREATE's recordings: tools, balls, boxes, goals and subgoals.

use serde::Deserialize;

use super::lines::Ignored;
use mge_base::validation::ValidationError;
use mge_physics::{Tool, ToolKind, to_normalised, to_units};
use mge_task::{BallSpec, BoxSpec, Form, Goal, GoalShape, Region, STANDARD_RADIUS};

/// A recorded object. Its position is `pos_norm` if present, which is exact, while `pos` is rounded. Corners, end
/// points and joints are computed, not read.
#[expect(dead_code, reason = "the ignored fields are never read")]
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Recorded {
    /// Its type; empty for the moving bodies of scenes, which have a `shape`.
    #[serde(default)]
    pub r#type: String,
    pub shape: Option<String>,
    pub dynamic: Option<bool>,
    /// Its name in a level.
    pub name: Option<String>,
    /// Its number in the catalogue of tools.
    pub tool_id: Option<usize>,
    pos: Option<[f64; 2]>,
    pos_norm: Option<[f64; 2]>,
    mass: Option<f64>,
    size: Option<f64>,
    length: Option<f64>,
    radius: Option<f64>,
    thickness: Option<f64>,
    angle: Option<f64>,
    elasticity: Option<f64>,
    friction: Option<f64>,
    force: Option<f64>,
    vel: Option<f64>,
    max_angle: Option<f64>,
    on_left: Option<bool>,
    ball_mass: Option<f64>,
    roll_friction: Option<f64>,
    sensor: Ignored,
    variant: Ignored,
    create_type: Ignored,
    role: Ignored,
    moment: Ignored,
    vertices: Ignored,
    a: Ignored,
    b: Ignored,
    plank: Ignored,
    weight: Ignored,
    joints: Ignored,
    split: Ignored,
    kind: Ignored,
}

impl Recorded {
    /// The tool at its recorded position.
    ///
    /// # Errors
    /// When the position or the size is missing, or a number is out of range.
    pub fn tool(&self) -> Result<Tool, ValidationError> {
        let place = self.pos_norm.map(to_units).or(self.pos);
        self.tool_at(place.ok_or_else(|| missing("pos_norm"))?)
    }

    /// The tool at another position, in units.
    ///
    /// # Errors
    /// As [`form`](Self::form), and when the position is out of range.
    pub fn tool_at(&self, position: [f64; 2]) -> Result<Tool, ValidationError> {
        let (kind, form) = self.form()?;
        let tool = form.apply(Tool::new(kind, position));
        tool.check()?;
        Ok(tool)
    }

    /// The tool's type and its numbers.
    ///
    /// # Errors
    /// When it is no tool, the size is missing or a number is out of range.
    pub fn form(&self) -> Result<(ToolKind, Form), ValidationError> {
        let kind: ToolKind = self.r#type.parse().map_err(|problem| ValidationError::new("type", problem as String))?;
        let measure = kind.measure();
        let size = match measure {
            "radius" => self.radius,
            "length" => self.length,
            _ => self.size,
        };
        if size.is_none() && kind.has_size() {
            return Err(ValidationError::new(measure, format_args!("is missing: a {kind} needs it")));
        }
        // Other shapes have sharp corners; recordings may give their radius as 0.
        let rounding = self.radius.or(self.thickness.map(|thickness| (thickness / 2.0).floor()));
        let radius = rounding.filter(|radius| measure != "radius" && (kind.is_segment() || *radius != 0.0));
        let form = Form {
            size,
            angle: self.angle,
            radius,
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
            "size" => ValidationError { path: measure.to_owned(), ..problem },
            _ => problem,
        })?;
        Ok((kind, form))
    }

    /// The ball at a normalised position; numbers that are missing are those of CREATE.
    pub fn ball(&self, position: [f32; 2]) -> BallSpec {
        let usual = BallSpec::at(position);
        BallSpec {
            radius: single(self.radius).unwrap_or(usual.radius),
            mass: single(self.mass).unwrap_or(usual.mass),
            elasticity: single(self.elasticity).unwrap_or(usual.elasticity),
            friction: single(self.friction).unwrap_or(usual.friction),
            ..usual
        }
    }

    /// The moving box at a normalised position, with the material of a ball.
    ///
    /// # Errors
    /// When the size is missing.
    pub fn moving_box(&self, position: [f32; 2]) -> Result<BoxSpec, ValidationError> {
        let size = single(self.size).ok_or_else(|| missing("size"))?;
        let BallSpec { velocity, mass, elasticity, friction, .. } = self.ball(position);
        Ok(BoxSpec { position, velocity, size, mass, elasticity, friction })
    }

    /// The subgoal.
    ///
    /// # Errors
    /// When position or radius are missing.
    pub fn region(&self) -> Result<Region, ValidationError> {
        let radius = single(self.radius).ok_or_else(|| missing("radius"))?;
        Ok(Region { position: self.position()?, radius })
    }

    /// The goal.
    ///
    /// # Errors
    /// When it is of an unknown type or its position is missing.
    pub fn goal(&self) -> Result<Goal, ValidationError> {
        let (shape, radius) = match self.r#type.as_str() {
            "goal_star" => (GoalShape::Star, None),
            "goal_ball" => (GoalShape::Ball, single(self.radius)),
            "basket" => (GoalShape::Basket, Some(single(self.size).unwrap_or(10.0) / 2.0)),
            other => return Err(ValidationError::new("type", format_args!("`{other}` is not a goal of CREATE"))),
        };
        Ok(Goal { position: self.position()?, radius: radius.unwrap_or(STANDARD_RADIUS), shape })
    }

    /// The normalised position.
    ///
    /// # Errors
    /// When it is missing.
    pub fn position(&self) -> Result<[f32; 2], ValidationError> {
        let place = self.pos_norm.map(|at| at.map(|p| p as f32));
        let rounded = || self.pos.map(|at| to_normalised(at.map(|p| p as f32)));
        place.or_else(rounded).ok_or_else(|| missing("pos_norm"))
    }
}

fn single(value: Option<f64>) -> Option<f32> {
    value.map(|value| value as f32)
}

fn missing(name: &str) -> ValidationError {
    ValidationError::new(name, "is missing")
}
