//! Services: requests and their answers.

use std::time::{Duration, Instant};

use super::node::{Node, network};
use super::wait::wait_for;
use super::wire::Wire;
use crate::cdr::Cdr;
use crate::error::RosError;

/// Which request an answer is for.
pub type RequestId = ros2_client::RmwRequestId;

/// A service's type, as in `std_srvs/srv/Trigger`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ServiceType {
    /// `std_srvs`
    pub package: &'static str,
    /// `Trigger`
    pub name: &'static str,
}

/// Answers requests.
pub struct Server<Q: Cdr + 'static, A: Cdr + 'static> {
    name: String,
    inner: ros2_client::Server<Wire<Q>, Wire<A>>,
}

impl<Q: Cdr + 'static, A: Cdr + 'static> Server<Q, A> {
    pub(super) fn new(name: String, inner: ros2_client::Server<Wire<Q>, Wire<A>>) -> Self {
        Self { name, inner }
    }

    /// The service's absolute name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The next request, or why it is none; `None` where none comes in time. Either is to be answered.
    ///
    /// # Errors
    /// What the network reports.
    #[allow(clippy::type_complexity, reason = "a request and its number")]
    pub fn receive(&self, timeout: Duration) -> Result<Option<(RequestId, Result<Q, RosError>)>, RosError> {
        let taken = wait_for(self.inner.async_receive_request(), Some(Instant::now() + timeout));
        let Some(taken) = taken else { return Ok(None) };
        let (id, Wire(request)) = taken.map_err(|error| network(&self.name, error))?;
        Ok(Some((id, request.map_err(|source| RosError::Malformed { topic: self.name.clone(), source }))))
    }

    /// Answers a request.
    ///
    /// # Errors
    /// What the network reports.
    pub fn answer(&self, request: RequestId, answer: A) -> Result<(), RosError> {
        self.inner.send_response(request, Wire(Ok(answer))).map_err(|error| network(&self.name, error))
    }
}

/// Sends requests.
pub struct ServiceClient<Q: Cdr + 'static, A: Cdr + 'static> {
    name: String,
    inner: ros2_client::Client<Wire<Q>, Wire<A>>,
}

impl<Q: Cdr + 'static, A: Cdr + 'static> ServiceClient<Q, A> {
    pub(super) fn new(name: String, inner: ros2_client::Client<Wire<Q>, Wire<A>>) -> Self {
        Self { name, inner }
    }

    /// Waits until somebody answers this service.
    ///
    /// # Errors
    /// Nobody in time.
    pub fn wait_for_server(&self, node: &Node, timeout: Duration) -> Result<(), RosError> {
        let Some(inner) = node.inner() else { return Err(network(&self.name, "the node has left")) };
        wait_for(self.inner.wait_for_service(inner), Some(Instant::now() + timeout)).ok_or_else(|| {
            network(&self.name, format!("nobody answers this service within {:.0} s", timeout.as_secs_f64()))
        })
    }

    /// Sends a request.
    ///
    /// # Errors
    /// What the network reports.
    pub fn send(&self, request: Q) -> Result<RequestId, RosError> {
        self.inner.send_request(Wire(Ok(request))).map_err(|error| network(&self.name, error))
    }

    /// The answer to a request; `None` where it does not come in time. Answers to other requests are thrown away.
    ///
    /// # Errors
    /// [`RosError::Malformed`], and what the network reports.
    pub fn receive(&self, request: RequestId, timeout: Duration) -> Result<Option<A>, RosError> {
        let taken = wait_for(self.inner.async_receive_response(request), Some(Instant::now() + timeout));
        let Some(taken) = taken else { return Ok(None) };
        let Wire(answer) = taken.map_err(|error| network(&self.name, error))?;
        answer.map(Some).map_err(|source| RosError::Malformed { topic: self.name.clone(), source })
    }

    /// Sends a request and waits for its answer.
    ///
    /// # Errors
    /// No answer in time, and as [`Self::receive`].
    pub fn call(&self, request: Q, timeout: Duration) -> Result<A, RosError> {
        let id = self.send(request)?;
        self.receive(id, timeout)?
            .ok_or_else(|| network(&self.name, format!("no answer within {:.1} s", timeout.as_secs_f64())))
    }
}
