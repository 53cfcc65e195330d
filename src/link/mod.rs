//! The serial side: packets, the bus, the servo and the tracker.
