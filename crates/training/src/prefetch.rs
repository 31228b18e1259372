//! Prepares batches on another thread while the network processes the batch before.

use std::collections::VecDeque;
use std::sync::mpsc;

use crate::error::TrainingError;

/// A requested batch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct BatchRequest<K> {
    /// The step that uses it.
    pub(crate) step: usize,
    /// Kind of the batch, if a run has several.
    pub(crate) kind: K,
}

/// Number of batches requested ahead: one ready, one in preparation.
const AHEAD: usize = 2;

/// Batches in the order of their steps, prepared ahead on another thread.
pub(crate) struct Batches<K, B> {
    requests: mpsc::Sender<BatchRequest<K>>,
    batches: mpsc::Receiver<Result<B, TrainingError>>,
    pending: VecDeque<BatchRequest<K>>,
}

impl<K: Copy + PartialEq, B> Batches<K, B> {
    /// The requested batch. The following batches are requested on the assumption that the kind does not change. If the
    /// kind changes, they are discarded, so the training depends only on the requests and not on the threads' speed.
    pub(crate) fn next(&mut self, wanted: BatchRequest<K>) -> Result<B, TrainingError> {
        if self.pending.front().is_some_and(|first| *first != wanted) {
            while self.pending.pop_front().is_some() {
                let _ = self.receive();
            }
        }
        for step in wanted.step + self.pending.len()..=wanted.step + AHEAD {
            let request = BatchRequest { step, ..wanted };
            self.pending.push_back(request);
            // Fails only when the thread has ended, which the receiving side reports.
            let _ = self.requests.send(request);
        }
        self.pending.pop_front();
        self.receive()
    }

    fn receive(&mut self) -> Result<B, TrainingError> {
        match self.batches.recv() {
            Ok(batch) => batch,
            // The thread ends early only by a panic, which the scope propagates.
            Err(mpsc::RecvError) => panic!("the thread that prepares batches ended"),
        }
    }
}

/// Runs `consume` while another thread prepares the requested batches, in the order of the requests. The thread ends
/// with `consume`.
pub(crate) fn with_batches<K: Copy + PartialEq + Send, B: Send, T>(
    mut prepare: impl FnMut(BatchRequest<K>) -> Result<B, TrainingError> + Send,
    consume: impl FnOnce(&mut Batches<K, B>) -> T,
) -> T {
    std::thread::scope(|scope| {
        let (requests, asked) = mpsc::channel::<BatchRequest<K>>();
        let (sender, batches) = mpsc::channel();
        scope.spawn(move || {
            for request in asked {
                // An error here means that the receiver is gone.
                if sender.send(prepare(request)).is_err() {
                    return;
                }
            }
        });
        consume(&mut Batches { requests, batches, pending: VecDeque::new() })
    })
}
