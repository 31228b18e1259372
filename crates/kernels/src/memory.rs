//! How the process keeps the memory that operations give back.

/// Has the C library keep what is freed, for the whole process. To be called once, first thing in `main`.
///
/// A network's maps are megabytes each. GNU's allocator takes such blocks from the system and gives them back, so that
/// every operation finds its result's pages missing: a sixth of a backbone's time on one core. Kept in one heap they are
/// used again. Elsewhere this does nothing.
pub fn keep_freed_memory() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    for (parameter, value) in [
        // One heap for all threads: a map is seldom freed by the thread that made it.
        (libc::M_ARENA_MAX, 1),
        (libc::M_MMAP_MAX, 0),
        (libc::M_TRIM_THRESHOLD, libc::c_int::MAX),
    ] {
        // SAFETY: takes two numbers; GNU's allocator guards its settings itself.
        unsafe { libc::mallopt(parameter, value) };
    }
}
