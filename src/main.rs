//! The `mge` program.

/// Gives memory that is free back to the system, whichever thread had it: that of the C library keeps gaps
/// in a heap for each thread, and a long session would hold many times what it uses.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// `mi_option_purge_delay` in `mimalloc.h`: milliseconds until free memory is given back.
const PURGE_DELAY: libmimalloc_sys::mi_option_t = 15;

fn main() -> std::process::ExitCode {
    shorten_purge_delay();
    mge::run_program()
}

/// Ten milliseconds instead of a second, in which a busy session frees more than it holds.
fn shorten_purge_delay() {
    // SAFETY: the option exists, and no other thread is there yet that could set it.
    unsafe { libmimalloc_sys::mi_option_set(PURGE_DELAY, 10) };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn free_memory_is_given_back_after_ten_milliseconds_instead_of_a_second() {
        // SAFETY: the option exists; options are numbers that are read and written in one piece.
        let delay = || unsafe { libmimalloc_sys::mi_option_get(PURGE_DELAY) };
        assert_eq!(delay(), 1000, "its number in this version, unless MIMALLOC_PURGE_DELAY is set");
        shorten_purge_delay();
        assert_eq!(delay(), 10);
    }
}
