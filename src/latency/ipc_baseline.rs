//! The least that iceoryx2 can do: one publisher and one subscriber of the state's size, with an event, and nothing of wormd's
//! around them. What delivery costs wormd is held against it.

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

/// Values that a subscriber may be behind.
const BUFFER: usize = 64;

/// The bare pair could not be made, or failed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the bare publisher and subscriber that delivery is held against failed to {doing}: {reason}")]
pub struct BareError {
    /// What was tried.
    pub doing: &'static str,
    /// iceoryx2's reason.
    pub reason: String,
}

impl BareError {
    fn of<E: Debug>(doing: &'static str) -> impl FnOnce(E) -> Self {
        move |error| Self {
            doing,
            reason: format!("{error:?}"),
        }
    }
}

/// The two services. They may move between threads; the ports made from them may not.
pub struct Bare {
    topic: publish_subscribe::PortFactory<ipc::Service, State, ()>,
    event: event::PortFactory<ipc::Service>,
    // Last, so that it is dropped last.
    _node: Node<ipc::Service>,
}

impl Bare {
    /// Makes the services beside those of a worm.
    ///
    /// # Errors
    /// [`BareError`].
    pub fn open(instance: &Instance) -> Result<Self, BareError> {
        let node = NodeBuilder::new()
            .config(instance.iceoryx())
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<ipc::Service>()
            .map_err(BareError::of("create a node"))?;
        let name = "latency/bare".try_into().map_err(BareError::of("name the services"))?;
        Ok(Self {
            topic: node
                .service_builder(&name)
                .publish_subscribe::<State>()
                .enable_safe_overflow(true)
                .subscriber_max_buffer_size(BUFFER)
                .open_or_create()
                .map_err(BareError::of("open the topic"))?,
            event: node
                .service_builder(&name)
                .event()
                .open_or_create()
                .map_err(BareError::of("open the event"))?,
            _node: node,
        })
    }

    /// The end that publishes, for the calling thread.
    ///
    /// # Errors
    /// [`BareError`].
    pub fn speaker(&self) -> Result<Speaker, BareError> {
        Ok(Speaker {
            publisher: self
                .topic
                .publisher_builder()
                .create()
                .map_err(BareError::of("create the publisher"))?,
            notifier: self
                .event
                .notifier_builder()
                .create()
                .map_err(BareError::of("create the notifier"))?,
            value: State::unknown(worm_physics::MAX_CELLS),
        })
    }

    /// The end that is woken by the event, for the calling thread.
    ///
    /// # Errors
    /// [`BareError`].
    pub fn sleeper(&self) -> Result<Sleeper, BareError> {
        Ok(Sleeper {
            listener: self
                .event
                .listener_builder()
                .create()
                .map_err(BareError::of("create the listener"))?,
            poller: self.poller()?,
        })
    }

    /// The end that looks without being woken, for the calling thread.
    ///
    /// # Errors
    /// [`BareError`].
    pub fn poller(&self) -> Result<Poller, BareError> {
        let subscriber = self
            .topic
            .subscriber_builder()
            .buffer_size(BUFFER)
            .create()
            .map_err(BareError::of("create the subscriber"))?;
        Ok(Poller { subscriber })
    }
}

/// Publishes the time at which it began to.
pub struct Speaker {
    publisher: Publisher<ipc::Service, State, ()>,
    notifier: Notifier<ipc::Service>,
    value: State,
}

impl Speaker {
    /// Publishes, and wakes who sleeps; gives how long the waking took, ns.
    ///
    /// # Errors
    /// [`BareError`].
    pub fn speak(&mut self) -> Result<u64, BareError> {
        self.value.time_ns = monotonic_ns();
        self.publisher
            .loan_uninit()
            .map_err(BareError::of("take a loan"))?
            .write_payload(self.value)
            .send()
            .map_err(BareError::of("send"))?;
        let sent = monotonic_ns();
        self.notifier.notify().map_err(BareError::of("notify"))?;
        Ok(monotonic_ns() - sent)
    }
}

/// Receives, and tells how old what it received is.
pub struct Poller {
    subscriber: Subscriber<ipc::Service, State, ()>,
}

impl Poller {
    /// Hands over the age of each value that has come, ns.
    ///
    /// # Errors
    /// [`BareError`].
    pub fn look(&self, mut take: impl FnMut(u64)) -> Result<(), BareError> {
        while let Some(sample) = self.subscriber.receive().map_err(BareError::of("receive"))? {
            take(monotonic_ns().saturating_sub(sample.time_ns));
        }
        Ok(())
    }
}

/// As a [`Poller`], that sleeps until the event.
pub struct Sleeper {
    listener: Listener<ipc::Service>,
    poller: Poller,
}

impl Sleeper {
    /// Sleeps, no longer than `timeout`, and hands over the age of each value that has come, ns.
    ///
    /// # Errors
    /// [`BareError`].
    pub fn sleep(&self, timeout: Duration, take: impl FnMut(u64)) -> Result<(), BareError> {
        self.listener
            .timed_wait(|_| {}, timeout)
            .map_err(BareError::of("wait"))?;
        self.poller.look(take)
    }
}
