//! The `mge` program.

fn main() -> std::process::ExitCode {
    mge::run_program()
}
