//! The worm as pure physics.
