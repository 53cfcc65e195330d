//! The bus with a worm's devices on it.

use std::ops::{Deref, DerefMut};

use super::owed_answers::OwedAnswers;
use super::{Bus, ExchangeCounters, LinkCounters, Port};

/// A [`Bus`] with a worm's servo and tracker on it: what any bus can do, and the [exchange](Self::exchange) of a tick.
#[derive(Debug)]
pub struct WormBus<P> {
    pub(super) bus: Bus<P>,
    pub(super) exchange_counters: ExchangeCounters,
    /// Exchanges to which the servo's answer may still come.
    pub(super) owed: OwedAnswers,
    /// Exchanges since a device last sent anything.
    pub(super) silent_in_a_row: u32,
}

impl<P: Port> WormBus<P> {
    /// The worm's bus on this port.
    pub const fn new(port: P) -> Self {
        Self {
            bus: Bus::new(port),
            exchange_counters: ExchangeCounters::NONE,
            owed: OwedAnswers::NONE,
            silent_in_a_row: 0,
        }
    }

    /// What the exchanges have counted so far.
    pub const fn exchange_counters(&self) -> ExchangeCounters {
        self.exchange_counters
    }

    /// What bus and exchanges have counted so far.
    pub const fn link_counters(&self) -> LinkCounters {
        LinkCounters {
            bus: self.bus.counters(),
            exchange: self.exchange_counters,
        }
    }
}

impl<P> Deref for WormBus<P> {
    type Target = Bus<P>;

    fn deref(&self) -> &Bus<P> {
        &self.bus
    }
}

impl<P> DerefMut for WormBus<P> {
    fn deref_mut(&mut self) -> &mut Bus<P> {
        &mut self.bus
    }
}
