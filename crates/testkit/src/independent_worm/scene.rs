//! How one recording is made: a worm, its motor, and the camera.

use super::body::{Body, Motion};
use super::cam::{Cam, Drive};
use super::camera::{Camera, CameraSampler};
use super::truth::Truth;
use crate::nominal::{MAX_BODY_SPEED_M_S, STROKE_M, TIMEOUT_CYCLES};
use std::path::PathBuf;
use worm_analysis::recording::Recording;

/// Time step of the integrator, s: below a hundredth of the fastest swing of a body on its tips.
pub const STEP_S: f64 = 50e-6;
/// Time between two rows of the truth, s.
const ROW_S: f64 = 1e-3;

/// The tips did not hold the worm.
#[derive(Debug)]
pub struct SlidDown;

/// A worm, its motor and the camera.
#[derive(Debug, Clone)]
pub struct Scene {
    pub body: Body,
    pub cam: Cam,
    pub drive: Drive,
    pub camera: Camera,
    /// Gait cycles, not necessarily whole, before the camera is switched on; 0: from the start at rest.
    pub warm_up_cycles: f64,
    /// Gait cycles in the recording.
    pub cycles: f64,
    /// Time at rest at the end, s; 0: the recording ends in mid-crawl.
    pub rest_after_s: f64,
    pub seed: u64,
    /// Time step of the integrator, s.
    pub step_s: f64,
}

impl Scene {
    /// Twelve cycles of a given worm with an even motor and a perfect camera, recorded from the start.
    pub fn ideal(body: Body, cycle_s: f64) -> Self {
        let cells = body.cells();
        Self {
            body,
            cam: Cam::new(STROKE_M, (0..cells).collect()),
            drive: Drive::even(cycle_s),
            camera: Camera::perfect(),
            warm_up_cycles: 0.0,
            cycles: 12.0,
            rest_after_s: 0.0,
            seed: 1,
            step_s: STEP_S,
        }
    }

    /// Simulates the scene: the recording, with the gait phase, and what truly happened.
    ///
    /// # Errors
    /// [`SlidDown`] when the worm does not hold on the slope.
    pub fn record(&self) -> Result<(Recording, Truth), SlidDown> {
        let cells = self.cam.cells();
        let from_phase = self.drive.first_phase + self.warm_up_cycles;
        let to_phase = from_phase + self.cycles;
        let mut drive = self.drive.clone();
        if self.rest_after_s > 0.0 {
            drive.last_phase = to_phase;
        }
        let mut motion = Motion::laid_down(self.body.clone(), self.cam.clone(), drive.first_phase, self.step_s);
        let mut phase = drive.first_phase;
        // Without a warm-up the camera runs while the worm rests before its first step.
        while self.warm_up_cycles > 0.0 && phase < from_phase {
            phase = self.step(&drive, phase, &mut motion)?;
        }

        let origin_s = motion.time_s();
        let mut sampler = CameraSampler::new(self.camera.clone(), cells, self.seed);
        let mut truth = Truth::beginning(&self.body, &self.cam);
        truth.stored_j = [motion.stored_j(); 2];
        let mut recording = self.empty_recording();
        let mut sample_s = sampler.next_s();
        let mut row_s = 0.0;
        let mut last_s = f64::INFINITY;
        let timeout_s = drive.rest_before_s + TIMEOUT_CYCLES * self.cycles * drive.cycle_s;
        loop {
            let now_s = motion.time_s() - origin_s;
            if now_s >= row_s {
                truth.push(now_s, phase, motion.balance.clone());
                row_s += ROW_S;
            }
            if phase >= to_phase && last_s.is_infinite() {
                last_s = now_s + self.rest_after_s;
            }
            if now_s >= last_s {
                truth.push(now_s + self.step_s, phase, motion.balance.clone());
                break;
            }
            assert!(now_s < timeout_s, "the motor does not reach its last phase: {drive:?}");
            let before_m = motion.position_m.clone();
            let next_phase = self.step(&drive, phase, &mut motion)?;
            let next_s = motion.time_s() - origin_s;
            while sample_s < next_s {
                let fraction = (sample_s - now_s) / (next_s - now_s);
                recording.time_s.push(sample_s);
                truth.sample_phase.push(phase + fraction * (next_phase - phase));
                for (cell, &before) in before_m.iter().enumerate() {
                    let position_m = before + fraction * (motion.position_m[cell] - before);
                    truth.sample_position_m[cell].push(position_m);
                    recording.position_m[cell].push(sampler.measure(cell, sample_s, position_m));
                }
                sample_s = sampler.next_s();
            }
            phase = next_phase;
        }
        truth.stored_j[1] = motion.stored_j();
        truth.find_cycles();
        recording.gait_phase = Some(truth.sample_phase.clone());
        Ok((recording, truth))
    }

    /// One time step by the midpoint rule; returns the phase it leads to.
    fn step(&self, drive: &Drive, phase: f64, motion: &mut Motion) -> Result<f64, SlidDown> {
        let cells = self.cam.cells();
        let half_s = 0.5 * self.step_s;
        let midway = phase + half_s * drive.speed(phase, motion.time_s(), cells);
        let speed = drive.speed(midway, motion.time_s() + half_s, cells);
        let next = (phase + self.step_s * speed).min(drive.last_phase);
        motion.step_to(next);
        if motion.translation_m_s.abs() > MAX_BODY_SPEED_M_S {
            return Err(SlidDown);
        }
        Ok(next)
    }

    fn empty_recording(&self) -> Recording {
        let cells = self.cam.cells();
        Recording {
            source: PathBuf::from(format!("seed{}", self.seed)),
            cell_names: (1..=cells).map(|cell| format!("x{cell}_m")).collect(),
            time_s: Vec::new(),
            position_m: vec![Vec::new(); cells],
            gait_phase: None,
            motor: None,
            warnings: Vec::new(),
            repairs: Vec::new(),
        }
    }
}

/// The recording as motion capture gives it: positions and nothing else.
pub fn positions_only(recording: &Recording) -> Recording {
    Recording {
        gait_phase: None,
        ..recording.clone()
    }
}
