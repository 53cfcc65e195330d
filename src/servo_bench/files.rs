//! What a session on a bench leaves behind: a CSV file for each run, and the campaign for `wormd explain` beside them.

use super::recorder::Reading;
use super::trajectory::Trajectory;
use std::fmt::Write as _;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Name of the campaign's file.
pub const CAMPAIGN: &str = "bench.toml";

/// What the servo moves, and on which supply.
#[derive(Debug, Clone, PartialEq)]
pub struct Bench {
    /// Mass at the end of the arm, kg.
    pub mass_kg: f64,
    /// From the shaft to that mass, m.
    pub length_m: f64,
    /// The arm's own mass, kg.
    pub arm_mass_kg: f64,
    /// Voltage without load, V.
    pub supply_v: f64,
    /// Greatest duty of the servo, in (0, 1].
    pub duty_limit: f64,
    /// The servo's name, or the file of its model.
    pub servo: String,
}

/// A folder with recordings. The campaign names each run as soon as its file is whole.
#[derive(Debug)]
pub struct BenchFiles {
    folder: PathBuf,
    campaign: String,
}

impl BenchFiles {
    /// A new folder, or one without a campaign.
    ///
    /// # Errors
    /// [`io::Error`] when it cannot be made, or holds a campaign already.
    pub fn create(folder: &Path, bench: &Bench) -> io::Result<Self> {
        fs::create_dir_all(folder)?;
        if folder.join(CAMPAIGN).exists() {
            return Err(io::Error::new(
                io::ErrorKind::AlreadyExists,
                format!("{CAMPAIGN} is there already: give a new folder"),
            ));
        }
        let Bench {
            mass_kg,
            length_m,
            arm_mass_kg,
            supply_v,
            duty_limit,
            servo,
        } = bench;
        let servo = toml::Value::from(servo.as_str());
        let campaign = format!(
            "plant = \"servo-bench\"\n\n[bench]\nmass_kg = {mass_kg:?}\nlength_m = {length_m:?}\narm_mass_kg = {arm_mass_kg:?}\nsupply_v = \
             {supply_v:.2}\nduty_limit = {duty_limit:.5}\nservo = {servo}\n"
        );
        Ok(Self {
            folder: folder.to_path_buf(),
            campaign,
        })
    }

    /// Where the campaign is.
    pub fn campaign(&self) -> PathBuf {
        self.folder.join(CAMPAIGN)
    }

    /// Adds a run; returns the name of its file.
    ///
    /// # Errors
    /// [`io::Error`] when a file cannot be written.
    pub fn add(&mut self, trajectory: Trajectory, gain: u16, readings: &[Reading]) -> io::Result<String> {
        let name = format!("{}-p{gain}.csv", trajectory.name());
        fs::write(self.folder.join(&name), csv(readings))?;
        // Writing to a string cannot fail.
        let _ = write!(
            self.campaign,
            "\n[[run]]\nrecording = \"{name}\"\nposition_p_gain = {gain}\ntrajectory = \"{}\"\n",
            trajectory.name()
        );
        fs::write(self.campaign(), &self.campaign)?;
        Ok(name)
    }
}

fn csv(readings: &[Reading]) -> String {
    let mut text =
        String::from("time_s,goal_rad,position_rad,velocity_rad_s,current_ma,input_v,temperature_c,torque_enabled\n");
    for reading in readings {
        let _ = writeln!(
            text,
            "{:.6},{:.6},{:.6},{:.5},{:.0},{:.1},{:.0},{}",
            reading.time_s,
            reading.goal_rad,
            reading.position_rad,
            reading.velocity_rad_s,
            reading.current_ma,
            reading.input_v,
            reading.temperature_c,
            u8::from(reading.torque_enabled)
        );
    }
    text
}
