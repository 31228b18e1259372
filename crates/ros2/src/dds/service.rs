//! Services: requests and their answers.

use std::time::{Duration, Instant};

use super::failure::network;
use super::wait::wait_for;
use super::wire::Wire;
use crate::cdr::Cdr;
use crate::error::RosError;

/// Identifier of the request to which an answer belongs.
pub type RequestId = ros2_client::RmwRequestId;

/// The type of a service, such as `std_srvs/srv/Trigger`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ServiceType {
    /// The package, such as `std_srvs`.
    pub package: &'static str,
    /// The name, such as `Trigger`.
    pub name: &'static str,
}

/// The server of a service.
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

    /// The next request, or the reason why it is invalid; `None` if none arrives in time. An invalid request must also
    /// be answered.
    ///
    /// # Errors
    /// Errors reported by the network.
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
    /// Errors reported by the network.
    pub fn answer(&self, request: RequestId, answer: A) -> Result<(), RosError> {
        self.inner.send_response(request, Wire(Ok(answer))).map_err(|error| network(&self.name, error))
    }
}
