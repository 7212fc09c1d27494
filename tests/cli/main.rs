//! The program as its users run it: in a shell, in a terminal, from Python, on a cluster.

// Skipped tests print a note, the hour of `soak` its measurements.
#![allow(clippy::print_stderr)]

#[allow(dead_code, reason = "shared with other test binaries, which need other parts")]
mod program;
#[cfg(unix)]
#[allow(dead_code, reason = "shared with the tests of the screens, which need other parts")]
mod terminal;

mod documents;
mod faults;
mod hostile_input;
mod learning;
mod python;
mod regressions;
mod rliable;
mod runs;
mod script;
#[cfg(target_os = "linux")]
mod soak;
mod sweep;
#[cfg(unix)]
mod workbench_in_a_terminal;
