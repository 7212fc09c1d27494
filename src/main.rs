//! The `mge` program.

fn main() -> std::process::ExitCode {
    mge::cli::run()
}
