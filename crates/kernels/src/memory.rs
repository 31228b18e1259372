//! Makes the process keep freed memory.

/// Makes the C library keep freed memory, for the whole process. Call it once, at the start of `main`.
///
/// A network's maps are megabytes each. GNU's allocator takes such blocks from the system and returns them, so the
/// pages of every operation's result must be mapped again: a sixth of a backbone's time on one core. With these
/// settings the pages are reused. On other systems this function does nothing.
pub fn keep_freed_memory() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    for (parameter, value) in [
        // One heap for all threads, because a map is seldom freed by the thread that made it.
        (libc::M_ARENA_MAX, 1),
        (libc::M_MMAP_MAX, 0),
        (libc::M_TRIM_THRESHOLD, libc::c_int::MAX),
    ] {
        // SAFETY: takes two numbers; GNU's allocator guards its settings itself.
        unsafe { libc::mallopt(parameter, value) };
    }
}
