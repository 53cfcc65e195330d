//! Which answers of the servo are still to come, and which never will.
//!
//! The protocol numbers no packets: an answer that comes after the next request looks like the answer to that one, and the real one may
//! still be on its way. So the first answer in a question's time is taken for its own and a further one for that of the oldest open
//! question. What is still open then is lost, or late:
//!
//! - The servo repeats the goal that came with the question. Where an answer repeats one that no question had since the oldest open one,
//!   it is the answer to the newest question. Answers come in order, so all open ones are lost.
//! - Otherwise an open question counts as lost only when many later ones have been answered and some time has passed: a line that is behind
//!   by some answers has caught up by then. One that stays behind for longer counts once as having lost so many.

use std::time::{Duration, Instant};

/// Answered questions that have to follow an open one before it counts as lost.
const PASSED_BY: u32 = 32;

/// Time that has to pass as well: a loop that makes up for a pause may ask many questions in a moment.
const OVERDUE: Duration = Duration::from_millis(100);

/// Questions that may be open before the oldest counts as lost: those of a tenth of a second at 1 kHz.
const MAX_OPEN: usize = 100;

/// An open question.
#[derive(Debug, Clone, Copy)]
struct Question {
    deadline: Instant,
    /// How many had been answered by then.
    answered_before: u32,
}

/// Open questions to the servo. Their memory is fixed.
#[derive(Debug)]
pub(super) struct OwedAnswers {
    ring: [Option<Question>; MAX_OPEN],
    oldest: usize,
    open: usize,
    /// Questions answered in their own time, wrapping.
    answered: u32,
    /// Smallest and greatest goal since the oldest open question; none while nothing is open.
    goals: Option<(i32, i32)>,
}

impl OwedAnswers {
    /// No question is open.
    pub(super) const NONE: Self = Self {
        ring: [None; MAX_OPEN],
        oldest: 0,
        open: 0,
        answered: 0,
        goals: None,
    };

    /// Whether any question is open.
    pub(super) const fn is_any(&self) -> bool {
        self.open > 0
    }

    /// Takes this many answers to earlier questions. Returns how many of them no question was open for.
    pub(super) fn take_late(&mut self, answers: u32) -> u32 {
        let taken = self.open.min(answers as usize);
        self.forget_oldest(taken);
        answers - taken as u32
    }

    /// Notes that a question was asked with this deadline and goal, how many answers came in its time, and whether the newest repeats the goal.
    /// Returns how many earlier questions count as lost now.
    pub(super) fn ask(&mut self, deadline: Instant, goal: i32, answers: u32, goal_repeated: bool) -> u32 {
        let is_new_goal = self.goals.is_some_and(|(least, most)| !(least..=most).contains(&goal));
        if answers > 0 && goal_repeated && is_new_goal {
            self.take_late(answers - 1);
            let lost = self.open as u32;
            self.forget_oldest(self.open);
            return lost;
        }
        let lost = self.note(deadline, answers);
        self.goals = match self.goals {
            _ if !self.is_any() => None,
            None => Some((goal, goal)),
            Some((least, most)) => Some((least.min(goal), most.max(goal))),
        };
        lost
    }

    fn note(&mut self, deadline: Instant, answers: u32) -> u32 {
        let mut lost = 0;
        if answers == 0 {
            if self.open == MAX_OPEN {
                self.forget_oldest(1);
                lost += 1;
            }
            self.ring[(self.oldest + self.open) % MAX_OPEN] = Some(Question {
                deadline,
                answered_before: self.answered,
            });
            self.open += 1;
            return lost;
        }
        self.answered = self.answered.wrapping_add(1);
        self.take_late(answers - 1);
        while self.oldest().is_some_and(|question| {
            self.answered.wrapping_sub(question.answered_before) >= PASSED_BY
                && deadline.saturating_duration_since(question.deadline) >= OVERDUE
        }) {
            self.forget_oldest(1);
            lost += 1;
        }
        lost
    }

    fn oldest(&self) -> Option<Question> {
        self.ring[self.oldest].filter(|_| self.is_any())
    }

    const fn forget_oldest(&mut self, count: usize) {
        self.oldest = (self.oldest + count) % MAX_OPEN;
        self.open -= count;
        if self.open == 0 {
            self.goals = None;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Questions at an interval, each with so many answers; what each lost.
    fn ask(
        owed: &mut OwedAnswers,
        at: &mut Instant,
        interval: Duration,
        answers: impl Iterator<Item = u32>,
    ) -> Vec<u32> {
        let lost = answers.map(|answers| {
            *at += interval;
            owed.ask(*at, 0, answers, true)
        });
        lost.collect()
    }

    #[test]
    fn an_open_question_is_lost_when_many_later_ones_are_answered_and_it_is_overdue() {
        for (interval_ms, lost_after) in [(1, 99), (4, PASSED_BY as usize), (200, PASSED_BY as usize)] {
            let (mut owed, mut at) = (OwedAnswers::NONE, Instant::now());
            let interval = Duration::from_millis(interval_ms);
            let answers = [0, 0].into_iter().chain(std::iter::repeat_n(1, 150));
            let lost = ask(&mut owed, &mut at, interval, answers);
            let mut expected = vec![0; 152];
            if interval_ms == 1 {
                // The second one is overdue a question later.
                (expected[1 + lost_after], expected[2 + lost_after]) = (1, 1);
            } else {
                expected[1 + lost_after] = 2;
            }
            assert_eq!((lost, owed.is_any()), (expected, false), "every {interval_ms} ms");
        }
    }

    #[test]
    fn an_answer_that_repeats_a_new_goal_leaves_all_open_questions_lost() {
        let (mut owed, at) = (OwedAnswers::NONE, Instant::now());
        // (goal, answers, whether the newest repeats the goal, lost)
        for (step, (goal, answers, repeated, lost)) in [
            (104, 0, false, 0),
            (104, 1, true, 0), // it may be the answer to the one before
            (105, 1, false, 0),
            (104, 1, true, 0),
            (106, 1, false, 0), // an answer to an earlier one
            (107, 1, true, 1),
            (107, 0, false, 0),
            (105, 0, false, 0),
            (104, 1, true, 2),
            (107, 0, false, 0),
            (104, 2, true, 0), // the late one, and its own
            (103, 1, true, 0),
        ]
        .into_iter()
        .enumerate()
        {
            assert_eq!(owed.ask(at, goal, answers, repeated), lost, "step {step}");
        }
        assert!(!owed.is_any());
    }

    #[test]
    fn a_line_that_catches_up_has_lost_nothing() {
        let ms = Duration::from_millis;
        // (questions behind, questions for which it stays so, interval)
        for (behind, stays, interval) in [(1, 31, ms(50)), (5, 90, ms(1)), (3, 500, Duration::from_micros(70))] {
            let (mut owed, mut at) = (OwedAnswers::NONE, Instant::now());
            let unanswered = std::iter::repeat_n(0, behind);
            let answers = unanswered.chain(std::iter::repeat_n(1, stays));
            let mut lost = ask(&mut owed, &mut at, interval, answers);
            if behind == 1 {
                lost.push(owed.ask(at, 0, 2, true)); // both at once
            } else {
                assert_eq!(owed.take_late(behind as u32 + 1), 1, "one that nobody waited for");
            }
            assert_eq!((lost.iter().sum::<u32>(), owed.is_any()), (0, false), "{behind} behind");
        }
    }

    #[test]
    fn a_silent_servo_loses_the_oldest_when_too_many_are_open() {
        let (mut owed, mut at) = (OwedAnswers::NONE, Instant::now());
        let answers = std::iter::repeat_n(0, 3 * MAX_OPEN);
        let lost = ask(&mut owed, &mut at, Duration::from_millis(1), answers);
        assert_eq!((lost.iter().sum::<u32>(), owed.open), (2 * MAX_OPEN as u32, MAX_OPEN));
    }
}
