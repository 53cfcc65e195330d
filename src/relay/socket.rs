//! Where the relay listens: a Unix socket in the worm's folder, which is its user's alone.

use crate::topics::Instance;
use nix::sys::socket::{getsockopt, sockopt::PeerCredentials};
use std::io;
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::PathBuf;

/// The bound socket; its name goes when it is dropped.
#[derive(Debug)]
pub(crate) struct Listener {
    pub(crate) socket: UnixListener,
    path: PathBuf,
    /// Device and inode of the name.
    identity: (u64, u64),
}

impl Listener {
    /// Binds the socket, in the place of one that a killed relay has left. Only for who has the role of the relay.
    pub(crate) fn bind(instance: &Instance) -> io::Result<Self> {
        let path = instance.relay_socket();
        match std::fs::remove_file(&path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
        let socket = UnixListener::bind(&path)?;
        std::fs::set_permissions(&path, PermissionsExt::from_mode(0o600))?;
        socket.set_nonblocking(true)?;
        let metadata = path.symlink_metadata()?;
        let identity = (metadata.dev(), metadata.ino());
        Ok(Self { socket, path, identity })
    }

    /// Whether the name still leads to this socket.
    pub(crate) fn is_in_place(&self) -> bool {
        let there = self.path.symlink_metadata();
        there.is_ok_and(|there| (there.dev(), there.ino()) == self.identity)
    }
}

impl Drop for Listener {
    fn drop(&mut self) {
        // Somebody else's may be there by now.
        if self.is_in_place()
            && let Err(error) = std::fs::remove_file(&self.path)
        {
            tracing::debug!("{}: {error}", self.path.display());
        }
    }
}

/// User and process at the other end, by the kernel.
pub(crate) fn peer_of(stream: &UnixStream) -> io::Result<(u32, i32)> {
    let peer = getsockopt(stream, PeerCredentials)?;
    Ok((peer.uid(), peer.pid()))
}
