//! Launches as training rows: a graph and a target for every stretch of one prediction interval.

use rand::Rng;

use super::bystander::Bystanders;
use super::codec::Codec;
use super::config::ModelConfig;
use super::error::Result;
use super::graph::{GraphBuilder, Graphs};
use super::launch::{Launch, gap};
use mge_physics::{BallState, SCREEN, STEPS_PER_ACTION};

/// A stretch counts as close to a contact if the gap at either end is below this, in units.
const CLOSE: f32 = 1.0;

/// Graphs and targets of launches. An observation gives one row for each physics step at
/// which a prediction interval can start. Its mirror image gives as many more; where the tool has no
/// mirror image, the same rows are repeated.
#[derive(Debug, Clone)]
pub struct Samples {
    /// One scene per row; the rows of an observation are consecutive.
    pub graphs: Graphs,
    /// Targets, rows × outputs.
    pub targets: Vec<f32>,
    rows_per_observation: usize,
    /// Rows close to a contact, of each observation.
    close: Vec<Vec<u32>>,
}

impl Samples {
    /// The rows of `launches`, with those of their mirror images if `mirror`, and with `bystanders`.
    ///
    /// # Errors
    /// When a launch's tool is not in the builder's tool set.
    pub fn new<'a>(
        config: &ModelConfig,
        builder: &GraphBuilder,
        launches: impl IntoIterator<Item = &'a Launch>,
        mirror: bool,
        mut bystanders: Bystanders,
    ) -> Result<Self> {
        let interval = config.interval as usize;
        let stretches = STEPS_PER_ACTION as usize + 1 - interval;
        let codec = Codec::new(config);
        let mut samples = Self {
            graphs: builder.empty(),
            targets: Vec::new(),
            rows_per_observation: stretches * if mirror { 2 } else { 1 },
            close: Vec::new(),
        };
        for launch in launches {
            let mut close = Vec::new();
            for image in [false, true].into_iter().take(1 + usize::from(mirror)) {
                let mirrored = launch.tool.mirrored(f64::from(SCREEN) / 2.0).filter(|_| image);
                let reflect = |state: &BallState| if mirrored.is_some() { reflect(*state) } else { *state };
                let states: Vec<BallState> = launch.states.iter().map(reflect).collect();
                let tool = mirrored.unwrap_or(launch.tool);
                for start in 0..stretches {
                    let (before, after) = (states[start], states[start + interval]);
                    let near = |state| gap(&tool, state) < CLOSE;
                    if near(&before) || near(&after) {
                        close.push((start + usize::from(image) * stretches) as u32);
                    }
                    let bystander = bystanders.draw(&states[start..=start + interval]);
                    builder.push(&mut samples.graphs, &before, [&tool].into_iter().chain(&bystander))?;
                    codec.encode(&before, &after, &mut samples.targets);
                }
            }
            samples.close.push(close);
        }
        Ok(samples)
    }

    /// Number of observations.
    pub fn observations(&self) -> usize {
        self.close.len()
    }

    /// A random row of an observation: with probability `contact_share` one close to a contact,
    /// if there is any; otherwise any row.
    pub fn draw(&self, observation: usize, contact_share: f32, rng: &mut impl Rng) -> usize {
        let close = &self.close[observation];
        let row = if !close.is_empty() && rng.r#gen::<f32>() < contact_share {
            close[rng.gen_range(0..close.len())] as usize
        } else {
            rng.gen_range(0..self.rows_per_observation)
        };
        observation * self.rows_per_observation + row
    }
}

/// The mirror image about the vertical centre line of the screen.
fn reflect(mut state: BallState) -> BallState {
    state.position[0] = SCREEN - state.position[0];
    state.velocity[0] = -state.velocity[0];
    state.angular_velocity = -state.angular_velocity;
    state
}
