//! The command line: arguments to commands.

use std::io;

use clap::{Parser, Subcommand};

use crate::physics;

/// Intuitive-physics puzzles, learned dynamics models and model-guided exploration.
#[derive(Debug, Parser)]
#[command(name = "mge", version)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Simulate scenes: JSON Lines in, one trajectory a line out
    Simulate,
}

/// Runs the program.
///
/// # Errors
/// When the command fails, with one line for the person who gave it.
pub fn run() -> Result<(), Box<dyn std::error::Error>> {
    match Arguments::parse().command {
        Command::Simulate => physics::simulate(io::stdin().lock(), io::BufWriter::new(io::stdout().lock()))?,
    }
    Ok(())
}
