//! Recordings from files: every format gives the same recording of the same worm, and every refusal names its cause.

mod c3d;
mod campaign;
mod capture;
mod clean_captures;
mod damaged_captures;
mod round_trip;
mod seen;
mod table;
