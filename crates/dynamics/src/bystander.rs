//! Additional tools in launches: near the ball, but without effect on it.

use rand::Rng;
use rand_chacha::ChaCha8Rng;

use super::launch::gap;
use super::variety::Variety;
use mge_physics::{BallState, Tool, ToolKind};

/// Least gap between the ball's surface and a bystander, in units.
const CLEAR: f32 = 0.1;
/// Places tried for each bystander.
const TRIES: usize = 20;

/// Adds bystanders to a share of the scenes of single-tool launches. The ball does not touch them and
/// moves as if they were not there, so a model learns that such tools have no effect. Without
/// bystanders, training scenes never have more than one tool near the ball, but tasks do.
#[derive(Debug)]
pub struct Bystanders {
    /// Share of scenes that get one.
    pub share: f32,
    /// The models' cutoff: largest distance of an active edge, in units.
    pub cutoff: f32,
    /// Types of bystanders.
    pub tools: Vec<ToolKind>,
    /// Which tools of these types.
    pub variety: Variety,
    /// Random number generator.
    pub rng: ChaCha8Rng,
}

impl Bystanders {
    /// A bystander for a ball that passes through `states` in order; none if this scene is not among
    /// the share, or if no free place was found.
    pub fn draw(&mut self, states: &[BallState]) -> Option<Tool> {
        if self.share == 0.0 || self.rng.r#gen::<f32>() >= self.share {
            return None;
        }
        let kind = self.tools[self.rng.gen_range(0..self.tools.len())];
        let tool = self.variety.draw(kind, &mut self.rng);
        (0..TRIES).find_map(|_| {
            let reach = tool.half_extents().map(|half| half + self.cutoff);
            let place = [0, 1].map(|axis| states[0].position[axis] + self.rng.gen_range(-reach[axis]..reach[axis]));
            let tool = tool.at(place.map(f64::from));
            let is_near = tool.surface(states[0].position).0 <= self.cutoff;
            (is_near && states.iter().all(|state| gap(&tool, state) > CLEAR)).then_some(tool)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mge_base::streams::Stream;
    use mge_physics::{Ball, GRAVITY, World};

    fn bystanders(share: f32) -> Bystanders {
        let tools = vec![ToolKind::Wall, ToolKind::Square];
        Bystanders { share, cutoff: 8.0, tools, variety: Variety::Sizes, rng: Stream::Bystanders.of(3) }
    }

    /// The states of a ball that falls for a sixth of a second, beside `tool` if given.
    fn falls(tool: Option<Tool>) -> Vec<BallState> {
        let mut world = World::new(GRAVITY);
        tool.into_iter().for_each(|tool| _ = world.add_tool(tool));
        let ball = world.add_ball(Ball::default(), BallState::at_rest([20.0, 20.0]));
        let mut states = vec![world.ball(ball)];
        for _ in 0..5 {
            world.step();
            states.push(world.ball(ball));
        }
        states
    }

    #[test]
    fn a_bystander_is_near_the_ball_and_changes_nothing() {
        let states = falls(None);
        let mut bystanders = bystanders(1.0);
        let drawn: Vec<Tool> = (0..100).filter_map(|_| bystanders.draw(&states)).collect();
        assert!(drawn.len() > 80, "there is room");
        for tool in drawn {
            assert!(tool.surface(states[0].position).0 <= 8.0);
            assert_eq!(falls(Some(tool)), states);
        }
    }

    #[test]
    fn a_share_of_the_scenes_has_one() {
        let states = falls(None);
        let count = |share| {
            let mut bystanders = bystanders(share);
            (0..1000).filter(|_| bystanders.draw(&states).is_some()).count()
        };
        assert_eq!(count(0.0), 0);
        assert!((400..520).contains(&count(0.5)), "{}", count(0.5));
    }
}
