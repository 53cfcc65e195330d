//! The `wormd` binary.
fn main() {}
