//! One run: a worm, its motor, and the camera.

use super::MAX_CELLS;
use super::body::{Motion, Placement, StepInput, Worm};
use super::camera::{Camera, CameraSampler};
use super::drive::Drive;
use super::parameters::each_of;
use super::servo::Servo;
use crate::nominal::{MAX_BODY_SPEED_M_S, TIMEOUT_CYCLES};
use crate::random::{log_uniform, normal};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::TAU;
use std::path::PathBuf;
use worm_analysis::recording::Recording;

/// Time step of the integrator, s: below a hundredth of the fastest swing of a body on its tips.
pub const STEP_S: f64 = 100e-6;

/// The tips did not hold the worm, or the motor did not turn the cam far enough.
#[derive(Debug)]
pub struct CrawlFailed;

/// A camera whose noise is partly correlated in time.
#[derive(Debug, Clone)]
pub struct MotionCapture {
    pub camera: Camera,
    /// Standard deviation of the correlated part of the noise, m.
    pub drift_m: f64,
    /// Its correlation time, s.
    pub drift_s: f64,
}

impl MotionCapture {
    /// A camera that sees everything as it is.
    pub fn perfect() -> Self {
        Self {
            camera: Camera::perfect(),
            drift_m: 0.0,
            drift_s: 0.05,
        }
    }

    /// A camera of middling noise.
    pub fn usual() -> Self {
        Self {
            camera: Camera::default(),
            drift_m: 0.02e-3,
            drift_s: 0.1,
        }
    }

    /// A camera drawn at random.
    pub fn draw(rng: &mut Xoshiro256PlusPlus) -> Self {
        Self {
            camera: Camera {
                noise_m: log_uniform(0.03e-3, 0.15e-3, rng),
                ..Camera::default()
            },
            drift_m: log_uniform(0.01e-3, 0.05e-3, rng),
            drift_s: log_uniform(0.02, 0.2, rng),
        }
    }
}

/// How one run is made.
#[derive(Debug, Clone)]
pub struct Scene {
    pub placement: Placement,
    pub drive: Drive,
    pub capture: MotionCapture,
    /// Gait cycles, not necessarily whole, before the camera is switched on; 0: from the start at rest.
    pub warm_up_cycles: f64,
    /// Gait cycles in the recording.
    pub cycles: f64,
    /// Rest after each whole cycle, s.
    pub dwell_s: f64,
    /// Cycle of the recording at which the friction jumps; infinite: never.
    pub jump_at_cycle: f64,
    /// Cycle of the recording at which what is hidden begins: minus infinity: it is there from the start; infinity: never.
    pub begins_at_cycle: f64,
    /// Cycle of the recording at which it ends again; infinity: it stays.
    pub ends_at_cycle: f64,
    /// Whether the cam's phase is recorded.
    pub with_phase: bool,
    pub seed: u64,
    /// Which servo it has: the same in all runs of a worm.
    pub servo: u64,
    /// Time step of the integrator, s.
    pub step_s: f64,
}

/// A run as recorded, and its truth.
#[derive(Debug, Clone)]
pub struct SimulatedRun {
    pub recording: Recording,
    /// Phase at each sample, cycles, recorded or not.
    pub phase: Vec<f64>,
    /// Positions as a perfect camera of the same scale and latency would give them, m: `[cell][sample]`.
    pub position_m: Vec<Vec<f64>>,
    /// Positive work of the drive at each sample, J, as old as the positions.
    pub work_j: Vec<f64>,
    /// Torque on the cam at each sample, N m, as old as the phase.
    pub cam_n_m: Vec<f64>,
}

impl Scene {
    /// Twelve cycles of an even motor before a perfect camera, from rest.
    pub fn ideal(slope_deg: f64, cycle_s: f64) -> Self {
        Self {
            placement: Placement {
                slope_deg,
                payload_kg: 0.0,
                start_m: 0.0,
            },
            drive: Drive::even(cycle_s),
            capture: MotionCapture::perfect(),
            warm_up_cycles: 0.0,
            cycles: 12.0,
            dwell_s: 0.0,
            jump_at_cycle: f64::INFINITY,
            begins_at_cycle: f64::NEG_INFINITY,
            ends_at_cycle: f64::INFINITY,
            with_phase: true,
            seed: 1,
            servo: 1,
            step_s: STEP_S,
        }
    }

    /// Simulates the run.
    ///
    /// # Errors
    /// [`CrawlFailed`] when the worm does not hold on the slope or the motor does not reach its last phase.
    pub fn simulate(&self, worm: &Worm) -> Result<SimulatedRun, CrawlFailed> {
        let from_phase = self.drive.first_phase + self.warm_up_cycles;
        let to_phase = from_phase + self.cycles;
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(self.seed);
        let scatter = worm.parameters.scatter_over(to_phase.ceil() as usize + 2, &mut rng);
        let mut motion = Motion::laid_down(
            worm,
            self.placement,
            self.drive.first_phase,
            self.step_s,
            self.begins_at_cycle == f64::NEG_INFINITY,
        );
        let mut cam = CamRotation::new(self, worm.parameters.cells);
        // Without a warm-up the camera runs while the worm rests before its first step.
        while cam.phase < from_phase {
            if self.warm_up_cycles == 0.0 {
                break;
            }
            self.step(&mut motion, &mut cam, worm, &scatter, from_phase)?;
        }
        motion.begin();

        let rate_hz = self.capture.camera.rate_hz;
        let (origin_s, latency_s) = (motion.time_s(), worm.deviations.latency_s);
        let mut recorder = Recorder::new(self, worm);
        // Positions are those of so long ago, so they are taken from the origin on and the phase so much later.
        while cam.phase < to_phase || recorder.phase.len() < recorder.position_m[0].len() {
            let begun_s = motion.time_s() - origin_s;
            let (before_m, before, before_j) = (motion.position_m, cam.phase, motion.drive_j);
            let going = cam.phase < to_phase;
            self.step(&mut motion, &mut cam, worm, &scatter, from_phase)?;
            let ended_s = motion.time_s() - origin_s;
            let fraction_at = |time_s: f64| (time_s - begun_s) / (ended_s - begun_s);
            while going && recorder.position_m[0].len() as f64 / rate_hz < ended_s {
                let fraction = fraction_at(recorder.position_m[0].len() as f64 / rate_hz);
                recorder.record(std::array::from_fn(|cell| {
                    before_m[cell] + fraction * (motion.position_m[cell] - before_m[cell])
                }));
                recorder.work_j.push(motion.work_j);
            }
            while latency_s + recorder.phase.len() as f64 / rate_hz < ended_s {
                let fraction = fraction_at(latency_s + recorder.phase.len() as f64 / rate_hz);
                recorder.phase.push(before + fraction * (cam.phase - before));
                let turned_rad = TAU * (cam.phase - before);
                recorder.cam_n_m.push(if turned_rad > 0.0 {
                    (motion.drive_j - before_j) / turned_rad
                } else {
                    0.0
                });
            }
        }
        Ok(recorder.finish(self))
    }

    /// One time step by the midpoint rule.
    fn step(
        &self,
        motion: &mut Motion,
        cam: &mut CamRotation,
        worm: &Worm,
        scatter: &[Vec<f64>],
        from_phase: f64,
    ) -> Result<(), CrawlFailed> {
        let droop = if worm.deviations.slowdown_per_n > 0.0 {
            1.0 / (1.0 + worm.deviations.slowdown_per_n * motion.actuator_n(cam.phase).max(0.0))
        } else {
            1.0
        };
        cam.turn(motion.time_s(), self.step_s, droop);
        let cycle = (cam.phase - self.drive.first_phase).max(0.0) as usize;
        let factors = each_of(scatter.len(), |cell| scatter[cell][cycle.min(scatter[cell].len() - 1)]);
        let cycles = cam.phase - from_phase;
        let acts = (self.begins_at_cycle..self.ends_at_cycle).contains(&cycles);
        if motion.effect_acts() != acts {
            motion.switch_effect(acts, cam.phase);
        }
        motion.step(StepInput {
            phase: cam.phase,
            cycles,
            scatter: &factors,
            jumped: cycles >= self.jump_at_cycle,
        });
        let timeout_s =
            TIMEOUT_CYCLES * (self.warm_up_cycles + self.cycles + 2.0) * (self.drive.cycle_s + self.dwell_s);
        let holds = motion.translation_m_s.abs() < MAX_BODY_SPEED_M_S && motion.time_s() < timeout_s;
        if holds { Ok(()) } else { Err(CrawlFailed) }
    }
}

/// The cam as the motor turns it.
struct CamRotation<'a> {
    cells: usize,
    drive: &'a Drive,
    dwell_s: f64,
    phase: f64,
    rest_until_s: f64,
}

impl<'a> CamRotation<'a> {
    fn new(scene: &'a Scene, cells: usize) -> Self {
        Self {
            cells,
            drive: &scene.drive,
            dwell_s: scene.dwell_s,
            phase: scene.drive.first_phase,
            rest_until_s: 0.0,
        }
    }

    fn turn(&mut self, time_s: f64, step_s: f64, droop: f64) {
        if time_s < self.rest_until_s {
            return;
        }
        let half_s = 0.5 * step_s;
        let midway = self.phase + half_s * droop * self.drive.speed(self.phase, time_s, self.cells);
        let next = self.phase + step_s * droop * self.drive.speed(midway, time_s + half_s, self.cells);
        let whole = self.phase.floor() + 1.0;
        if self.dwell_s > 0.0 && next >= whole {
            self.phase = whole;
            self.rest_until_s = time_s + self.dwell_s;
        } else {
            self.phase = next;
        }
    }
}

/// What the camera records.
struct Recorder {
    sampler: CameraSampler,
    rng: Xoshiro256PlusPlus,
    /// Of the correlated noise: the factor from one sample to the next, and the standard deviation of what is added, m.
    correlated: (f64, f64),
    error_m: [f64; MAX_CELLS],
    scale: f64,
    phase: Vec<f64>,
    cam_n_m: Vec<f64>,
    position_m: Vec<Vec<f64>>,
    work_j: Vec<f64>,
    seen_m: Vec<Vec<f64>>,
}

impl Recorder {
    fn new(scene: &Scene, worm: &Worm) -> Self {
        let cells = worm.parameters.cells;
        let capture = &scene.capture;
        let kept = (-1.0 / (capture.camera.rate_hz * capture.drift_s)).exp();
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(!scene.seed);
        let error_m = each_of(cells, |_| capture.drift_m * normal(&mut rng));
        Self {
            sampler: CameraSampler::new(capture.camera.clone(), cells, scene.seed.rotate_left(32)),
            rng,
            correlated: (kept, capture.drift_m * (1.0 - kept * kept).sqrt()),
            error_m,
            scale: worm.deviations.scale,
            phase: Vec::new(),
            cam_n_m: Vec::new(),
            work_j: Vec::new(),
            position_m: vec![Vec::new(); cells],
            seen_m: vec![Vec::new(); cells],
        }
    }

    fn record(&mut self, position_m: [f64; MAX_CELLS]) {
        let time_s = self.sampler.next_s();
        for (cell, position_m) in position_m.into_iter().enumerate().take(self.seen_m.len()) {
            let (kept, added_m) = self.correlated;
            let measured_m = self.scale * position_m;
            self.error_m[cell] = kept * self.error_m[cell] + added_m * normal(&mut self.rng);
            self.position_m[cell].push(measured_m);
            self.seen_m[cell].push(self.sampler.measure(cell, time_s, measured_m + self.error_m[cell]));
        }
    }

    fn finish(mut self, scene: &Scene) -> SimulatedRun {
        let samples = self.seen_m[0].len();
        self.phase.truncate(samples);
        self.cam_n_m.truncate(samples);
        let recording = Recording {
            source: PathBuf::from(format!("seed{}at{}deg", scene.seed, scene.placement.slope_deg)),
            cell_names: (1..=self.seen_m.len()).map(|cell| format!("x{cell}_m")).collect(),
            time_s: (0..samples)
                .map(|sample| sample as f64 / scene.capture.camera.rate_hz)
                .collect(),
            position_m: self.seen_m,
            gait_phase: scene.with_phase.then(|| self.phase.clone()),
            motor: scene.with_phase.then(|| {
                let rate_hz = scene.capture.camera.rate_hz;
                Servo::draw(scene.servo).report(rate_hz, &self.phase, &self.cam_n_m, scene.seed)
            }),
            warnings: Vec::new(),
            repairs: Vec::new(),
        };
        SimulatedRun {
            recording,
            phase: self.phase,
            position_m: self.position_m,
            work_j: self.work_j,
            cam_n_m: self.cam_n_m,
        }
    }
}
