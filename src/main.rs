//! The `mge` program.

/// Gives memory that is free back to the system, whichever thread had it: that of the C library keeps gaps
/// in a heap for each thread, and a long session would hold many times what it uses.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> std::process::ExitCode {
    mge::run_program()
}
