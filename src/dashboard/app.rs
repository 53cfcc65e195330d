//! What all answers are made of.

use super::Token;
use super::access::Hosts;
use super::fleet::FleetThread;
use super::places::Places;
use super::relay_thread::{RelayThread, Shared};
use super::strangers::Strangers;
use crate::black_box::place::Place as BoxPlace;
use std::net::IpAddr;
use std::path::PathBuf;
use std::sync::Arc;

/// The address of who asks.
#[derive(Debug, Clone, Copy)]
pub(super) struct Peer(pub(super) IpAddr);

/// What all answers are made of.
pub(super) struct App {
    pub(super) shared: Shared,
    pub(super) relay: RelayThread,
    pub(super) fleet: FleetThread,
    pub(super) token: Token,
    pub(super) strangers: Strangers,
    pub(super) hosts: Hosts,
    pub(super) reports: Option<PathBuf>,
    pub(super) boxes: BoxPlace,
    pub(super) places: Arc<Places>,
}
