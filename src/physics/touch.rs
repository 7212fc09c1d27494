//! Objects of the world and what touches what.

/// An object of the world, by the order in which its kind was added.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ObjectId {
    /// A ball, or a box that moves.
    Ball(usize),
    /// A tool.
    Tool(usize),
    /// A sensor.
    Sensor(usize),
}

/// A ball overlapped an object when a step looked for collisions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Touch {
    /// Index of the ball.
    pub ball: usize,
    /// What it touched.
    pub object: ObjectId,
}
