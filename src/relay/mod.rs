//! One local process that serves all watchers of a worm: terminals, browsers, metrics, bridges.
//!
//! A topic admits 16 readers, and attaching one costs the loop up to 400 µs. So one process, `wormd relay`, reads the topics; it keeps
//! a history for who joins late, and serves any number of watchers over a Unix socket in the worm's folder, as JSON, one object a
//! line. A watcher that does not read loses frames and delays nobody. Commands take the same way back: anyone may make the worm hold,
//! everything else belongs to one driver at a time.
//!
//! - [`wire`]: what both sides say; [`message_json`] puts the messages of the topics into it.
//! - [`history`]: ten minutes of samples.
//! - [`drive`]: who drives, as a pure state machine; [`lateness`]: what comes too late for it; [`departure`]: a driver
//!   that is gone.
//! - [`remark`]: what this process decides, for the recordings.
//! - [`source`]: the topics, gathered into frames.
//! - [`event_log`]: what happened, in words.
//! - [`commander`]: the thread that waits for the controller's answers.
//! - [`outbox`]: what waits for one watcher; [`watcher`]: its connection.
//! - [`server`]: the process.
//! - [`socket`]: where it listens, and who may connect.
//! - [`direct_hold`]: the way past a relay that does not answer.
//! - [`client`]: the other end: connects by a [`connection`], and starts a relay where there is none.

pub(crate) mod client;
mod commander;
pub(crate) mod connection;
pub(crate) mod departure;
pub(crate) mod direct_hold;
mod drive;
mod event_log;
mod history;
pub(crate) mod lateness;
pub(crate) mod message_json;
pub(crate) mod outbox;
pub(crate) mod remark;
pub(crate) mod server;
pub(crate) mod socket;
pub(crate) mod source;
pub(crate) mod watcher;
pub(crate) mod wire;

pub(crate) use history::History;
