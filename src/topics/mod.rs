//! The topics of one worm: shared memory between its processes, without copies and without locks.
//!
//! Read in this order. An [`Instance`] is one worm's namespace on this computer: a folder, and a prefix of names in
//! `/dev/shm`. A process that may exist only once per worm takes its [`RoleLock`]. A [`Hub`] opens every service of the
//! worm, guarded against what killed processes left behind. From the hub come the ports: [`Publisher`] and
//! [`Subscriber`] for values, [`Notifier`] and [`Listener`] for waking a sleeper, [`CommandServer`] and
//! [`CommandClient`] for commands.
//!
//! | service | pattern | written by | history | buffer |
//! |---|---|---|---|---|
//! | `worm/<name>/state` | publish-subscribe and event | [`Controller`] | 1 | 1024 |
//! | `worm/<name>/timing` | publish-subscribe | [`Controller`] | 1 | 1024 |
//! | `worm/<name>/estimate` | publish-subscribe | [`Estimator`] | 1 | 256 |
//! | `worm/<name>/cycle` | publish-subscribe | [`Estimator`] | 16 | 64 |
//! | `worm/<name>/alarm` | publish-subscribe and event | [`Estimator`] | 32 | 64 |
//! | `worm/<name>/range` | publish-subscribe | [`Estimator`] | 1 | 64 |
//! | `worm/<name>/trip` | publish-subscribe | [`Trip`] | 1 | 32 |
//! | `worm/<name>/recording` | publish-subscribe | [`Recorder`] | 1 | 16 |
//! | `worm/<name>/black_box` | publish-subscribe | [`BlackBox`] | 1 | 16 |
//! | `worm/<name>/command` | request-response | answered by [`Controller`] | | |
//! | `worm/<name>/command` | publish-subscribe: each command with its answer | [`Controller`] | 32 | 256 |
//!
//! ```no_run
//! use std::time::Duration;
//! use worm_estimator::{config::Config, message::State};
//! use wormd::topics::{Controller, Hub, Instance, RoleLock};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let instance = Instance::of(&Config::default())?;
//! // In the controller:
//! let controller = RoleLock::<Controller>::take(&instance)?; // refuses a second one
//! let hub = Hub::open(&instance)?;
//! let states = hub.publisher::<State>(&controller)?;
//! let event = hub.notifier::<State>(&controller)?;
//! states.publish(&State::unknown(4))?;
//! event.notify()?;
//! // In any other process:
//! let hub = Hub::open(&instance)?;
//! let listener = hub.listener::<State>()?;
//! let mut states = hub.subscriber::<State>()?;
//! listener.wait(Duration::from_millis(100))?;
//! while let Some(state) = states.next()? {
//!     println!("{} at {}", state.sequence, state.phase);
//! }
//! # Ok(())
//! # }
//! ```
//!
//! # What the types rule out
//! Only the holder of a role's lock gets that role's publishers, so no second process writes a topic by mistake:
//!
//! ```compile_fail,E0308
//! use worm_estimator::message::State;
//! use wormd::topics::{Estimator, Hub, Instance, RoleLock};
//! # fn f(hub: &Hub, estimator: &RoleLock<Estimator>) {
//! let publisher = hub.publisher::<State>(estimator); // the state belongs to the controller
//! # }
//! ```
//!
//! A sample borrows its subscriber, so the limit of samples held at once cannot be passed; a [`Responder`] answers
//! once; ports stay in the thread that created them, as iceoryx2 demands, while the hub may move between threads.
//!
//! # Backpressure
//! None. A subscriber that does not read loses its oldest samples; the publisher never waits for it.
//! [`Subscriber::lost`] counts the gap where a topic is numbered. A frozen listener's notifications are dropped.
//!
//! # Late joiners
//! A new subscriber gets a topic's last values ("history"), but only when the publisher next sends or checks for new
//! subscribers: a publisher with nothing to send calls [`Publisher::idle`] from time to time.
//!
//! # Memory
//! A publisher reserves `16 subscribers × (buffer + 2) + history + 2` samples: 5.3 MB for `state`, 1.9 MB for `timing`,
//! 4.3 MB for `estimate`, 0.8 MB for `cycle`, 0.1 MB for `alarm`, 0.2 MB for `range`, 0.5 MB for `command`, 0.4 MB for `trip`, 0.02 MB for
//! `recording` and `black_box` each. Only written pages use
//! memory, and the same few slots are reused (80 kB after 5000 ticks), unless the process locks its future memory: then
//! all of it is resident. A subscriber takes 33 kB for each publisher.
//!
//! # Cost
//! On two shared cores at 1 kHz, with one subscriber in another thread, median and 99th percentile: publishing a state
//! 0.9 and 6 µs, a timing 0.4 and 2 µs, waking a sleeping listener 7 and 30 µs, polling for a command 0.2 and 1.5 µs.
//! Publishing makes one heap allocation, inside iceoryx2; receiving, waking and polling make none.
//! `benches/topics.rs` measures the warm path.
//!
//! # Killed processes
//! The next process to start removes what a process killed while running left behind. A process killed
//! *while it starts* can leave incomplete files that stop every later start in iceoryx2 0.10. See [`Hub::open`] for the
//! guard. After an orderly exit of the last process nothing remains of the instance's folder or in `/dev/shm`.

mod command;
mod configuration;
mod error;
mod event;
pub(crate) mod fleet_list;
mod folder;
mod hub;
mod instance;
mod kernel_locks;
mod lock;
mod lock_holder;
mod open;
#[cfg(any(test, feature = "bridge"))]
mod published_list;
mod publisher;
mod role;
mod services;
mod stale_resources;
mod start;
mod subscriber;
mod topic;

pub use command::{AnswerError, CommandClient, CommandError, CommandServer, Responder};
pub(crate) use configuration::{RunningConfiguration, SharedConfiguration};
pub use error::{InstanceError, PortError};
pub use event::{Listener, Notifier, NotifyError, WaitError};
pub use fleet_list::OfferedFrom;
pub use hub::Hub;
pub use instance::Instance;
pub use lock::LockError;
pub(crate) use lock::LockPlace;
#[cfg(any(test, feature = "bridge"))]
pub(crate) use published_list::PublishedList;
pub use publisher::{PublishError, Publisher};
pub use role::{
    AlreadyRunning, BlackBox, Bridge, Controller, Estimator, Recorder, Relay, Role, RoleError, RoleLock, Supervisor,
    Trip,
};
pub use stale_resources::Peer;
pub use start::StartError;
pub(crate) use subscriber::Count;
pub use subscriber::{ReceiveError, Sample, Subscriber};
pub use topic::{Announced, Topic, TopicDescription, describe_topics};
