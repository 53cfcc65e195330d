//! The line to the virtual worm in virtual time: a port in memory, for tests and for many simulated hours.

use super::devices::Devices;
use crate::link::{Port, PortError};
use std::time::{Duration, Instant};

/// A port in memory with the virtual worm's devices at its other end. Its time runs only while the link waits, and then for at most
/// `timeout_s`.
#[derive(Debug)]
pub struct VirtualPort {
    /// What is at its other end.
    pub devices: Devices,
    /// Virtual time, s.
    pub now_s: f64,
    /// How long an answer may take, s.
    pub timeout_s: f64,
    /// When the answer to the last request is given up, s.
    pub give_up_s: f64,
    began: Instant,
    line: Vec<u8>,
}

impl VirtualPort {
    /// At time 0.
    pub fn new(devices: Devices, timeout_s: f64) -> Self {
        Self {
            devices,
            now_s: 0.0,
            timeout_s,
            give_up_s: 0.0,
            began: Instant::now(),
            line: Vec::new(),
        }
    }
}

/// The physics refuse only a configuration that was not checked.
fn simulated<E>(result: Result<(), E>) -> Result<(), PortError> {
    result.map_err(|_| PortError::Os {
        doing: "simulate the worm",
        kind: std::io::ErrorKind::InvalidInput,
    })
}

impl Port for VirtualPort {
    fn now(&self) -> Instant {
        self.began + Duration::from_secs_f64(self.now_s)
    }

    fn pass_time(&mut self, time: Duration) -> Result<(), PortError> {
        self.now_s += time.as_secs_f64();
        simulated(self.devices.advance_to(self.now_s))
    }

    fn send(&mut self, bytes: &[u8], _: Instant) -> Result<(), PortError> {
        simulated(self.devices.receive(bytes, self.now_s))?;
        self.give_up_s = self.now_s + self.timeout_s;
        Ok(())
    }

    fn receive(&mut self, into: &mut [u8], _: Instant) -> Result<usize, PortError> {
        if self.line.is_empty() {
            self.devices.take_due(self.now_s, &mut self.line);
        }
        if self.line.is_empty() {
            let due_s = self.devices.next_due_s().unwrap_or(f64::INFINITY);
            self.now_s = due_s.min(self.give_up_s).max(self.now_s);
            simulated(self.devices.advance_to(self.now_s))?;
            self.devices.take_due(self.now_s, &mut self.line);
        }
        let count = into.len().min(self.line.len());
        into[..count].copy_from_slice(&self.line[..count]);
        self.line.drain(..count);
        Ok(count)
    }

    fn discard_input(&mut self) -> Result<usize, PortError> {
        self.devices.take_due(self.now_s, &mut self.line);
        let count = self.line.len();
        self.line.clear();
        Ok(count)
    }

    fn set_baud_rate(&mut self, _: u32) -> Result<(), PortError> {
        Ok(())
    }
}
