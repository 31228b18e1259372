//! Prints repeated problems on standard error.

use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Time after which the same message is printed again.
const AGAIN_AFTER: Duration = Duration::from_secs(2);
/// Maximum number of different messages that are remembered.
const MAX_REMEMBERED: usize = 200;

/// Prints each message at once, and repetitions at most every two seconds, with the number of repetitions not printed.
#[derive(Debug, Default)]
pub(super) struct Lines(Mutex<HashMap<String, (Instant, u64)>>);

impl Lines {
    /// Prints a message if it is due; messages that differ only in numbers count as the same.
    pub(super) fn complain(&self, text: &str) {
        if let Some(line) = self.line(text, Instant::now()) {
            sdg_files::print_stderr(format_args!("sdg ros2: {line}\n"));
        }
    }

    fn line(&self, text: &str, now: Instant) -> Option<String> {
        let key: String = text.chars().filter(|character| !character.is_ascii_digit()).collect();
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if known.len() >= MAX_REMEMBERED && !known.contains_key(&key) {
            known.clear();
        }
        match known.get_mut(&key) {
            Some((printed, num_silent)) if now.duration_since(*printed) < AGAIN_AFTER => {
                *num_silent += 1;
                None
            }
            Some((printed, num_silent)) => {
                let times = std::mem::take(num_silent);
                *printed = now;
                Some(if times > 0 { format!("{text} (and {times} times before)") } else { text.to_owned() })
            }
            None => {
                known.insert(key, (now, 0));
                Some(text.to_owned())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repetitions_are_counted_and_other_complaints_printed() {
        let lines = Lines::default();
        let now = Instant::now();
        assert_eq!(lines.line("stale by 1 s", now).unwrap(), "stale by 1 s");
        assert_eq!(lines.line("stale by 2 s", now), None);
        assert_eq!(lines.line("unknown encoding", now).unwrap(), "unknown encoding");
        let later = now + AGAIN_AFTER;
        assert_eq!(lines.line("stale by 3 s", later).unwrap(), "stale by 3 s (and 1 times before)");
        assert_eq!(lines.line("stale by 3 s", later + AGAIN_AFTER).unwrap(), "stale by 3 s");
    }
}
