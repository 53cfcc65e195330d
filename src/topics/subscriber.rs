//! Receiving values.

use super::error::PortError;
use super::services::{Ipc, MAX_READERS, Services};
use super::start::Presence;
use super::topic::Topic;
use iceoryx2::port::ReceiveError as IoxReceiveError;
use iceoryx2::port::subscriber::{Subscriber as Port, SubscriberCreateError};
use iceoryx2::sample::Sample as IoxSample;
use std::marker::PhantomData;
use std::ops::Deref;
use std::sync::Arc;

/// A topic that could not be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{topic}: not readable ({reason:?}): restart this process")]
pub struct ReceiveError {
    /// The topic.
    pub topic: &'static str,
    /// iceoryx2's reason.
    pub reason: IoxReceiveError,
}

/// Reads one topic, each value in its turn or only the latest. Bound to the thread that created it.
#[derive(Debug)]
pub struct Subscriber<T: Topic> {
    port: Port<Ipc, T, ()>,
    count: Count,
    _presence: Arc<Presence>,
}

/// A value where it lies in shared memory. Copy it to keep it: the next call of its subscriber needs its place.
#[derive(Debug)]
pub struct Sample<'subscriber, T: Topic> {
    inner: IoxSample<Ipc, T, ()>,
    _one_at_a_time: PhantomData<&'subscriber mut Subscriber<T>>,
}

impl<T: Topic> Deref for Sample<'_, T> {
    type Target = T;

    fn deref(&self) -> &T {
        self.inner.payload()
    }
}

impl<T: Topic> Subscriber<T> {
    pub(super) fn create(services: &Services, presence: &Arc<Presence>) -> Result<Self, PortError> {
        let full = SubscriberCreateError::ExceedsMaxSupportedSubscribers;
        let service = presence.instance().service(T::NAME);
        let port = T::service(services)
            .subscriber_builder()
            .buffer_size(T::BUFFER)
            .history_request(T::HISTORY)
            .create()
            .map_err(PortError::from_iceoryx(service, "subscriber", MAX_READERS, full))?;
        Ok(Self {
            port,
            count: Count::default(),
            _presence: Arc::clone(presence),
        })
    }

    /// The oldest value not yet read; `None` when there is none. Does not wait.
    ///
    /// # Errors
    /// [`ReceiveError`] when a publisher cannot be connected.
    #[expect(
        clippy::should_implement_trait,
        reason = "an iterator cannot lend: each sample borrows the subscriber"
    )]
    pub fn next(&mut self) -> Result<Option<Sample<'_, T>>, ReceiveError> {
        Ok(self.receive()?.map(Sample::new))
    }

    /// The newest value; `None` when nothing came since the last call. Passes over those before it. Does not wait.
    ///
    /// # Errors
    /// [`ReceiveError`] when a publisher cannot be connected.
    pub fn latest(&mut self) -> Result<Option<Sample<'_, T>>, ReceiveError> {
        let mut newest = None;
        while let Some(sample) = self.receive()? {
            newest = Some(sample);
        }
        Ok(newest.map(Sample::new))
    }

    /// Values received so far, including those that [`Subscriber::latest`] skipped.
    pub fn received(&self) -> u64 {
        self.count.received
    }

    /// Values that were published since the first received one and never arrived; 0 on topics without numbers.
    pub fn lost(&self) -> u64 {
        self.count.lost
    }

    fn receive(&mut self) -> Result<Option<IoxSample<Ipc, T, ()>>, ReceiveError> {
        let sample = self
            .port
            .receive()
            .map_err(|reason| ReceiveError { topic: T::NAME, reason })?;
        if let Some(sample) = &sample {
            self.count.add(sample.payload().number());
        }
        Ok(sample)
    }
}

impl<T: Topic> Sample<'_, T> {
    fn new(inner: IoxSample<Ipc, T, ()>) -> Self {
        Self {
            inner,
            _one_at_a_time: PhantomData,
        }
    }
}

/// Counts the samples that arrived, and by the gaps in their numbers those that did not.
#[derive(Debug, Default)]
pub(crate) struct Count {
    received: u64,
    lost: u64,
    last: Option<u64>,
}

impl Count {
    /// Takes a sample that arrived; a number that goes back means that the publisher restarted.
    pub(crate) fn add(&mut self, number: Option<u64>) {
        self.received += 1;
        if let (Some(number), Some(last)) = (number, self.last)
            && number > last
        {
            self.lost += number - last - 1;
        }
        self.last = number.or(self.last);
    }

    /// Samples that did not arrive.
    pub(crate) fn lost(&self) -> u64 {
        self.lost
    }
}

#[cfg(test)]
mod tests {
    use super::Count;

    #[test]
    fn gaps_are_counted_and_restarts_are_not() {
        let mut count = Count::default();
        for number in [5, 6, 9, 0, 1, 3] {
            count.add(Some(number));
        }
        assert_eq!((count.received, count.lost), (6, 3));
        count.add(None);
        assert_eq!((count.received, count.lost), (7, 3));
    }
}
