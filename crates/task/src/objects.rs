//! The moving objects of a scene, and the regions that the ball must reach.

use serde::{Deserialize, Serialize};

use mge_physics::{Ball, Motion, exact, to_units};

/// Radius of CREATE's balls and stars, and default radius of regions, in units.
pub const STANDARD_RADIUS: f32 = 4.0;

/// A ball and its start.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BallSpec {
    /// Normalised start of the centre.
    pub position: [f32; 2],
    /// Start velocity in units/s.
    #[serde(default)]
    pub velocity: [f32; 2],
    /// Radius in units.
    #[serde(default = "default_radius")]
    pub radius: f32,
    /// Mass.
    #[serde(default = "default_mass")]
    pub mass: f32,
    /// Elasticity.
    #[serde(default = "one")]
    pub elasticity: f32,
    /// Friction coefficient.
    #[serde(default = "one")]
    pub friction: f32,
}

impl BallSpec {
    /// A ball of CREATE's standard size and material, at rest.
    pub fn at(position: [f32; 2]) -> Self {
        Self { position, velocity: [0.0; 2], radius: STANDARD_RADIUS, mass: 10.0, elasticity: 1.0, friction: 1.0 }
    }

    /// Size and material of the ball.
    pub fn material(&self) -> Ball {
        Ball { radius: self.radius, mass: self.mass, elasticity: self.elasticity, friction: self.friction }
    }

    /// Initial motion, in units and in the precision of the physics.
    pub fn motion(&self) -> Motion {
        motion(self.position, self.velocity)
    }
}

/// A moving box and its start.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoxSpec {
    /// Normalised start of the centre.
    pub position: [f32; 2],
    /// Start velocity in units/s.
    #[serde(default)]
    pub velocity: [f32; 2],
    /// Side in units.
    #[serde(default = "default_side")]
    pub size: f32,
    /// Mass.
    #[serde(default = "default_mass")]
    pub mass: f32,
    /// Elasticity.
    #[serde(default = "one")]
    pub elasticity: f32,
    /// Friction coefficient.
    #[serde(default = "one")]
    pub friction: f32,
}

impl BoxSpec {
    /// Size and material of the box.
    pub fn material(&self) -> Ball {
        let Self { size, mass, elasticity, friction, .. } = *self;
        Ball { radius: size / 2.0, mass, elasticity, friction }
    }

    /// Initial motion, in units and in the precision of the physics.
    pub fn motion(&self) -> Motion {
        motion(self.position, self.velocity)
    }
}

/// A marker ball and its rules.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Marker {
    /// The marker ball.
    pub ball: BallSpec,
    /// The target counts as moved once it is farther than this from its start, normalised and divided by the square
    /// root of 8.
    #[serde(default = "default_move_threshold")]
    pub move_threshold: f32,
    /// The move counts only once the marker has touched the target.
    #[serde(default)]
    pub must_hit: bool,
    /// Regions that the marker ball is rewarded for touching at the end of an action, each once, in any order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub subgoals: Vec<Region>,
}

/// A circular region the ball must touch.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Region {
    /// Normalised centre.
    pub position: [f32; 2],
    /// Radius in units.
    #[serde(default = "default_radius")]
    pub radius: f32,
}

/// The final goal.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Goal {
    /// Normalised centre.
    pub position: [f32; 2],
    /// Distance from the centre to the edge (circle, ball), to a vertex (star) or to a side (basket), in units.
    #[serde(default = "default_radius")]
    pub radius: f32,
    /// Its shape.
    #[serde(default)]
    pub shape: GoalShape,
}

/// CREATE's kinds of goal, and the circle of our tasks.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum GoalShape {
    /// A disc that detects the ball.
    #[default]
    Circle,
    /// A five-pointed star; the engine keeps its convex hull, a pentagon.
    Star,
    /// A moving ball.
    Ball,
    /// An axis-aligned square that detects the ball.
    Basket,
}

impl Goal {
    /// A circle of the standard radius.
    pub fn at(position: [f32; 2]) -> Self {
        Self { position, radius: STANDARD_RADIUS, shape: GoalShape::Circle }
    }

    /// The goal as the region a rollout must reach.
    pub fn region(&self) -> Region {
        Region { position: self.position, radius: self.radius }
    }
}

/// The start of an object with a normalised position and a velocity in units/s.
fn motion(position: [f32; 2], velocity: [f32; 2]) -> Motion {
    Motion { velocity: velocity.map(exact), ..Motion::at_rest(to_units(position.map(exact))) }
}

fn default_radius() -> f32 {
    STANDARD_RADIUS
}

fn default_mass() -> f32 {
    10.0
}

fn default_side() -> f32 {
    5.0
}

fn one() -> f32 {
    1.0
}

fn default_move_threshold() -> f32 {
    0.03
}
