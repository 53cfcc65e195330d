//! Asking the controller, and answering.

use super::error::PortError;
use super::fleet_list::{self, OfferedFrom};
use super::instance::Instance;
use super::role::{Controller, Relay, RoleLock};
use super::services::{Ipc, MAX_READERS, MAX_WRITERS, Services};
use super::start::Presence;
use crate::realtime::is_suspended;
use iceoryx2::active_request::ActiveRequest;
use iceoryx2::pending_response::PendingResponse;
use iceoryx2::port::client::Client;
use iceoryx2::port::server::Server;
use iceoryx2::port::{ReceiveError, SendError};
use iceoryx2::service::port_factory::client::ClientCreateError;
use iceoryx2::service::port_factory::server::ServerCreateError;
use std::fmt::{self, Debug};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};
use worm_estimator::message::{Command, Reply};

/// How often a client polls for its answer.
const POLL: Duration = Duration::from_micros(500);

/// A command that could not be taken, or an answer that could not be given.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum AnswerError {
    /// The requests could not be read.
    #[error("command: requests are not readable ({0:?}): restart the client that sends them")]
    Take(ReceiveError),
    /// The answer could not be delivered.
    #[error("command: the answer was not delivered ({0:?}): the client may have left")]
    Answer(SendError),
}

/// A command that was not answered.
#[derive(Debug, thiserror::Error)]
pub enum CommandError {
    /// Nobody is there to take it.
    #[error("no controller of {worm} is running: start one with `wormd up` or `wormd control`, with the same --config")]
    NoController {
        /// The worm.
        worm: String,
    },
    /// A fleet process offers the worm of a robot under this name, and none runs here.
    #[error(
        "{worm} is a worm of {robot}, which `wormd fleet` (process {pid}) offers here, and `wormd command` reaches worms of this computer alone: \
         hold or drive it by `wormd watch` or `wormd dashboard`, with the same --config"
    )]
    Elsewhere {
        /// The worm.
        worm: String,
        /// The robot.
        robot: String,
        /// The fleet process.
        pid: u32,
    },
    /// A controller is there and did not answer in time; it will not carry the command out later.
    #[error(
        "the controller of {worm} (process {pid}) did not answer within {waited:?}: see its log, or stop it (kill {pid})"
    )]
    NoAnswer {
        /// The worm.
        worm: String,
        /// The controller.
        pid: u32,
        /// How long the client waited.
        waited: Duration,
    },
    /// A controller is there and is suspended; it will not carry the command out later.
    #[error(
        "the controller of {worm} (process {pid}) is suspended, by a signal or a debugger, and answers nobody; without its requests the servo's \
         watchdog stops the motor: let it go on (kill -CONT {pid}), or end it (kill -KILL {pid})"
    )]
    Suspended {
        /// The worm.
        worm: String,
        /// The controller.
        pid: u32,
    },
    /// The controller took the command and ended without an answer; whether it was carried out is not known.
    #[error("the controller of {worm} ended before it answered: see its log, start it again, and repeat the command")]
    Left {
        /// The worm.
        worm: String,
    },
    /// The command could not be sent, or the answer not be read.
    #[error("command to {worm}: {reason}: try again")]
    Failed {
        /// The worm.
        worm: String,
        /// iceoryx2's reason.
        reason: String,
    },
}

/// Takes commands, in the controller's tick. Bound to the thread that created it.
#[derive(Debug)]
pub struct CommandServer {
    port: Server<Ipc, Command, (), Reply, ()>,
    _presence: Arc<Presence>,
}

impl CommandServer {
    pub(super) fn create(services: &Services, presence: &Arc<Presence>) -> Result<Self, PortError> {
        let full = ServerCreateError::ExceedsMaxSupportedServers;
        let service = presence.instance().service("command");
        let port = services
            .command_service
            .server_builder()
            .create()
            .map_err(PortError::from_iceoryx(service, "server", MAX_WRITERS, full))?;
        Ok(Self {
            port,
            _presence: Arc::clone(presence),
        })
    }

    /// The next command, if one is there, with what answers it. Does not wait. Commands whose sender has stopped waiting
    /// are not among them.
    ///
    /// # Errors
    /// [`AnswerError::Take`] when the requests cannot be read.
    pub fn take(&self) -> Result<Option<(Command, Responder)>, AnswerError> {
        let request = self.port.receive().map_err(AnswerError::Take)?;
        Ok(request.map(|request| (*request.payload(), Responder(request))))
    }
}

/// Answers one command, once.
#[must_use = "a command without an answer looks like a controller that hangs"]
pub struct Responder(ActiveRequest<Ipc, Command, (), Reply, ()>);

impl Debug for Responder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Responder").field(self.0.payload()).finish()
    }
}

impl Responder {
    /// Answers.
    ///
    /// # Errors
    /// [`AnswerError::Answer`] when it could not be delivered.
    pub fn answer(self, reply: &Reply) -> Result<(), AnswerError> {
        self.0.send_copy(*reply).map_err(AnswerError::Answer)
    }
}

/// Sends commands. Bound to the thread that created it.
#[derive(Debug)]
pub struct CommandClient {
    port: Client<Ipc, Command, (), Reply, ()>,
    presence: Arc<Presence>,
}

impl CommandClient {
    pub(super) fn create(services: &Services, presence: &Arc<Presence>) -> Result<Self, PortError> {
        let full = ClientCreateError::ExceedsMaxSupportedClients;
        let service = presence.instance().service("command");
        let port = services
            .command_service
            .client_builder()
            .create()
            .map_err(PortError::from_iceoryx(service, "client", MAX_READERS, full))?;
        Ok(Self {
            port,
            presence: Arc::clone(presence),
        })
    }

    /// Sends a command and waits for the answer, no longer than `timeout`. A controller that is just starting has that
    /// long to be ready.
    ///
    /// # Errors
    /// [`CommandError`]: no controller, no answer in time, or a fault in between.
    pub fn call(&self, command: Command, timeout: Duration) -> Result<Reply, CommandError> {
        let begun = Instant::now();
        loop {
            let pending = self.port.send_copy(command).map_err(|error| self.failed(&error))?;
            // Once delivered, a command is not sent again: the answer may be what got lost.
            if pending.number_of_server_connections() > 0
                && let Some(reply) = self.wait(&pending, begun, timeout)?
            {
                return Ok(reply);
            }
            let Some(pid) = RoleLock::<Controller>::holder(self.instance()) else {
                return Err(self.nobody());
            };
            if begun.elapsed() >= timeout {
                let worm = self.instance().worm().to_owned();
                return Err(match is_suspended(pid) {
                    true => CommandError::Suspended { worm, pid },
                    false => CommandError::NoAnswer {
                        worm,
                        pid,
                        waited: timeout,
                    },
                });
            }
            thread::sleep(POLL);
        }
    }

    /// Why there is no controller.
    fn nobody(&self) -> CommandError {
        let instance = self.instance();
        let offered = RoleLock::<Relay>::holder(instance).and_then(|holder| fleet_list::offered_by(holder, instance));
        match offered {
            Some(OfferedFrom { worm, robot, pid }) => CommandError::Elsewhere { worm, robot, pid },
            None => CommandError::NoController {
                worm: instance.worm().to_owned(),
            },
        }
    }

    /// Waits for the answer to a delivered command; `None` after the time-out.
    fn wait(
        &self,
        pending: &PendingResponse<Ipc, Command, (), Reply, ()>,
        begun: Instant,
        timeout: Duration,
    ) -> Result<Option<Reply>, CommandError> {
        loop {
            // In this order: an answer may be the last thing that a leaving controller gave.
            let connected = pending.is_connected();
            if let Some(reply) = pending.receive().map_err(|error| self.failed(&error))? {
                return Ok(Some(*reply.payload()));
            }
            if begun.elapsed() >= timeout {
                return Ok(None);
            }
            if !connected {
                let worm = self.instance().worm().to_owned();
                return Err(CommandError::Left { worm });
            }
            thread::sleep(POLL);
        }
    }

    pub(crate) fn instance(&self) -> &Instance {
        self.presence.instance()
    }

    fn failed(&self, error: &impl Debug) -> CommandError {
        CommandError::Failed {
            worm: self.instance().worm().to_owned(),
            reason: format!("{error:?}"),
        }
    }
}
