//! Where gait cycles begin and end.
//!
//! A cycle runs from one whole number of the phase to the next in the direction of the crawl. It may rest on the way: a pause
//! belongs to the cycle in which it falls, with its time and its electrical energy, because both were spent on that
//! cycle's advance. A hold that trembles by less than [`JITTER`] changes nothing. A larger turn back breaks the cycle: its tips
//! have a path that no single pass over the phase can describe, so it is not reported, and the next one begins afresh.

/// How far the phase may turn back without breaking a cycle, cycles.
const JITTER: f64 = 0.02;
/// Phase up to which a cycle that begins from rest has not begun, cycles: a few steps of the encoder.
const AT_REST: f64 = 1e-3;

/// What a new phase means for the cycles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Event {
    /// Nothing ended.
    Continues,
    /// The open cycle still rests at its beginning.
    AtRest,
    /// A cycle ended at this share of the way from the last phase to this one, and the next began.
    Ended {
        /// 0 to 1.
        fraction: f64,
        /// The phase went through it in one direction.
        whole: bool,
    },
    /// A cycle began, in another direction or after a jump; what was open is void.
    Began,
}

/// The open cycle, if any.
#[derive(Debug, Clone)]
pub(super) struct Cycles {
    default_direction: i32,
    start: Option<i64>,
    direction: i32,
    last: f64,
    furthest: f64,
    whole: bool,
    resting: bool,
}

impl Cycles {
    /// No phase known yet; `default_direction` is what a worm at rest is taken to be about to do.
    pub(super) fn new(default_direction: i32) -> Self {
        Self {
            default_direction,
            start: None,
            direction: 0,
            last: 0.0,
            furthest: 0.0,
            whole: false,
            resting: false,
        }
    }

    /// Takes up a phase; it must be finite.
    pub(super) fn advance_to(&mut self, phase: f64) -> Event {
        let last = std::mem::replace(&mut self.last, phase);
        let Some(start) = self.start else {
            return self.open_near(phase);
        };
        if (phase - last).abs() > 0.5 {
            self.start = None;
            return self.open_near(phase);
        }
        let done = self.done(phase, start);
        if done >= 1.0 {
            let fraction = ((1.0 - self.done(last, start)) / (done - self.done(last, start))).clamp(0.0, 1.0);
            let whole = self.whole;
            self.begin(start + i64::from(self.direction), self.direction, done - 1.0);
            self.resting = false;
            return Event::Ended { fraction, whole };
        }
        if done < -JITTER {
            self.begin(start, -self.direction, -done);
            return Event::Began;
        }
        self.furthest = self.furthest.max(done);
        self.whole &= self.furthest - done < JITTER;
        self.resting &= done <= AT_REST;
        if self.resting { Event::AtRest } else { Event::Continues }
    }

    fn open_near(&mut self, phase: f64) -> Event {
        let near = phase.round();
        if near.abs() >= 1e15 {
            return Event::Continues;
        }
        let off = phase - near;
        let direction = if off.abs() <= AT_REST {
            self.default_direction
        } else if off > 0.0 {
            1
        } else {
            -1
        };
        self.begin(near as i64, direction, off.abs());
        // Away from a whole number this is the rest of some cycle, which cannot be reported.
        self.whole = off.abs() < JITTER;
        Event::Began
    }

    fn begin(&mut self, start: i64, direction: i32, done: f64) {
        self.start = Some(start);
        self.direction = direction;
        self.furthest = done;
        self.whole = true;
        self.resting = true;
    }

    fn done(&self, phase: f64, start: i64) -> f64 {
        f64::from(self.direction) * (phase - start as f64)
    }

    /// +1 forward, −1 backward, 0 before anything is known.
    pub(super) fn direction(&self) -> i32 {
        self.direction
    }

    /// Phase since the start of the open cycle in its direction, cycles; negative before it.
    pub(super) fn phase_in_cycle(&self, phase: f64) -> Option<f64> {
        self.start.map(|start| self.done(phase, start))
    }

    /// Nothing is known of the phase any more.
    pub(super) fn forget(&mut self) {
        *self = Self::new(self.default_direction);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ends(cycles: &mut Cycles, phases: &[f64]) -> Vec<Event> {
        let events = phases.iter().map(|&phase| cycles.advance_to(phase));
        events
            .filter(|event| !matches!(event, Event::Continues | Event::AtRest))
            .collect()
    }

    #[test]
    fn a_cycle_ends_where_the_phase_is_whole() {
        let mut cycles = Cycles::new(1);
        let events = ends(&mut cycles, &[0.0, 0.3, 0.6, 0.9, 1.1, 1.5, 1.9, 2.0]);
        let whole = |fraction| Event::Ended { fraction, whole: true };
        assert_eq!(events.len(), 3);
        assert_eq!(events[0], Event::Began);
        assert!(matches!(events[1], Event::Ended { fraction, whole: true } if (fraction - 0.5).abs() < 1e-9));
        assert_eq!(events[2], whole(1.0));
    }

    #[test]
    fn a_trembling_hold_on_the_boundary_ends_nothing_twice() {
        let mut cycles = Cycles::new(1);
        let events = ends(&mut cycles, &[0.0, 0.5, 0.99, 1.001, 0.999, 1.001, 0.995, 1.0, 1.4]);
        assert_eq!(events.len(), 2);
        assert_eq!(cycles.phase_in_cycle(1.25), Some(0.25));
    }

    #[test]
    fn a_turn_back_breaks_the_cycle_and_turns_the_count() {
        let mut cycles = Cycles::new(1);
        let events = ends(&mut cycles, &[0.0, 0.4, 0.6, 0.4, 0.7, 1.0]);
        assert_eq!(
            events[1],
            Event::Ended {
                fraction: 1.0,
                whole: false
            }
        );
        let events = ends(&mut cycles, &[1.3, 1.1, 0.9, 0.5, 0.1, 0.0]);
        assert_eq!(
            events,
            [
                Event::Began,
                Event::Ended {
                    fraction: 1.0,
                    whole: true
                }
            ]
        );
        assert_eq!(cycles.direction(), -1);
    }

    #[test]
    fn what_begins_in_the_middle_is_no_whole_cycle() {
        let mut cycles = Cycles::new(1);
        let events = ends(&mut cycles, &[0.3, 0.6, 0.9, 1.0, 1.4, 1.8, 2.0, 17.4]);
        assert_eq!(
            events[1],
            Event::Ended {
                fraction: 1.0,
                whole: false
            }
        );
        assert_eq!(
            events[2],
            Event::Ended {
                fraction: 1.0,
                whole: true
            }
        );
        assert_eq!(events[3], Event::Began, "a jump");
    }
}
