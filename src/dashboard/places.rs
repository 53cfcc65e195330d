//! Places for connections. Whoever comes gets one: where all are taken, the connection that waits longest for its next request is
//! closed for it, so that nobody can keep others from HOLD by what he leaves open.

use std::collections::BTreeMap;
use std::net::IpAddr;
use std::sync::{Arc, Mutex, PoisonError};
use tokio::sync::Notify;

/// Most connections, and most of one address. A browser opens six.
const MAX_CONNECTIONS: usize = 256;
const MAX_OF_ONE: usize = 64;
/// Most streams of events, and most of one address: behind a tunnel or a proxy all users are one. Streams are never closed for others, so
/// these are fewer than the connections.
const MAX_STREAMS: usize = 64;
const MAX_STREAMS_OF_ONE: usize = 48;

/// What a connection is busy with; the first is the first to be closed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Stage {
    /// No whole head of a request has come.
    Waiting,
    /// A request is not answered yet; its body may still be to come.
    Asked,
    /// An answer is being sent.
    Answered,
    /// An answer that goes on for as long as the page is there.
    Stream,
}

#[derive(Debug)]
struct Connection {
    address: IpAddr,
    stage: Stage,
    /// When it came to its stage, counted in such changes.
    since: u64,
    closed: Arc<Notify>,
}

#[derive(Debug, Default)]
struct Table {
    changes: u64,
    connections: BTreeMap<u64, Connection>,
}

/// All connections.
#[derive(Debug, Default)]
pub(super) struct Places(Mutex<Table>);

/// The place of one connection.
#[derive(Debug)]
pub(super) struct Place {
    places: Arc<Places>,
    number: u64,
    closed: Arc<Notify>,
}

impl Table {
    fn count(&self, is_meant: impl Fn(&Connection) -> bool) -> usize {
        self.connections
            .values()
            .filter(|connection| is_meant(connection))
            .count()
    }

    fn change(&mut self) -> u64 {
        self.changes += 1;
        self.changes
    }

    /// Closes the connection that can best be spared; false where all are streams.
    fn close_one(&mut self, is_meant: impl Fn(&Connection) -> bool) -> bool {
        let spared = self
            .connections
            .iter()
            .filter(|(_, connection)| connection.stage != Stage::Stream && is_meant(connection))
            .min_by_key(|(_, connection)| (connection.stage, connection.since))
            .map(|(&number, _)| number);
        let closed = spared.and_then(|number| self.connections.remove(&number));
        if let Some(closed) = &closed {
            closed.closed.notify_one();
        }
        closed.is_some()
    }
}

impl Places {
    fn table(&self) -> std::sync::MutexGuard<'_, Table> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A place for a new connection.
    pub(super) fn take(self: &Arc<Self>, address: IpAddr) -> Option<Place> {
        let mut table = self.table();
        let is_of_one = |connection: &Connection| connection.address == address;
        if table.count(is_of_one) >= MAX_OF_ONE && !table.close_one(is_of_one) {
            return None;
        }
        if table.connections.len() >= MAX_CONNECTIONS && !table.close_one(|_| true) {
            return None;
        }
        let number = table.change();
        let closed = Arc::new(Notify::new());
        let connection = Connection {
            address,
            stage: Stage::Waiting,
            since: number,
            closed: Arc::clone(&closed),
        };
        table.connections.insert(number, connection);
        Some(Place {
            places: Arc::clone(self),
            number,
            closed,
        })
    }

    /// How many streams of events there are.
    pub(super) fn streams(&self) -> usize {
        self.table().count(|connection| connection.stage == Stage::Stream)
    }
}

impl Place {
    /// Says what the connection is busy with now. A stream remains one until it waits for its next request.
    pub(super) fn enter(&self, stage: Stage) {
        let mut table = self.places.table();
        let since = table.change();
        if let Some(connection) = table.connections.get_mut(&self.number)
            && (connection.stage != Stage::Stream || stage == Stage::Waiting)
        {
            (connection.stage, connection.since) = (stage, since);
        }
    }

    /// Makes it a stream of events.
    ///
    /// # Errors
    /// When there are too many already: what to do about it.
    pub(super) fn begin_stream(&self) -> Result<(), String> {
        let mut table = self.places.table();
        let is_stream = |connection: &Connection| connection.stage == Stage::Stream;
        if table.count(is_stream) >= MAX_STREAMS {
            return Err(format!("{MAX_STREAMS} pages are open already: close some"));
        }
        let Some(address) = table.connections.get(&self.number).map(|it| it.address) else {
            return Err("this connection was closed for another: try again".to_owned());
        };
        if table.count(|it| is_stream(it) && it.address == address) >= MAX_STREAMS_OF_ONE {
            return Err(format!(
                "{MAX_STREAMS_OF_ONE} pages of {address} are open already: close some"
            ));
        }
        let since = table.change();
        if let Some(connection) = table.connections.get_mut(&self.number) {
            (connection.stage, connection.since) = (Stage::Stream, since);
        }
        Ok(())
    }

    /// Waits until the place is given to another.
    pub(super) async fn closed(&self) {
        self.closed.notified().await;
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.places.table().connections.remove(&self.number);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use futures_util::FutureExt;

    fn taken(places: &Arc<Places>, last_byte: u8) -> Place {
        places.take([10, 0, 0, last_byte].into()).expect("there is always one")
    }

    fn is_closed(place: &Place) -> bool {
        std::pin::pin!(place.closed()).now_or_never().is_some()
    }

    #[test]
    fn the_newest_gets_the_place_of_who_waits_longest() {
        let places = Arc::new(Places::default());
        let mut held: Vec<Place> = (0..MAX_OF_ONE).map(|_| taken(&places, 1)).collect();
        let refused: Vec<_> = held.iter().filter(|place| place.begin_stream().is_err()).collect();
        assert_eq!(refused.len(), MAX_OF_ONE - MAX_STREAMS_OF_ONE);
        assert_eq!(places.streams(), MAX_STREAMS_OF_ONE);
        // The first of the others has asked for something, the last waits again.
        held[MAX_STREAMS_OF_ONE].enter(Stage::Asked);
        held[MAX_STREAMS_OF_ONE + 1].enter(Stage::Answered);
        held[MAX_STREAMS_OF_ONE + 2].enter(Stage::Waiting);
        for _ in MAX_STREAMS_OF_ONE..MAX_OF_ONE {
            let newest = taken(&places, 1);
            newest.enter(Stage::Answered);
            held.push(newest);
        }
        let closed: Vec<usize> = (0..held.len()).filter(|&number| is_closed(&held[number])).collect();
        let all_but_streams: Vec<usize> = (MAX_STREAMS_OF_ONE..MAX_OF_ONE).collect();
        assert_eq!(closed, all_but_streams, "and no stream");

        // Others have their own.
        let other = taken(&places, 2);
        assert!(other.begin_stream().is_ok());
        drop(other);
        assert_eq!(places.streams(), MAX_STREAMS_OF_ONE);
        held[0].enter(Stage::Answered);
        assert_eq!(places.streams(), MAX_STREAMS_OF_ONE, "is one until it ends");
        held.clear();
        assert_eq!(places.streams(), 0);
    }

    #[test]
    fn those_of_many_addresses_are_bounded_too() {
        let places = Arc::new(Places::default());
        let held: Vec<Place> = (0..MAX_CONNECTIONS).map(|it| taken(&places, it as u8)).collect();
        held[0].enter(Stage::Asked);
        let _newest = taken(&places, 7);
        let closed: Vec<usize> = (0..held.len()).filter(|&number| is_closed(&held[number])).collect();
        assert_eq!(closed, [1]);
        assert_eq!(places.table().connections.len(), MAX_CONNECTIONS);
    }
}
