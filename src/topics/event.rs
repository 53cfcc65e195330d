//! Waking a sleeper.

use super::error::PortError;
use super::services::{Ipc, MAX_READERS, MAX_WRITERS, Services};
use super::start::Presence;
use super::topic::Announced;
use iceoryx2::port::listener::{Listener as ListenerPort, ListenerCreateError, ListenerWaitError};
use iceoryx2::port::notifier::{Notifier as NotifierPort, NotifierCreateError, NotifierNotifyError};
use std::marker::PhantomData;
use std::sync::Arc;
use std::time::Duration;

/// Listeners that could not be woken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{topic}: its listeners could not be woken ({reason:?}): restart this process")]
pub struct NotifyError {
    /// The topic.
    pub topic: &'static str,
    /// iceoryx2's reason.
    pub reason: NotifierNotifyError,
}

/// A wait that failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{topic}: waiting for it failed ({reason:?}): restart this process")]
pub struct WaitError {
    /// The topic.
    pub topic: &'static str,
    /// iceoryx2's reason.
    pub reason: ListenerWaitError,
}

/// Wakes every listener of a topic at once; a frozen one does not hold it up. Bound to the thread that created it.
#[derive(Debug)]
pub struct Notifier<T: Announced> {
    port: NotifierPort<Ipc>,
    _topic: PhantomData<T>,
    _presence: Arc<Presence>,
}

impl<T: Announced> Notifier<T> {
    pub(super) fn create(services: &Services, presence: &Arc<Presence>) -> Result<Self, PortError> {
        let full = NotifierCreateError::ExceedsMaxSupportedNotifiers;
        let service = presence.instance().service(T::NAME);
        let port = T::event(services)
            .notifier_builder()
            .create()
            .map_err(PortError::from_iceoryx(service, "notifier", MAX_WRITERS, full))?;
        Ok(Self {
            port,
            _topic: PhantomData,
            _presence: Arc::clone(presence),
        })
    }

    /// Wakes the listeners, after the value was published. Returns how many there are.
    ///
    /// # Errors
    /// [`NotifyError`] when iceoryx2 could not notify them.
    pub fn notify(&self) -> Result<usize, NotifyError> {
        self.port
            .notify()
            .map_err(|reason| NotifyError { topic: T::NAME, reason })
    }
}

/// Sleeps until its topic's notifier wakes it. Bound to the thread that created it.
#[derive(Debug)]
pub struct Listener<T: Announced> {
    port: ListenerPort<Ipc>,
    _topic: PhantomData<T>,
    _presence: Arc<Presence>,
}

impl<T: Announced> Listener<T> {
    pub(super) fn create(services: &Services, presence: &Arc<Presence>) -> Result<Self, PortError> {
        let full = ListenerCreateError::ExceedsMaxSupportedListeners;
        let service = presence.instance().service(T::NAME);
        let port = T::event(services)
            .listener_builder()
            .create()
            .map_err(PortError::from_iceoryx(service, "listener", MAX_READERS, full))?;
        Ok(Self {
            port,
            _topic: PhantomData,
            _presence: Arc::clone(presence),
        })
    }

    /// Sleeps until it is woken, but no longer than `timeout`. Returns how often it was notified since the last call,
    /// 0 after a time-out, when a signal came, and now and then for nothing. Read the topic until it is empty after every
    /// wait: several values may stand behind one notification.
    ///
    /// # Errors
    /// [`WaitError`] when the wait itself failed.
    pub fn wait(&self, timeout: Duration) -> Result<u64, WaitError> {
        // The socket takes a time-out of less than a microsecond for none at all, and would sleep for ever.
        let result = if timeout < Duration::from_micros(1) {
            self.port.try_wait(|_| {})
        } else {
            self.port.timed_wait(|_| {}, timeout)
        };
        match result {
            Ok(notifications) => Ok(notifications),
            Err(ListenerWaitError::InterruptSignal) => Ok(0),
            Err(reason) => Err(WaitError { topic: T::NAME, reason }),
        }
    }
}
