//! The arguments of the command line.

mod dynamics;
mod examples;
mod physics;
mod runs;
mod selection;
mod studies;
mod tasks;

pub use dynamics::{Clusters, Dynamics, DynamicsEvaluate, DynamicsTrain};
pub use examples::{command, grouped};
pub use physics::{Env, Play};
pub use runs::{Compare, Delete, Evaluate, Export, Figures, Fork, Rename, Resume, Runs, Show, Train};
pub use selection::{Selection, SelectionEvaluate, SelectionTrain};
pub use studies::{Report, Reproduce, Script, Sweep};
pub use tasks::{Puzzles, PuzzlesBench, PuzzlesGenerate, Tasks, TasksCommand};

use std::path::{Path, PathBuf};

use clap::builder::RangedU64ValueParser;
use clap::{Args, Parser, Subcommand};

use crate::tui::Notify;
use mge_base::atomic::Target;
use mge_figures::DEFAULT_DPI;

/// Intuitive-physics puzzles, learned dynamics models and model-guided exploration.
///
/// Without a command it opens the workbench in the terminal.
#[derive(Debug, Parser)]
#[command(name = "mge", version = env!("MGE_VERSION"), max_term_width = 100)]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Option<Command>,
    #[command(flatten)]
    pub workbench: Workbench,
}

/// A number from 1 to `most`.
fn count(most: u64) -> RangedU64ValueParser<usize> {
    RangedU64ValueParser::new().range(1..=most)
}

/// The first of consecutive seeds, of which at most a million follow.
fn first_seed() -> RangedU64ValueParser<u64> {
    RangedU64ValueParser::new().range(..=u64::MAX - 1_000_000)
}

/// Options of work in several jobs.
#[derive(Debug, Args)]
pub struct Jobs {
    /// Number of concurrent jobs [default: all cores]
    #[arg(long, value_parser = count(1024))]
    pub threads: Option<usize>,
    /// No progress on stderr
    #[arg(long)]
    pub quiet: bool,
}

/// The option to replace any files.
#[derive(Debug, Args)]
pub struct Force {
    /// Also replace tasks, and files that this program did not write
    #[arg(long)]
    pub force: bool,
}

impl Force {
    /// A file or folder to write to.
    pub fn target(&self, path: &Path) -> Target {
        Target { force: self.force, ..path.into() }
    }
}

/// The option to print data for programs.
#[derive(Debug, Args)]
pub struct Format {
    /// As JSON
    #[arg(long)]
    pub json: bool,
}

/// Options for figures.
#[derive(Debug, Args)]
pub struct Print {
    /// Dots per inch of PNGs
    #[arg(long, default_value_t = DEFAULT_DPI, value_parser = clap::value_parser!(u32).range(1..=2400))]
    pub dpi: u32,
}

#[derive(Debug, Args)]
pub struct Workbench {
    /// Folder of a run to open, with its task
    #[arg(value_name = "RUN")]
    pub run: Option<PathBuf>,
    /// Task to open: the name of a shipped task, or a file; by default the one opened last, at first task1
    #[arg(long)]
    pub task: Option<String>,
    /// Folder for runs
    #[arg(long, env = "MGE_RUNS", default_value = "runs")]
    pub runs: PathBuf,
    /// Forget the task, the settings and the screen that earlier sessions with this folder of runs have left
    #[arg(long)]
    pub fresh: bool,
    /// Do not capture the mouse
    #[arg(long)]
    pub no_mouse: bool,
    /// How to announce that a training is finished or has failed: the terminal's bell, a notification (OSC 9),
    /// or not at all
    #[arg(long, env = "MGE_NOTIFY", default_value = "bell")]
    pub notify: Notify,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// List and check tasks, and propose subgoals
    Tasks(Tasks),
    /// Generate puzzles, and train methods on them
    #[command(subcommand)]
    Puzzles(Puzzles),
    /// Simulate scenes: JSON Lines in, one trajectory per line out
    Simulate,
    /// Replay actions in a task, or recorded CREATE episodes (JSON Lines in and out)
    Play(Play),
    /// Serve tasks as environments for other programs
    #[command(subcommand)]
    Env(Env),
    /// Train and evaluate dynamics models
    #[command(subcommand)]
    Dynamics(Dynamics),
    /// Train and evaluate agents that choose among CREATE's tools
    #[command(subcommand)]
    Selection(Selection),
    /// Compute the action clusters of a task, as JSON
    Clusters(Clusters),
    /// Train an agent: a few minutes for the default 2000 episodes
    Train(Train),
    /// Print every effective setting of a method or a file of settings, with its source, as JSON
    Config {
        /// A method, or a file of settings as for `mge train --config`
        #[arg(value_name = "METHOD|FILE")]
        name: PathBuf,
    },
    /// Continue runs from their latest checkpoints
    Resume(Resume),
    /// Train a new run that branches off another at an episode, with other settings
    Fork(Fork),
    /// List runs: their states, progress, success and the time since they last changed
    Runs(Runs),
    /// Show a run: its state, the settings that differ from the defaults, results and notes
    Show(Show),
    /// Compare two runs: the settings in which they differ, and their results
    Compare(Compare),
    /// Move runs to the trash beside them, or bring them back
    Delete(Delete),
    /// Give a run another name, in lists, legends, figures and reports
    Rename(Rename),
    /// Play the greedy policy of a run
    Evaluate(Evaluate),
    /// Save the actor of a run as a safetensors file
    Export(Export),
    /// Draw the learning curves of runs
    Figures(Figures),
    /// Run a workbench script
    Script(Script),
    /// Train many agents or dynamics models: all combinations of the values in a sweep file
    Sweep(Sweep),
    /// Write tables and figures of runs: report.md, report.html and report.json
    Report(Report),
    /// Reproduce the whole study in one folder, with a report: the paper's figures, and all main methods from noisy
    /// starts; some hours on two cores, nine minutes with --quick
    Reproduce(Reproduce),
    /// Print the manual page: `mge man > mge.1`
    Man {
        /// Print Markdown instead: the page docs/reference.md
        #[arg(long)]
        markdown: bool,
    },
    /// Print the completions of a shell
    Completions {
        /// The shell
        shell: clap_complete::Shell,
    },
}
