//! Memory of the program.

/// Makes the C library's allocator keep freed blocks of up to 4 MiB, 16 MiB in all. A step of training allocates and
/// frees such blocks: giving each back to the system made a step of a dynamics model half as slow again.
#[allow(unsafe_code)]
pub fn keep_freed_blocks() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: the call only sets numbers of the allocator, which it may do at any time.
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, 4 << 20);
        libc::mallopt(libc::M_TRIM_THRESHOLD, 16 << 20);
    }
}
