//! Rollouts: hits, touches, ends of episodes.

use super::*;

#[test]
fn rollouts_follow_free_flight_and_stop_at_the_stage() {
    let task = std::sync::Arc::new(task::load("task1").unwrap());
    let env = Environment::new(task.clone());
    let free = ConstantVelocity { interval: 5 };
    // Far from the ball on its first two actions.
    let actions: Vec<Action> = vec![[-0.9, -0.9], [-0.9, -0.8]];
    let found = rollouts(&free, &[env.snapshot()], std::slice::from_ref(&actions), &Stop::default()).unwrap().remove(0);
    let expected = [(actions[0], true), (actions[1], false)];
    let expected = expected.map(|(action, placed)| RolloutAction { action, placed, touched: false });
    assert_eq!(found.actions, expected);
    let mut real = env.clone();
    for (index, action) in actions.iter().enumerate() {
        real.step(*action).unwrap();
        let [x, y] = to_normalised(real.snapshot().ball().position);
        let [px, py] = found.path[8 * (index + 1)];
        assert!((x - px).abs() < 1e-3 && (y - py).abs() < 1e-3);
    }
    assert!(!found.hit && found.path.len() == 17);

    let mut below = (*task).clone();
    below.subgoals[0].position = [below.ball.position[0], 0.2];
    let below = std::sync::Arc::new(below);
    let start = Environment::new(below.clone());
    let found = rollouts(&free, &[start.snapshot()], &[vec![[-0.9, -0.9]; 8]], &Stop::default()).unwrap().remove(0);
    assert!(found.hit && found.actions.len() < 8, "{found:?}");
    assert_eq!(found.actions.len(), found.path.len().saturating_sub(2) / 8 + 1, "it ends with the action that hits");
}

/// Predicts a ball that falls by the same distance in every prediction interval.
struct Falling(f32);

impl Predictor for Falling {
    fn interval(&self) -> u32 {
        5
    }

    fn advance(&self, balls: &[BallState], _: &[&[Tool]]) -> Result<Vec<BallState>> {
        let fall = |ball: &BallState| BallState { position: [ball.position[0], ball.position[1] - self.0], ..*ball };
        Ok(balls.iter().map(fall).collect())
    }
}

#[test]
fn a_touch_counts_only_before_the_stage_is_reached() {
    let mut task = task::load("task1").unwrap();
    let [x, y] = mge_physics::to_units(task.ball.position);
    // 16 units below its start, the ball has just passed the subgoal's upper edge.
    task.subgoals[0].position = to_normalised([x, y - 16.5]);
    let task = std::sync::Arc::new(task);
    let env = Environment::new(task.clone());
    let place = |at: [f32; 2]| {
        let action = to_normalised(at);
        let found = rollouts(&Falling(8.0), &[env.snapshot()], &[vec![action]], &Stop::default()).unwrap().remove(0);
        assert!(found.hit && found.path.len() == 3, "{found:?}");
        assert!(found.actions[0].placed, "{found:?}");
        found.actions[0].touched
    };
    assert!(place([x + 9.0, y - 8.0]), "beside the ball's path to the subgoal");
    assert!(!place([x, y - 24.9]), "near the ball only where it has reached the subgoal");
    assert!(!place([x + 12.0, y - 8.0]), "too far from its path");
}

#[test]
fn a_stage_is_reached_when_the_ball_s_surface_touches_it() {
    let mut task = task::load("task1").unwrap();
    let [x, y] = mge_physics::to_units(task.ball.position);
    // The radii of the ball and of the subgoal are 4 units each.
    for (offset, expected) in [(7.9, true), (8.1, false)] {
        task.subgoals[0].position = to_normalised([x + offset, y - 20.0]);
        let task = std::sync::Arc::new(task.clone());
        let env = Environment::new(task.clone());
        let found =
            rollouts(&Falling(6.0), &[env.snapshot()], &[vec![[-0.9, -0.9]]], &Stop::default()).unwrap().remove(0);
        assert_eq!(found.hit, expected, "{offset}");
    }
}

/// Free flight; requests a stop in its first prediction.
struct Stopping<'a>(&'a Stop);

impl Predictor for Stopping<'_> {
    fn interval(&self) -> u32 {
        5
    }

    fn advance(&self, balls: &[BallState], _: &[&[Tool]]) -> Result<Vec<BallState>> {
        assert!(!self.0.is_requested(), "it goes on after the request");
        self.0.request();
        Ok(balls.to_vec())
    }
}

#[test]
fn rollouts_end_soon_after_a_stop() {
    let env = Environment::new(std::sync::Arc::new(task::load("task1").unwrap()));
    let stop = Stop::default();
    let found = rollouts(&Stopping(&stop), &[env.snapshot()], &[vec![[-0.9, -0.9]]], &stop);
    assert!(matches!(found, Err(DynamicsError::Stopped(_))));
    // Many predictions are made in pieces.
    let (stop, many) = (Stop::default(), vec![ball(); 6000]);
    let found = Stopping(&stop).advance_until(&stop, &many, &vec![&[][..]; 6000]);
    assert!(matches!(found, Err(DynamicsError::Stopped(_))));
    let found = Falling(1.0).advance_until(&Stop::default(), &many, &vec![&[][..]; 6000]).unwrap();
    assert_eq!(found.len(), 6000);
}
