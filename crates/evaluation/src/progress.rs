//! Progress of an evaluation.

/// Receives progress from all workers; the caller implements it and displays the progress.
pub trait Progress: Sync {
    /// Announces further units.
    fn expect(&self, units: usize);

    /// Reports that a unit has ended; `what` describes its result.
    fn unit_done(&self, what: &str);

    /// Prints a separate line.
    fn print_line(&self, text: &str);
}

/// Progress that is not shown.
pub struct NoProgress;

impl Progress for NoProgress {
    fn expect(&self, _units: usize) {}
    fn unit_done(&self, _what: &str) {}
    fn print_line(&self, _text: &str) {}
}
