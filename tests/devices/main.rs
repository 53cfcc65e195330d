//! The serial side: the link against a worm in memory, and against the virtual worm on a pseudo-terminal; the manufacturer's own client.

mod drive;
mod example_tracker;
mod link;
mod official_sdk;
mod trials;
mod virtual_worm;
