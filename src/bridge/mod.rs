//! Worms over a network: `wormd bridge` on the robot, `wormd fleet` on the laptop. The feature `bridge`.
//!
//! Between the two is Zenoh, over TLS that both ends prove themselves by, with rules for every certificate. What crosses it is the
//! relay's language: the bridge is a watcher of the relays on the robot, and the laptop offers for each worm a socket that speaks as a relay
//! does. So `wormd watch` and `wormd dashboard` know nothing of any of this.
//!
//! - [`settings`]: `bridge.toml` and `fleet.toml`, refused when they leave anything open.
//! - [`credentials`]: certificate, key and authority, whether they belong together and serve the end that has them.
//! - [`network`]: all that concerns Zenoh.
//! - [`link_log`] and [`reasons`]: why a link does not come about.
//! - [`wire`]: what both ends say; [`pieces`] cuts it, so that a laptop confirms what it has.
//! - [`backlog`]: what waits for a laptop: bounded, the newest first, losses counted. Pure.
//! - [`remote`]: a laptop from the robot's side: its connections to the relays, and what it may ask.
//! - [`refusals`]: which of those that it refuses the worms' records get.
//! - [`clock`]: what the robot's clocks are worth.
//! - [`robot`]: the process on the robot.
//! - [`offer`]: a worm from the laptop's side, [`offers`]: those of one robot; [`laptop`]: the process on the laptop.
//!
//! No message of a laptop is believed to be fresh because of a clock. It names the newest piece that it has received, and the bridge
//! knows when it sent that: so much time at most has passed since the message was sent.

mod backlog;
mod clock;
mod credentials;
pub(crate) mod laptop;
mod link_log;
mod network;
mod offer;
mod offers;
mod pieces;
mod reasons;
mod refusals;
mod remote;
pub(crate) mod robot;
pub(crate) mod settings;
mod wire;

pub use link_log::LinkLog;
