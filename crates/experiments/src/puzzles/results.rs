//! The results of a bench: how many puzzles each method solves, and how fast.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use serde::Serialize;

use super::index::Index;
use crate::error::ExperimentError;
use mge_base::markdown;
use mge_figures::{Figure, Provenance};
use mge_results::{AREA, CHARGED_AREA, Groups, LearningRow, ReportFolder, Score, reached};
use mge_stats::Bootstrap;
use mge_stats::rolling::WINDOW;

/// Minimum success rate of a solved puzzle.
pub(super) const SOLVED: f64 = 0.8;

/// Groups of puzzles by the share of episodes of uniform play that reach the goal: the least of each, and its name.
pub(super) const GROUPS: [(f64, &str); 4] = [
    (1.0 / 3e3, "1 of 3,000 or more"),
    (1.0 / 1e4, "1 of 3,000 to 10,000"),
    (1.0 / 3e4, "1 of 10,000 to 30,000"),
    (0.0, "fewer than 1 of 30,000"),
];

/// The group of a puzzle with this rate.
pub(super) fn group_of(rate: f64) -> Option<usize> {
    GROUPS.iter().position(|(least, _)| *least <= rate)
}

/// Trainings on generated puzzles.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BenchResults {
    /// The command that reproduces them.
    pub command: String,
    /// Version of the program that wrote them.
    pub mge_version: String,
    /// The puzzles.
    pub index: Index,
    /// Number of episodes of the longest training.
    pub episodes: u64,
    /// One row per training.
    pub runs: Vec<LearningRow>,
}

impl BenchResults {
    /// The results of trainings on the puzzles of `index`; runs of other tasks are left out.
    pub fn new(command: &str, index: Index, mut rows: Vec<LearningRow>) -> Self {
        rows.retain(|row| index.puzzles.iter().any(|puzzle| puzzle.name == row.task));
        Self {
            command: command.to_owned(),
            mge_version: mge_base::identity::version().to_owned(),
            episodes: rows.iter().map(|row| row.episodes).max().unwrap_or(0),
            index,
            runs: rows,
        }
    }

    /// Writes `report.md`, `report.json` and `figures/` (at `dpi` dots per inch) into `folder`. `config_hash` is that
    /// of the trainings' settings.
    ///
    /// # Errors
    /// When a statistic cannot be computed, or a file cannot be written.
    pub fn write(&self, folder: &ReportFolder, config_hash: &str, dpi: u32) -> Result<(), ExperimentError> {
        let (_alone, figures, bootstrap) = (folder.hold()?, folder.figures()?, Bootstrap::default());
        folder.write(self, &self.to_markdown())?;
        let seeds: BTreeSet<u64> = self.runs.iter().map(|row| row.seed).collect();
        let provenance = Provenance::new(&self.command, &Vec::from_iter(seeds), config_hash);
        self.solved_curves(&bootstrap)?.write_all(&figures, "solved", &provenance, dpi)?;
        Ok(self.profile(&bootstrap)?.write_all(&figures, "profile", &provenance, dpi)?)
    }

    /// The results as Markdown tables.
    pub fn to_markdown(&self) -> String {
        let mut text = String::from("# Generated puzzles\n\n");
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "{}: {} trainings of {} episodes on {} puzzles (seed {}, start noise {}). A puzzle is \
             solved when {:.0} % of the last {WINDOW} episodes reached the goal, and held when that is so over the \
             last quarter of the training. Charged to 80 %: median of all actions in the real environment until the \
             puzzle was solved, and how many trainings did; areas are under the curve of the success rate, over charged \
             actions and over episodes. {}\n",
            markdown::made_by(&self.command, &self.mge_version),
            self.runs.len(),
            self.episodes,
            self.index.puzzles.len(),
            self.index.seed,
            self.index.start_noise,
            100.0 * SOLVED,
            self.index.selection(),
        );
        text += "## Share of trainings that solved their puzzle\n\n";
        self.write_table(&mut text, "method", &[""], |_| Some(0));
        text += "\n## By the episodes of uniform play that reach the goal\n\n";
        self.write_table(&mut text, "uniform play, method", &GROUPS.map(|(_, name)| name), |row| self.difficulty(row));
        text += "\n![Share of puzzles solved against episodes](figures/solved.png)\n\n\
                 ![Share of puzzles with a final success rate above each threshold](figures/profile.png)\n";
        text
    }

    /// The group of a run's puzzle by difficulty.
    pub(super) fn difficulty(&self, row: &LearningRow) -> Option<usize> {
        let puzzle = self.index.puzzles.iter().find(|puzzle| puzzle.name == row.task)?;
        group_of(puzzle.random_rate())
    }

    /// Writes a table with one row per group and method; `group` returns the index of a run's group in `names`.
    fn write_table(
        &self,
        text: &mut String,
        title: &str,
        names: &[&str],
        group: impl Fn(&LearningRow) -> Option<usize>,
    ) {
        let within = [self.episodes / 4, self.episodes / 2, self.episodes];
        let columns = within.map(|episodes| format!("within {episodes}"));
        let titles = [title, "trainings"].map(str::to_owned).into_iter().chain(columns);
        *text +=
            &markdown::header(titles.chain(["held", "charged to 80 %", "charged area", "area"].map(str::to_owned)));
        let all = &Groups::new(&self.runs);
        let pairs = names.iter().enumerate().flat_map(|group| all.labels().iter().map(move |method| (group, method)));
        for ((number, name), method) in pairs {
            let is_in = |row: &&LearningRow| group(row) == Some(number) && row.label() == *method;
            let rows: Vec<&LearningRow> = self.runs.iter().filter(is_in).collect();
            if rows.is_empty() {
                continue;
            }
            let share = |is: &dyn Fn(&LearningRow) -> bool| {
                let count = rows.iter().filter(|row| is(row)).count();
                format!("{:.2}", count as f64 / rows.len() as f64)
            };
            let solved =
                |least: u64| share(&|row| row.efficiency.episodes_to_80.is_some_and(|episodes| episodes <= least));
            let held = share(&|row| row.efficiency.held_success.is_some_and(|success| success >= SOLVED));
            let mean = |score: Score| {
                let scores: f64 = rows.iter().filter_map(|row| score(row)).sum();
                format!("{:.2}", scores / rows.len() as f64)
            };
            let charged = reached(rows.iter().map(|row| row.charged_to_80));
            let title = [*name, method].into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(", ");
            let cells = [title, rows.len().to_string()].into_iter().chain(within.map(solved));
            *text += &markdown::row(cells.chain([held, charged, mean(CHARGED_AREA), mean(AREA)]));
        }
    }
}
