//! What an evaluation tells while it goes on.

/// Told what is to do and what was done, by all workers; the caller shows it.
pub trait Progress: Sync {
    /// There are so many units more to do.
    fn expect(&self, units: usize);

    /// A unit ended, as the text tells.
    fn unit_done(&self, what: &str);

    /// A line of its own.
    fn print_line(&self, text: &str);
}
