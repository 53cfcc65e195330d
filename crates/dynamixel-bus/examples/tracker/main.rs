//! A tracker of cell positions as a DYNAMIXEL device of one's own: the other end of the line.
//!
//! `device.rs` is the device and `capture.rs` what it measures. Both would run on a microcontroller as they are. This file gives
//! them a clock and a line:
//!
//! ```text
//! tracker /dev/ttyUSB0 [baud]     # a serial port
//! tracker < port > port           # standard input and output, for a pseudo-terminal or a pipe
//! ```
//!
//! It has ID 100 and tracks 5 cells, unless `TRACKER_ID` and `TRACKER_CELLS` say otherwise. Its emergency stop is a file, for want of
//! a switch: it is pressed while the file that `TRACKER_EMERGENCY_STOP` names exists. Its inertial sensor is a file, too: `TRACKER_PITCH` names
//! one that says the pitch in degrees.

mod capture;
mod device;

use device::{NO_PITCH, Tracker};
use dynamixel_bus::packet::DeviceId;
use dynamixel_bus::{Port, PortError, Tty};
use std::error::Error;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

/// Longest wait for bytes, so that what is due is sent in time.
const POLL: Duration = Duration::from_millis(1);
/// How long an answer may take to be sent.
const SEND_TIME: Duration = Duration::from_millis(100);

fn main() -> Result<(), Box<dyn Error>> {
    let id = DeviceId::new(number("TRACKER_ID", 100)?).ok_or("TRACKER_ID: an ID is 0 to 252")?;
    let tracker = Tracker::new(id, usize::from(number("TRACKER_CELLS", 5)?));
    let file = |variable: &str| std::env::var_os(variable).map(PathBuf::from);
    let sensors = Sensors {
        emergency_stop: file("TRACKER_EMERGENCY_STOP"),
        pitch: file("TRACKER_PITCH"),
    };
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let ended = match arguments.as_slice() {
        [] => run(tracker, &sensors, StandardIo::new()),
        [path] => run(tracker, &sensors, Tty::open(Path::new(path), 1_000_000)?.0),
        [path, baud] => run(tracker, &sensors, Tty::open(Path::new(path), baud.parse()?)?.0),
        _ => return Err("usage: tracker [PORT [BAUD]]".into()),
    };
    match ended {
        PortError::Disconnected => Ok(()), // the line is closed
        error => Err(error.into()),
    }
}

fn number(variable: &str, default: u8) -> Result<u8, Box<dyn Error>> {
    match std::env::var(variable) {
        Ok(text) => Ok(text.parse().map_err(|error| format!("{variable}={text}: {error}"))?),
        Err(_) => Ok(default),
    }
}

/// Files that stand for switch and sensor.
struct Sensors {
    emergency_stop: Option<PathBuf>,
    pitch: Option<PathBuf>,
}

impl Sensors {
    fn is_pressed(&self) -> bool {
        self.emergency_stop.as_deref().is_some_and(Path::exists)
    }

    /// In 0.01°.
    fn pitch(&self) -> i16 {
        let text = self
            .pitch
            .as_deref()
            .and_then(|file| std::fs::read_to_string(file).ok());
        let degrees = text.and_then(|text| text.trim().parse::<f64>().ok());
        let known = degrees.filter(|degrees| degrees.is_finite());
        known.map_or(NO_PITCH, |degrees| (100.0 * degrees).round() as i16)
    }
}

/// Runs the device until the port fails.
fn run(mut tracker: Tracker, sensors: &Sensors, mut port: impl Port) -> PortError {
    let started = Instant::now();
    let mut bytes = [0; 256];
    loop {
        let received = match port.receive(&mut bytes, Instant::now() + POLL) {
            Ok(received) => received,
            Err(error) => return error,
        };
        let now_us = started.elapsed().as_micros() as u64;
        tracker.set_emergency_stop(sensors.is_pressed());
        tracker.set_pitch(sensors.pitch());
        let mut failed = None;
        let mut send = |answer: &[u8]| failed = port.send(answer, Instant::now() + SEND_TIME).err().or(failed);
        for &byte in &bytes[..received] {
            tracker.receive(byte, now_us, &mut send);
        }
        tracker.poll(now_us, &mut send);
        if let Some(error) = failed {
            return error;
        }
    }
}

/// Standard input and output as a port.
struct StandardIo {
    input: Receiver<Vec<u8>>,
    unread: Vec<u8>,
}

impl StandardIo {
    fn new() -> Self {
        let (sender, input) = channel();
        // A read of standard input cannot end at a deadline, so a thread does the waiting.
        std::thread::spawn(move || {
            let mut bytes = [0; 256];
            while let Ok(count @ 1..) = std::io::stdin().lock().read(&mut bytes) {
                if sender.send(bytes[..count].to_vec()).is_err() {
                    return;
                }
            }
        });
        Self {
            input,
            unread: Vec::new(),
        }
    }
}

impl Port for StandardIo {
    fn send(&mut self, bytes: &[u8], _: Instant) -> Result<(), PortError> {
        let mut output = std::io::stdout().lock();
        let sent = output.write_all(bytes).and_then(|()| output.flush());
        sent.map_err(|_| PortError::Disconnected)
    }

    fn receive(&mut self, into: &mut [u8], deadline: Instant) -> Result<usize, PortError> {
        if self.unread.is_empty() {
            match self
                .input
                .recv_timeout(deadline.saturating_duration_since(Instant::now()))
            {
                Ok(bytes) => self.unread = bytes,
                Err(RecvTimeoutError::Timeout) => return Ok(0),
                Err(RecvTimeoutError::Disconnected) => return Err(PortError::Disconnected),
            }
        }
        let count = into.len().min(self.unread.len());
        into[..count].copy_from_slice(&self.unread[..count]);
        self.unread.drain(..count);
        Ok(count)
    }

    fn discard_input(&mut self) -> Result<usize, PortError> {
        let queued: usize = self.input.try_iter().map(|bytes| bytes.len()).sum();
        Ok(queued + std::mem::take(&mut self.unread).len())
    }

    fn set_baud_rate(&mut self, _: u32) -> Result<(), PortError> {
        Ok(()) // a pipe has none
    }
}
