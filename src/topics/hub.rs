//! All services of a worm, and the ports made from them.

use super::command::{CommandClient, CommandServer};
use super::error::PortError;
use super::event::{Listener, Notifier};
use super::instance::Instance;
use super::publisher::Publisher;
use super::role::{Controller, Role, RoleLock};
use super::services::Services;
use super::start::{self, Presence, StartError};
use super::subscriber::Subscriber;
use super::topic::{Announced, Topic};
use iceoryx2::prelude::{LogLevel, set_log_level_from_env_or};
use std::fmt;
use std::sync::{Arc, Once};
use std::time::Duration;

/// How long a start may take before it counts as hung; a good one takes some milliseconds.
const START_LIMIT: Duration = Duration::from_secs(3);

/// A process's part in a worm's topics: all services, open. May move between threads; its ports may not.
pub struct Hub {
    services: Services,
    presence: Arc<Presence>,
}

impl fmt::Debug for Hub {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Hub")
            .field("instance", self.instance())
            .finish_non_exhaustive()
    }
}

impl Hub {
    /// Opens every service of the worm, and creates those that are missing.
    ///
    /// A process that was killed while it started can have left files that make iceoryx2 0.10 hang, or refuse, at every
    /// later start. So starts are serialised by a lock; each participant holds a shared lock for as long as it
    /// or one of its ports lives; and
    /// - a process that starts *alone* (no other holds that lock or maps the worm's memory) removes everything that is there,
    /// - one that starts *beside peers* removes only incomplete segments that no process has open, and what dead nodes held,
    /// - opening has a time limit; if it fails and no other process is left, everything is removed and opening is retried once,
    /// - and otherwise the error names the processes to stop.
    ///
    /// iceoryx2's own messages go to `tracing`, errors only; the environment variable `IOX2_LOG_LEVEL` shows more.
    ///
    /// # Errors
    /// [`StartError`] as above, or when a lock file cannot be used.
    pub fn open(instance: &Instance) -> Result<Self, StartError> {
        Self::open_within(instance, START_LIMIT)
    }

    /// As [`Hub::open`], with another time limit for each attempt.
    ///
    /// # Errors
    /// As [`Hub::open`].
    pub fn open_within(instance: &Instance, limit: Duration) -> Result<Self, StartError> {
        static QUIET: Once = Once::new();
        QUIET.call_once(|| set_log_level_from_env_or(LogLevel::Error));
        let (services, presence) = start::open(instance, limit)?;
        Ok(Self {
            services,
            presence: Arc::new(presence),
        })
    }

    /// The namespace that it takes part in.
    pub fn instance(&self) -> &Instance {
        self.presence.instance()
    }

    /// A publisher, for the process that has the topic's role.
    ///
    /// # Errors
    /// [`PortError`] when it cannot be created, or the role is that of another worm.
    pub fn publisher<T: Topic>(&self, role: &RoleLock<T::Owner>) -> Result<Publisher<T>, PortError> {
        self.check(role, T::NAME)?;
        Publisher::create(&self.services, &self.presence)
    }

    /// A subscriber; gets the topic's history first, when the publisher next sends or idles.
    ///
    /// # Errors
    /// [`PortError`] when it cannot be created.
    pub fn subscriber<T: Topic>(&self) -> Result<Subscriber<T>, PortError> {
        Subscriber::create(&self.services, &self.presence)
    }

    /// What wakes the topic's listeners.
    ///
    /// # Errors
    /// [`PortError`] when it cannot be created, or the role is that of another worm.
    pub fn notifier<T: Announced>(&self, role: &RoleLock<T::Owner>) -> Result<Notifier<T>, PortError> {
        self.check(role, T::NAME)?;
        Notifier::create(&self.services, &self.presence)
    }

    /// What sleeps until the topic's notifier wakes it.
    ///
    /// # Errors
    /// [`PortError`] when it cannot be created.
    pub fn listener<T: Announced>(&self) -> Result<Listener<T>, PortError> {
        Listener::create(&self.services, &self.presence)
    }

    /// The side of the command service that answers.
    ///
    /// # Errors
    /// [`PortError`] when it cannot be created, or the role is that of another worm.
    pub fn command_server(&self, role: &RoleLock<Controller>) -> Result<CommandServer, PortError> {
        self.check(role, "command")?;
        CommandServer::create(&self.services, &self.presence)
    }

    /// The side of the command service that asks.
    ///
    /// # Errors
    /// [`PortError`] when it cannot be created.
    pub fn command_client(&self) -> Result<CommandClient, PortError> {
        CommandClient::create(&self.services, &self.presence)
    }

    fn check<R: Role>(&self, role: &RoleLock<R>, topic: &str) -> Result<(), PortError> {
        if role.instance().prefix() == self.instance().prefix() {
            return Ok(());
        }
        Err(PortError::OtherWorm {
            service: self.instance().service(topic),
            worm: role.instance().worm().to_owned(),
        })
    }
}
