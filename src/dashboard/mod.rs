//! A worm in a browser: one process between the relay of the worm and any number of pages.
//!
//! It is one watcher of the relay: a thread takes the relay's lines and keeps what was seen ([`feed`]), an HTTP server on another thread
//! passes it on as server-sent events. A page that comes late gets the history from here, a slow one the newest frame and never a queue,
//! one that takes nothing is cut off. Commands go the other way: anyone may make the worm hold, all else needs the token, and each page
//! that drives is a watcher of its own at the relay ([`seat`]), whose word that it is there is passed on and never made up. So whatever
//! happens to the page, the network or this process, the worm holds. docs/dashboard.md has it from outside.
//!
//! - [`access`]: who may ask for what: hosts, origins, the token. Pure.
//! - [`token`]: where the token comes from; [`strangers`]: who did not have it.
//! - [`listen`]: the address.
//! - [`feed`]: what is known of the worm, as events for pages. Pure.
//! - [`relay_thread`]: the thread between relay and feed; [`seat`]: the connection of a page that drives.
//! - [`server`]: connections and their limits; [`paced_stream`] cuts off who does not read.
//! - [`routes`]: what can be asked for; [`commands`]: the commands among it; [`caller`]: who commands; [`app`]: what answers are made of;
//!   [`response`]: how they are written.
//! - [`events`]: the stream of events.
//! - [`fleet`]: all worms that there are here, and one hold for all of them; [`fleet_view`]: what is said of each; [`unreached`]: those that
//!   cannot be held from here.
//! - [`metrics`]: the same for Prometheus.
//! - [`reports`]: reports of finished runs; [`boxes`]: files of the black box, whose downloads resume by [`byte_range`].
//! - [`assets`]: the page.

mod access;
mod app;
mod assets;
mod boxes;
mod byte_range;
mod caller;
mod commands;
mod events;
mod feed;
mod fleet;
mod fleet_view;
mod listen;
mod metrics;
mod paced_stream;
mod places;
mod relay_thread;
mod reports;
mod response;
mod routes;
mod seat;
pub(crate) mod server;
mod strangers;
mod token;
mod unreached;

pub(crate) use listen::listen;
pub(crate) use token::Token;
