//! Objects of the world and touches between them.

/// An object of the world, by its index among objects of its kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ObjectId {
    /// A ball or a moving box.
    Ball(usize),
    /// A tool.
    Tool(usize),
    /// A sensor.
    Sensor(usize),
}

/// An overlap of a ball with an object, found by the collision detection of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Touch {
    /// Index of the ball.
    pub ball: usize,
    /// The object it touched.
    pub object: ObjectId,
}
