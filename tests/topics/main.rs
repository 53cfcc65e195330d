//! The topics in real shared memory: publishing, starting and leaving, readers in Python.

mod foreign;
mod home;
mod publishing;
mod python;
mod start;
