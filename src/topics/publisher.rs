//! Sending values.

use super::error::PortError;
use super::services::{Ipc, MAX_WRITERS, Services};
use super::start::Presence;
use super::topic::Topic;
use iceoryx2::port::publisher::{Publisher as Port, PublisherCreateError};
use iceoryx2::port::update_connections::{ConnectionFailure, UpdateConnections};
use iceoryx2::port::{LoanError, SendError};
use iceoryx2::sample_mut::SampleMut;
use iceoryx2::sample_mut_uninit::SampleMutUninit;
use std::mem::MaybeUninit;
use std::sync::Arc;

/// A value that could not be published.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum PublishError {
    /// No memory for it.
    #[error("{topic}: no memory for a sample ({reason:?}): this is a fault in wormd, please report it")]
    Loan {
        /// The topic.
        topic: &'static str,
        /// iceoryx2's reason.
        reason: LoanError,
    },
    /// Not every subscriber got it.
    #[error("{topic}: not delivered to every subscriber ({reason:?}): restart the subscriber that misses it")]
    Send {
        /// The topic.
        topic: &'static str,
        /// iceoryx2's reason.
        reason: SendError,
    },
    /// A subscriber that came could not be connected.
    #[error("{topic}: a new subscriber could not be connected ({reason:?}): restart it")]
    Connect {
        /// The topic.
        topic: &'static str,
        /// iceoryx2's reason.
        reason: ConnectionFailure,
    },
}

/// Publishes one topic. Never waits for a subscriber. Bound to the thread that created it.
#[derive(Debug)]
pub struct Publisher<T: Topic> {
    port: Port<Ipc, T, ()>,
    _presence: Arc<Presence>,
}

impl<T: Topic> Publisher<T> {
    pub(super) fn create(services: &Services, presence: &Arc<Presence>) -> Result<Self, PortError> {
        let full = PublisherCreateError::ExceedsMaxSupportedPublishers;
        let service = presence.instance().service(T::NAME);
        let port = T::service(services)
            .publisher_builder()
            .create()
            .map_err(PortError::from_iceoryx(service, "publisher", MAX_WRITERS, full))?;
        Ok(Self {
            port,
            _presence: Arc::clone(presence),
        })
    }

    /// Publishes a copy of the value, written once, into the shared memory itself.
    ///
    /// # Errors
    /// [`PublishError`]; the other subscribers have got the value then.
    pub fn publish(&self, value: &T) -> Result<(), PublishError> {
        send(self.loan()?.write_payload(*value))
    }

    fn loan(&self) -> Result<SampleMutUninit<Ipc, MaybeUninit<T>, ()>, PublishError> {
        let topic = T::NAME;
        self.port
            .loan_uninit()
            .map_err(|reason| PublishError::Loan { topic, reason })
    }

    /// Lets late joiners in, and gives them the history. For a publisher that has had nothing to say for a while.
    ///
    /// # Errors
    /// [`PublishError::Connect`] when one of them could not be connected.
    pub fn idle(&self) -> Result<(), PublishError> {
        self.port
            .update_connections()
            .map_err(|reason| PublishError::Connect { topic: T::NAME, reason })
    }
}

fn send<T: Topic>(sample: SampleMut<Ipc, T, ()>) -> Result<(), PublishError> {
    match sample.send() {
        Ok(_) => Ok(()),
        Err(reason) => Err(PublishError::Send { topic: T::NAME, reason }),
    }
}
