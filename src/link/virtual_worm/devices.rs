//! Servo and tracker on their bus, without a port and without a clock: bytes and a time in, bytes out.
//!
//! On a shared bus the order of the answers is the protocol's: to a broadcast ping by ID, to sync and bulk reads in the
//! order of the request. There each device waits for the one before it, so **those behind a silent device
//! stay silent**, in plain reads as in fast ones, where the joint answer then ends early.
//!
//! A damaged instruction is answered with a CRC error by the device whose ID it bears, an unknown one with an instruction
//! error. The return delay is kept by each device; the time that bytes take on a real wire is not modelled.

use super::body::BodyError;
use super::bus::Bus;
use super::fault::Fault;
use super::options::Options;
use super::plant::Plant;
use crate::link::servo::BAUD_RATES;
use dynamixel_bus::packet::Decoder;
use worm_estimator::config::Config;
use worm_physics::WormError;

/// A packet whose end does not come within this time is given up, s.
const IDLE_S: f64 = 5e-3;

/// Why the devices cannot be simulated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DevicesError {
    /// The configuration describes no body.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// A fault names a cell that this worm does not have.
    #[error("the fault {fault} names cell {cell}, but the worm has {cells} cells: give a cell from 1 to {cells}")]
    NoSuchCell {
        /// Kind of the fault.
        fault: &'static str,
        /// The cell that it names.
        cell: usize,
        /// Cells of the worm.
        cells: usize,
    },
    /// A battery fault without a battery.
    #[error("the fault battery needs a battery: add a section [battery] to the configuration, or use the fault sag")]
    NoBattery,
    /// A baud rate that the servo does not have.
    #[error("the servo has no baud rate {0}: use one of {BAUD_RATES:?}")]
    Baud(u32),
}

/// The devices, the machine between them, and the line to the controller.
#[derive(Debug, Clone)]
pub struct Devices {
    decoder: Decoder,
    last_byte_s: f64,
    bus: Bus,
    has_battery: bool,
    /// When the worm began to crawl on the clock of the real-time server, ns.
    pub(super) crawl_began_ns: Option<u64>,
}

impl Devices {
    /// Both devices at time 0, the worm at rest.
    ///
    /// # Errors
    /// [`DevicesError`]
    pub fn new(config: &Config, options: &Options) -> Result<Self, DevicesError> {
        let (cells, has_battery) = (config.worm.cells, config.battery.is_some());
        for fault in &options.faults {
            check_fault(fault, cells, has_battery)?;
        }
        if let Some(baud) = options.baud
            && !BAUD_RATES.contains(&baud)
        {
            return Err(DevicesError::Baud(baud));
        }
        Ok(Self {
            decoder: Decoder::new(),
            last_byte_s: 0.0,
            bus: Bus::new(config, options)?,
            has_battery,
            crawl_began_ns: None,
        })
    }

    /// Switches a fault on from now on, beside those that there are; START and END of its window are seconds from now.
    ///
    /// # Errors
    /// [`DevicesError`] when this worm cannot have it.
    pub fn switch_on(&mut self, fault: Fault) -> Result<(), DevicesError> {
        check_fault(&fault, self.bus.plant().body().cells(), self.has_battery)?;
        self.bus.switch_on(fault);
        Ok(())
    }

    /// Ends all faults, or those of a kind, also those that have not begun. Returns how many there were.
    pub fn clear_faults(&mut self, kind: Option<&str>) -> usize {
        self.bus.clear_faults(kind)
    }

    /// Every fault that there is, and whether it holds at the moment.
    pub fn faults(&self) -> impl Iterator<Item = (&Fault, bool)> {
        self.bus.faults()
    }

    /// Lets time pass until `now_s`.
    ///
    /// # Errors
    /// [`WormError`] never for a checked configuration.
    pub fn advance_to(&mut self, now_s: f64) -> Result<(), WormError> {
        self.bus.advance_to(now_s)
    }

    /// Takes bytes from the controller at `now_s`. Answers come out of [`take_due`](Self::take_due).
    ///
    /// # Errors
    /// [`WormError`] never for a checked configuration.
    pub fn receive(&mut self, mut bytes: &[u8], now_s: f64) -> Result<(), WormError> {
        self.bus.advance_to(now_s)?;
        if now_s - self.last_byte_s > IDLE_S {
            self.decoder.clear();
        }
        self.last_byte_s = now_s;
        while !bytes.is_empty() {
            let taken = self.decoder.push(bytes);
            bytes = &bytes[taken..];
            while let Some(packet) = self.decoder.next_packet() {
                self.bus.take(packet);
            }
        }
        Ok(())
    }

    /// Appends the answers that are due at `now_s` to `out`.
    pub fn take_due(&mut self, now_s: f64, out: &mut Vec<u8>) {
        self.bus.line().take_due(now_s, out);
    }

    /// When the next answer is due, s.
    pub fn next_due_s(&self) -> Option<f64> {
        self.bus.next_due_s()
    }

    /// Baud rate that the servo is set to, bit/s.
    pub fn baud(&self) -> u32 {
        self.bus.baud()
    }

    /// The machine.
    pub fn plant(&self) -> &Plant {
        self.bus.plant()
    }

    /// When the worm began to crawl, s.
    pub fn crawl_began_s(&self) -> Option<f64> {
        self.bus.crawl_began_s()
    }
}

/// Whether a worm can have this fault.
fn check_fault(fault: &Fault, cells: usize, has_battery: bool) -> Result<(), DevicesError> {
    let cell = fault.greatest_cell();
    if cell > cells {
        let fault = fault.name();
        return Err(DevicesError::NoSuchCell { fault, cell, cells });
    }
    if fault.name() == "battery" && !has_battery {
        return Err(DevicesError::NoBattery);
    }
    Ok(())
}
