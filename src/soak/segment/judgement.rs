//! Holds what a segment shows against what was drawn: alarms, stops, energies, and whether each fault was noticed in time.

use super::{Episode, Over, Segment};
use crate::link::virtual_worm::PlantLedger;
use crate::soak::draw::{Drawn, ROWS, Row};
use crate::soak::invariants::Broken;
use crate::soak::machine::Machine;
use crate::soak::report::{FaultTally, FindingKind, Found, QUANTITIES};
use worm_estimator::message::{Alarm, AlarmKind, Cycle, Fault, Mode, State};

/// A cycle of the ledger is the estimator's when they end within this share of a cycle.
const SAME_END: f64 = 0.03;

/// A servo that was too hot is still reported until it is this much below the threshold, and a count of its thermometer, K.
const COOL_C: f64 = 4.0;
/// Copper that is warmer by this much takes 6 % more energy at the same current (0.39 % per kelvin). The alarm's chart climbs from 10 %
/// on, half its threshold, and falls to 0 within some ten cycles of 4 % less than that: so much longer may it stand.
const WARMER_K: f64 = 15.0;
/// A cam that is slower than this fraction of the command truly lags: the alarm allows for 0.8 of it, and the last readings before the
/// alarm may be somewhat faster.
const LAGS_BELOW: f64 = 0.85;

type Energy = (fn(&Cycle) -> f64, fn(&PlantLedger) -> f64);

/// In the order of [`QUANTITIES`].
const ENERGIES: [Energy; QUANTITIES.len()] = [
    (|c| c.energy_loss_j, |t| t.loss_j),
    (|c| c.energy_actuator_net_j, |t| t.actuator_net_j),
    (|c| c.energy_actuator_positive_j, |t| t.actuator_positive_j),
    (|c| c.energy_electrical_j, |t| t.electrical_j),
    (|c| c.energy_copper_j, |t| t.copper_j),
    (|c| c.energy_friction_inside_j, |t| t.friction_inside_j),
];

impl Segment {
    /// The segment is over: a fault under way is judged as far as it can be.
    pub(super) fn judge_unfinished(&mut self) {
        let Some(episode) = &self.episode else { return };
        let age_s = self.session.now_s() - episode.began_s;
        let is_due = episode.must_s.is_some_and(|must_s| age_s > must_s);
        if !episode.is_judged && (is_due || episode.noticed_s.is_some()) {
            self.judge();
        }
    }

    /// Nothing explains any more an alarm that still stands, but that a servo which was overheated takes minutes to cool down.
    pub(super) fn find_standing_alarms(&mut self) {
        let hot_c = self.config.alarms.device_fault.threshold - COOL_C;
        let is_hot = self.session.machine.plant().motor().case_c() > hot_c;
        let is_warm = self.is_still_warm();
        // Cycles crawled backward do not show that a change by the current is over.
        let is_backward = self.speed < 0.0;
        let by_current = [AlarmKind::FrictionLoss, AlarmKind::InferredJam, AlarmKind::MoreLoad].map(AlarmKind::name);
        let mut standing = self.standing();
        standing.retain(|name| {
            let is_true = (is_hot && *name == AlarmKind::DeviceFault.name())
                || (is_warm && *name == AlarmKind::EnergyOverBudget.name())
                || (is_backward && by_current.contains(name));
            !is_true
        });
        let cause = self.episode.as_ref().map(|episode| episode.drawn.cause.clone());
        let after = self.under_way();
        for name in standing {
            self.find(
                FindingKind::FalseAlarm,
                format!("{name} still stands after {after}"),
                format!("{name} still stands after {cause:?}"),
            );
        }
    }

    /// The fault is over: was it noticed, and in time?
    pub(super) fn judge(&mut self) {
        let age_s = self.session.now_s();
        let Some(episode) = &mut self.episode else { return };
        episode.is_judged = true;
        let age_s = age_s - episode.began_s;
        let (row, must_s) = (episode.drawn.row, episode.must_s);
        let noticed_s = episode.noticed_s.map(|noticed_s| noticed_s - episode.began_s);
        let what = format!("{} ({:?})", row.name, episode.drawn.cause);
        let drawn = episode.drawn.clone();
        let tally = self.tally_of(&drawn);
        tally.noticed += u64::from(noticed_s.is_some());
        let Some(must_s) = must_s else { return };
        match noticed_s {
            None => {
                tally.missed += 1;
                self.find(
                    FindingKind::Missed,
                    row.name.to_owned(),
                    format!("{what}: nothing within {age_s:.2} s"),
                );
            }
            Some(noticed_s) => {
                tally.slowest_s = tally.slowest_s.max(noticed_s);
                if noticed_s > must_s {
                    tally.late += 1;
                    self.find(
                        FindingKind::Late,
                        row.name.to_owned(),
                        format!("{what}: after {noticed_s:.3} s, {must_s:.3} s at most"),
                    );
                }
            }
        }
    }

    /// Whether the servo has not cooled yet to what it was before it was overheated. Its winding has: the case takes minutes.
    fn is_still_warm(&mut self) -> bool {
        let case_c = self.session.machine.plant().motor().case_c();
        self.cool_c.is_some_and(|cool_c| case_c > cool_c + WARMER_K)
    }

    /// Whether the cam turns as slowly as a stall says.
    fn truly_lags(&mut self, state: &State) -> bool {
        let velocity_rad_s = self.session.machine.plant().motor().velocity_rad_per_s();
        let goal_rad_s = state.goal_velocity_rad_s;
        velocity_rad_s * goal_rad_s.signum() <= LAGS_BELOW * goal_rad_s.abs()
    }

    pub(super) fn take_alarm(&mut self, alarm: &Alarm, state: &State) {
        // A service behind the tick takes its time.
        let now_s = alarm.time_ns as f64 * 1e-9;
        let kind = AlarmKind::try_from(alarm.kind).ok();
        let is_possible = match kind {
            Some(AlarmKind::MotorStall) => self.truly_lags(state),
            _ => true,
        };
        let is_warm = kind == Some(AlarmKind::EnergyOverBudget) && self.is_still_warm();
        let explained = self.episode.as_mut().filter(|episode| {
            let follows =
                |kind: AlarmKind| episode.drawn.row.alarms.contains(&kind) || follows_from_fault(kind, episode);
            is_possible && kind.is_some_and(follows)
        });
        match explained {
            Some(episode) => {
                episode.noticed_s.get_or_insert(now_s);
                self.tally.true_alarms += 1;
            }
            None if is_warm => self.tally.true_alarms += 1,
            None => {
                let during = self.episode.as_ref().map_or_else(
                    || "no fault".to_owned(),
                    |episode| format!("{} ({:?})", episode.drawn.row.name, episode.drawn.cause),
                );
                let name = kind.map_or("unknown", AlarmKind::name);
                let text = format!(
                    "{name}: {:.4} beyond {:.4}, cell {}, phase {:.2}, speed {:.3}, slope {}°, with {during}",
                    alarm.value,
                    alarm.threshold,
                    alarm.cell as i32,
                    alarm.phase,
                    self.speed,
                    self.config.canal.slope_deg
                );
                let sort = format!("{name} with {}", self.under_way());
                self.find(FindingKind::FalseAlarm, sort, text);
            }
        }
    }

    pub(super) fn take_mode(&mut self, state: &State) -> Result<(), Over> {
        let Ok(mode) = Mode::try_from(state.mode) else {
            return self.broken("the mode is known", format!("mode {}", state.mode));
        };
        let was = std::mem::replace(&mut self.last_mode, mode);
        if mode != Mode::Fault || was == Mode::Fault {
            return Ok(());
        }
        let now_s = state.time_ns as f64 * 1e-9;
        let fault = Fault::try_from(state.fault).unwrap_or(Fault::None);
        match &mut self.episode {
            Some(episode) if may_stop(episode.drawn.row, fault, state.fault_alarm) => {
                episode.noticed_s.get_or_insert(now_s);
                Ok(())
            }
            episode => {
                let text = format!(
                    "{fault} (alarm {}) from {was}, with {}",
                    state.fault_alarm as i32,
                    episode
                        .as_ref()
                        .map_or_else(|| "no fault".to_owned(), |episode| format!("{:?}", episode.drawn.cause))
                );
                self.broken("a stop has the right reason", text)
            }
        }
    }

    /// Notes the cycles that the ledger has closed.
    pub(super) fn take_accounts(&mut self) {
        let offset_s = self.session.now_s() - self.session.world_s();
        let plant = self.session.machine.plant();
        let cycles = plant.ledger().cycles();
        while self.ledger_seen < cycles.len() {
            self.accounts
                .push_back((plant.time_s() + offset_s, cycles[self.ledger_seen].clone()));
            self.ledger_seen += 1;
        }
        while self.accounts.len() > 4 {
            self.accounts.pop_front();
        }
    }

    /// Whether neither a fault nor a pause can have anything to do with this cycle.
    pub(super) fn is_undisturbed(&self, cycle: &Cycle) -> bool {
        let before_s = cycle.end_ns as f64 * 1e-9 - 2.0 * cycle.duration_s;
        self.episode.is_none() && before_s >= self.undisturbed_since_s && cycle.host_paused_s == 0.0
    }

    /// Holds a settled cycle against the ledger's.
    pub(super) fn compare(&mut self, cycle: &Cycle) {
        let (end_s, tolerance_s) = (cycle.end_ns as f64 * 1e-9, SAME_END * cycle.duration_s);
        if cycle.settled != 1 {
            return;
        }
        let same = |(true_end_s, truth): &&(f64, PlantLedger)| {
            (true_end_s - end_s).abs() < tolerance_s && (truth.duration_s - cycle.duration_s).abs() < tolerance_s
        };
        if let Some((_, truth)) = self.accounts.iter().find(same) {
            for ((measured, true_value), sums) in ENERGIES.iter().zip(&mut self.tally.energies) {
                sums.add(100.0 * (measured(cycle) / true_value(truth) - 1.0));
            }
        }
    }

    pub(super) fn tally_of(&mut self, drawn: &Drawn) -> &mut FaultTally {
        let index = ROWS.iter().position(|row| row.name == drawn.row.name).unwrap_or(0);
        &mut self.tally.faults[index]
    }

    /// The name of the fault under way, or of the one that ended not long ago.
    fn under_way(&self) -> &'static str {
        self.episode
            .as_ref()
            .map_or("no fault", |episode| episode.drawn.row.name)
    }

    pub(super) fn find(&mut self, kind: FindingKind, sort: String, text: String) {
        self.tally.findings.push(Found {
            kind,
            time_s: self.session.now_s() - self.began_s,
            sort,
            text,
        });
    }

    pub(super) fn end_with<T>(&mut self, broken: Broken) -> Result<T, Over> {
        self.broken(broken.rule, broken.text)
    }

    pub(super) fn broken<T>(&mut self, rule: &str, text: String) -> Result<T, Over> {
        let during = self.episode.as_ref().map_or_else(String::new, |episode| {
            let for_s = self.session.now_s() - episode.began_s;
            format!(
                "; {for_s:.3} s after the beginning of {:?}, which lasts {:.3} s",
                episode.drawn.cause, episode.drawn.lasts_s
            )
        });
        let sort = format!("{rule}, with {}", self.under_way());
        self.find(FindingKind::Invariant, sort, format!("{rule}: {text}{during}"));
        Err(Over)
    }
}

/// Whether this fault of the controller may follow; one that an alarm caused, if that alarm may follow.
fn may_stop(row: &Row, fault: Fault, alarm: u32) -> bool {
    let is_its_alarm = || row.alarms.iter().any(|kind| kind.code() == alarm);
    row.faults.contains(&fault) && (fault != Fault::Alarm || is_its_alarm())
}

/// The estimator reports the controller's own faults, too.
fn follows_from_fault(kind: AlarmKind, episode: &Episode) -> bool {
    let stopped_by_device = episode.drawn.row.faults.iter().any(|fault| {
        [
            Fault::WatchdogTripped,
            Fault::ServoRestarted,
            Fault::ServoHardware,
            Fault::OverTemperature,
            Fault::UnderVoltage,
        ]
        .contains(fault)
    });
    kind == AlarmKind::DeviceFault && stopped_by_device
}
