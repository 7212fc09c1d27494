//! The `mge` program.

use std::ffi::{c_char, c_void};

/// Gives memory that is free back to the system, whichever thread had it, and leaves few gaps between what is in
/// use: with others a long session holds many times what it uses.
#[global_allocator]
static ALLOCATOR: tikv_jemallocator::Jemalloc = tikv_jemallocator::Jemalloc;

/// The pointer to a C string that jemalloc reads when memory is first allocated (`malloc_conf` in its manual): what
/// has been free for a second goes back, not after ten.
#[unsafe(export_name = "_rjem_malloc_conf")]
static CONFIGURATION: &[u8; 20] = b"dirty_decay_ms:1000\0";

fn main() -> std::process::ExitCode {
    free_memory_in_the_background();
    mge::run_program()
}

/// Threads that have nothing more to do give nothing back themselves. Where the system allows no thread for it,
/// the others do it while they work.
fn free_memory_in_the_background() {
    // SAFETY: nobody else is there yet who could read or write the variable.
    unsafe { tikv_jemalloc_sys::malloc_message = Some(ignore) };
    let _ = tikv_jemalloc_ctl::background_thread::write(true);
}

/// Takes the place of what writes messages of the allocator to the terminal, in the middle of ours.
unsafe extern "C" fn ignore(_: *mut c_void, _: *const c_char) {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn free_memory_is_given_back_after_a_second_in_the_background() {
        free_memory_in_the_background();
        assert!(tikv_jemalloc_ctl::background_thread::read().unwrap());
        // SAFETY: the option is a number of this size.
        let delay: isize = unsafe { tikv_jemalloc_ctl::raw::read(b"arenas.dirty_decay_ms\0") }.unwrap();
        assert_eq!(delay, 1000);
    }
}
