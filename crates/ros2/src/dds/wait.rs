//! Waits for a future in this thread, with a timeout.

use std::future::Future;
use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::{Context, Poll, Wake, Waker};
use std::thread::Thread;
use std::time::{Duration, Instant};

/// Interval after which a future is polled again even if it was not woken, because `ros2-client` drops events when its
/// channel is full.
const POLL_EVERY: Duration = Duration::from_millis(100);

/// Whether the future was woken, and the thread to unpark. The thread's own token is not sufficient: code that the
/// future calls may park the thread and thereby consume the token.
struct Woken(AtomicBool, Thread);

impl Wake for Woken {
    fn wake(self: Arc<Self>) {
        self.0.store(true, Ordering::SeqCst);
        self.1.unpark();
    }
}

/// The output of the future; `None` if the deadline comes first. Without a deadline, the wait is unlimited.
pub(super) fn wait_for<F: Future>(future: F, deadline: Option<Instant>) -> Option<F::Output> {
    let woken = Arc::new(Woken(AtomicBool::new(false), std::thread::current()));
    let waker = Waker::from(Arc::clone(&woken));
    let mut context = Context::from_waker(&waker);
    let mut future = pin!(future);
    loop {
        if let Poll::Ready(output) = future.as_mut().poll(&mut context) {
            return Some(output);
        }
        let poll_again = Instant::now() + POLL_EVERY;
        while !woken.0.swap(false, Ordering::SeqCst) {
            let now = Instant::now();
            if deadline.is_some_and(|deadline| deadline <= now) {
                return None;
            }
            let until = deadline.map_or(poll_again, |deadline| deadline.min(poll_again));
            if until <= now {
                break;
            }
            std::thread::park_timeout(until - now);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::future::poll_fn;

    use super::*;

    #[test]
    fn a_wake_up_is_seen_where_the_future_parks_the_thread_itself() {
        let mut is_first = true;
        let begun = Instant::now();
        let future = poll_fn(|context| {
            if !std::mem::take(&mut is_first) {
                return Poll::Ready(());
            }
            context.waker().wake_by_ref();
            // The future consumes the thread's token, like a waiting channel.
            std::thread::park();
            Poll::Pending
        });
        assert_eq!(wait_for(future, None), Some(()));
        assert!(begun.elapsed() < POLL_EVERY, "the future was polled at the wake-up, not after the interval");
    }

    #[test]
    fn a_deadline_ends_it_and_a_future_that_nobody_wakes_is_polled_again() {
        let begun = Instant::now();
        assert_eq!(wait_for(std::future::pending::<()>(), Some(begun + Duration::from_millis(20))), None);
        assert!(begun.elapsed() >= Duration::from_millis(20));
        let mut num_polls = 0;
        let counted = poll_fn(|_| {
            num_polls += 1;
            if num_polls == 2 { Poll::Ready(()) } else { Poll::Pending }
        });
        assert_eq!(wait_for(counted, None), Some(()));
    }
}
