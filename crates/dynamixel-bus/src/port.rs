//! The interface between a bus and a serial port: sending and receiving with deadlines.

use std::time::{Duration, Instant};

/// A serial port with bounded waits.
///
/// [`Tty`](super::Tty) is a port of the operating system; [`FaultInjector`](super::FaultInjector) wraps any other, for tests.
pub trait Port {
    /// Sends all of `bytes`.
    ///
    /// # Errors
    /// [`PortError::SendTimeout`] when they are not accepted by `deadline`, [`PortError::Disconnected`] when the other end is gone.
    fn send(&mut self, bytes: &[u8], deadline: Instant) -> Result<(), PortError>;

    /// Waits for bytes, and returns how many were written to `into`; zero when none has come by `deadline`.
    ///
    /// Bytes that have already arrived are returned even when the deadline has passed.
    ///
    /// # Errors
    /// [`PortError::Disconnected`] when no more can come.
    fn receive(&mut self, into: &mut [u8], deadline: Instant) -> Result<usize, PortError>;

    /// Discards bytes that have arrived and were not received; returns how many.
    ///
    /// # Errors
    /// [`PortError::Disconnected`] when the other end is gone.
    fn discard_input(&mut self) -> Result<usize, PortError>;

    /// Changes the baud rate, in bit/s.
    ///
    /// # Errors
    /// [`PortError::Os`] when the port does not have it.
    fn set_baud_rate(&mut self, baud: u32) -> Result<(), PortError>;

    /// The time at this port. A simulated port has its own.
    fn now(&self) -> Instant {
        Instant::now()
    }

    /// Waits while nothing is sent or received.
    ///
    /// # Errors
    /// [`PortError`] when a simulated port cannot go on.
    fn pass_time(&mut self, time: Duration) -> Result<(), PortError> {
        std::thread::sleep(time);
        Ok(())
    }
}

impl<P: Port + ?Sized> Port for &mut P {
    fn now(&self) -> Instant {
        (**self).now()
    }

    fn pass_time(&mut self, time: Duration) -> Result<(), PortError> {
        (**self).pass_time(time)
    }

    fn send(&mut self, bytes: &[u8], deadline: Instant) -> Result<(), PortError> {
        (**self).send(bytes, deadline)
    }

    fn receive(&mut self, into: &mut [u8], deadline: Instant) -> Result<usize, PortError> {
        (**self).receive(into, deadline)
    }

    fn discard_input(&mut self) -> Result<usize, PortError> {
        (**self).discard_input()
    }

    fn set_baud_rate(&mut self, baud: u32) -> Result<(), PortError> {
        (**self).set_baud_rate(baud)
    }
}

/// Why a port failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum PortError {
    /// The adapter was unplugged, or the other end of a pseudo-terminal is closed.
    #[error("the serial port is gone: plug the adapter in again, or restart the virtual worm")]
    Disconnected,
    /// The port accepted no bytes.
    #[error("the serial port takes no more bytes: is its other end alive, and flow control off?")]
    SendTimeout,
    /// Any other error of the operating system.
    #[error("the serial port failed to {doing}: {kind}")]
    Os {
        /// What was tried.
        doing: &'static str,
        /// The error.
        kind: std::io::ErrorKind,
    },
}
