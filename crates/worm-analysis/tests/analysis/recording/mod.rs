//! Recordings from files: what is refused and with which words, and that every format tells the same story of the same worm.

mod c3d;
mod campaign;
mod capture;
mod round_trip;
mod seen;
mod table;
