//! Figure 4: actions sampled from the clusters, over each scene.

use super::Figure;
use super::canvas::{Canvas, Pen};
use super::geometry::ellipse;
use super::layout::{LEGEND, Mark, around_panels};
use super::scene::{Position, SceneView};
use super::style::{Color, GREEN, MARGIN, WHITE, faded, stage_color};
use super::table::Table;
use super::tasks::{cells, heading, page_size};
use mge_guidance::{ActionPrior, Cluster};
use mge_task::Task;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Sampled actions over the scenes of the tasks.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ActionSamples {
    /// One panel per task.
    pub tasks: Vec<TaskActions>,
}

/// A task, and the actions for each of its stages.
#[derive(Debug, Clone, PartialEq)]
pub struct TaskActions {
    /// The scene.
    pub task: Task,
    /// Subgoals in order, then the goal.
    pub stages: Vec<StageActions>,
}

/// The clusters of one stage and actions sampled from them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct StageActions {
    /// Sampled actions: normalised tool positions.
    pub samples: Vec<Position>,
    /// The clusters they come from.
    pub clusters: Vec<Cluster>,
}

/// Number of actions sampled per stage.
const SAMPLES_PER_STAGE: usize = 200;

impl TaskActions {
    /// The clusters of a prior, and actions sampled from them with the seed. A stage without clusters has no samples.
    pub fn sample(task: &Task, prior: &ActionPrior, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let stages = prior.stages.iter().map(|stage| StageActions {
            samples: match stage.clusters.is_empty() {
                true => Vec::new(),
                false => (0..SAMPLES_PER_STAGE).map(|_| stage.sample(&mut rng)).collect(),
            },
            clusters: stage.clusters.clone(),
        });
        Self { task: task.clone(), stages: stages.collect() }
    }

    fn draw(&self, view: &SceneView<'_>, canvas: &Canvas) {
        view.task(&self.task);
        for (n, stage) in self.stages.iter().enumerate() {
            let color = stage_color(n, self.stages.len());
            for sample in stage.samples.iter().filter(|sample| view.shows(**sample)) {
                canvas.dot(view.at(*sample), 1.1, faded(color, 0.45));
            }
        }
        for (n, stage) in self.stages.iter().enumerate() {
            let name = if n + 1 == self.stages.len() { "G".to_owned() } else { (n + 1).to_string() };
            for cluster in &stage.clusters {
                draw_cluster(view, cluster, &name, stage_color(n, self.stages.len()));
            }
        }
        view.names(&self.task, faded(WHITE, 0.75))
    }
}

/// The note that explains the shapes.
const SHAPES: &str = "Dots: tool placements sampled from the action clusters of the stage of their colour. Ellipses: one (solid) and two \
                      (dashed) standard deviations around the cluster mean, which has the name of its stage.";

/// Draws the stage's name at the mean, and ellipses at one and two standard deviations.
fn draw_cluster(view: &SceneView<'_>, cluster: &Cluster, name: &str, color: Color) {
    let center = view.at(cluster.mean);
    let edge = view.at([cluster.mean[0] + cluster.std[0], cluster.mean[1] + cluster.std[1]]);
    let radii = [edge[0] - center[0], center[1] - edge[1]];
    if !radii.iter().chain(&center).all(|value| value.is_finite()) {
        return;
    }
    let clear = faded(WHITE, 0.0);
    view.shape(&ellipse(center, radii), clear, Pen::new(color, 1.0));
    view.shape(&ellipse(center, radii.map(|r| 2.0 * r)), clear, Pen::new(color, 0.7).dashed(&[2.0, 1.4]));
    view.name(cluster.mean, name, color, faded(WHITE, 0.85));
}

impl Figure for ActionSamples {
    fn size(&self) -> [f64; 2] {
        page_size(self.tasks.len(), LEGEND, SHAPES)
    }

    fn draw(&self, canvas: &Canvas) {
        let empty = self.tasks.is_empty().then_some("no sampled actions");
        let most = self.tasks.iter().map(|task| task.stages.len()).max().unwrap_or(0);
        let mut marks: Vec<(Mark, String)> = (0..most.saturating_sub(1))
            .map(|n| (Mark::Dot(stage_color(n, most)), format!("subgoal {}", n + 1)))
            .collect();
        marks.push((Mark::Dot(GREEN), "goal (G)".to_owned()));
        let Some(rect) = around_panels(canvas, canvas.page().inset(MARGIN), empty, SHAPES, &marks) else { return };
        for (actions, (cell, window)) in self.tasks.iter().zip(cells(rect, self.tasks.len())) {
            let title = format!("{}: {}", heading(&actions.task.name), actions.task.placeable.kind);
            let view = SceneView::new(canvas, cell, &title, window);
            actions.draw(&view, canvas);
        }
    }

    fn table(&self) -> Table {
        let mut table = Table::new(["task", "stage", "kind", "x", "y", "std_x", "std_y", "weight"]);
        for actions in &self.tasks {
            for (n, stage) in actions.stages.iter().enumerate() {
                let (task, order) = (&actions.task.name, n + 1);
                for Cluster { mean: [x, y], std: [sx, sy], weight, .. } in &stage.clusters {
                    table.push(&[task, &order, &"cluster", x, y, sx, sy, weight]);
                }
                for [x, y] in &stage.samples {
                    table.push(&[task, &order, &"sample", x, y]);
                }
            }
        }
        table
    }
}
