//! Actions, as a client: a goal, its acceptance, feedback, result, and its cancellation.

use std::pin::pin;
use std::time::{Duration, Instant};

use futures_util::StreamExt;
use ros2_client::action::{GoalId, GoalStatusEnum};

use super::failure::network;
use super::wait::wait_for;
use super::wire::Wire;
use crate::cdr::Cdr;
use crate::error::RosError;
use crate::messages::AfterStatus;

/// An action's type, as in `control_msgs/action/FollowJointTrajectory`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ActionType {
    /// `control_msgs`
    pub package: &'static str,
    /// `FollowJointTrajectory`
    pub name: &'static str,
}

/// How a goal ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GoalEnd {
    /// It was reached.
    Succeeded,
    /// It was cancelled.
    Cancelled,
    /// The server gave it up.
    Aborted,
    /// The server knows no such goal, as after it was restarted.
    Unknown,
}

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

/// A goal that the server took.
#[derive(Debug, Clone, Copy)]
pub struct Goal {
    id: GoalId,
    result: ros2_client::RmwRequestId,
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

    /// Sends a goal and asks for its result; `None` where the server refuses it.
    ///
    /// # Errors
    /// No answer in time, and what the network reports.
    pub fn send(&self, goal: G, timeout: Duration) -> Result<Option<Goal>, RosError> {
        let sent = wait_for(self.inner.async_send_goal(Wire(Ok(goal))), Some(Instant::now() + timeout));
        let (id, response) = sent
            .ok_or_else(|| network(&self.name, format!("no answer to a goal within {:.1} s", timeout.as_secs_f64())))?
            .map_err(|error| network(&self.name, error))?;
        if !response.accepted {
            return Ok(None);
        }
        let result = self.inner.request_result(id).map_err(|error| network(&self.name, error))?;
        Ok(Some(Goal { id, result }))
    }

    /// How a goal ended, with its result; `None` where it has not ended in time.
    ///
    /// # Errors
    /// [`RosError::Malformed`], and what the network reports.
    pub fn result(&self, goal: &Goal, timeout: Duration) -> Result<Option<(GoalEnd, R)>, RosError> {
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

    /// The next feedback of a goal; `None` where none comes in time.
    ///
    /// # Errors
    /// [`RosError::Malformed`], and what the network reports.
    pub fn feedback(&self, goal: &Goal, timeout: Duration) -> Result<Option<F>, RosError> {
        let next = async {
            let mut stream = pin!(self.inner.feedback_stream(goal.id));
            stream.next().await
        };
        let Some(Some(taken)) = wait_for(next, Some(Instant::now() + timeout)) else { return Ok(None) };
        let Wire(feedback) = taken.map_err(|error| network(&self.name, error))?;
        feedback.map(Some).map_err(|source| RosError::Malformed { topic: self.name.clone(), source })
    }

    /// The last status that the server told of a goal, 1 to 6 as in `action_msgs/msg/GoalStatus`; `None` where it told none.
    ///
    /// # Errors
    /// What the network reports.
    pub fn status(&self, goal: &Goal) -> Result<Option<i8>, RosError> {
        let mut status = None;
        while let Some(all) = self.inner.receive_status().map_err(|error| network(&self.name, error))? {
            let of_goal = all.status_list.iter().find(|one| one.goal_info.goal_id == goal.id);
            status = of_goal.map(|one| one.status as i8).or(status);
        }
        Ok(status)
    }

    /// Asks the server to give a goal up; whether it will.
    ///
    /// # Errors
    /// No answer in time, and what the network reports.
    pub fn cancel(&self, goal: &Goal, timeout: Duration) -> Result<bool, RosError> {
        let zero = ros2_client::builtin_interfaces::Time::ZERO;
        let answered = wait_for(self.inner.async_cancel_goal(goal.id, zero), Some(Instant::now() + timeout));
        let response = answered
            .ok_or_else(|| network(&self.name, "no answer to a cancellation"))?
            .map_err(|error| network(&self.name, error))?;
        Ok(response.goals_canceling.iter().any(|info| info.goal_id == goal.id))
    }
}
