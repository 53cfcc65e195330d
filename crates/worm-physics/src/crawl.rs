//! The motion under any of the laws, increment by increment.
//!
//! # One increment
//! The drive moves each cell in the body; the only unknown is the body's translation. Every cell's force is monotone in the translation, so
//! Σ Fᵢ + pull + M a = 0 is one monotone scalar equation, solved by Newton's method within a bracket. The law of each tip is integrated over
//! the whole increment at once (a *return mapping*), which is exact for springs with sliders as long as no cell reverses within it; curved
//! and rate-dependent laws are evaluated at the increment's end (implicit Euler). `balance` solves the equation; this file applies the
//! solution to the worm.
//!
//! # Inertia
//! By default there is none and the motion is quasi-static, as [`Motion`](super::Motion) is: both give the same results where both apply. With
//! a damping ratio the mean of the cells has mass: Newmark's method with constant average acceleration, which neither damps nor excites.
//! The difference is a tenth of a millimetre at 2.5 s a cycle, and visible in recordings.

mod balance;
mod carry;
#[cfg(test)]
mod tests;

use super::ledger::Ledger;
use super::mechanics::Mechanics;
use super::pad::{Hold, Loaded, Pad, Rate};
use super::play::Play;
use super::table::Whereabouts;
use super::worm::SlidesDown;
use crate::{MAX_CELLS, MAX_TABLES};

/// Velocity of the body beyond which it counts as sliding down, m/s.
const LOST_M_S: f64 = 1.0;
/// Fewest increments per step.
const PARTS_OF_STEP: f64 = 100.0;
/// Limits of the longest increment of a body with mass, s, a small part of an oscillation; between them it is a fraction of a step.
const LONGEST_S: [f64; 2] = [4.2e-3, 8.4e-3];
const LONGEST_OF_STEP: f64 = 1.0 / 150.0;
/// Shortest increment, s: rate-dependent laws need a time.
const SHORTEST_S: f64 = 1e-9;
/// Time in which a worm that was laid down comes to rest, s: until nothing creeps any more.
const SETTLING_S: f64 = 1e6;

/// Part of its way that a displacement by the motion goes in an increment.
const FOLLOWS: f64 = 0.5;

/// Longest increment of a body with mass, s, where a step takes so long, s: a slow drive excites it less.
pub fn longest_increment_s(step_s: f64) -> f64 {
    let [shortest, longest] = LONGEST_S;
    (LONGEST_OF_STEP * step_s).clamp(shortest, longest)
}

/// A worm in motion under any of the laws. Fixed size, no heap. Every method takes the [`Mechanics`], so that they may change while it
/// moves.
#[derive(Debug, Clone)]
pub struct Crawl {
    cells: usize,
    cell: [Cell; MAX_CELLS],
    position_m: [f64; MAX_CELLS],
    phase: f64,
    first_phase: f64,
    travelled_m: f64, // by the mean of the cells
    velocity_m_s: f64,
    acceleration_m_s2: f64,
    damping_ratio: Option<f64>,
    ledger: Ledger,
}

/// One cell in motion.
#[derive(Debug, Clone, Copy, Default)]
struct Cell {
    pad: Pad,
    drive_m: f64,
    drag_n: f64,   // on the cell, in the last increment, and the push of tables
    behind_m: f64, // in the drive's play, by its middle
    // These six only where there are tables.
    speed_m_s: f64,
    strain_m_s: f64, // of its pad
    recent_deformation_m: [f64; MAX_TABLES],
    recent_slide_m: [f64; MAX_TABLES],
    displaced_m: Option<Displacement>, // in the drive; none before the first increment, which moves nothing by it
    turned_m_per_cycle: f64,           // rate at which the drive's displacement changed with the phase alone
    trial: Trial,
}

/// How far ahead of its cam the drive holds a cell, m: by what does not change with the motion, and by what does.
type Displacement = [f64; 2];

/// The effect of the present increment on a cell.
#[derive(Debug, Clone, Copy, Default)]
struct Trial {
    driven_m: f64,
    friction: f64,
    hold: Hold,
    shift_m: f64,
    loaded: Loaded,
    /// At the increment's start, for tables.
    here: Whereabouts,
    /// Force of tables that does not change within the increment, and of all, N.
    standing_n: f64,
    pushed_n: f64,
    displaced_m: Displacement, // by tables, at the end
}

/// The constants of one increment's equation.
struct Increment {
    step_s: f64,
    rate: Rate,
    is_drive_rigid: bool,
    play: Option<Play>,            // of the drive, where there is any
    remembered: [f64; MAX_TABLES], // by each table, a fraction
    drag_n_per_m: f64,
    inertia_n_per_m: f64, // 0 without mass
}

impl Crawl {
    /// A worm at rest: laid down unloaded, the tips have given way together until they carry the pull. Without a damping ratio the motion
    /// is quasi-static.
    ///
    /// # Errors
    /// [`SlidesDown`] when they cannot.
    ///
    /// # Panics
    /// When there is not one position for each cell.
    pub fn at_rest(
        mechanics: &Mechanics,
        phase: f64,
        first_positions_m: &[f64],
        damping_ratio: Option<f64>,
    ) -> Result<Self, SlidesDown> {
        let cells = mechanics.worm.cells();
        assert_eq!(first_positions_m.len(), cells, "one first position for each cell");
        let mut position_m = [0.0; MAX_CELLS];
        position_m[..cells].copy_from_slice(first_positions_m);
        let mut crawl = Self {
            cells,
            cell: [Cell::default(); MAX_CELLS],
            position_m,
            phase,
            first_phase: phase,
            travelled_m: 0.0,
            velocity_m_s: 0.0,
            acceleration_m_s2: 0.0,
            damping_ratio: None,
            ledger: Ledger::default(),
        };
        mechanics.worm.check_hold()?;
        crawl.take_up(mechanics);
        // The tether is slack at the place of rest.
        let mut untethered = mechanics.clone();
        untethered.laws.tether_n_per_m = 0.0;
        crawl.increment(&untethered, phase, SETTLING_S)?;
        // At rest nothing drags, but tables push.
        for cell in &mut crawl.cell {
            cell.drag_n = cell.trial.pushed_n;
            cell.displaced_m = None;
        }
        Ok(Self {
            position_m,
            travelled_m: 0.0,
            damping_ratio,
            ledger: Ledger::default(),
            ..crawl
        })
    }

    /// Advances to a phase at a uniform rate over `duration_s`.
    ///
    /// # Errors
    /// [`SlidesDown`] when the tips cannot hold the worm.
    pub fn advance_to(&mut self, mechanics: &Mechanics, phase: f64, duration_s: f64) -> Result<(), SlidesDown> {
        let from = self.phase;
        if phase == from && duration_s < SHORTEST_S {
            return Ok(());
        }
        let parts = self.parts(phase, duration_s);
        for part in 1..parts as usize {
            self.increment(
                mechanics,
                from + (phase - from) * part as f64 / parts,
                duration_s / parts,
            )?;
        }
        self.increment(mechanics, phase, duration_s / parts)
    }

    /// Number of increments to a phase.
    fn parts(&self, phase: f64, duration_s: f64) -> f64 {
        let by_phase = (phase - self.phase).abs() * self.cells as f64 * PARTS_OF_STEP;
        let by_time = if self.damping_ratio.is_some() {
            let steps = (phase - self.phase).abs() * self.cells as f64;
            duration_s / longest_increment_s(duration_s / steps)
        } else {
            0.0
        };
        by_phase.max(by_time).ceil().max(1.0)
    }

    /// Changes the mechanics at the present phase: nothing moves, and cells step on from where they are.
    ///
    /// # Panics
    /// When the number of cells changes.
    pub fn take_up(&mut self, mechanics: &Mechanics) {
        assert_eq!(self.cells, mechanics.worm.cells(), "a motion keeps its number of cells");
        let cam = mechanics.cam(self.phase);
        for (index, cell) in self.cell[..self.cells].iter_mut().enumerate() {
            cell.drive_m = mechanics.drive_at_m(index, &cam);
            cell.displaced_m = None;
            cell.turned_m_per_cycle = 0.0;
        }
    }

    /// Moves the whole body along the canal against the contacts, whether or not forces balance, within `duration_s`. This is how a
    /// worm that cannot hold slides down. The energy that the slide releases beyond friction is added to the settling loss.
    pub fn translate(&mut self, mechanics: &Mechanics, distance_m: f64, duration_s: f64) {
        let before_j = self.elastic_energy_j(mechanics);
        let earlier = self.ledger.clone();
        let increment = self.prepare(mechanics, self.phase, duration_s.max(SHORTEST_S));
        self.try_out(mechanics, &increment, distance_m);
        self.take(mechanics, &increment, distance_m, self.phase);
        let spent_j = self.ledger.since(&earlier).loss_j();
        self.ledger.settling_loss_j = earlier.settling_loss_j + before_j - self.elastic_energy_j(mechanics) - spent_j;
    }

    /// Starts here: sets the cells to these positions, and cycles and distance travelled to 0.
    ///
    /// # Panics
    /// When there is not one position for each cell.
    pub fn begin_at(&mut self, positions_m: &[f64]) {
        self.position_m[..self.cells].copy_from_slice(positions_m);
        self.first_phase = self.phase;
        self.travelled_m = 0.0;
        self.ledger = Ledger::default();
        for cell in &mut self.cell {
            cell.displaced_m = None;
        }
    }

    /// As [`begin_at`](Self::begin_at), at a phase some whole cycles from the present one: the crawl is where it is in the gait.
    pub fn begin_at_phase(&mut self, mechanics: &Mechanics, phase: f64, positions_m: &[f64]) {
        self.phase = phase;
        self.take_up(mechanics);
        self.begin_at(positions_m);
    }

    /// Changes the damping ratio: none makes the motion quasi-static from here on.
    pub fn set_damping_ratio(&mut self, damping_ratio: Option<f64>) {
        self.damping_ratio = damping_ratio;
    }

    /// Positions Xᵢ along the canal, m.
    pub fn positions_m(&self) -> &[f64] {
        &self.position_m[..self.cells]
    }

    /// Mean position of the cells, m.
    pub fn mean_position_m(&self) -> f64 {
        self.positions_m().iter().sum::<f64>() / self.cells as f64
    }

    /// Deformation of a cell's pad, m.
    pub fn deformation_m(&self, cell: usize) -> f64 {
        self.cell[..self.cells][cell].pad.deformation_m
    }

    /// Contact force on a cell's pad, N, positive when the pad is deformed forward.
    pub fn contact_force_n(&self, cell: usize) -> f64 {
        self.cell[..self.cells][cell].pad.force_n
    }

    /// Gait phase at which it began: cycles are counted from there.
    pub fn first_phase(&self) -> f64 {
        self.first_phase
    }

    /// Gait phase, cycles, unwrapped.
    pub fn phase(&self) -> f64 {
        self.phase
    }

    /// Energies and slides since the motion began.
    pub fn ledger(&self) -> &Ledger {
        &self.ledger
    }

    /// Force that the stepping cell's actuator exerts, N: its contact force, its weight along the canal and its part of every other
    /// force on the worm (13).
    pub fn actuator_force_n(&self, mechanics: &Mechanics) -> f64 {
        let step = (self.phase * self.cells as f64).floor();
        let cell = mechanics.worm.step_order()[step.rem_euclid(self.cells as f64) as usize];
        self.driving_force_n(mechanics, cell)
    }

    /// Present work of the whole drive per cycle of phase, J: Σ force × dX/dφ over the stepping cells.
    pub fn drive_load_j(&self, mechanics: &Mechanics) -> f64 {
        let cam = mechanics.cam(self.phase);
        (0..self.cells)
            .map(|cell| {
                let slope_m = mechanics.drive_slope_m(cell, &cam) + self.cell[cell].turned_m_per_cycle;
                self.driving_force_n(mechanics, cell) * slope_m
            })
            .sum()
    }

    /// Elastic energy, J: of the pads and of the drive that holds the cells.
    pub fn elastic_energy_j(&self, mechanics: &Mechanics) -> f64 {
        let compliance = mechanics.laws.compliance_m_per_n;
        let cells = self.cell[..self.cells]
            .iter()
            .zip(&mechanics.pad)
            .zip(&mechanics.standing_n);
        cells
            .map(|((cell, law), standing_n)| {
                law.elastic_j(&cell.pad) + 0.5 * compliance * (cell.pad.force_n + standing_n).powi(2)
            })
            .sum()
    }

    /// Kinetic energy, J; 0 without a damping ratio.
    pub fn kinetic_energy_j(&self, mechanics: &Mechanics) -> f64 {
        0.5 * mechanics.mass_kg * self.velocity_m_s * self.velocity_m_s
    }

    /// Force of a cell's actuator, N.
    fn driving_force_n(&self, mechanics: &Mechanics, cell: usize) -> f64 {
        self.cell[cell].pad.force_n + mechanics.standing_n[cell] + self.passing_force_n(mechanics, cell)
    }

    /// Force on a cell besides its contact, its weight and its part of the constant force, N.
    fn passing_force_n(&self, mechanics: &Mechanics, cell: usize) -> f64 {
        let cell = &self.cell[cell];
        cell.drag_n + self.shared_force_n(mechanics) / self.cells as f64
    }

    /// Force of tether and inertia on the whole worm, N.
    fn shared_force_n(&self, mechanics: &Mechanics) -> f64 {
        mechanics.laws.tether_n_per_m * self.travelled_m + mechanics.mass_kg * self.acceleration_m_s2
    }

    fn increment(&mut self, mechanics: &Mechanics, phase: f64, step_s: f64) -> Result<(), SlidesDown> {
        let increment = self.prepare(mechanics, phase, step_s.max(SHORTEST_S));
        let translation_m = self.solve(mechanics, &increment)?;
        self.take(mechanics, &increment, translation_m, phase);
        if self.velocity_m_s.abs() > LOST_M_S {
            return Err(self.slides(mechanics));
        }
        Ok(())
    }

    /// Prepares every cell for an increment to a phase.
    fn prepare(&mut self, mechanics: &Mechanics, phase: f64, step_s: f64) -> Increment {
        let laws = &mechanics.laws;
        let even = mechanics.has_even_friction();
        let tables = (!mechanics.tables.is_empty()).then_some(&mechanics.tables);
        let slope_deg = mechanics.worm.slope_rad().to_degrees();
        let cam = mechanics.cam(phase);
        for (index, cell) in self.cell[..self.cells].iter_mut().enumerate() {
            cell.trial.driven_m = mechanics.drive_at_m(index, &cam) - cell.drive_m;
            cell.trial.friction = if even {
                1.0
            } else {
                let tip_m = self.position_m[index] - cell.pad.deformation_m;
                mechanics.friction(tip_m, phase - self.first_phase)
            };
            if let Some(tables) = tables {
                cell.trial.here = Whereabouts {
                    deformation_m: cell.pad.deformation_m,
                    deformation_rate_m_s: cell.strain_m_s,
                    speed_m_s: cell.speed_m_s,
                    load_n: cell.pad.force_n + mechanics.standing_n[index],
                    recent_deformation_m: cell.recent_deformation_m,
                    recent_slide_m: cell.recent_slide_m,
                    place_m: self.position_m[index] - cell.pad.deformation_m,
                    phase: mechanics.own_phase(index, &cam),
                    slope_deg,
                    cycles: (phase - self.first_phase).abs(),
                };
                cell.trial.friction *= tables.friction(index, &cell.trial.here);
                cell.trial.standing_n = tables.standing_n(index, &cell.trial.here);
                let target_m = tables.displacement_m(index, &cell.trial.here);
                let before_m = cell.displaced_m.unwrap_or(target_m);
                let follows_m = FOLLOWS * (target_m[1] - before_m[1]);
                cell.displaced_m = Some(before_m);
                cell.trial.displaced_m = [target_m[0], before_m[1] + follows_m];
                cell.trial.driven_m += target_m[0] - before_m[0] + follows_m;
            }
            cell.trial.hold = mechanics.pad[index].hold(&cell.pad, cell.trial.friction, step_s);
        }
        let (damping_n_s_per_m, mass_kg) = match self.damping_ratio {
            Some(ratio) => (ratio * mechanics.critical_n_s_per_m, mechanics.mass_kg),
            None => (0.0, 0.0),
        };
        Increment {
            step_s,
            rate: Rate {
                relaxing: if laws.creep_share > 0.0 {
                    1.0 - (-step_s / laws.creep_time_s).exp()
                } else {
                    0.0
                },
                damping_n_per_m: damping_n_s_per_m / step_s,
            },
            is_drive_rigid: laws.compliance_m_per_n == 0.0 && laws.play_m == 0.0,
            play: (laws.play_m > 0.0).then(|| Play {
                half_m: 0.5 * laws.play_m,
                yields_m_per_n: step_s / laws.play_damping_n_s_per_m,
            }),
            remembered: tables.map_or([0.0; MAX_TABLES], |tables| tables.remembered_after(step_s)),
            drag_n_per_m: laws.drag_n_s_per_m / step_s,
            inertia_n_per_m: 4.0 * mass_kg / (step_s * step_s),
        }
    }

    /// Accepts the trial that balances the body, and adds it to the ledger: every force is linear within an increment.
    fn take(&mut self, mechanics: &Mechanics, increment: &Increment, translation_m: f64, phase: f64) {
        let cells = self.cells as f64;
        let mean_shift_m = self.cell[..self.cells]
            .iter()
            .map(|cell| cell.trial.shift_m)
            .sum::<f64>()
            / cells;
        let shared_before_n = self.shared_force_n(mechanics) / cells;
        let tether_before_m = self.travelled_m;
        if increment.inertia_n_per_m > 0.0 {
            let acceleration_m_s2 = self.acceleration_after(mean_shift_m, increment);
            self.velocity_m_s = 2.0 * mean_shift_m / increment.step_s - self.velocity_m_s;
            self.acceleration_m_s2 = acceleration_m_s2;
        }
        self.travelled_m += mean_shift_m;
        let shared_after_n = self.shared_force_n(mechanics) / cells;
        let tether_n = mechanics.laws.tether_n_per_m * 0.5 * (tether_before_m + self.travelled_m) / cells;
        let resisting_n = mechanics.worm.cell_resistance_n() + tether_n;
        let has_tables = !mechanics.tables.is_empty();
        let mut deformation_m = 0.0;
        for (index, cell) in self.cell[..self.cells].iter_mut().enumerate() {
            let Trial {
                driven_m,
                shift_m,
                loaded,
                pushed_n,
                ..
            } = cell.trial;
            let (law, standing_n) = (&mechanics.pad[index], mechanics.standing_n[index]);
            let (before_m, before_n) = (cell.pad.deformation_m, cell.pad.force_n);
            let mut lost_j = law.take(&mut cell.pad, &loaded, increment.step_s, increment.rate);
            if let Some(play) = increment.play {
                // As if the drive bore the load across the play, too: it is small there.
                let behind_m = play.behind_m(cell.behind_m + driven_m, loaded.force_n + standing_n).0;
                lost_j += (0.5 * (before_n + loaded.force_n) + standing_n) * (behind_m - cell.behind_m);
                cell.behind_m = behind_m;
            }
            let drag_n = increment.drag_n_per_m * shift_m + pushed_n;
            let dragged_j = 0.5 * (cell.drag_n + drag_n) * shift_m;
            let ledger = &mut self.ledger;
            if loaded.slide_m != 0.0 {
                ledger.slide(index, loaded.slide_m, loaded.force_n * loaded.slide_m);
            }
            ledger.weight_work_j += mechanics.worm.cell_weight_n(index) * shift_m;
            ledger.resisting_work_j += resisting_n * shift_m + dragged_j;
            ledger.settling_loss_j += lost_j;
            let passing_before_n = cell.drag_n + shared_before_n;
            let passing_after_n = drag_n + shared_after_n;
            if driven_m != 0.0 {
                ledger.add_actuator_work(
                    before_n + standing_n + passing_before_n,
                    loaded.force_n + standing_n + passing_after_n,
                    driven_m,
                );
                cell.drive_m += driven_m;
            }
            // The drive yields to the contact alone: every other force acts over the cell's own displacement.
            ledger.actuator_net_j += 0.5 * (passing_before_n + passing_after_n) * (shift_m - translation_m - driven_m);
            deformation_m += 0.5 * (before_m + loaded.deformation_m);
            self.position_m[index] += shift_m;
            cell.drag_n = drag_n;
            if has_tables {
                cell.speed_m_s = shift_m / increment.step_s;
                let strain_m = loaded.deformation_m - before_m;
                cell.strain_m_s = strain_m / increment.step_s;
                let slide_m = loaded.slide_m.abs();
                for (table, left) in increment.remembered.into_iter().enumerate() {
                    let (deformation_m, slid_m) = (cell.recent_deformation_m[table], cell.recent_slide_m[table]);
                    cell.recent_deformation_m[table] = (deformation_m + strain_m) * left;
                    cell.recent_slide_m[table] = (slid_m + slide_m) * left;
                }
                let after_m = cell.trial.displaced_m;
                let before_m = cell.displaced_m.replace(after_m).unwrap_or(after_m);
                let turned = phase - self.phase;
                let by_phase_m = after_m[0] - before_m[0];
                cell.turned_m_per_cycle = if turned == 0.0 { 0.0 } else { by_phase_m / turned };
                // What is left is the cam's part.
                cell.drive_m -= by_phase_m + after_m[1] - before_m[1];
            }
        }
        self.ledger.deformation_integral_m += deformation_m * (phase - self.phase).abs();
        self.phase = phase;
    }
}
