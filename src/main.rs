//! The `mge` program.

use std::alloc::{GlobalAlloc, Layout};
use std::ffi::{c_char, c_void};

use tikv_jemallocator::Jemalloc;

#[global_allocator]
static ALLOCATOR: Allocator = Allocator;

/// jemalloc returns free memory to the system, whichever thread freed it, with little fragmentation: with other
/// allocators a long session holds many times the memory it uses. But it clears blocks of more than a few pages by
/// giving them back to the system and taking them again, which costs more than overwriting them.
struct Allocator;

/// Largest zeroed block that is overwritten, in bytes.
const MAX_OVERWRITTEN: usize = 1 << 20;

// SAFETY: calls are passed on as they are; a zeroed block is cleared over its whole size, if there is one.
#[allow(unsafe_op_in_unsafe_fn)]
unsafe impl GlobalAlloc for Allocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        Jemalloc.alloc(layout)
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        if layout.size() > MAX_OVERWRITTEN {
            return Jemalloc.alloc_zeroed(layout);
        }
        let block = Jemalloc.alloc(layout);
        if !block.is_null() {
            block.write_bytes(0, layout.size());
        }
        block
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        Jemalloc.dealloc(block, layout)
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        Jemalloc.realloc(block, layout, size)
    }
}

/// The C string that jemalloc reads at its first allocation (`malloc_conf` in its manual): unused memory is returned
/// after one second instead of ten.
#[unsafe(export_name = "_rjem_malloc_conf")]
static CONFIGURATION: &[u8; 20] = b"dirty_decay_ms:1000\0";

fn main() -> std::process::ExitCode {
    free_memory_in_the_background();
    mge::run_program()
}

/// Starts jemalloc's background thread, because idle threads return no memory themselves. If the system allows no
/// further thread, the others return it while they work.
fn free_memory_in_the_background() {
    // SAFETY: no other thread exists yet that could read or write the variable.
    unsafe { tikv_jemalloc_sys::malloc_message = Some(ignore) };
    let _ = tikv_jemalloc_ctl::background_thread::write(true);
}

/// Discards the allocator's messages, which would otherwise be written to the terminal over the screen.
unsafe extern "C" fn ignore(_: *mut c_void, _: *const c_char) {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zeroed_blocks_are_clear_wherever_they_were_used_before() {
        for size in [100, 100_000, 2 * MAX_OVERWRITTEN] {
            drop(std::hint::black_box(vec![7_u8; size]));
            assert!(std::hint::black_box(vec![0_u8; size]).iter().all(|byte| *byte == 0), "{size}");
        }
    }

    #[test]
    fn free_memory_is_given_back_after_a_second_in_the_background() {
        free_memory_in_the_background();
        assert!(tikv_jemalloc_ctl::background_thread::read().unwrap());
        // SAFETY: the option is a number of this size.
        let delay: isize = unsafe { tikv_jemalloc_ctl::raw::read(b"arenas.dirty_decay_ms\0") }.unwrap();
        assert_eq!(delay, 1000);
    }
}
