//! Figure 5: how often guided and random exploration reach goals and subgoals.

use super::Figure;
use super::axes::number;
use super::bars::{BarCluster, grouped_bars};
use super::canvas::Canvas;
use super::data::{Statistics, labels};
use super::geometry::Rect;
use super::layout::{Mark, around_panels};
use super::style::{DOUBLE_COLUMN, GAP, MARGIN, series};
use super::table::Table;
use super::tasks::heading;
use mge_stats::Estimate;

/// Bars of how often each policy reached the goal and the subgoals of each task.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct HitBars {
    /// Number of episodes per count.
    pub episodes: usize,
    /// How the counts were summarised over seeds.
    pub statistics: Statistics,
    /// The tasks in order.
    pub tasks: Vec<TaskHits>,
}

/// Hit counts on one task.
#[derive(Debug, Clone, PartialEq)]
pub struct TaskHits {
    /// Name of the task.
    pub task: String,
    /// The policies, in the same order for every task.
    pub policies: Vec<PolicyHits>,
}

/// Number of episodes in which a policy reached each stage of a task.
#[derive(Debug, Clone, PartialEq)]
pub struct PolicyHits {
    /// Name of the policy, as in the legend.
    pub policy: String,
    /// Episodes that reached the final goal.
    pub goal: Estimate,
    /// Episodes that reached each subgoal, in order.
    pub subgoals: Vec<Estimate>,
}

impl HitBars {
    fn policies(&self) -> Vec<&str> {
        labels(self.tasks.iter().flat_map(|task| &task.policies).map(|hits| hits.policy.as_str()))
    }

    /// Bars of a task in legend order; a policy that was not run has an empty one.
    fn bars(&self, task: &TaskHits, stage: impl Fn(&PolicyHits) -> Option<Estimate>) -> Vec<Estimate> {
        let of = |name: &str| task.policies.iter().find(|hits| hits.policy == name).and_then(&stage);
        self.policies().into_iter().map(|name| of(name).unwrap_or(Estimate::exact(f64::NAN))).collect()
    }

    fn goals(&self) -> Vec<BarCluster> {
        let members = |task| vec![(String::new(), self.bars(task, |hits| Some(hits.goal)))];
        self.tasks.iter().map(|task| BarCluster { label: short(&task.task), members: members(task) }).collect()
    }

    fn subgoals(&self) -> Vec<BarCluster> {
        let members = |task: &TaskHits| {
            let count = task.policies.iter().map(|hits| hits.subgoals.len()).max().unwrap_or(0);
            (0..count).map(|n| ((n + 1).to_string(), self.bars(task, |hits| hits.subgoals.get(n).copied()))).collect()
        };
        self.tasks.iter().map(|task| BarCluster { label: short(&task.task), members: members(task) }).collect()
    }
}

/// "T1" for `task1`.
fn short(name: &str) -> String {
    heading(name).replace("Task ", "T")
}

impl Figure for HitBars {
    fn size(&self) -> [f64; 2] {
        [DOUBLE_COLUMN, 200.0]
    }

    fn draw(&self, canvas: &Canvas) {
        let episodes = number(self.episodes as f64, 0);
        let text = format!(
            "Counts in {episodes} episodes of each policy. {}. T1: Task 1; below the bars in (b): subgoals in order of reach.",
            self.statistics.caption("error bars")
        );
        let policies = self.policies();
        let looks = series(&policies);
        let marks: Vec<(Mark, String)> =
            looks.iter().zip(&policies).map(|(look, name)| (Mark::Patch(look.color), (*name).to_owned())).collect();
        let empty = self.tasks.is_empty().then_some("no hits were counted");
        let Some(rect) = around_panels(canvas, canvas.page().inset(MARGIN), empty, &text, &marks) else { return };
        let middle = rect.left + 0.4 * rect.width();
        let left = Rect { right: middle - GAP / 2.0, ..rect };
        let right = Rect { left: middle + GAP / 2.0, ..rect };
        let label = &format!("episodes of {episodes}");
        grouped_bars(canvas, left, ["(a) Final goal hit", label], &self.goals(), &looks);
        grouped_bars(canvas, right, ["(b) Subgoal hit", label], &self.subgoals(), &looks);
    }

    fn table(&self) -> Table {
        let mut table = Table::new(["task", "policy", "stage", "hits", "low", "high", "episodes", "seeds"]);
        for task in &self.tasks {
            for hits in &task.policies {
                let stages = (1..).map(|n: usize| format!("subgoal {n}")).zip(&hits.subgoals);
                for (stage, estimate) in stages.chain([("goal".to_owned(), &hits.goal)]) {
                    let ([value, low, high], seeds) = (estimate.values(), &self.statistics.seeds);
                    table.push(&[&task.task, &hits.policy, &stage, &value, &low, &high, &self.episodes, seeds]);
                }
            }
        }
        table
    }
}
