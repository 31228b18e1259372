//! Progress of an evaluation.

/// Receives progress from all workers; implemented by the caller, who shows it.
pub trait Progress: Sync {
    /// Announces further units.
    fn expect(&self, units: usize);

    /// A unit has ended; `what` describes its result.
    fn unit_done(&self, what: &str);

    /// Prints a separate line.
    fn print_line(&self, text: &str);
}
