//! Logs of a worm's topics: what is written is read back, whatever happens to the file, and replays to the same results.

mod damage;
mod export;
mod replay;
mod writing;
