//! A node: a named participant on the network.

use std::net::Ipv4Addr;
use std::str::FromStr;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use ros2_client::action::{ActionClientQosPolicies, ActionServerQosPolicies};
use ros2_client::dds::ServiceMapping;
use ros2_client::dds::rustdds::DomainParticipantBuilder;
use ros2_client::{
    ActionTypeName, Context, MessageTypeName, Name, NodeName, NodeOptions, ParameterValue, ServiceTypeName,
};

use super::action::{ActionClient, ActionType};
use super::action_server::ActionServer;
use super::failure::network;
use super::panics::network_thread;
use super::service::{Server, ServiceType};
use super::topic::{Publisher, Qos, Subscription};
use super::wait::wait_for;
use crate::cdr::Cdr;
use crate::error::RosError;
use crate::messages::Message;
use crate::names::Naming;

/// The middleware whose form of services is used. ROS 2's two usual middlewares send services in different forms, but
/// topics in the same form.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Rmw {
    /// `rmw_fastrtps_cpp`, ROS 2's default.
    #[default]
    FastRtps,
    /// `rmw_cyclonedds_cpp`.
    CycloneDds,
}

impl FromStr for Rmw {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "fastrtps" | "rmw_fastrtps_cpp" => Ok(Self::FastRtps),
            "cyclonedds" | "rmw_cyclonedds_cpp" => Ok(Self::CycloneDds),
            _ => Err(format!("expected fastrtps or cyclonedds, found \"{text}\"")),
        }
    }
}

impl Rmw {
    fn mapping(self) -> ServiceMapping {
        match self {
            Self::FastRtps => ServiceMapping::Enhanced,
            Self::CycloneDds => ServiceMapping::Cyclone,
        }
    }
}

/// The highest domain for which there are ports.
pub(super) const MAX_DOMAIN: u16 = 232;
/// Size of a socket's buffer: larger than the system's default, because a picture is a burst of hundreds of packets.
/// The kernel limits the value.
const SOCKET_BUFFER_BYTES: usize = 8 << 20;

/// Interval after which `wait_for_service` is called again. The function checks the matches when it is called and then
/// waits for events. `ros2-client` keeps eight events and drops the rest: if the endpoints of two actions are matched
/// within a millisecond, the last event may be dropped.
const MATCH_AGAIN: Duration = Duration::from_millis(100);
/// Wait after a match: Cyclone's readers ask a new writer for its state, and ignore the writer's messages until the
/// answer arrives; see action.rs.
const SETTLE: Duration = Duration::from_millis(200);

/// The settings of a node before it joins.
#[derive(Debug, Clone)]
pub struct NodeConfig {
    /// Name, namespace and remappings of the node.
    pub naming: Naming,
    /// The domain, as in `ROS_DOMAIN_ID`.
    pub domain_id: u16,
    /// The middleware of the services.
    pub rmw: Rmw,
    /// Whether the node announces itself and sends on this computer only. RustDDS's sockets still receive packets of
    /// other computers.
    pub is_loopback_only: bool,
    /// The parameters for `ros2 param get`, by name.
    pub parameters: Vec<(String, String)>,
}

impl NodeConfig {
    /// Settings for domain 0 on all networks, without parameters.
    pub fn new(naming: Naming) -> Self {
        Self { naming, domain_id: 0, rmw: Rmw::default(), is_loopback_only: false, parameters: Vec::new() }
    }
}

/// A node on the network, until it is dropped.
pub struct Node {
    // Dropped first, because dropping the inner node ends the spinner.
    node: Option<ros2_client::Node>,
    naming: Naming,
    rmw: Rmw,
    spinner: Option<JoinHandle<()>>,
}

impl Node {
    /// Joins the network.
    ///
    /// # Errors
    /// [`RosError`] for an invalid domain or name, or if no socket can be opened.
    pub fn join(config: NodeConfig) -> Result<Self, RosError> {
        let NodeConfig { naming, domain_id, rmw, is_loopback_only, parameters } = config;
        if domain_id > MAX_DOMAIN {
            return Err(network("domain id", format!("expected 0 to {MAX_DOMAIN}, found {domain_id}")));
        }
        let mut builder = DomainParticipantBuilder::new(domain_id).socket_receive_buffer_size(SOCKET_BUFFER_BYTES);
        if is_loopback_only {
            builder = builder.with_only_networks([Ipv4Addr::LOCALHOST]);
        }
        let participant = builder.build().map_err(|error| network("ROS 2", error))?;
        let context = Context::from_domain_participant(participant).map_err(|error| network("ROS 2", error))?;
        let name = NodeName::new(naming.namespace(), naming.node()).map_err(|error| network("node", error))?;
        // The parameter services of `ros2-client` support only the calls of Fast DDS.
        let mut options = NodeOptions::new().enable_rosout(true).start_parameter_services(rmw == Rmw::FastRtps);
        for (parameter, value) in &parameters {
            options = options.declare_parameter(parameter, ParameterValue::String(value.clone()));
        }
        // This function also checks the initial values, including use_sim_time, which every node has.
        let is_fixed = move |name: &str, value: &ParameterValue| match value {
            ParameterValue::String(text) if parameters.iter().any(|(known, told)| known == name && told == text) => {
                Ok(())
            }
            ParameterValue::Boolean(false) if name == "use_sim_time" => Ok(()),
            _ => Err("it is set on the command line of the node".to_owned()),
        };
        options = options.parameter_validator(Box::new(is_fixed));
        let mut node = context.new_node(name, options).map_err(|error| network("node", error))?;
        let spinner = node.spinner().map_err(|error| network("node", error))?;
        let spinner = network_thread("node", move || drop(wait_for(spinner.spin(), None)))?;
        Ok(Self { node: Some(node), naming, rmw, spinner: Some(spinner) })
    }

    /// The naming of the node, for the resolution of names.
    pub fn naming(&self) -> &Naming {
        &self.naming
    }

    /// Subscribes to a topic.
    ///
    /// # Errors
    /// [`RosError`] for an invalid name, and errors reported by the network.
    pub fn subscribe<T: Message + 'static>(&mut self, topic: &str, qos: Qos) -> Result<Subscription<T>, RosError> {
        let (absolute, name) = self.name(topic)?;
        let profile = qos.profile();
        let node = self.node()?;
        let topic = node
            .create_topic(&name, MessageTypeName::new(T::PACKAGE, T::NAME), &profile)
            .map_err(|error| network(&absolute, error))?;
        let inner = node.create_subscription(&topic, Some(profile)).map_err(|error| network(&absolute, error))?;
        Ok(Subscription::new(absolute, inner))
    }

    /// Creates a publisher for a topic.
    ///
    /// # Errors
    /// As for [`Self::subscribe`].
    pub fn publish<T: Message>(&mut self, topic: &str, qos: Qos) -> Result<Publisher<T>, RosError> {
        let (absolute, name) = self.name(topic)?;
        let profile = qos.profile();
        let node = self.node()?;
        let topic = node
            .create_topic(&name, MessageTypeName::new(T::PACKAGE, T::NAME), &profile)
            .map_err(|error| network(&absolute, error))?;
        let inner = node.create_publisher(&topic, Some(profile)).map_err(|error| network(&absolute, error))?;
        Ok(Publisher::new(absolute, inner))
    }

    /// Creates the server of a service.
    ///
    /// # Errors
    /// As for [`Self::subscribe`].
    pub fn serve<Q: Cdr + Clone + 'static, A: Cdr + 'static>(
        &mut self,
        service: &str,
        of: ServiceType,
    ) -> Result<Server<Q, A>, RosError> {
        let (absolute, name) = self.name(service)?;
        let (mapping, profile) = (self.rmw.mapping(), Qos::SERVICES.profile());
        let type_name = ServiceTypeName::new(of.package, of.name);
        let inner = self
            .node()?
            .create_server(mapping, &name, &type_name, profile.clone(), profile)
            .map_err(|error| network(&absolute, error))?;
        Ok(Server::new(absolute, inner))
    }

    /// Creates a client of an action: three services and two topics.
    ///
    /// # Errors
    /// As for [`Self::subscribe`].
    pub fn action_client<G, R, F>(&mut self, action: &str, of: ActionType) -> Result<ActionClient<G, R, F>, RosError>
    where
        G: Cdr + Clone + 'static,
        R: Cdr + Clone + 'static,
        F: Cdr + Clone + 'static,
    {
        let (absolute, name) = self.name(action)?;
        let (mapping, qos) = (self.rmw.mapping(), Qos::SERVICES.profile());
        let qos = ActionClientQosPolicies {
            goal_service: qos.clone(),
            result_service: qos.clone(),
            cancel_service: qos.clone(),
            feedback_subscription: qos,
            status_subscription: Qos::STATUSES.profile(),
        };
        let of = ActionTypeName::new(of.package, of.name);
        let inner =
            self.node()?.create_action_client(mapping, &name, &of, qos).map_err(|error| network(&absolute, error))?;
        Ok(ActionClient::new(absolute, inner))
    }

    /// Creates the server of an action.
    ///
    /// # Errors
    /// As for [`Self::subscribe`].
    pub fn action_server<G, R, F>(&mut self, action: &str, of: ActionType) -> Result<ActionServer<G, R, F>, RosError>
    where
        G: Cdr + Clone + 'static,
        R: Cdr + Clone + Default + 'static,
        F: Cdr + Clone + 'static,
    {
        let (absolute, name) = self.name(action)?;
        let (mapping, qos) = (self.rmw.mapping(), Qos::SERVICES.profile());
        let qos = ActionServerQosPolicies {
            goal_service: qos.clone(),
            result_service: qos.clone(),
            cancel_service: qos.clone(),
            feedback_publisher: qos,
            status_publisher: Qos::STATUSES.profile(),
        };
        let of = ActionTypeName::new(of.package, of.name);
        let inner =
            self.node()?.create_action_server(mapping, &name, &of, qos).map_err(|error| network(&absolute, error))?;
        Ok(ActionServer::new(absolute, inner))
    }

    fn name(&self, name: &str) -> Result<(String, Name), RosError> {
        let absolute = self.naming.resolve(name)?;
        let name = Name::parse(&absolute).map_err(|error| network(&absolute, error))?;
        Ok((absolute, name))
    }

    fn node(&mut self) -> Result<&mut ros2_client::Node, RosError> {
        self.node.as_mut().ok_or_else(|| network("node", "it has left"))
    }

    /// Waits until a server of an action exists.
    ///
    /// # Errors
    /// [`RosError::Network`] if there is no server in time.
    pub fn wait_for_server<G, R, F>(&self, client: &ActionClient<G, R, F>, timeout: Duration) -> Result<(), RosError>
    where
        G: Cdr + Clone + 'static,
        R: Cdr + Clone + 'static,
        F: Cdr + Clone + 'static,
    {
        let Some(node) = &self.node else { return Err(network(client.name(), "the node has left")) };
        let inner = client.inner();
        let deadline = Instant::now() + timeout;
        while Instant::now() < deadline {
            let all = async {
                inner.goal_client().wait_for_service(node).await;
                inner.result_client().wait_for_service(node).await;
                inner.cancel_client().wait_for_service(node).await;
            };
            if wait_for(all, Some(Instant::now() + MATCH_AGAIN)).is_some() {
                std::thread::sleep(SETTLE);
                return Ok(());
            }
        }
        let secs = timeout.as_secs_f64();
        Err(network(client.name(), format!("no server of this action within {secs:.0} s")))
    }

    /// Number of readers of a topic to which this node publishes.
    pub fn num_readers<T: Cdr>(&self, publisher: &Publisher<T>) -> usize {
        self.node.as_ref().map_or(0, |node| publisher.inner().get_subscription_count(node))
    }
}

impl Drop for Node {
    fn drop(&mut self) {
        self.node = None;
        if let Some(spinner) = self.spinner.take() {
            // If the spinner's thread panicked, it has already printed a message.
            let _ = spinner.join();
        }
    }
}
