//! The topics in real shared memory: publishing, starting and leaving, readers in Python and C.

mod c_header;
mod foreign;
mod home;
mod publishing;
mod python;
mod start;
