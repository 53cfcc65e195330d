//! Every service of a worm, opened or created with the same settings by whoever comes first.

use super::instance::Instance;
use super::topic::Topic;
use iceoryx2::prelude::{CallbackProgression, Node, NodeBuilder, NodeState, ServiceName, SignalHandlingMode, ipc};
use iceoryx2::service::port_factory::{event, publish_subscribe, request_response};
use std::fmt::Debug;
use worm_estimator::message::{Alarm, Command, Cycle, Estimate, Reply, State, Timing};

/// The iceoryx2 flavour in use: between processes, ports bound to their thread.
pub type Ipc = ipc::Service;
pub type TopicService<T> = publish_subscribe::PortFactory<Ipc, T, ()>;
pub type EventService = event::PortFactory<Ipc>;
pub type CommandService = request_response::PortFactory<Ipc, Command, (), Reply, ()>;

/// Most subscribers of a topic, and most listeners of an event.
pub(super) const MAX_READERS: usize = 16;
/// Most publishers of a topic and servers of commands: one, and one more for a tunnel or a killed predecessor.
pub(super) const MAX_WRITERS: usize = 2;
/// Most processes that take part in a worm's topics.
pub(super) const MAX_NODES: usize = 48;
/// Samples that a subscriber may hold at once: the one it shows, and the next while it looks for the latest.
const MAX_BORROWED: usize = 2;

/// A step of the start that iceoryx2 refused.
#[derive(Debug, thiserror::Error)]
#[error("{step}: {reason}")]
pub(super) struct Refused {
    pub(super) step: String,
    pub(super) reason: String,
}

impl Refused {
    fn at<E: Debug>(step: impl Into<String>) -> impl FnOnce(E) -> Self {
        move |error| Self {
            step: step.into(),
            reason: format!("{error:?}"),
        }
    }
}

/// The services of one worm. Movable between threads, unlike the ports made from it.
pub struct Services {
    pub(super) state: TopicService<State>,
    pub(super) timing: TopicService<Timing>,
    pub(super) estimate: TopicService<Estimate>,
    pub(super) cycle: TopicService<Cycle>,
    pub(super) alarm: TopicService<Alarm>,
    pub(super) state_event: EventService,
    pub(super) alarm_event: EventService,
    pub(super) command: CommandService,
    // Last, so that it is dropped last.
    _node: Node<Ipc>,
}

impl Services {
    /// Cleans up after dead processes, joins the instance as a new node, and opens everything. May hang: see `start`.
    pub(super) fn open(instance: &Instance) -> Result<Self, Refused> {
        clean_up_after_the_dead(instance);
        let node = NodeBuilder::new()
            .config(instance.iceoryx())
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<Ipc>()
            .map_err(Refused::at("creating the node"))?;
        Ok(Self {
            state: open_topic(&node, instance)?,
            timing: open_topic(&node, instance)?,
            estimate: open_topic(&node, instance)?,
            cycle: open_topic(&node, instance)?,
            alarm: open_topic(&node, instance)?,
            state_event: open_event(&node, instance, State::NAME)?,
            alarm_event: open_event(&node, instance, Alarm::NAME)?,
            command: open_command(&node, instance)?,
            _node: node,
        })
    }
}

/// Frees what killed processes held: their places as publishers and subscribers, and their memory.
fn clean_up_after_the_dead(instance: &Instance) {
    let result = Node::<Ipc>::list(instance.iceoryx(), |node| {
        if let NodeState::Dead(dead) = node
            && let Err(error) = dead.try_remove_stale_resources()
        {
            tracing::debug!("cleaning up after a dead process: {error}");
        }
        CallbackProgression::Continue
    });
    if let Err(error) = result {
        tracing::debug!("looking for dead processes: {error}");
    }
}

fn service_name(instance: &Instance, topic: &str) -> Result<ServiceName, Refused> {
    let name = instance.service(topic);
    ServiceName::new(&name).map_err(Refused::at(name))
}

fn open_topic<T: Topic>(node: &Node<Ipc>, instance: &Instance) -> Result<TopicService<T>, Refused> {
    let name = service_name(instance, T::NAME)?;
    node.service_builder(&name)
        .publish_subscribe::<T>()
        .enable_safe_overflow(true)
        .history_size(T::HISTORY)
        .subscriber_max_buffer_size(T::BUFFER)
        .subscriber_max_borrowed_samples(MAX_BORROWED)
        .max_subscribers(MAX_READERS)
        .max_publishers(MAX_WRITERS)
        .max_nodes(MAX_NODES)
        .open_or_create()
        .map_err(Refused::at(instance.service(T::NAME)))
}

fn open_event(node: &Node<Ipc>, instance: &Instance, topic: &str) -> Result<EventService, Refused> {
    let name = service_name(instance, topic)?;
    node.service_builder(&name)
        .event()
        .max_listeners(MAX_READERS)
        .max_notifiers(MAX_WRITERS)
        .max_nodes(MAX_NODES)
        .open_or_create()
        .map_err(Refused::at(format!("{} (event)", instance.service(topic))))
}

fn open_command(node: &Node<Ipc>, instance: &Instance) -> Result<CommandService, Refused> {
    let name = service_name(instance, "command")?;
    node.service_builder(&name)
        .request_response::<Command, Reply>()
        // A command whose sender has given up waiting must not be carried out any more.
        .enable_fire_and_forget_requests(false)
        .max_clients(MAX_READERS)
        .max_servers(MAX_WRITERS)
        .max_nodes(MAX_NODES)
        .open_or_create()
        .map_err(Refused::at(instance.service("command")))
}
