//! Lengths, times and limits. The screen is 84 x 84 units with the origin at the lower left;
//! outside this module positions are normalised to [-1, 1].

use std::ops::{Add, Div, Mul, Sub};

/// Width and height of the screen in units.
pub const SCREEN: f32 = 84.0;
/// Duration of one physics step in seconds.
pub const PHYSICS_DT: f32 = 1.0 / 30.0;
/// The same in the precision of the physics.
pub(super) const DT: f64 = 1.0 / 30.0;
/// Physics steps between two actions.
pub const STEPS_PER_ACTION: u32 = 40;
/// CREATE's gravity in units per second squared.
pub const GRAVITY: [f32; 2] = [0.0, -2.0];

/// More objects of one kind than this are refused.
pub const MAX_OBJECTS: usize = 64;
/// A ball may start this far inside a tool, in units, as one of CREATE's levels has it; a start deeper
/// is refused.
pub const START_OVERLAP: f32 = 1.0;

/// The decimal number that one in single precision stands for: 0.1 for the number nearest to
/// it. Files and people give decimals, and the physics is in double precision.
pub fn exact(value: f32) -> f64 {
    if value.fract() == 0.0 {
        return value.into();
    }
    // The shortest text of a number is one.
    value.to_string().parse().unwrap_or(f64::NAN)
}

/// A normalised position in units.
pub fn to_units<T>(normalised: [T; 2]) -> [T; 2]
where
    T: Copy + From<f32> + Add<Output = T> + Div<Output = T> + Mul<Output = T>,
{
    normalised.map(|n| (n + 1.0.into()) / 2.0.into() * SCREEN.into())
}

/// A position in units, normalised: the screen is [-1, 1] in both axes.
pub fn to_normalised<T>(units: [T; 2]) -> [T; 2]
where
    T: Copy + From<f32> + Sub<Output = T> + Div<Output = T> + Mul<Output = T>,
{
    units.map(|p| T::from(2.0) * p / SCREEN.into() - 1.0.into())
}
