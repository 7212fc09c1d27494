//! A random walk through the screens: what is shown is consistent after every event.

use super::*;

/// Keys that move between screens, episodes, curves, runs and layers.
const WALK: &str = "1 2 3 4 5 6 7 8 left right up down pageup pagedown home end space enter esc tab s v b i g a P r u \
                    z Z 0 9 p x y n V B C X { } f / o : ? . , I";

#[test]
fn the_screen_stays_consistent_on_random_walks() {
    use rand::seq::SliceRandom;
    use rand::{Rng, SeedableRng};

    let keys: Vec<&str> = WALK.split_whitespace().collect();
    for seed in 0..6 {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let view = [typical, grouped, failed, empty][seed as usize % 4]();
        let (mut app, _) = app(view);
        let mut walked = Vec::new();
        for step in 0..300 {
            let key = *keys.choose(&mut rng).unwrap();
            walked.push(key);
            press(&mut app, key);
            if step % 10 == 0 {
                shot(&mut app, 120, 40);
                mouse(&mut app, MouseEventKind::Down(MouseButton::Left), (rng.gen_range(0..120), rng.gen_range(0..40)));
                mouse(&mut app, MouseEventKind::Up(MouseButton::Left), (0, 0));
            }
            if app.is_leaving() {
                break;
            }
            let subject = &app.subject;
            let context = || format!("seed {seed}, after {}", walked.join(" "));
            assert!(subject.episode.task == subject.task, "{}", context());
            let clusters = subject.clusters.as_ref().map(|clusters| clusters.prior.stages.len());
            assert!(clusters.is_none_or(|stages| stages == subject.task.stage_count()), "{}", context());
            if let Some(episode) = subject.past_episode() {
                let is_of_watched = subject.run().is_some_and(|run| subject.episode.is_of(&run.path));
                assert!(is_of_watched, "{}", context());
                let crosshair = app.screens.curves.crosshair;
                assert!(crosshair.is_none_or(|at| at == episode as f32), "{crosshair:?} {episode}: {}", context());
            }
        }
    }
}
