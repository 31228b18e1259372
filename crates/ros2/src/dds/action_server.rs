//! Action server with one goal at a time, for the controllers of a simulated arm.

use ros2_client::RmwRequestId;
use ros2_client::action::{GetResultResponse, GoalId, GoalStatusEnum, SendGoalResponse};
use ros2_client::action_msgs::{GoalInfo, GoalStatus as StatusMessage, GoalStatusArray};
use ros2_client::builtin_interfaces::Time;

use super::action::GoalEnd;
use super::cancellation;
use super::failure::network;
use super::wire::Wire;
use crate::cdr::Cdr;
use crate::error::RosError;
use crate::messages::AfterStatus;

/// Number of results of ended goals that clients may still request.
const MAX_ENDED: usize = 16;

/// A client's request.
#[derive(Debug, Clone, PartialEq)]
pub enum Asked<G> {
    /// An accepted goal. A goal that was still running has been aborted.
    Goal(G),
    /// A cancellation of the running goal.
    Cancel,
}

/// Serves an action.
pub struct ActionServer<G, R, F>
where
    G: Cdr + Clone + 'static,
    R: Cdr + Clone + Default + 'static,
    F: Cdr + Clone + 'static,
{
    name: String,
    inner: ros2_client::dds::ActionServer<Wire<G>, Wire<AfterStatus<R>>, Wire<F>>,
    /// The running goal, with the time of its acceptance.
    running: Option<GoalInfo>,
    ended: Vec<(GoalId, GoalEnd, R)>,
    waiting: Vec<(GoalId, RmwRequestId)>,
}

impl<G, R, F> ActionServer<G, R, F>
where
    G: Cdr + Clone + 'static,
    R: Cdr + Clone + Default + 'static,
    F: Cdr + Clone + 'static,
{
    pub(super) fn new(
        name: String,
        inner: ros2_client::dds::ActionServer<Wire<G>, Wire<AfterStatus<R>>, Wire<F>>,
    ) -> Self {
        Self { name, inner, running: None, ended: Vec::new(), waiting: Vec::new() }
    }

    /// The next request, without waiting; `None` if there is none, or the request was refused. `accepts` decides
    /// whether a valid goal is accepted.
    ///
    /// # Errors
    /// Errors reported by the network.
    pub fn asked(&mut self, accepts: impl Fn(&G) -> bool) -> Result<Option<Asked<G>>, RosError> {
        self.answer_results()?;
        let failed = |error: ros2_client::ReadError| network(&self.name, error);
        if let Some((request, asked)) = self.inner.receive_cancel_request().map_err(failed)? {
            let named = cancellation::named_in(&asked).map_err(|error| network(&self.name, error))?;
            let ended: Vec<GoalId> = self.ended.iter().map(|(goal, ..)| *goal).collect();
            let response = cancellation::answer(&named, self.running.as_ref(), &ended);
            let is_cancelled = !response.goals_canceling.is_empty();
            self.inner.send_cancel_response(request, response).map_err(|error| network(&self.name, error))?;
            return Ok(is_cancelled.then_some(Asked::Cancel));
        }
        let Some((request, message)) = self.inner.receive_goal().map_err(failed)? else { return Ok(None) };
        let Wire(goal) = message.goal;
        let goal = goal.ok().filter(|goal| accepts(goal));
        let stamp = Time::now();
        let response = SendGoalResponse { accepted: goal.is_some(), stamp };
        self.inner.send_goal_response(request, response).map_err(|error| network(&self.name, error))?;
        let Some(goal) = goal else { return Ok(None) };
        if self.running.is_some() {
            self.end(GoalEnd::Aborted, R::default())?;
        }
        let accepted = GoalInfo { goal_id: message.goal_id, stamp };
        self.running = Some(accepted.clone());
        self.tell(accepted, GoalStatusEnum::Executing)?;
        Ok(Some(Asked::Goal(goal)))
    }

    /// Publishes the progress of the running goal.
    ///
    /// # Errors
    /// Errors reported by the network.
    pub fn feedback(&self, feedback: F) -> Result<(), RosError> {
        let Some(goal) = &self.running else { return Ok(()) };
        self.inner
            .send_feedback(goal.goal_id, Wire(Ok(feedback)))
            .map_err(|error| network(&self.name, error.forget_data()))
    }

    /// Ends the running goal.
    ///
    /// # Errors
    /// Errors reported by the network.
    pub fn end(&mut self, end: GoalEnd, result: R) -> Result<(), RosError> {
        let Some(goal) = self.running.take() else { return Ok(()) };
        if self.ended.len() >= MAX_ENDED {
            self.ended.remove(0);
        }
        self.ended.push((goal.goal_id, end, result));
        self.tell(goal, status(end))?;
        self.answer_results()
    }

    /// Answers the clients that requested the result of an ended goal.
    fn answer_results(&mut self) -> Result<(), RosError> {
        while let Some((request, message)) =
            self.inner.receive_result_request().map_err(|error| network(&self.name, error))?
        {
            self.waiting.push((message.goal_id, request));
        }
        for (goal, request) in std::mem::take(&mut self.waiting) {
            let ended = self.ended.iter().find(|(ended, ..)| *ended == goal);
            let (end, result) = match ended {
                Some((_, end, result)) => (*end, result.clone()),
                None if self.running.as_ref().is_some_and(|running| running.goal_id == goal) => {
                    self.waiting.push((goal, request));
                    continue;
                }
                None => (GoalEnd::Unknown, R::default()),
            };
            let response = GetResultResponse { status: status(end), result: Wire(Ok(AfterStatus(result))) };
            self.inner.send_result(request, response).map_err(|error| network(&self.name, error))?;
        }
        Ok(())
    }

    fn tell(&self, goal_info: GoalInfo, status: GoalStatusEnum) -> Result<(), RosError> {
        let statuses = GoalStatusArray { status_list: vec![StatusMessage { goal_info, status }] };
        self.inner.send_goal_statuses(statuses).map_err(|error| network(&self.name, error.forget_data()))
    }
}

fn status(end: GoalEnd) -> GoalStatusEnum {
    match end {
        GoalEnd::Succeeded => GoalStatusEnum::Succeeded,
        GoalEnd::Cancelled => GoalStatusEnum::Canceled,
        GoalEnd::Aborted => GoalStatusEnum::Aborted,
        GoalEnd::Unknown => GoalStatusEnum::Unknown,
    }
}
