//! The fastest delivery that iceoryx2 allows: one publisher and one subscriber of a payload as large as the state, with an event,
//! and none of wormd's code around them. wormd's own delivery is compared with it.

use crate::realtime::monotonic_ns;
use crate::topics::Instance;
use iceoryx2::port::listener::Listener;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::{Node, NodeBuilder, SignalHandlingMode, ipc};
use iceoryx2::service::port_factory::{event, publish_subscribe};
use std::fmt::Debug;
use std::time::Duration;
use worm_estimator::message::State;

/// How many values a subscriber may lag behind.
const BUFFER: usize = 64;

/// The bare pair could not be created, or failed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the bare publisher and subscriber that delivery is compared with failed to {doing}: {reason}")]
pub struct IpcBaselineError {
    /// What was tried.
    pub doing: &'static str,
    /// iceoryx2's reason.
    pub reason: String,
}

impl IpcBaselineError {
    fn of<E: Debug>(doing: &'static str) -> impl FnOnce(E) -> Self {
        move |error| Self {
            doing,
            reason: format!("{error:?}"),
        }
    }
}

/// The two services of the bare pair. They may move between threads; the ports made from them may not.
pub struct IpcBaseline {
    topic: publish_subscribe::PortFactory<ipc::Service, State, ()>,
    event: event::PortFactory<ipc::Service>,
    // Last, so that it is dropped last.
    _node: Node<ipc::Service>,
}

impl IpcBaseline {
    /// Opens the services beside those of a worm.
    ///
    /// # Errors
    /// [`IpcBaselineError`].
    pub fn open(instance: &Instance) -> Result<Self, IpcBaselineError> {
        let node = NodeBuilder::new()
            .config(instance.iceoryx())
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<ipc::Service>()
            .map_err(IpcBaselineError::of("create a node"))?;
        let name = "latency/bare"
            .try_into()
            .map_err(IpcBaselineError::of("name the services"))?;
        Ok(Self {
            topic: node
                .service_builder(&name)
                .publish_subscribe::<State>()
                .enable_safe_overflow(true)
                .subscriber_max_buffer_size(BUFFER)
                .open_or_create()
                .map_err(IpcBaselineError::of("open the topic"))?,
            event: node
                .service_builder(&name)
                .event()
                .open_or_create()
                .map_err(IpcBaselineError::of("open the event"))?,
            _node: node,
        })
    }

    /// The publisher, for the calling thread.
    ///
    /// # Errors
    /// [`IpcBaselineError`].
    pub fn publisher(&self) -> Result<BaselinePublisher, IpcBaselineError> {
        Ok(BaselinePublisher {
            publisher: self
                .topic
                .publisher_builder()
                .create()
                .map_err(IpcBaselineError::of("create the publisher"))?,
            notifier: self
                .event
                .notifier_builder()
                .create()
                .map_err(IpcBaselineError::of("create the notifier"))?,
            value: State::unknown(worm_physics::MAX_CELLS),
        })
    }

    /// A subscriber that the event wakes, for the calling thread.
    ///
    /// # Errors
    /// [`IpcBaselineError`].
    pub fn waiting_subscriber(&self) -> Result<WaitingSubscriber, IpcBaselineError> {
        Ok(WaitingSubscriber {
            listener: self
                .event
                .listener_builder()
                .create()
                .map_err(IpcBaselineError::of("create the listener"))?,
            subscriber: self.polling_subscriber()?,
        })
    }

    /// A subscriber that polls, for the calling thread.
    ///
    /// # Errors
    /// [`IpcBaselineError`].
    pub fn polling_subscriber(&self) -> Result<PollingSubscriber, IpcBaselineError> {
        let subscriber = self
            .topic
            .subscriber_builder()
            .buffer_size(BUFFER)
            .create()
            .map_err(IpcBaselineError::of("create the subscriber"))?;
        Ok(PollingSubscriber { subscriber })
    }
}

/// Publishes the time at which it began to publish.
pub struct BaselinePublisher {
    publisher: Publisher<ipc::Service, State, ()>,
    notifier: Notifier<ipc::Service>,
    value: State,
}

impl BaselinePublisher {
    /// Publishes, and wakes the waiting subscriber; returns how long the notification took, ns.
    ///
    /// # Errors
    /// [`IpcBaselineError`].
    pub fn publish(&mut self) -> Result<u64, IpcBaselineError> {
        self.value.time_ns = monotonic_ns();
        self.publisher
            .loan_uninit()
            .map_err(IpcBaselineError::of("take a loan"))?
            .write_payload(self.value)
            .send()
            .map_err(IpcBaselineError::of("send"))?;
        let sent = monotonic_ns();
        self.notifier.notify().map_err(IpcBaselineError::of("notify"))?;
        Ok(monotonic_ns() - sent)
    }
}

/// Receives without sleeping, and measures the age of what it receives.
pub struct PollingSubscriber {
    subscriber: Subscriber<ipc::Service, State, ()>,
}

impl PollingSubscriber {
    /// Passes the age of each new value to `take`, ns.
    ///
    /// # Errors
    /// [`IpcBaselineError`].
    pub fn poll(&self, mut take: impl FnMut(u64)) -> Result<(), IpcBaselineError> {
        while let Some(sample) = self.subscriber.receive().map_err(IpcBaselineError::of("receive"))? {
            take(monotonic_ns().saturating_sub(sample.time_ns));
        }
        Ok(())
    }
}

/// A [`PollingSubscriber`] that sleeps until the event.
pub struct WaitingSubscriber {
    listener: Listener<ipc::Service>,
    subscriber: PollingSubscriber,
}

impl WaitingSubscriber {
    /// Sleeps until the event, at most `timeout`, and passes the age of each new value to `take`, ns.
    ///
    /// # Errors
    /// [`IpcBaselineError`].
    pub fn wait(&self, timeout: Duration, take: impl FnMut(u64)) -> Result<(), IpcBaselineError> {
        self.listener
            .timed_wait(|_| {}, timeout)
            .map_err(IpcBaselineError::of("wait"))?;
        self.subscriber.poll(take)
    }
}
