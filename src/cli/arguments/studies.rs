//! Arguments of `script`, `sweep`, `report` and `reproduce`.

use std::path::PathBuf;

use clap::Args;

use super::{Force, Jobs, Print, first_seed};

#[derive(Debug, Args)]
pub struct Script {
    /// The script, one command per line
    pub file: PathBuf,
    /// Value of the variable ${NAME} in the script
    #[arg(long = "define", value_name = "NAME=VALUE")]
    pub variables: Vec<String>,
    /// Folder for runs
    #[arg(long, env = "MGE_RUNS", default_value = "runs")]
    pub runs: PathBuf,
    /// Only errors and warnings on stderr
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Debug, Args)]
#[command(group = clap::ArgGroup::new("what").required(true).args(["file", "one"]))]
pub struct Sweep {
    /// JSON file of settings and lists of their values
    pub file: Option<PathBuf>,
    /// A sweep as JSON instead of a file; writes no table of results
    #[arg(long, value_name = "JSON", requires = "out")]
    pub one: Option<String>,
    /// The sweep's folder; finished runs there are not repeated [default: sweeps/NAME of the file]
    #[arg(long)]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub force: Force,
    /// Train nothing: print one command line per run, for GNU parallel
    #[arg(long, visible_alias = "dry-run", requires = "file")]
    pub plan: bool,
    /// Train nothing: print a Slurm job-array script
    #[arg(long, requires = "file", conflicts_with = "plan")]
    pub slurm: bool,
    #[command(flatten)]
    pub jobs: Jobs,
}

#[derive(Debug, Args)]
pub struct Report {
    /// Runs, or folders of runs such as those of sweeps and studies; or dynamics models or counts of hits of sweeps
    #[arg(required = true, value_name = "DIR")]
    pub runs: Vec<PathBuf>,
    /// Folder for report.md, report.html, report.json and figures
    #[arg(long, default_value = "report")]
    pub out: PathBuf,
    #[command(flatten)]
    pub force: Force,
    /// Label of the method that the others are compared with, as in the report [default: plain DDPG, or else the
    /// first method]
    #[arg(long, value_name = "LABEL")]
    pub reference: Option<String>,
    /// Bootstrap resamples for every interval
    #[arg(long, default_value_t = 2000, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub resamples: u32,
    /// Seed of the resampling
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    #[command(flatten)]
    pub print: Print,
    /// No progress on stderr
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Debug, Args)]
pub struct Reproduce {
    /// A small study in minutes: few seeds and short trainings
    #[arg(long)]
    pub quick: bool,
    /// The study's folder; finished parts there are not repeated
    #[arg(long, default_value = "study")]
    pub out: PathBuf,
    #[command(flatten)]
    pub force: Force,
    /// First seed
    #[arg(long, default_value_t = 0, value_parser = first_seed())]
    pub seed: u64,
    #[command(flatten)]
    pub print: Print,
    #[command(flatten)]
    pub jobs: Jobs,
}
