//! The loop's ports on the topics, and what one tick takes from them.

use crate::attendance::Attendance;
use crate::topics::{
    CommandServer, Controller as ControllerRole, Hub, Notifier, PortError, Publisher, Responder, RoleLock, Subscriber,
};
use worm_estimator::message::{Alarm, AlarmKind, Command, CommandRecord, Estimate, State, Timing};

/// Maximum number of alarm changes that one tick reads; more wait for the next tick.
pub(super) const ALARMS_PER_TICK: usize = AlarmKind::ALL.len();

/// The loop's ports on the topics.
pub(super) struct Ports {
    pub state: Publisher<State>,
    pub state_event: Notifier<State>,
    pub timing: Publisher<Timing>,
    pub estimates: Subscriber<Estimate>,
    pub alarms: Subscriber<Alarm>,
    pub commands: CommandServer,
    pub command_records: Publisher<CommandRecord>,
}

impl Ports {
    pub fn open(hub: &Hub, role: &RoleLock<ControllerRole>) -> Result<Self, PortError> {
        Ok(Self {
            state: hub.publisher(role)?,
            state_event: hub.notifier(role)?,
            timing: hub.publisher(role)?,
            estimates: hub.subscriber()?,
            alarms: hub.subscriber()?,
            commands: hub.command_server(role)?,
            command_records: hub.publisher(role)?,
        })
    }

    /// Reads the alarms that arrived since the last tick. A topic that cannot be read counts as silent, which the safety rules
    /// handle.
    pub fn take_alarms(&mut self, into: &mut [Alarm; ALARMS_PER_TICK]) -> usize {
        let mut count = 0;
        while count < into.len() {
            let Ok(Some(alarm)) = self.alarms.next() else { break };
            into[count] = *alarm;
            count += 1;
        }
        count
    }
}

/// Who asked for a command, and gets the answer.
pub(super) enum Asker {
    Topic(Responder),
    StopSocket(u64),
}

/// The next command: from the stop socket, else from the topics.
pub(super) fn take_command(topic: &CommandServer, attendance: &Attendance) -> (Option<Command>, Option<Asker>) {
    if let Some((number, command)) = attendance.take_command() {
        return (Some(command), Some(Asker::StopSocket(number)));
    }
    match topic.take() {
        Ok(Some((command, responder))) => (Some(command), Some(Asker::Topic(responder))),
        // A request that cannot be read is not answered; its sender times out.
        Ok(None) | Err(_) => (None, None),
    }
}
