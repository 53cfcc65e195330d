//! Opens or creates every service of a worm, with the same settings in every process.

use super::instance::Instance;
use super::services::{
    CommandService, EventService, Ipc, MAX_BORROWED, MAX_NODES, MAX_READERS, MAX_WRITERS, Services, TopicService,
};
use super::topic::Topic;
use iceoryx2::prelude::{CallbackProgression, Node, NodeBuilder, NodeState, ServiceName, SignalHandlingMode};
use std::fmt::Debug;
use worm_estimator::message::{Alarm, Command, Reply, State};

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

/// Cleans up after dead processes, joins the instance as a new node, and opens every service. May hang: see `start`.
pub(super) fn open(instance: &Instance) -> Result<Services, Refused> {
    remove_dead_nodes(instance);
    let node = NodeBuilder::new()
        .config(instance.iceoryx())
        .signal_handling_mode(SignalHandlingMode::Disabled)
        .create::<Ipc>()
        .map_err(Refused::at("creating the node"))?;
    Ok(Services {
        state: open_topic(&node, instance)?,
        timing: open_topic(&node, instance)?,
        estimate: open_topic(&node, instance)?,
        cycle: open_topic(&node, instance)?,
        alarm: open_topic(&node, instance)?,
        range: open_topic(&node, instance)?,
        recording: open_topic(&node, instance)?,
        trip: open_topic(&node, instance)?,
        inferred: open_topic(&node, instance)?,
        black_box: open_topic(&node, instance)?,
        state_event: open_event(&node, instance, State::NAME)?,
        alarm_event: open_event(&node, instance, Alarm::NAME)?,
        command: open_topic(&node, instance)?,
        command_service: open_command(&node, instance)?,
        _node: node,
    })
}

/// Frees what killed processes held: their slots as publishers and subscribers, and their memory.
fn remove_dead_nodes(instance: &Instance) {
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
        // A command whose sender has stopped waiting must not be executed any more.
        .enable_fire_and_forget_requests(false)
        .max_clients(MAX_READERS)
        .max_servers(MAX_WRITERS)
        .max_nodes(MAX_NODES)
        .open_or_create()
        .map_err(Refused::at(format!("{} (service)", instance.service("command"))))
}
