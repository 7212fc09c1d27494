//! Equivalent rotations of tools, and mirror images.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::tool::Tool;
use super::tool_kind::ToolKind;

impl Tool {
    /// The same tool with the smallest equivalent angle from 0 upwards: a ramp is the same after half a turn.
    pub fn with_least_angle(mut self) -> Self {
        let period = self.kind.period();
        let angle = self.angle.rem_euclid(period);
        // An angle just below a whole period is a rounding error of 0.
        self.angle = if period - angle < 1e-9 { 0.0 } else { angle };
        self
    }

    /// The mirror image about the vertical line at `axis` (units). None for a cannon: its body is rotated to one
    /// side, wherever it points.
    pub fn mirrored(mut self, axis: f64) -> Option<Self> {
        use ToolKind::{Belt, Bucket, Cannon, Funnel, SeeSaw};
        self.position[0] = 2.0 * axis - self.position[0];
        match self.kind {
            Cannon => return None,
            // Their angle is measured at the upper side, not at a corner or along a direction.
            Bucket | Funnel => self.angle = 0.0 - self.angle,
            SeeSaw => self.on_left = !self.on_left,
            Belt => (self.angle, self.velocity) = (PI - self.angle, -self.velocity),
            _ => self.angle = PI - self.angle,
        }
        Some(self.with_least_angle())
    }
}

impl ToolKind {
    /// The angle after which a tool of the type looks and acts the same, in radians.
    fn period(self) -> f64 {
        match self {
            Self::Ramp | Self::Trampoline | Self::Wall | Self::Floor | Self::Belt => PI,
            Self::Square | Self::Box => FRAC_PI_2,
            Self::Triangle => TAU / 3.0,
            Self::Pentagon => TAU / 5.0,
            Self::Hexagon => TAU / 6.0,
            _ => TAU,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Ball, BallState, GRAVITY, NO_OP, SCREEN, World, catalogue_tool};

    const AXIS: f64 = SCREEN as f64 / 2.0;

    /// The position of a ball after falling for 30 steps near the middle of the screen.
    fn falls(tool: Tool, side: f32) -> [f32; 2] {
        let mut world = World::new(GRAVITY);
        world.add_tool(tool);
        let x = AXIS as f32 + side * 2.5;
        let state = BallState { velocity: [side, -7.0], ..BallState::at_rest([x, 58.0]) };
        let ball = world.add_ball(Ball::default(), state);
        (0..30).for_each(|_| world.step());
        world.ball(ball).position
    }

    #[test]
    fn a_mirrored_tool_acts_as_the_mirror_image_of_the_tool() {
        let mut compared = 0;
        for number in (0..NO_OP).step_by(29) {
            let tool = catalogue_tool(number).unwrap().at([AXIS + 1.0, 44.0]);
            let Some(mirrored) = tool.mirrored(AXIS) else { continue };
            let ([x, y], [mirrored_x, mirrored_y]) = (falls(tool, 1.0), falls(mirrored, -1.0));
            let apart = (x + mirrored_x - SCREEN).hypot(y - mirrored_y);
            assert!(apart < 0.05, "{number}, {}: {apart}", tool.kind);
            compared += 1;
        }
        assert!(compared > 60);
    }

    #[test]
    fn catalogue_tools_have_the_least_angle_and_mirroring_twice_is_the_identity() {
        for tool in (0..NO_OP).filter_map(catalogue_tool) {
            assert_eq!(tool.with_least_angle(), *tool);
            let Some(image) = tool.mirrored(AXIS) else { continue };
            let again = image.mirrored(AXIS).unwrap();
            assert!((again.angle - tool.angle).abs() < 1e-9, "{tool:?}");
            assert_eq!(Tool { angle: tool.angle, ..again }, *tool);
        }
        let turned = Tool { angle: -PI / 6.0, ..Tool::new(ToolKind::Ramp, [0.0; 2]) }.with_least_angle();
        assert!((turned.angle - 5.0 * PI / 6.0).abs() < 1e-9);
    }
}
