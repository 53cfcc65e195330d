//! The services of a worm as iceoryx2 has them, and their limits.

use iceoryx2::prelude::{Node, ipc};
use iceoryx2::service::port_factory::{event, publish_subscribe, request_response};
use worm_estimator::message::{
    Alarm, BlackBoxStatus, Command, CommandRecord, Cycle, Estimate, Inferred, Range, RecordingStatus, Reply, State,
    Timing, TripStatus,
};

/// The variant of iceoryx2 in use: between processes, ports bound to their thread.
pub type Ipc = ipc::Service;
pub type TopicService<T> = publish_subscribe::PortFactory<Ipc, T, ()>;
pub type EventService = event::PortFactory<Ipc>;
pub type CommandService = request_response::PortFactory<Ipc, Command, (), Reply, ()>;

/// Maximum number of subscribers of a topic, and of listeners of an event.
pub(super) const MAX_READERS: usize = 16;
/// Maximum number of publishers of a topic, and of servers of commands: one, and one more for a tunnel or a killed predecessor.
pub(super) const MAX_WRITERS: usize = 2;
/// Maximum number of processes that use a worm's topics.
pub(super) const MAX_NODES: usize = 48;
/// Samples that a subscriber may hold at once: the current one, and the next while it searches for the latest.
pub(super) const MAX_BORROWED: usize = 2;

/// The services of one worm. Movable between threads, unlike the ports made from it.
pub struct Services {
    pub(super) state: TopicService<State>,
    pub(super) timing: TopicService<Timing>,
    pub(super) estimate: TopicService<Estimate>,
    pub(super) cycle: TopicService<Cycle>,
    pub(super) alarm: TopicService<Alarm>,
    pub(super) range: TopicService<Range>,
    pub(super) recording: TopicService<RecordingStatus>,
    pub(super) trip: TopicService<TripStatus>,
    pub(super) inferred: TopicService<Inferred>,
    pub(super) black_box: TopicService<BlackBoxStatus>,
    pub(super) state_event: EventService,
    pub(super) alarm_event: EventService,
    pub(super) command: TopicService<CommandRecord>,
    pub(super) command_service: CommandService,
    // Last, so that it is dropped last.
    pub(super) _node: Node<Ipc>,
}
