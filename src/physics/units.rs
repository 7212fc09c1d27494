//! Lengths, times and limits. The screen is 84 x 84 units with the origin at the lower left;
//! outside this module positions are normalised to [-1, 1].

/// Width and height of the screen in units.
pub const SCREEN: f32 = 84.0;
/// Duration of one physics step in seconds.
pub const PHYSICS_DT: f32 = 1.0 / 30.0;
/// Physics steps between two actions.
pub const STEPS_PER_ACTION: u32 = 40;
/// Time between two actions in seconds (the paper's 1.33 s).
pub const ACTION_INTERVAL: f32 = STEPS_PER_ACTION as f32 * PHYSICS_DT;
/// CREATE's gravity in units per second squared.
pub const GRAVITY: [f32; 2] = [0.0, -2.0];

/// More objects of one kind than this are refused.
pub const MAX_OBJECTS: usize = 64;
/// A resting ball may sink this far into what it lies on, in units; a start deeper
/// inside a tool is refused.
pub const START_OVERLAP: f32 = 0.5;

/// A normalised position in units.
pub fn to_units(normalised: [f32; 2]) -> [f32; 2] {
    normalised.map(|n| (n + 1.0) / 2.0 * SCREEN)
}

/// A position in units, normalised: the screen is [-1, 1] in both axes.
pub fn to_normalised(units: [f32; 2]) -> [f32; 2] {
    units.map(|p| 2.0 * p / SCREEN - 1.0)
}
