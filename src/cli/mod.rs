//! The command line. Machine-readable results go to stdout, progress and messages to stderr.

mod arguments;
mod dynamics;
mod interrupt;
mod listing;
mod manual;
mod output;
mod physics;
mod progress;
mod provenance;
mod puzzles;
mod runs;
mod selection;
mod session;
mod settings;
mod studies;
mod sweeps;
mod tasks;
#[cfg(test)]
mod tests;
mod usage;

use std::error::Error;
use std::ffi::OsStr;
use std::io::{self, Write};
use std::iter;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::builder::{PathBufValueParser, TypedValueParser, ValueParser};
use clap::{Arg, FromArgMatches};

use mge_base::paths;
use mge_run::{RunDirectory, RunError};
use mge_trainer::batch::start_global_pool;

use arguments::{Arguments, Command, Dynamics, Env, Puzzles, Selection};

/// Runs the program. Exit status 0: success, 1: failure (one line on stderr), 2: wrong usage, 128 and
/// the number of a signal: ended by it (one line on stderr tells how to continue).
pub fn run() -> ExitCode {
    crate::memory::keep_freed_blocks();
    mge_base::identity::set_version(env!("MGE_VERSION"));
    let command = adjusted(arguments::command());
    let parsed = command.clone().try_get_matches().and_then(|matches| Arguments::from_arg_matches(&matches));
    let words: Vec<String> = std::env::args_os().skip(1).map(|word| word.to_string_lossy().into_owned()).collect();
    let outcome = match (parsed, usage::misplaced(&command, &words)) {
        (_, Some(text)) => usage_error(&text),
        (Ok(arguments), None) => dispatch(arguments),
        (Err(error), None) => print_usage(&error),
    };
    match outcome {
        Ok(status) => status,
        Err(error) if is_broken_pipe(&*error) => ExitCode::SUCCESS,
        Err(error) => {
            let interrupted = error.downcast_ref::<interrupt::Interrupted>();
            let prefix = if interrupted.is_some() { "" } else { "error: " };
            output::message(format_args!("{prefix}{error}{}", named_so(&*error).unwrap_or_default()));
            interrupted.map_or(ExitCode::FAILURE, interrupt::Interrupted::status)
        }
    }
}

/// The command line, in which an empty environment variable is the same as none, a negative number is a value, and `~`
/// in a path is the home folder: a shell expands neither variables nor `--out=~/runs`.
fn adjusted(command: clap::Command) -> clap::Command {
    let is_empty = |name: &OsStr| std::env::var_os(name).is_some_and(|value| value.is_empty());
    let is_path = |argument: &Arg| argument.get_value_parser().type_id() == ValueParser::path_buf().type_id();
    command
        .mut_args(|argument| match is_path(&argument) {
            true => argument.value_parser(PathBufValueParser::new().map(paths::expanded)),
            false => argument,
        })
        .mut_args(|argument| match argument.get_env().is_some_and(is_empty) {
            true => argument.env(None::<&str>),
            false if argument.get_action().takes_values() => argument.allow_negative_numbers(true),
            false => argument,
        })
        .mut_subcommands(adjusted)
}

/// Prints the requested help, or the error in the arguments.
fn print_usage(error: &clap::Error) -> Result<ExitCode, Box<dyn Error>> {
    if !error.use_stderr() {
        error.print().and_then(|()| io::stdout().flush()).map_err(output::OutputError::from)?;
        return Ok(ExitCode::SUCCESS);
    }
    // A misspelt command is taken for the folder of a run, and what follows it for a command.
    if let Some(word) = std::env::args_os().nth(1).map(PathBuf::from).filter(|word| runs::is_unknown(word)) {
        return Err(runs::no_such(&word).into());
    }
    if let Some(text) = usage::refused(error) {
        return usage_error(&text);
    }
    // Escape sequences in what was typed stay text. Writing fails if the terminal is closed.
    let plain = error.to_string();
    if output::shown_lines(&plain) == plain {
        let _ = error.print();
    } else {
        output::message_lines(&plain);
    }
    Ok(ExitCode::from(2))
}

/// Prints what is wrong with the arguments, in one line.
fn usage_error(text: &str) -> Result<ExitCode, Box<dyn Error>> {
    output::message(format_args!("error: {text}"));
    Ok(ExitCode::from(2))
}

fn dispatch(arguments: Arguments) -> Result<ExitCode, Box<dyn Error>> {
    let Some(command) = arguments.command else { return runs::workbench(&arguments.workbench) };
    start_global_pool();
    let outcome = match command {
        Command::Tasks(tasks) => tasks::run(tasks),
        Command::Puzzles(Puzzles::Generate(arguments)) => puzzles::generate(&arguments),
        Command::Puzzles(Puzzles::Bench(arguments)) => puzzles::bench(&arguments),
        Command::Simulate => physics::simulate(),
        Command::Play(play) => physics::play(&play),
        Command::Env(Env::Serve { task, tools, seed }) => physics::serve(&task, tools, seed),
        Command::Dynamics(Dynamics::Train(arguments)) => dynamics::train(&arguments),
        Command::Dynamics(Dynamics::Evaluate(arguments)) => dynamics::evaluate(&arguments),
        Command::Selection(Selection::Train(arguments)) => selection::train(&arguments),
        Command::Selection(Selection::Evaluate(arguments)) => selection::evaluate(&arguments),
        Command::Clusters(arguments) => tasks::clusters(&arguments),
        Command::Train(train) => runs::train(&train),
        Command::Config { name } => settings::print(&name),
        Command::Resume(resume) => runs::resume(&resume),
        Command::Fork(fork) => runs::fork(&fork),
        Command::Runs(runs) => listing::runs(&runs),
        Command::Show(show) => listing::show(&show),
        Command::Compare(compare) => listing::compare(&compare),
        Command::Delete(delete) => runs::delete(&delete),
        Command::Rename(rename) => runs::rename(&rename),
        Command::Evaluate(evaluate) => runs::evaluate(&evaluate),
        Command::Export(export) => runs::export_actor(&export),
        Command::Figures(figures) => runs::figures(&figures),
        Command::Script(script) => runs::script(&script),
        Command::Sweep(sweep) => sweeps::run(&sweep),
        Command::Report(report) => studies::report(&report),
        Command::Reproduce(reproduce) => studies::reproduce(&reproduce),
        Command::Man { markdown } => manual::print(markdown),
        Command::Completions { shell } => manual::completions(shell),
    };
    outcome.map(|()| ExitCode::SUCCESS)
}

/// Whether the reader of our output has closed the pipe, which is not an error.
fn is_broken_pipe(error: &(dyn Error + 'static)) -> bool {
    let is_broken = |io: &io::Error| io.kind() == io::ErrorKind::BrokenPipe;
    causes(error).any(|error| error.downcast_ref().is_some_and(is_broken))
}

/// An error and those that have led to it.
fn causes<'a>(error: &'a (dyn Error + 'static)) -> impl Iterator<Item = &'a (dyn Error + 'static)> {
    iter::successors(Some(error), |error: &&'a (dyn Error + 'static)| (*error).source())
}

/// Which run has the name that was taken for that of its folder, if there is no such folder.
fn named_so(error: &(dyn Error + 'static)) -> Option<String> {
    let missing = causes(error).find_map(|error| match error.downcast_ref()? {
        RunError::NotARun(path) if !path.exists() => Some(path),
        _ => None,
    })?;
    RunDirectory::named_so(missing, &runs::usual_folder())
}
