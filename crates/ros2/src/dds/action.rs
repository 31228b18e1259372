//! Action client: a goal, its acceptance, feedback, result, and its cancellation.
//!
//! The first request of a writer may be lost. A Cyclone reader that has just matched the writer asks for the writer's
//! state once per second, until the writer has sent a sample. If RustDDS receives such a question while it sends its
//! first sample, its answer is sent before the sample. The answer is a heartbeat that already counts the sample, so the
//! reader treats the sample as an old one. Later requests are not affected. Therefore a cancellation and a result
//! request are repeated if no answer arrives. A goal is repeated only after the server has reported that it does not
//! know the goal.

use std::pin::pin;
use std::time::{Duration, Instant};

use futures_util::StreamExt;
use ros2_client::action::{GoalId, GoalStatusEnum};
use ros2_client::action_msgs::{CancelGoalResponse, CancelGoalResponseEnum};

use super::failure::network;
use super::wait::wait_for;
use super::wire::Wire;
use crate::cdr::Cdr;
use crate::error::RosError;
use crate::messages::AfterStatus;

/// The type of an action, such as `control_msgs/action/FollowJointTrajectory`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ActionType {
    /// The package, such as `control_msgs`.
    pub package: &'static str,
    /// The name, such as `FollowJointTrajectory`.
    pub name: &'static str,
}

/// The end of a goal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GoalEnd {
    /// The goal was reached.
    Succeeded,
    /// The goal was cancelled.
    Cancelled,
    /// The server aborted the goal.
    Aborted,
    /// The server does not know the goal, for example after a restart.
    Unknown,
}

/// Time after which a result request is repeated once.
const ASK_AGAIN: Duration = Duration::from_secs(1);
/// Maximum number of times that a cancellation is sent.
const MAX_CANCELLATIONS: u32 = 3;

/// Sends goals to an action's server, one at a time.
pub struct ActionClient<G, R, F>
where
    G: Cdr + Clone + 'static,
    R: Cdr + Clone + 'static,
    F: Cdr + Clone + 'static,
{
    name: String,
    inner: ros2_client::dds::ActionClient<Wire<G>, Wire<AfterStatus<R>>, Wire<F>>,
}

/// An accepted goal.
#[derive(Debug, Clone, Copy)]
pub struct Goal {
    id: GoalId,
    result: ros2_client::RmwRequestId,
    /// The time at which the result request is repeated.
    ask_again: Option<Instant>,
}

impl<G, R, F> ActionClient<G, R, F>
where
    G: Cdr + Clone + 'static,
    R: Cdr + Clone + 'static,
    F: Cdr + Clone + 'static,
{
    pub(super) fn new(
        name: String,
        inner: ros2_client::dds::ActionClient<Wire<G>, Wire<AfterStatus<R>>, Wire<F>>,
    ) -> Self {
        Self { name, inner }
    }

    /// The action's absolute name.
    pub fn name(&self) -> &str {
        &self.name
    }

    pub(super) fn inner(&self) -> &ros2_client::dds::ActionClient<Wire<G>, Wire<AfterStatus<R>>, Wire<F>> {
        &self.inner
    }

    /// Sends a goal and requests its result; `None` if the server refuses the goal. A goal is cancelled if it is not
    /// answered or if its answer cannot be read; an unanswered goal is sent again if the server does not know it.
    ///
    /// # Errors
    /// No answer in time, and errors reported by the network.
    pub fn send(&self, goal: G, timeout: Duration) -> Result<Option<Goal>, RosError> {
        match self.send_once(goal.clone(), timeout / 2)? {
            Sent::Accepted(goal) => Ok(Some(goal)),
            Sent::Refused => Ok(None),
            Sent::Unanswered(id) => match self.ask_to_cancel(id, timeout)?.return_code {
                CancelGoalResponseEnum::UnknownGoal => match self.send_once(goal, timeout)? {
                    Sent::Accepted(goal) => Ok(Some(goal)),
                    Sent::Refused => Ok(None),
                    Sent::Unanswered(id) => {
                        self.ask_to_cancel(id, timeout)?;
                        Err(self.unanswered("a goal", timeout))
                    }
                },
                _ => Err(self.unanswered("a goal", timeout)),
            },
        }
    }

    fn send_once(&self, goal: G, timeout: Duration) -> Result<Sent, RosError> {
        let (request, id) = self.inner.send_goal(Wire(Ok(goal))).map_err(|error| network(&self.name, error))?;
        let sent = self.acceptance(request, id, timeout);
        if sent.is_err() {
            // The server may have accepted the goal, and would execute it although the caller has no handle to it.
            let _ = self.ask_to_cancel(id, timeout);
        }
        sent
    }

    fn acceptance(&self, request: ros2_client::RmwRequestId, id: GoalId, timeout: Duration) -> Result<Sent, RosError> {
        let answer = self.inner.goal_client().async_receive_response(request);
        let Some(answer) = wait_for(answer, Some(Instant::now() + timeout)) else { return Ok(Sent::Unanswered(id)) };
        if !answer.map_err(|error| network(&self.name, error))?.accepted {
            return Ok(Sent::Refused);
        }
        let result = self.inner.request_result(id).map_err(|error| network(&self.name, error))?;
        Ok(Sent::Accepted(Goal { id, result, ask_again: Some(Instant::now() + ASK_AGAIN) }))
    }

    fn unanswered(&self, what: &str, timeout: Duration) -> RosError {
        network(&self.name, format!("no answer to {what} within {:.1} s", timeout.as_secs_f64()))
    }

    /// The end of a goal, with its result; `None` if it has not ended in time.
    ///
    /// # Errors
    /// [`RosError::Malformed`], and errors reported by the network.
    pub fn result(&self, goal: &mut Goal, timeout: Duration) -> Result<Option<(GoalEnd, R)>, RosError> {
        if goal.ask_again.is_some_and(|time| time <= Instant::now()) {
            goal.ask_again = None;
            goal.result = self.inner.request_result(goal.id).map_err(|error| network(&self.name, error))?;
        }
        let taken =
            wait_for(self.inner.result_client().async_receive_response(goal.result), Some(Instant::now() + timeout));
        let Some(taken) = taken else { return Ok(None) };
        let response = taken.map_err(|error| network(&self.name, error))?;
        let Wire(result) = response.result;
        let AfterStatus(result) = result.map_err(|source| RosError::Malformed { topic: self.name.clone(), source })?;
        let end = match response.status {
            GoalStatusEnum::Succeeded => GoalEnd::Succeeded,
            GoalStatusEnum::Canceled => GoalEnd::Cancelled,
            GoalStatusEnum::Aborted => GoalEnd::Aborted,
            _ => GoalEnd::Unknown,
        };
        Ok(Some((end, result)))
    }

    /// The next feedback of a goal; `None` if none arrives in time.
    ///
    /// # Errors
    /// [`RosError::Malformed`], and errors reported by the network.
    pub fn feedback(&self, goal: &Goal, timeout: Duration) -> Result<Option<F>, RosError> {
        let next = async {
            let mut stream = pin!(self.inner.feedback_stream(goal.id));
            stream.next().await
        };
        let Some(Some(taken)) = wait_for(next, Some(Instant::now() + timeout)) else { return Ok(None) };
        let Wire(feedback) = taken.map_err(|error| network(&self.name, error))?;
        feedback.map(Some).map_err(|source| RosError::Malformed { topic: self.name.clone(), source })
    }

    /// Asks the server to cancel a goal; returns whether the server accepts.
    ///
    /// # Errors
    /// No answer in time, and errors reported by the network.
    pub fn cancel(&self, goal: &Goal, timeout: Duration) -> Result<bool, RosError> {
        let response = self.ask_to_cancel(goal.id, timeout)?;
        Ok(response.goals_canceling.iter().any(|info| info.goal_id == goal.id))
    }

    fn ask_to_cancel(&self, id: GoalId, timeout: Duration) -> Result<CancelGoalResponse, RosError> {
        let zero = ros2_client::builtin_interfaces::Time::ZERO;
        for _ in 0..MAX_CANCELLATIONS {
            let deadline = Instant::now() + timeout / MAX_CANCELLATIONS;
            if let Some(answer) = wait_for(self.inner.async_cancel_goal(id, zero), Some(deadline)) {
                return answer.map_err(|error| network(&self.name, error));
            }
        }
        Err(self.unanswered("a cancellation", timeout))
    }
}

/// The outcome of a sent goal.
enum Sent {
    Accepted(Goal),
    Refused,
    Unanswered(GoalId),
}
