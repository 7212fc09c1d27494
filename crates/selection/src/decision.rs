//! The candidates for an action: tools of the action set at places where a ball meets them.

use rand::Rng;

use super::effect::Effect;
use super::features;
use super::flight::{Flight, NO_OP};
use mge_base::streams::index;
use mge_env::{Choice, Environment, Placement, Snapshot, uniform_action};
use mge_physics::{SCREEN, Tool, to_normalised, to_units};

/// Share of places drawn anywhere on the screen; the others are near the flight of a ball.
const ANYWHERE: f64 = 0.1;
/// Draws for each candidate that is asked for, of which those are kept that may be placed and that a ball meets.
const DRAWS: usize = 3;

/// What the agent knows before an action.
pub(super) struct Decision {
    /// What happens if nothing more is placed.
    pub(super) flight: Flight,
    /// The actions considered, the no-op first.
    pub(super) choices: Vec<Choice>,
    /// The features of all choices, one after the other.
    pub(super) rows: Vec<f32>,
}

impl Decision {
    /// At most `count` choices in the present state.
    pub(super) fn new(env: &Environment, count: usize, rng: &mut impl Rng) -> Self {
        let (state, flight) = (env.snapshot(), Flight::after(env, NO_OP));
        let common = features::of_state(state, &flight);
        let (mut choices, mut rows) = (vec![NO_OP], common.clone());
        features::of_candidate(None, &mut rows);
        let set: Vec<(usize, &Tool)> = env
            .action_set()
            .into_iter()
            .flat_map(|set| set.tools().enumerate())
            .filter_map(|(entry, tool)| Some((entry, tool?)))
            .collect();
        for _ in 0..DRAWS * count {
            if choices.len() >= count || set.is_empty() {
                break;
            }
            let (entry, tool) = set[index(rng, set.len())];
            let place = draw_place(state, &flight, tool, rng);
            let placed = tool.at(to_units(place.map(f64::from)));
            if state.check_tool(tool, place) == Placement::Placed
                && let Some(effect) = Effect::of(state, &flight, &placed)
            {
                choices.push(Choice { tool: entry, place });
                rows.extend_from_slice(&common);
                features::of_candidate(Some((&placed, &effect)), &mut rows);
            }
        }
        Self { flight, choices, rows }
    }

    /// Number of features of a choice.
    pub(super) fn width(&self) -> usize {
        self.rows.len() / self.choices.len()
    }
}

/// A place at which the tool's bounding box reaches a ball in its flight, rather soon than late, or any place.
fn draw_place(state: &Snapshot, flight: &Flight, tool: &Tool, rng: &mut impl Rng) -> [f32; 2] {
    let moving: Vec<usize> = flight.moving().collect();
    if moving.is_empty() || rng.gen_bool(ANYWHERE) {
        return uniform_action(rng);
    }
    let ball = moving[index(rng, moving.len())];
    let path = &flight.paths[ball];
    let on_screen = path.iter().take_while(|ball| ball.position.iter().all(|p| (0.0..SCREEN).contains(p))).count();
    let share: f32 = rng.gen_range(0.0..1.0);
    let passed = path[(share * share.sqrt() * on_screen as f32) as usize].position;
    let (halves, radius) = (tool.half_extents(), state.world.ball_material(ball).radius);
    let place = [0, 1].map(|axis| passed[axis] + rng.gen_range(-1.0..1.0) * (halves[axis] + radius));
    to_normalised(place).map(|value| value.clamp(-1.0, 1.0))
}
