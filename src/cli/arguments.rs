//! What can be typed.

use std::path::PathBuf;

use clap::builder::RangedU64ValueParser;
use clap::{Args, Parser, Subcommand};

use crate::dynamics::{Loss, Variant};
use crate::figures::DEFAULT_DPI;
use crate::guidance::EpsilonSchedule;
use crate::physics::{MAX_OBJECTS, ToolKind, ToolSplit};
use crate::puzzles::Split;
use crate::trainer::{Method, PriorSource};
use crate::tui::Notify;

/// Intuitive-physics puzzles, learned dynamics models and model-guided exploration.
///
/// Without a command it opens the workbench in the terminal.
#[derive(Debug, Parser)]
#[command(name = "mge", version, max_term_width = 100)]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Option<Command>,
    #[command(flatten)]
    pub workbench: Workbench,
}

#[derive(Debug, Args)]
pub struct Play {
    /// Name of a shipped task, or path of a task file
    #[arg(required_unless_present = "levels", conflicts_with = "levels", requires = "actions")]
    pub task: Option<String>,
    /// JSON file of actions, [[x, y], ...], normalised to [-1, 1]
    #[arg(long, value_name = "FILE", conflicts_with = "levels")]
    pub actions: Option<PathBuf>,
    /// JSON Lines file of recorded levels; episodes are read from standard input
    #[arg(long, value_name = "FILE")]
    pub levels: Option<PathBuf>,
    /// JSON Lines file of the tools that action sets name, in place of CREATE's catalogue
    #[arg(long, value_name = "FILE", requires = "levels")]
    pub tools: Option<PathBuf>,
}

/// A number of threads.
fn threads() -> RangedU64ValueParser<usize> {
    count(1024)
}

/// A number from 1 to `most`.
fn count(most: u64) -> RangedU64ValueParser<usize> {
    RangedU64ValueParser::new().range(1..=most)
}

/// How figures are printed.
#[derive(Debug, Args)]
pub struct Print {
    /// Dots per inch of PNGs
    #[arg(long, default_value_t = DEFAULT_DPI, value_parser = clap::value_parser!(u32).range(1..=2400))]
    pub dpi: u32,
}

impl Print {
    /// The option as a part of the command that made a figure; nothing when it is the default.
    pub fn option(&self) -> String {
        if self.dpi == DEFAULT_DPI { String::new() } else { format!(" --dpi {}", self.dpi) }
    }
}

#[derive(Debug, Args)]
pub struct Workbench {
    /// Task to open: the name of a shipped task, or a file
    #[arg(long, default_value = "task1")]
    pub task: String,
    /// Folder for runs
    #[arg(long, env = "MGE_RUNS", default_value = "runs")]
    pub runs: PathBuf,
    /// File with your own keys, lines such as `train = t`
    #[arg(long, env = "MGE_KEYS")]
    pub keys: Option<PathBuf>,
    /// Leave the mouse to the terminal
    #[arg(long)]
    pub no_mouse: bool,
    /// How the terminal says that all trainings are done: its bell, a notification (OSC 9), or not at all
    #[arg(long, env = "MGE_NOTIFY", default_value = "bell")]
    pub notify: Notify,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// List, check and audit tasks
    Tasks(Tasks),
    /// Generate puzzles, and train methods on them
    #[command(subcommand)]
    Puzzles(Puzzles),
    /// Simulate scenes: JSON Lines in, one trajectory a line out
    Simulate,
    /// Replay actions in a task, or recorded CREATE episodes (JSON Lines in and out)
    Play(Play),
    /// Tasks as environments for other programs
    Env {
        #[command(subcommand)]
        command: Env,
    },
    /// Train and evaluate dynamics models
    Dynamics {
        #[command(subcommand)]
        command: Dynamics,
    },
    /// Compute the action clusters of a task, as JSON
    Clusters(Clusters),
    /// Train an agent
    Train(Train),
    /// Continue runs from their newest checkpoints, or one that another process has paused
    Resume(Resume),
    /// Train a new run that goes on from an episode of another with other settings
    Fork(Fork),
    /// Pause a run that another process trains, after its present episode
    Pause(OnRun),
    /// End a run that another process trains, with a checkpoint
    Stop(OnRun),
    /// Give a run that another process trains another epsilon schedule
    Epsilon(Epsilon),
    /// Play the greedy policy of a run
    Evaluate(Evaluate),
    /// Save the actor of a run as a safetensors file
    Export(Export),
    /// Draw the learning curves of runs
    Figures(Figures),
    /// Run a workbench script
    Script(Script),
    /// Draw screens of the workbench as it is after a script
    Screenshot(Screenshot),
    /// Train many agents or dynamics models: all combinations in a file of lists
    Sweep(Sweep),
    /// Tables and figures of runs: report.md and report.json
    Report(Report),
    /// The whole study of the paper, into one folder with a report
    Reproduce(Reproduce),
    /// Print the manual page, with all keys and script commands: `mge man > mge.1`
    Man(Man),
    /// Time the program's own work, one JSON line each
    Bench(Bench),
}

#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true)]
pub struct Tasks {
    #[command(subcommand)]
    pub command: Option<TasksCommand>,
    /// As JSON
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Subcommand)]
pub enum TasksCommand {
    /// Check task files, and play them under the environment's contract
    Check {
        /// Task files, or names of shipped tasks
        #[arg(required = true)]
        files: Vec<String>,
    },
    /// Propose subgoals for a task: prints the task with them in place of its own
    Propose {
        /// Name of a shipped task, or a task file
        task: String,
        /// Subgoals to propose, at most
        #[arg(long, default_value_t = 2, value_parser = count(MAX_OBJECTS as u64))]
        subgoals: usize,
        /// What predicts the rollouts: learned, rapier, true, or a model file
        #[arg(long, default_value = "learned")]
        model: PriorSource,
        /// Seed of the rollouts
        #[arg(long, default_value_t = 0)]
        seed: u64,
        /// Write to this file instead of stdout
        #[arg(long)]
        out: Option<PathBuf>,
    },
    /// Count how often random exploration, and that guided by the true physics, reach each stage
    Audit {
        /// Tasks; all shipped ones if none is named
        tasks: Vec<String>,
        /// Episodes for each seed and way of exploring
        #[arg(long, default_value_t = 1000, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
        episodes: u32,
        /// Number of seeds, counted from 0
        #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u64).range(1..=100_000))]
        seeds: u64,
        /// As JSON
        #[arg(long)]
        json: bool,
    },
}

#[derive(Debug, Subcommand)]
pub enum Puzzles {
    /// Generate puzzles that random play hardly ever solves and play guided by the true physics does
    Generate(PuzzlesGenerate),
    /// Propose subgoals for generated puzzles, train methods on them and report; resumes
    Bench(PuzzlesBench),
}

#[derive(Debug, Args)]
pub struct PuzzlesGenerate {
    /// Puzzles in all; those that are in the folder already are kept
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u64).range(1..=10_000))]
    pub count: u64,
    /// Seed of the layouts
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// What the puzzles are for; each has puzzles of its own for the same seed
    #[arg(long, value_enum, default_value = "test")]
    pub split: Split,
    /// Half width of the uniform noise on the ball's start, normalised
    #[arg(long, default_value_t = 0.01, value_parser = start_noise)]
    pub start_noise: f32,
    /// Actions of random play behind the random hit rate in the index
    #[arg(long, default_value_t = 1_000_000, value_parser = clap::value_parser!(u64).range(1..=1_000_000_000))]
    pub random_actions: u64,
    /// Folder for the task files and index.json
    #[arg(long, default_value = "puzzles")]
    pub out: PathBuf,
    /// Puzzles at a time [default: all cores]
    #[arg(long, value_parser = threads())]
    pub threads: Option<usize>,
    /// No progress on stderr
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Debug, Args)]
pub struct PuzzlesBench {
    /// Folder of generated puzzles
    pub puzzles: PathBuf,
    /// A method to train; may be repeated
    #[arg(long = "method", default_values_t = [Method::RECOMMENDED])]
    pub methods: Vec<Method>,
    /// Seeds of each method on each puzzle, counted from 0
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=1000))]
    pub seeds: u64,
    /// Episodes of a training
    #[arg(long, default_value_t = 2000)]
    pub episodes: u32,
    /// What predicts the rollouts behind subgoals and clusters: learned, rapier, true, uniform, or a model file
    #[arg(long, default_value = "learned")]
    pub model: String,
    /// Subgoals to propose for a puzzle, at most
    #[arg(long, default_value_t = 2, value_parser = count(MAX_OBJECTS as u64))]
    pub subgoals: usize,
    /// Any other setting of the trainings by its JSON path, such as refinement.every=50
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub settings: Vec<String>,
    /// Folder for tasks, sweep.json, runs and the report
    #[arg(long, default_value = "bench")]
    pub out: PathBuf,
    /// Train nothing: write the tasks and sweep.json for `mge sweep --plan` or `--slurm`
    #[arg(long)]
    pub prepare: bool,
    /// Trainings at a time [default: all cores]
    #[arg(long, value_parser = threads())]
    pub threads: Option<usize>,
    /// No progress on stderr
    #[arg(long)]
    pub quiet: bool,
}

/// Half width of start noise, in the range that tasks allow.
fn start_noise(text: &str) -> Result<f32, String> {
    let noise: f32 = text.parse().map_err(|_| "must be a number".to_owned())?;
    if (0.0..=1.0).contains(&noise) { Ok(noise) } else { Err("must be from 0 to 1".to_owned()) }
}

#[derive(Debug, Subcommand)]
pub enum Env {
    /// Reset and step as JSON Lines on stdin ask, answers on stdout, for programs in any language
    Serve {
        /// Name of a shipped task, or a task file
        task: String,
        /// Let the agent choose among 40 of CREATE's tools, redrawn at every reset from: all, train,
        /// validation, test
        #[arg(long, value_name = "SPLIT")]
        tools: Option<ToolSplit>,
        /// Send images of the scene too, 84 x 84 pixels as in CREATE
        #[arg(long)]
        images: bool,
        /// CREATE's own pictures of tools for the images: its folder `create_game/assets`
        #[arg(long, value_name = "DIR", requires = "images")]
        pictures: Option<PathBuf>,
        /// Seed of the start noise, random shifts and action sets until a reset brings another
        #[arg(long, default_value_t = 0)]
        seed: u64,
    },
}

#[derive(Debug, Subcommand)]
pub enum Dynamics {
    /// Collect launches and train one model
    Train(DynamicsTrain),
    /// Measure the errors of a model on fresh launches and unseen scenes, as JSON
    Evaluate(DynamicsEvaluate),
    /// Compare the model with three that lack one structural assumption each; resumes
    Ablate(DynamicsAblate),
}

#[derive(Debug, Args)]
pub struct DynamicsTrain {
    /// The tool set, such as box,bucket
    #[arg(long, value_delimiter = ',', required = true)]
    pub tools: Vec<ToolKind>,
    /// Model file to write; an unfinished training beside it is resumed
    #[arg(long)]
    pub out: PathBuf,
    /// Seed of launches, weights and batches
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Passes over the observations (paper: 5000 of 1000, 2500, 5000, 10000)
    #[arg(long)]
    pub epochs: Option<u32>,
    /// Linear layers of each function (paper: 17 of 5, 8, 12, 17)
    #[arg(long)]
    pub layers: Option<usize>,
    /// Learning rate (paper: 1e-4 of 1e-3, 1e-4, 1e-5)
    #[arg(long)]
    pub learning_rate: Option<f32>,
    /// Observations in a batch (paper: 128 of 32, 64, 128, 256)
    #[arg(long)]
    pub batch: Option<usize>,
    /// Optimiser (paper: adam of adam, sgd, rmsprop)
    #[arg(long)]
    pub optimiser: Option<String>,
    /// One-step observations of each tool
    #[arg(long)]
    pub observations: Option<usize>,
    /// Share of rows in which a second tool, which the ball does not touch, is near
    #[arg(long)]
    pub bystanders: Option<f32>,
    /// Loss of the normalised outputs: squared or huber:WIDTH
    #[arg(long)]
    pub loss: Option<Loss>,
    /// Switch a structural assumption off: shared-edges, fully-connected or absolute
    #[arg(long)]
    pub ablate: Option<Variant>,
    /// The paper's literal reading: one prediction for a whole action, positions only,
    /// trained with the squared error and one learning rate
    #[arg(long)]
    pub literal: bool,
    /// No progress on stderr
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Debug, Args)]
pub struct DynamicsAblate {
    /// Folder of the results
    #[arg(long)]
    pub out: PathBuf,
    /// One tool set, such as box,bucket; those of all shipped tasks if not given
    #[arg(long, value_delimiter = ',')]
    pub tools: Option<Vec<ToolKind>>,
    /// Number of seeds
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    pub seeds: u64,
    /// First seed
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Passes over the observations, as in a training
    #[arg(long)]
    pub epochs: Option<u32>,
    #[command(flatten)]
    pub print: Print,
    /// Threads; all cores if not given
    #[arg(long, value_parser = threads())]
    pub threads: Option<usize>,
    /// No progress on stderr
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Debug, Args)]
pub struct DynamicsEvaluate {
    /// Model file, or the name of a shipped model
    pub model: String,
    /// Seed of the fresh launches
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Fresh launches of each tool
    #[arg(long, default_value_t = 300, value_parser = count(1_000_000))]
    pub launches: usize,
    /// Also draw the errors into this PNG, SVG or PDF
    #[arg(long)]
    pub figure: Option<PathBuf>,
    #[command(flatten)]
    pub print: Print,
    /// Say nothing on the way
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Debug, Args)]
pub struct Clusters {
    /// Name of a shipped task, or a task file
    pub task: String,
    /// What predicts the rollouts: learned, rapier, true, uniform, or a model file
    #[arg(long, default_value = "learned")]
    pub model: PriorSource,
    /// Seed of rollouts and clusters
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Write to this file instead of stdout
    #[arg(long)]
    pub out: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct Train {
    /// Name of a shipped task, or a task file
    pub task: String,
    /// Method: ddpg, ddpg-mge, ddpg-uniform, ddpg-mge-true, ddpg-model-replay, planning,
    /// ddpg-mge-adaptive, ddpg-uniform-adaptive, ddpg-adaptive or open-loop
    /// [default: ddpg-mge-adaptive, with --tools ddpg-uniform-adaptive]
    #[arg(long)]
    pub method: Option<Method>,
    /// Let the agent choose among 40 of CREATE's tools, redrawn for every episode from: all, train, validation,
    /// test
    #[arg(long, value_name = "SPLIT")]
    pub tools: Option<ToolSplit>,
    /// Episodes to train
    #[arg(long, default_value_t = 2000)]
    pub episodes: u32,
    /// Master seed
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Epsilon threshold: 0.1, linear:0.8:0.05:2000, exp:0.8:0.05:0.999, step:0.8:0.5:500,
    /// points:0=0.8,1000=0.3,3000=0, need:0.5:0.25:20 [default: that of the method, mostly
    /// linear:0.5:0:1000]
    #[arg(long)]
    pub epsilon: Option<EpsilonSchedule>,
    /// What predicts the rollouts: learned, rapier, true, uniform, or a model file
    #[arg(long)]
    pub model: Option<PriorSource>,
    /// Any other setting by its JSON path, such as ddpg.gamma=0.95
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub settings: Vec<String>,
    /// The run's folder [default: a new one in ./runs or $MGE_RUNS]
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// No progress on stderr
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Debug, Args)]
pub struct Resume {
    /// Folders of runs; as many are trained at the same time as there are cores
    #[arg(required = true, value_name = "RUN")]
    pub runs: Vec<PathBuf>,
    /// No progress on stderr
    #[arg(long)]
    pub quiet: bool,
    /// Go on when the terminal is closed
    #[arg(long)]
    pub detached: bool,
    /// Episodes of finished runs that are to go on
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    pub episodes: Option<u32>,
}

#[derive(Debug, Args)]
pub struct Fork {
    /// Folder of the run that is forked
    pub run: PathBuf,
    /// Episodes of it that are the new run's, too
    #[arg(long, value_name = "EPISODE")]
    pub at: u32,
    /// A setting that changes there, such as epsilon=0.1, ddpg.gamma=0.95 or episodes=4000
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub settings: Vec<String>,
    /// Another task with as many subgoals: the name of a shipped task, or a file
    #[arg(long)]
    pub task: Option<String>,
    /// The new run's folder [default: a new one beside the run's]
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// No progress on stderr
    #[arg(long)]
    pub quiet: bool,
}

/// A run that another process trains.
#[derive(Debug, Args)]
pub struct OnRun {
    /// The run's folder
    pub run: PathBuf,
}

/// Another epsilon schedule for a run that another process trains.
#[derive(Debug, Args)]
pub struct Epsilon {
    /// The run's folder
    pub run: PathBuf,
    /// The schedule, such as 0.1 or linear:0.8:0.05:2000
    pub schedule: EpsilonSchedule,
}

#[derive(Debug, Args)]
pub struct Evaluate {
    /// The run's folder
    pub run: PathBuf,
    /// Episodes to play
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub episodes: u32,
    /// Seed of the start noise
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Draw the action sets of an agent that chooses among tools from others: all, train, validation, test
    /// [default: those of its training]
    #[arg(long, value_name = "SPLIT")]
    pub tools: Option<ToolSplit>,
    /// Also print what the actor saw before each action
    #[arg(long)]
    pub observations: bool,
}

#[derive(Debug, Args)]
pub struct Export {
    /// The run's folder
    pub run: PathBuf,
    /// Safetensors file to write
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
}

#[derive(Debug, Args)]
pub struct Figures {
    /// Run folders
    #[arg(required = true)]
    pub runs: Vec<PathBuf>,
    /// Folder for the figures [default: the first run's own]
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// SVG instead of PNG
    #[arg(long, conflicts_with = "dpi")]
    pub svg: bool,
    /// PDF instead of PNG
    #[arg(long, conflicts_with_all = ["dpi", "svg"])]
    pub pdf: bool,
    /// Option of the learning curves, as of the script command `figure`: curve, name, reference, success
    /// (training or greedy), against (episodes or steps), width (single or double), font (points), axis (linear or log)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub options: Vec<String>,
    #[command(flatten)]
    pub print: Print,
}

#[derive(Debug, Args)]
pub struct Script {
    /// The script, one command a line
    pub file: PathBuf,
    /// Value of a variable that stands as ${NAME} in the script
    #[arg(long = "define", value_name = "NAME=VALUE")]
    pub variables: Vec<String>,
    /// Folder for runs
    #[arg(long, env = "MGE_RUNS", default_value = "runs")]
    pub runs: PathBuf,
    /// Only errors on stderr
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Debug, Args)]
pub struct Screenshot {
    #[command(flatten)]
    pub script: Script,
    /// PNG, SVG or PDF file to write, and the keys that lead to its screen from the one before:
    /// `training.png="3 z"`
    #[arg(long = "screen", value_name = "FILE=KEYS", required = true)]
    pub screens: Vec<String>,
    /// Columns and rows of the screen
    #[arg(long, value_name = "COLUMNSxROWS", default_value = "120x36")]
    pub size: String,
    /// Dots per inch of PNGs
    #[arg(long, default_value_t = 144, value_parser = clap::value_parser!(u32).range(1..=2400))]
    pub dpi: u32,
}

#[derive(Debug, Args)]
#[command(group = clap::ArgGroup::new("what").required(true).args(["file", "one", "collect"]))]
pub struct Sweep {
    /// JSON file of settings and lists of their values
    pub file: Option<PathBuf>,
    /// A sweep as JSON in place of a file; writes no table of results
    #[arg(long, value_name = "JSON", requires = "out")]
    pub one: Option<String>,
    /// Merge results of several machines: copy the runs of these sweep folders into --out
    #[arg(long, value_name = "DIR", num_args = 1.., requires = "out")]
    pub collect: Vec<PathBuf>,
    /// The sweep's folder; finished runs there are not repeated [default: sweeps/NAME of the file]
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// Train nothing: print one command a line for each run, for GNU parallel
    #[arg(long, requires = "file")]
    pub plan: bool,
    /// Train nothing: print a Slurm job-array script
    #[arg(long, requires = "file", conflicts_with = "plan")]
    pub slurm: bool,
    /// Runs at a time [default: all cores]
    #[arg(long, value_parser = threads())]
    pub threads: Option<usize>,
    /// No progress on stderr
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Debug, Args)]
pub struct Report {
    /// Runs, or folders of runs such as those of sweeps and studies
    #[arg(required = true, value_name = "DIR")]
    pub runs: Vec<PathBuf>,
    /// Folder for report.md, report.json and figures
    #[arg(long, default_value = "report")]
    pub out: PathBuf,
    /// Resamples behind every interval
    #[arg(long, default_value_t = 2000, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub resamples: u32,
    /// Seed of the resampling
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    #[command(flatten)]
    pub print: Print,
}

#[derive(Debug, Args)]
pub struct Reproduce {
    /// Small: few seeds and short trainings, in minutes
    #[arg(long)]
    pub quick: bool,
    /// Also the comparisons a reviewer asks for: uniform exploration, clusters from the true physics and from
    /// models without each assumption, refined clusters, model-generated transitions, planning
    #[arg(long)]
    pub questions: bool,
    /// The study's folder; finished parts there are not repeated
    #[arg(long, default_value = "study")]
    pub out: PathBuf,
    /// First seed
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    #[command(flatten)]
    pub print: Print,
    /// Threads [default: all cores]
    #[arg(long, value_parser = threads())]
    pub threads: Option<usize>,
    /// No progress on stderr
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Debug, Args)]
pub struct Man {
    /// As Markdown: the page docs/reference.md
    #[arg(long)]
    pub markdown: bool,
}

#[derive(Debug, Args)]
pub struct Bench {
    /// Work items by the beginnings of their names, comma-separated; all if none is named
    #[arg(long, value_delimiter = ',')]
    pub only: Vec<String>,
    /// Threads
    #[arg(long, default_value_t = 1, value_parser = threads())]
    pub threads: usize,
}
