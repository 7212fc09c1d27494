//! The rules of the world, and its determinism.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sha2::{Digest, Sha256};

use super::*;

fn world() -> World {
    World::new(GRAVITY)
}

fn moving(position: [f32; 2], velocity: [f32; 2]) -> BallState {
    BallState { velocity, ..BallState::at_rest(position) }
}

fn run(world: &mut World, steps: usize) {
    (0..steps).for_each(|_| world.step());
}

fn is_near(a: [f32; 2], b: [f32; 2]) -> bool {
    (a[0] - b[0]).hypot(a[1] - b[1]) < 1e-4
}

#[test]
fn positions_move_with_the_velocity_of_the_previous_step() {
    let mut world = world();
    world.add_ball(Ball::default(), moving([40.0, 40.0], [3.0, 0.0]));
    world.step();
    assert_eq!(world.ball(0).position, [40.1, 40.0]);
    assert!(is_near(world.ball(0).velocity, [3.0, -2.0 / 30.0]));
    run(&mut world, 29);
    // One second: 30 times the sum of 0 to 29 thirtieths of gravity's gain.
    assert!(is_near(world.ball(0).position, [43.0, 40.0 - 2.0 / 900.0 * 435.0]));
}

#[test]
fn a_bounce_keeps_elasticity_and_turns_by_friction() {
    let mut world = world();
    world.add_ball(Ball::default(), moving([40.0, 15.05], [3.0, -6.0]));
    world.add_tool(Tool::new(ToolKind::Floor, [40.0, 10.0]));
    world.step();
    let ball = world.ball(0);
    assert_eq!(world.touches, [Touch { ball: 0, object: ObjectId::Tool(0) }]);
    assert!((ball.velocity[1] - 3.0).abs() < 1e-4, "{ball:?}");
    // A disc that starts to roll without slipping keeps two thirds of its speed.
    assert!((ball.velocity[0] - 2.0).abs() < 1e-4, "{ball:?}");
    assert!((ball.angular_velocity + 0.5).abs() < 1e-4, "{ball:?}");
}

#[test]
fn every_tool_is_solid_where_it_should_be() {
    for (tool, touching, clear) in [
        (Tool::new(ToolKind::Box, [40.0, 40.0]), [47.9, 40.0], [48.1, 40.0]),
        (Tool::new(ToolKind::Square, [40.0, 40.0]), [51.9, 40.0], [48.0, 46.0]),
        (Tool::new(ToolKind::Bucket, [40.0, 40.0]), [40.0, 31.8], [40.0, 31.7]),
        (Tool::new(ToolKind::Wall, [40.0, 40.0]), [44.9, 47.0], [40.0, 53.1]),
        (Tool::new(ToolKind::Floor, [40.0, 40.0]), [52.9, 40.0], [40.0, 45.1]),
        (Tool { radius: 0.0, ..Tool::new(ToolKind::Floor, [40.0, 40.0]) }, [40.0, 43.9], [40.0, 44.1]),
        (Tool { angle: 0.5, ..Tool::new(ToolKind::Box, [40.0, 40.0]) }, [41.6, 49.3], [48.4, 43.0]),
    ] {
        for (position, expected) in [(touching, true), (clear, false)] {
            let mut world = World::new([0.0; 2]);
            world.add_ball(Ball::default(), BallState::at_rest(position));
            world.add_tool(tool);
            world.step();
            assert_eq!(!world.touches.is_empty(), expected, "{tool:?} and a ball at {position:?}");
            assert_eq!(tool.surface(position).0 < 4.0, expected, "{tool:?} and a ball at {position:?}");
        }
    }
}

#[test]
fn is_beyond_never_contradicts_the_surface_distance() {
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    let mut beyond = 0;
    for number in (0..NO_OP).step_by(7) {
        let tool = catalogue_tool(number).unwrap().at([40.0; 2]);
        for _ in 0..50 {
            let point = [0; 2].map(|_| rng.gen_range(0.0..84.0));
            let (distance, _) = tool.surface(point);
            assert!(!tool.is_beyond(point, distance), "{tool:?}, {point:?}, {distance}");
            beyond += usize::from(tool.is_beyond(point, 8.0));
        }
    }
    assert!(beyond > 5000, "few points are beyond: {beyond}");
}

#[test]
fn overlap_is_pushed_out_without_adding_speed() {
    let mut world = World::new([0.0; 2]);
    // The ball slides, because at rest it would fall asleep first.
    world.add_ball(Ball::default(), moving([40.0, 14.0], [1.0, 0.0]));
    world.add_tool(Tool { friction: 0.0, ..Tool::new(ToolKind::Floor, [40.0, 10.0]) });
    run(&mut world, 60);
    let ball = world.ball(0);
    assert!((ball.velocity[0] - 1.0).abs() < 1e-6 && ball.velocity[1].abs() < 1e-6, "{ball:?}");
    // A tenth of a unit is not corrected.
    assert!((14.89..14.91).contains(&ball.position[1]), "{ball:?}");
}

#[test]
fn a_bucket_captures_from_above_only() {
    let bucket = Tool::new(ToolKind::Bucket, [40.0, 40.0]);
    for (start, velocity, captured) in [
        ([40.0, 50.0], [0.0, -6.0], true),
        ([41.0, 50.0], [0.0, -6.0], true),
        ([30.0, 40.0], [6.0, 0.0], false),
        ([40.0, 30.0], [0.0, 6.0], false),
    ] {
        let mut world = world();
        world.add_ball(Ball::default(), moving(start, velocity));
        world.add_tool(bucket);
        run(&mut world, 40);
        assert_eq!(world.is_captured(0), captured, "{start:?}");
        assert_eq!((world.ball(0).position == bucket.centre()), captured, "{start:?}");
        if captured {
            assert!(is_near(world.ball(0).velocity, [0.0, -2.0 / 30.0]));
            run(&mut world, 400);
            assert!(world.ball(0).position == bucket.centre() && !world.is_asleep(0));
        }
    }
}

#[test]
fn sensors_detect_and_do_not_push() {
    let mut world = world();
    world.add_ball(Ball::default(), BallState::at_rest([40.0, 50.0]));
    let mut free = world.clone();
    let circle = world.add_sensor(&Sensor::Circle { position: [40.0, 44.0], radius: 3.0 });
    let star = world.add_sensor(&Sensor::Star { position: [40.0, 30.0], radius: 4.0 });
    let seen = |world: &World, sensor| world.touches.contains(&Touch { ball: 0, object: ObjectId::Sensor(sensor) });
    world.step();
    free.step();
    assert!(seen(&world, circle) && world.overlaps_sensor(0, circle));
    assert!(!seen(&world, star) && !world.overlaps_sensor(0, star));
    run(&mut world, 119);
    run(&mut free, 119);
    assert_eq!(world.ball(0), free.ball(0));
    assert!(seen(&world, star));
    world.remove_sensor(star);
    world.step();
    assert!(!seen(&world, star) && !world.overlaps_sensor(0, star));
}

#[test]
fn an_overlap_that_is_not_measured_is_found_at_the_same_places() {
    use super::closest::Side;
    use super::collide::collide;
    use super::outline::Outline;
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let star = Outline::hull(&tool_kind::regular(5, tool_kind::STAR_TURN, 4.0));
    let square = Outline::rectangle(5.0, 5.0);
    for second in [&star, &square] {
        let second = Side { outline: second, bounds: &second.bounds(), number: 1 };
        let mut hints = [0; 2];
        let mut counts = [0; 2];
        for _ in 0..5000 {
            let centre = [0; 2].map(|_| rng.gen_range(-9.0..9.0)).into();
            let first = Outline::Disc { centre, radius: 4.0 };
            let first = Side { outline: &first, bounds: &first.bounds(), number: 0 };
            let [measured, seen] = [true, false].map(|measures| {
                let touching = collide(first, second, hints[usize::from(measures)], measures);
                hints[usize::from(measures)] = touching.hint;
                !touching.points().is_empty()
            });
            assert_eq!(measured, seen, "{centre}");
            counts[usize::from(seen)] += 1;
        }
        assert!(counts.iter().all(|&count| count > 1000), "{counts:?}");
    }
}

#[test]
fn equal_balls_exchange_their_velocities() {
    let mut world = World::new([0.0; 2]);
    world.add_ball(Ball::default(), moving([30.0, 40.0], [6.0, 0.0]));
    world.add_ball(Ball::default(), moving([50.0, 40.0], [-3.0, 0.0]));
    run(&mut world, 60);
    assert!(is_near(world.ball(0).velocity, [-3.0, 0.0]));
    assert!(is_near(world.ball(1).velocity, [6.0, 0.0]));
}

#[test]
fn a_resting_ball_sleeps_until_an_awake_one_touches_it() {
    let mut world = world();
    world.add_ball(Ball::default(), BallState::at_rest([40.0, 15.0]));
    world.add_tool(Tool { elasticity: 0.0, ..Tool::new(ToolKind::Floor, [40.0, 10.0]) });
    run(&mut world, 60);
    assert!(world.is_asleep(0));
    let rest = world.ball(0);
    world.add_tool(Tool::new(ToolKind::Wall, [20.0, 40.0]));
    run(&mut world, 100);
    assert_eq!(world.ball(0), rest, "a new tool wakes nothing");
    let ball = world.add_ball(Ball::default(), moving([40.0, 30.0], [0.0, -6.0]));
    let touched = |world: &World| world.touches.contains(&Touch { ball, object: ObjectId::Ball(0) });
    while !touched(&world) {
        assert!(world.is_asleep(0));
        world.step();
    }
    assert!(!world.is_asleep(0));
    run(&mut world, 3000);
    assert!(world.is_asleep(0), "balls that come to rest together sleep again");
}

#[test]
fn degenerate_starts_stay_finite() {
    for kind in ToolKind::ALL {
        let mut world = world();
        world.add_tool(Tool::new(kind, [40.0, 40.0]));
        world.add_ball(Ball::default(), BallState::at_rest([40.0, 40.0]));
        world.add_ball(Ball::default(), BallState::at_rest([40.0, 40.0]));
        run(&mut world, 200);
        for ball in [0, 1] {
            let state = world.ball(ball);
            let numbers = [state.position, state.velocity, [state.angle, state.angular_velocity]];
            assert!(numbers.as_flattened().iter().all(|number| number.is_finite()), "{kind}: {state:?}");
        }
    }
}

#[test]
fn the_tool_table_is_in_the_order_of_tool_kinds() {
    for (index, kind) in ToolKind::ALL.into_iter().enumerate() {
        assert_eq!(kind.index(), index);
        assert_eq!(kind.name().parse(), Ok(kind));
    }
    assert_eq!(ToolKind::PAPER[..], ToolKind::ALL[..5]);
}

#[test]
fn exact_values_are_the_shortest_decimals() {
    let mut number = numbers(7);
    for round in 0..200_000 {
        let value = match round % 3 {
            0 => number(-10.0, 10.0) as f32,
            1 => (number(-10.0, 10.0) * 1e6).round() as f32 / 1e6,
            _ => (number(-1.0, 1.0) * 1e-5) as f32,
        };
        let decimal: f64 = value.to_string().parse().unwrap();
        assert_eq!(exact(value).to_bits(), decimal.to_bits(), "{value}");
    }
}

#[test]
fn the_share_of_overlap_removed_per_step_uses_single_precision() {
    let kept = f64::from(1.0_f32 - 0.1_f32).powf(60.0);
    assert!((contact::BIAS_SHARE - (1.0 - kept.powf(1.0 / 30.0))).abs() < 1e-16);
}

/// Total kinetic energy.
fn energy(world: &World) -> f64 {
    let moving = world.bodies.iter().skip(1);
    moving.map(|body| (body.mass * body.velocity.length_squared() + body.moment * body.spin * body.spin) / 2.0).sum()
}

/// A pseudo-random number generator.
fn numbers(seed: u64) -> impl FnMut(f64, f64) -> f64 {
    let mut state = seed;
    move |low, high| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * ((state >> 11) as f64 / (1u64 << 53) as f64)
    }
}

/// A random tool of a type and a ball thrown at it.
fn throw(kind: ToolKind, seed: u64) -> (Tool, Motion) {
    let mut number = numbers(seed);
    let tool = Tool {
        angle: if kind == ToolKind::Ladder { 1.66 } else { number(0.0, 3.1) },
        elasticity: number(0.0, 1.0),
        max_angle: number(0.1, 1.0),
        weight: number(1.0, 10.0),
        ..Tool::new(kind, [42.0, 42.0])
    };
    let (angle, speed) = (number(0.0, std::f64::consts::TAU), number(3.0, 25.0));
    let (x, y) = (angle.cos(), angle.sin());
    let aim = angle + number(-0.3, 0.3);
    let velocity = [-speed * aim.cos(), -speed * aim.sin()];
    (tool, Motion { velocity, ..Motion::at_rest([42.0 + 20.0 * x, 42.0 + 20.0 * y]) })
}

#[test]
fn energy_grows_only_where_a_tool_adds_it() {
    use ToolKind::*;
    let gives = [Cannon, Fan, Belt, Ladder];
    // These relocate bodies.
    let moves = [Funnel, Bucket];
    let is_plain = |kind: &ToolKind| !gives.contains(kind) && !moves.contains(kind) && !kind.is_hinged();
    for kind in ToolKind::ALL.into_iter().filter(is_plain) {
        for seed in 0..20 {
            let (tool, motion) = throw(kind, seed);
            // Without gravity, which would offset the energy added when overlapping bodies are pushed apart.
            let mut world = World::new([0.0; 2]);
            world.add_tool(tool);
            world.add_ball(Ball::default(), motion);
            let mut before = energy(&world);
            for step in 0..60 {
                world.step();
                let after = energy(&world);
                assert!(after <= before + 1e-9, "{kind}, seed {seed}, step {step}: {before} to {after}");
                before = after;
            }
        }
    }
    for kind in [Cannon, Fan, Belt, Ladder, Trampoline] {
        let grows = |seed| {
            let (tool, motion) = throw(kind, seed);
            let mut world = World::new([0.0; 2]);
            world.add_tool(Tool { elasticity: 1.2, ..tool });
            world.add_ball(Ball::default(), motion);
            let before = energy(&world);
            run(&mut world, 60);
            energy(&world) > before + 1.0
        };
        assert!((0..40).any(grows), "{kind} gives no energy");
    }
}

#[test]
fn mirrored_scenes_give_mirrored_trajectories() {
    use ToolKind::*;
    let mirror = |[x, y]: [f64; 2]| [84.0 - x, y];
    for kind in [Bucket, Square, Box, Wall, Floor, Ramp, Circle, Triangle, Pentagon, Hexagon, Hinge, Fan, Belt] {
        for seed in 0..10 {
            let (tool, motion) = throw(kind, seed);
            let turned = match kind {
                Triangle => Tool { angle: std::f64::consts::PI - tool.angle, ..tool },
                Pentagon => Tool { angle: std::f64::consts::PI - tool.angle, ..tool },
                Fan => Tool { angle: std::f64::consts::PI - tool.angle, ..tool },
                Belt => Tool { velocity: -tool.velocity, angle: -tool.angle, ..tool },
                _ => Tool { angle: -tool.angle, ..tool },
            };
            let [vx, vy] = motion.velocity;
            let reflected = Motion { velocity: [-vx, vy], ..Motion::at_rest(mirror(motion.position)) };
            let (mut a, mut b) = (world(), world());
            a.add_tool(tool);
            b.add_tool(turned);
            a.add_ball(Ball::default(), motion);
            b.add_ball(Ball::default(), reflected);
            for step in 0..60 {
                a.step();
                b.step();
                let (a, b) = (a.motion(0).position, mirror(b.motion(0).position));
                let error = (a[0] - b[0]).hypot(a[1] - b[1]);
                assert!(error < 1e-6, "{kind}, seed {seed}, step {step}: {a:?} and {b:?}");
            }
        }
    }
}

/// A screen with every tool type, balls and boxes.
fn everything() -> World {
    let mut world = world();
    for (index, kind) in ToolKind::ALL.into_iter().enumerate() {
        let place = [8.0 + 17.0 * (index % 5) as f64, 10.0 + 17.0 * (index / 5) as f64];
        world.add_tool(Tool::new(kind, place).with_size(6.0));
    }
    let mut number = numbers(7);
    for _ in 0..4 {
        let motion = Motion { velocity: [number(-9.0, 9.0), 0.0], ..Motion::at_rest([number(9.0, 75.0), 84.0]) };
        world.add_ball(Ball { radius: 2.0, ..Ball::default() }, motion);
        let motion = Motion { velocity: [number(-9.0, 9.0), 0.0], ..Motion::at_rest([number(9.0, 75.0), 92.0]) };
        world.add_box(Ball { radius: 2.0, mass: 30.0, elasticity: 0.1, friction: 1.0 }, motion);
    }
    world
}

#[test]
fn a_snapshot_of_everything_continues_bit_for_bit() {
    let mut world = everything();
    let state = |world: &World| -> Vec<u64> {
        let numbers = |body: &body::Body| {
            [body.position.x, body.position.y, body.velocity.x, body.velocity.y, body.angle, body.spin]
                .map(f64::to_bits)
        };
        world.bodies.iter().flat_map(numbers).collect()
    };
    for _ in 0..12 {
        let mut copy = world.clone();
        run(&mut world, 37);
        let mut other = everything();
        other.clone_from(&copy);
        for again in [&mut copy, &mut other] {
            run(again, 37);
            assert_eq!(state(again), state(&world));
            assert_eq!(&again.touches, &world.touches);
        }
    }
    assert!(state(&world).into_iter().all(|bits| f64::from_bits(bits).is_finite()));
}

/// Three bouncing balls in a pen with the paper's tool types.
fn pen() -> World {
    let mut world = world();
    for (position, velocity) in [([20.0, 60.0], [9.0, 2.0]), ([45.0, 62.0], [-7.0, 4.0]), ([60.0, 30.0], [5.0, -11.0])]
    {
        world.add_ball(Ball::default(), moving(position, velocity));
    }
    let lively = |tool: Tool| Tool { elasticity: 1.0, ..tool };
    for (kind, position) in
        [(ToolKind::Wall, [1.0, 42.0]), (ToolKind::Wall, [83.0, 42.0]), (ToolKind::Floor, [42.0, 83.0])]
    {
        world.add_tool(lively(Tool::new(kind, position).with_size(90.0)));
    }
    world.add_tool(lively(Tool::new(ToolKind::Floor, [42.0, 1.0]).with_size(90.0)));
    world.add_tool(lively(Tool::new(ToolKind::Box, [25.0, 25.0])));
    world.add_tool(lively(Tool::new(ToolKind::Square, [60.0, 50.0])));
    // Upside down, so that it captures nothing.
    world.add_tool(Tool { angle: std::f64::consts::PI, ..lively(Tool::new(ToolKind::Bucket, [42.0, 20.0])) });
    world.add_sensor(&Sensor::Circle { position: [42.0, 60.0], radius: 4.0 });
    world
}

fn digest(world: &mut World, steps: usize, digest: &mut Sha256) {
    for _ in 0..steps {
        world.step();
        for ball in 0..world.ball_count() {
            let BallState { position, velocity, angle, angular_velocity } = world.ball(ball);
            let numbers = [position, velocity, [angle, angular_velocity]];
            numbers.as_flattened().iter().for_each(|number| digest.update(number.to_bits().to_le_bytes()));
        }
        digest.update([world.touches.len() as u8]);
    }
}

fn pen_digest() -> String {
    let mut sha = Sha256::new();
    digest(&mut pen(), 10_000, &mut sha);
    format!("{:x}", sha.finalize())
}

#[test]
fn segments_on_one_line_obstruct_one_another_at_any_distance() {
    let belt = |position: [f64; 2]| Tool { size: 8.0, ..Tool::new(ToolKind::Belt, position) };
    let mut world = World::new(GRAVITY);
    world.add_tool(belt([59.595_9, 0.0]));
    assert!(world.is_obstructed(&belt([9.572_2, 0.0])), "as in CREATE");
    assert!(!world.is_obstructed(&belt([9.572_2, 0.001])));
}

#[test]
fn ten_thousand_steps_give_the_same_bytes() {
    assert_eq!(pen_digest(), PEN_DIGEST);
}

#[test]
fn a_restored_snapshot_continues_with_the_same_bytes() {
    let mut sha = Sha256::new();
    let mut world = pen();
    for _ in 0..100 {
        let snapshot = world.clone();
        // Changes after the snapshot must leave no trace in it.
        world.add_tool(Tool::new(ToolKind::Box, [42.0, 42.0]));
        run(&mut world, 50);
        world.clone_from(&snapshot);
        digest(&mut world, 100, &mut sha);
    }
    assert_eq!(format!("{:x}", sha.finalize()), PEN_DIGEST);
}

#[test]
fn worlds_on_other_threads_do_not_disturb_one_another() {
    std::thread::scope(|scope| {
        let threads: Vec<_> = (0..4).map(|_| scope.spawn(pen_digest)).collect();
        for thread in threads {
            assert_eq!(thread.join().unwrap(), PEN_DIGEST);
        }
    });
}

/// Digest of the states of all balls and the numbers of touches of [`pen`] over 10,000 steps. It changes only when
/// the physics changes.
const PEN_DIGEST: &str = "f3cc537df271402ca053a2511e6a9f7f538014ba86aaaae7eade2267acd3a990";
