//! What a bus needs of a serial port: to send, and to wait for bytes no longer than it is told.

use std::time::Instant;

/// A serial port with bounded waits.
///
/// [`Tty`](super::Tty) is the operating system's; [`FaultInjector`](super::FaultInjector) wraps any other, for tests and
/// rehearsals.
pub trait Port {
    /// Sends all of `bytes`.
    ///
    /// # Errors
    /// [`PortError::SendTimeout`] when they are not taken by `deadline`, [`PortError::Disconnected`] when nobody is there.
    fn send(&mut self, bytes: &[u8], deadline: Instant) -> Result<(), PortError>;

    /// Waits until bytes come, and returns how many were put into `into`; zero when none has come by `deadline`.
    ///
    /// Bytes that are there already are returned even when the deadline has passed.
    ///
    /// # Errors
    /// [`PortError::Disconnected`] when no more can come.
    fn receive(&mut self, into: &mut [u8], deadline: Instant) -> Result<usize, PortError>;

    /// Throws away what has come and was not received; returns how many bytes.
    ///
    /// # Errors
    /// [`PortError::Disconnected`] when nobody is there.
    fn discard_input(&mut self) -> Result<usize, PortError>;

    /// Changes the baud rate, in bit/s.
    ///
    /// # Errors
    /// [`PortError::Os`] when the port does not have it.
    fn set_baud_rate(&mut self, baud: u32) -> Result<(), PortError>;
}

impl<P: Port + ?Sized> Port for &mut P {
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
    /// The port took no bytes.
    #[error("the serial port takes no more bytes: is its other end alive, and flow control off?")]
    SendTimeout,
    /// Anything else that the operating system says.
    #[error("the serial port failed to {doing}: {kind}")]
    Os {
        /// What was tried.
        doing: &'static str,
        /// What came of it.
        kind: std::io::ErrorKind,
    },
}
