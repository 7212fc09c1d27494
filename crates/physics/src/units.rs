//! Lengths, times and limits. The screen is 84 x 84 units with the origin at the lower left;
//! outside this module positions are normalised to [-1, 1].

use std::ops::{Add, Div, Mul, Sub};

/// Width and height of the screen in units.
pub const SCREEN: f32 = 84.0;
/// Duration of one physics step in seconds.
pub const PHYSICS_DT: f32 = 1.0 / 30.0;
/// [`PHYSICS_DT`] in the precision of the physics.
pub(super) const DT: f64 = 1.0 / 30.0;
/// Physics steps between two actions.
pub const STEPS_PER_ACTION: u32 = 40;
/// CREATE's gravity in units per second squared.
pub const GRAVITY: [f32; 2] = [0.0, -2.0];

/// Largest number of objects of one kind.
pub const MAX_OBJECTS: usize = 64;
/// How far inside a tool a ball may start, in units: as far as in one of CREATE's levels.
pub const START_OVERLAP: f32 = 1.0;

/// The decimal number that a single-precision number stands for: 0.1 for the `f32` nearest to 0.1. Files and users
/// give decimals, and the physics uses double precision.
pub fn exact(value: f32) -> f64 {
    // Below 8, neighbouring numbers are less than a millionth apart, so that a decimal of at most six places that
    // rounds to the number is the only one.
    let rounded = (f64::from(value) * 1e6).round() / 1e6;
    if value.abs() < 8.0 && rounded as f32 == value {
        return rounded;
    }
    if value.fract() == 0.0 {
        return value.into();
    }
    // The text of a number always parses.
    value.to_string().parse().unwrap_or(f64::NAN)
}

/// Converts a normalised position to units.
pub fn to_units<T>(normalised: [T; 2]) -> [T; 2]
where
    T: Copy + From<f32> + Add<Output = T> + Div<Output = T> + Mul<Output = T>,
{
    normalised.map(|n| (n + 1.0.into()) / 2.0.into() * SCREEN.into())
}

/// Normalises a position in units: the screen is [-1, 1] in both axes.
pub fn to_normalised<T>(units: [T; 2]) -> [T; 2]
where
    T: Copy + From<f32> + Sub<Output = T> + Div<Output = T> + Mul<Output = T>,
{
    units.map(|p| T::from(2.0) * p / SCREEN.into() - 1.0.into())
}
