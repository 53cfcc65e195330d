//! The simulated tracker: [`link::tracker`](crate::link::tracker)'s control table around the plant's camera.

use super::control_table::{Area, ControlTable, Entry, eeprom, read_only};
use super::inertial_sensor::InertialSensor;
use super::plant::Plant;
use crate::link::tracker::register::{FIRMWARE_VERSION, ID, MODEL_NUMBER, PITCH, SWITCHES};
use crate::link::tracker::{BLOCK_ADDRESS, DEFAULT_ID, MAX_BLOCK_LEN, MODEL, NO_PITCH};
use dynamixel_bus::packet::{DeviceId, ResetScope, StatusError};
use worm_estimator::config::Config;

/// Firmware version.
const FIRMWARE: i64 = 1;

static ENTRIES: [Entry; 5] = [
    read_only(MODEL_NUMBER, MODEL as i64),
    read_only(FIRMWARE_VERSION, FIRMWARE),
    eeprom(ID, DEFAULT_ID as i64, 0, 252),
    read_only(PITCH, NO_PITCH as i64),
    read_only(SWITCHES, 0),
];

/// The tracker's electronics. It answers without delay, everything, whatever its registers say.
#[derive(Debug, Clone)]
pub(super) struct Tracker {
    table: ControlTable, // the head of the table
    inertial_sensor: Option<InertialSensor>,
    bytes: Vec<u8>, // the whole table, as it was last read
    registered: Option<(u16, Vec<u8>)>,
}

impl Tracker {
    /// The sensor's error comes from the seed.
    pub(super) fn new(config: &Config, seed: u64) -> Self {
        let mut table = ControlTable::new(&ENTRIES, BLOCK_ADDRESS);
        table.set(ID, i64::from(config.tracker.id));
        table.set(MODEL_NUMBER, i64::from(config.tracker.model_number));
        Self {
            table,
            inertial_sensor: InertialSensor::new(config, seed),
            bytes: vec![0; usize::from(BLOCK_ADDRESS) + MAX_BLOCK_LEN],
            registered: None,
        }
    }

    /// Sets the switches, one bit each.
    pub(super) fn set_switches(&mut self, switches: u8) {
        self.table.set(SWITCHES, i64::from(switches));
    }

    pub(super) fn id(&self) -> DeviceId {
        DeviceId::new(self.table.get(ID) as u8).unwrap_or(DeviceId::MAX) // the table keeps it within 0 to 252
    }

    pub(super) fn identity(&self) -> [u8; 3] {
        let [low, high] = (self.table.get(MODEL_NUMBER) as u16).to_le_bytes();
        [low, high, self.table.get(FIRMWARE_VERSION) as u8]
    }

    /// Bytes of the control table as they are now; a capture is never mixed with the next.
    pub(super) fn read(&mut self, address: u16, length: u16, plant: &Plant) -> Result<&[u8], StatusError> {
        if length == 0 {
            return Err(StatusError::DataLength);
        }
        if let Some(sensor) = &self.inertial_sensor {
            self.table.set(PITCH, i64::from(sensor.counts(plant.body())));
        }
        let (head, captured) = self.bytes.split_at_mut(usize::from(BLOCK_ADDRESS));
        head.copy_from_slice(self.table.read(0, BLOCK_ADDRESS)?);
        captured.copy_from_slice(&plant.capture().to_block());
        let from = usize::from(address);
        self.bytes
            .get(from..from + usize::from(length))
            .ok_or(StatusError::Access)
    }

    pub(super) fn write(&mut self, address: u16, data: &[u8]) -> Result<(), StatusError> {
        for (entry, value) in self.table.check_write(address, data, false)? {
            self.table.set(entry.register, value);
        }
        Ok(())
    }

    pub(super) fn register_write(&mut self, address: u16, data: &[u8]) -> Result<(), StatusError> {
        self.table.check_write(address, data, false)?;
        self.registered = Some((address, data.to_vec()));
        Ok(())
    }

    pub(super) fn action(&mut self) -> Result<(), StatusError> {
        let (address, data) = self.registered.take().ok_or(StatusError::Instruction)?;
        self.write(address, &data)
    }

    pub(super) fn factory_reset(&mut self, scope: ResetScope) -> Result<(), StatusError> {
        if scope == ResetScope::All {
            self.table.reset(Area::Eeprom, &[]);
        }
        self.registered = None;
        Ok(())
    }
}
