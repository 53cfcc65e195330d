//! How the processes around the controller end when their parent is gone.

use super::parent_pipe::{Parent, ParentPipe};
use crate::failure::Failure;
use crate::topics::{Controller, Instance, RoleLock};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// How often an orphan looks for the controller.
const POLL: Duration = Duration::from_millis(200);

/// A lease that only the end of the pipe ends: these processes move nothing.
const NEVER: Duration = Duration::MAX;

/// Sets `end` when the parent is gone and no controller of the worm is left: an orphaned controller goes on holding the worm, and
/// what it does is still estimated and recorded.
///
/// # Errors
/// [`Failure::Failed`] when there is no thread to be had.
pub(crate) fn end_after_controller(instance: &Instance, end: &Arc<AtomicBool>) -> Result<(), Failure> {
    let parent = ParentPipe::watch(NEVER, 0).map_err(no_thread)?;
    let (instance, end) = (instance.clone(), Arc::clone(end));
    std::thread::Builder::new()
        .name("orphan".to_owned())
        .spawn(move || {
            let mut attended = None;
            loop {
                std::thread::sleep(POLL);
                let controller = RoleLock::<Controller>::holder(&instance);
                if parent.state() != Parent::Gone {
                    attended = controller;
                } else if controller.is_none() || controller != attended {
                    // Gone, or already that of a successor, which comes with processes of its own.
                    end.store(true, Ordering::Relaxed);
                    return;
                }
            }
        })
        .map_err(no_thread)?;
    Ok(())
}

/// Sets `end` when standard input ends: whoever started this process and holds the other end of the pipe is gone, or closed it.
///
/// # Errors
/// [`Failure::Failed`] when there is no thread to be had.
pub(crate) fn end_with_parent(end: &Arc<AtomicBool>) -> Result<(), Failure> {
    let parent = ParentPipe::watch(NEVER, 0).map_err(no_thread)?;
    let end = Arc::clone(end);
    std::thread::Builder::new()
        .name("parent-end".to_owned())
        .spawn(move || {
            while parent.state() != Parent::Gone {
                std::thread::sleep(POLL);
            }
            end.store(true, Ordering::Relaxed);
        })
        .map_err(no_thread)?;
    Ok(())
}

fn no_thread(error: std::io::Error) -> Failure {
    Failure::failed(format!("no thread can be started: {error}"))
}
