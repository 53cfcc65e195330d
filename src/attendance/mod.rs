//! What reaches a process from beside the topics: the life of its parent, and a way to stop it that needs no shared memory.
//!
//! - `parent_pipe`: a pipe from the parent. Bytes say that it is there, the end of the pipe that it is gone.
//! - `stop_socket`: an abstract Unix socket in the controller that takes `stop` and says how the worm stands.
//! - `stop_client`: the other end of that socket.
//! - `survey`: all controllers of this computer, by their stop sockets.
//! - `standing`: where the controller stands, for the threads beside its loop.
//! - `service_manager`: what systemd learns about a process that it has started.
//! - `orphan`: how the processes around the controller end when their parent is gone.
//! - `lock_watch`: notices that the lock file of a role has been removed.

mod lock_watch;
mod orphan;
mod parent_pipe;
mod service_manager;
mod standing;
mod stop_client;
mod stop_socket;
mod survey;

pub(crate) use lock_watch::LockWatch;
pub(crate) use orphan::{end_after_controller, end_with_parent};
pub use parent_pipe::{Parent, ParentPipe};
pub(crate) use service_manager::{ProcessStatus, RoundCounter, ServiceManager, announce_ready};
pub use standing::Standing;
pub(crate) use stop_client::{StopError, ask, foreign};
pub use stop_socket::StopSocket;
pub(crate) use stop_socket::{Question, Request};
pub(crate) use survey::{RunningController, running_controllers};

use std::time::Duration;
use worm_estimator::message::{Command, Fault, Mode, Reply};

/// Who attends to a controller. Everything here is without locks and without system calls on the side of the loop.
#[derive(Debug, Default)]
pub struct Attendance {
    /// The pipe from the process that started this one, if that one watches over it.
    pub parent: Option<ParentPipe>,
    /// The stop socket, if it could be bound.
    pub stop: Option<StopSocket>,
    /// Where the controller stands; the stop socket's, if there is one.
    pub standing: Standing,
}

impl Attendance {
    /// What is known of the parent in this tick of the loop, one every `period`.
    pub fn parent_in_tick(&self, period: Duration) -> Parent {
        let parent = self.parent.as_ref();
        parent.map_or(Parent::None, |parent| parent.state_in_tick(period))
    }

    /// The next command from the stop socket, and the number to answer it with.
    pub fn take_command(&self) -> Option<(u64, Command)> {
        self.stop.as_ref()?.take_command()
    }

    /// Answers a command from the stop socket.
    pub fn answer(&self, number: u64, reply: &Reply) {
        if let Some(stop) = &self.stop {
            stop.answer(number, reply);
        }
    }

    /// Notes where the controller stands after so many ticks, for who asks at the stop socket, and for the service manager.
    pub fn note(&self, ticks: u64, mode: Mode, fault: Fault) {
        self.standing.note(ticks, mode, fault);
    }
}
