//! A serial port that may go and come back.
//!
//! A port that is gone is closed at once, so that an adapter that is plugged in again gets its old name. From then on a thread of its own
//! tries to open the port again: neither closing nor opening costs the loop any time.

use crate::link::{Port, PortError, Tty};
use std::path::Path;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::{Duration, Instant};

/// Interval of the attempts to open a port that is gone.
const RETRY: Duration = Duration::from_millis(100);

/// A port, or none while it is gone.
#[derive(Debug)]
pub(super) struct ReplaceablePort {
    tty: Option<Tty>,
    gone: SyncSender<Tty>,
    back: Receiver<Tty>,
}

impl ReplaceablePort {
    /// An open port that is opened again at `path` when it has gone.
    ///
    /// # Errors
    /// When no thread can be started.
    pub(super) fn new(tty: Tty, path: &Path, baud: u32) -> std::io::Result<Self> {
        let (gone, to_close) = sync_channel(1);
        let (opened, back) = sync_channel(1);
        let path = path.to_owned();
        std::thread::Builder::new()
            .name("port-opener".to_owned())
            .spawn(move || reopen(&path, baud, &to_close, &opened))?;
        Ok(Self {
            tty: Some(tty),
            gone,
            back,
        })
    }

    /// Whether there is no port.
    pub(super) const fn is_gone(&self) -> bool {
        self.tty.is_none()
    }

    /// Gives up the port: it is closed, and opened again as soon as it is back.
    pub(super) fn give_up(&mut self) {
        if let Some(tty) = self.tty.take() {
            // There is room for the only port that there is. If the thread were gone, the port would be closed here.
            let _closed = self.gone.try_send(tty);
        }
    }

    /// Takes the port if it is back. Never waits.
    pub(super) fn take_back(&mut self) {
        if self.tty.is_none() {
            self.tty = self.back.try_recv().ok();
        }
    }
}

/// Closes each port that is gone, and opens it again, until the other end is dropped.
fn reopen(path: &Path, baud: u32, to_close: &Receiver<Tty>, opened: &SyncSender<Tty>) {
    while let Ok(port) = to_close.recv() {
        drop(port);
        let port = loop {
            if let Ok((port, _findings)) = Tty::open(path, baud) {
                break port;
            }
            // Nothing is closed meanwhile; this waits, and notices the end.
            if let Err(RecvTimeoutError::Disconnected) = to_close.recv_timeout(RETRY) {
                return;
            }
        };
        tracing::info!("{}: the port is open again", path.display());
        if opened.send(port).is_err() {
            return;
        }
    }
}

impl Port for ReplaceablePort {
    fn send(&mut self, bytes: &[u8], deadline: Instant) -> Result<(), PortError> {
        self.tty.as_mut().ok_or(PortError::Disconnected)?.send(bytes, deadline)
    }

    fn receive(&mut self, into: &mut [u8], deadline: Instant) -> Result<usize, PortError> {
        self.tty
            .as_mut()
            .ok_or(PortError::Disconnected)?
            .receive(into, deadline)
    }

    fn discard_input(&mut self) -> Result<usize, PortError> {
        self.tty.as_mut().ok_or(PortError::Disconnected)?.discard_input()
    }

    fn set_baud_rate(&mut self, baud: u32) -> Result<(), PortError> {
        self.tty.as_mut().ok_or(PortError::Disconnected)?.set_baud_rate(baud)
    }
}
