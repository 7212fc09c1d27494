//! Arguments of `play` and `env`.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use mge_physics::ToolSplit;

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
    /// JSON Lines file of the tools that action sets refer to, instead of CREATE's catalogue
    #[arg(long, value_name = "FILE", requires = "levels")]
    pub tools: Option<PathBuf>,
}

#[derive(Debug, Subcommand)]
pub enum Env {
    /// Serve a task to a program in any language: JSON Lines requests on stdin, responses on stdout
    Serve {
        /// Name of a shipped task, or a task file
        task: String,
        /// Let the agent choose among 40 of CREATE's tools, redrawn at every reset from this split: all,
        /// train, validation, test
        #[arg(long, value_name = "SPLIT")]
        tools: Option<ToolSplit>,
        /// Seed of the start noise, random shifts and action sets until a reset sets another
        #[arg(long, default_value_t = 0)]
        seed: u64,
    },
}
