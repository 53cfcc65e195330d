//! Who drives: anyone may make the worm hold, everything else belongs to one watcher at a time.
//!
//! The driver is the first who commands, until it leaves, falls silent, or another takes over and says so. A crawl that the driver
//! commands is permitted for [`LIMIT_S`] and renewed for as long as the driver is heard; when it is not, the worm holds. Nothing here
//! begins a crawl but the request for one.
//!
//! Pure: times are arguments, ns of one clock.

use super::departure::{Departure, printable};
use super::lateness::LastHold;
use super::wire::{self, Request};
use crate::trip::wire::Ask;
use std::collections::BTreeMap;
use worm_estimator::time::seconds;

/// For how long a crawl is permitted at a time, s: should this process be killed, the worm holds this long after.
pub(super) const LIMIT_S: f64 = 1.0;
/// How often it is permitted anew, ns.
const RENEWAL_NS: u64 = 250_000_000;
/// A driver that was not heard for so long is gone, ns. Watchers say several times in it that they are there.
pub(super) const SILENCE_NS: u64 = 750_000_000;

/// Number of a watcher.
pub(super) type WatcherId = u64;

/// Who is at the other end of a connection.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Identity {
    /// The name that it gave, or one made of its process.
    pub(super) name: String,
    /// Its user, by the kernel.
    pub(super) user: u32,
    /// Its process, by the kernel.
    pub(super) pid: i32,
}

/// What becomes of a request.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Decision {
    /// The controller is to decide.
    Send,
    /// Done. The text is for all to see, where there is any.
    Done(Option<String>),
    /// Not the driver.
    Refused(String),
    /// It came too late, or after a hold that was asked for later.
    Stale(String),
}

/// What the controller is to be told without a request.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Effect {
    /// Hold, for this reason.
    Hold(Departure),
    /// The crawl may go on for [`LIMIT_S`].
    Renew,
}

/// All watchers, and which of them drives.
#[derive(Debug, Default)]
pub(super) struct Drive {
    watchers: BTreeMap<WatcherId, Identity>,
    /// When each was last heard; not those that never said that they are there.
    heard_ns: BTreeMap<WatcherId, u64>,
    driver: Option<Driver>,
    last_hold: LastHold,
}

#[derive(Debug)]
struct Driver {
    id: WatcherId,
    since_ns: u64,
    heard_ns: u64,
    /// When its crawl was last permitted, while it attends to one.
    permitted_ns: Option<u64>,
}

impl Drive {
    /// A watcher has come.
    pub(super) fn join(&mut self, id: WatcherId, identity: Identity) {
        self.watchers.insert(id, identity);
    }

    /// A watcher has gone.
    pub(super) fn leave(&mut self, id: WatcherId) -> Option<Effect> {
        self.heard_ns.remove(&id);
        let name = self.watchers.remove(&id)?.name;
        let driver = self.driver.take_if(|driver| driver.id == id)?;
        driver.permitted_ns.map(|_| Effect::Hold(Departure::left(name)))
    }

    /// A watcher was there at this time, whenever that is read.
    fn heard(&mut self, id: WatcherId, at_ns: u64) {
        if self.watchers.contains_key(&id) {
            let heard_ns = self.heard_ns.entry(id).or_insert(at_ns);
            *heard_ns = at_ns.max(*heard_ns);
        }
        if let Some(driver) = self.driver.as_mut().filter(|driver| driver.id == id) {
            driver.heard_ns = at_ns.max(driver.heard_ns);
        }
    }

    /// Whether any watcher was heard of late, a driver or not: for a trip that is the link.
    pub(super) fn is_attended(&self, now_ns: u64) -> bool {
        let mut heard = self.heard_ns.values();
        heard.any(|heard_ns| now_ns.saturating_sub(*heard_ns) < SILENCE_NS)
    }

    /// Decides on a request that was asked for at `sent_ns`.
    pub(super) fn request(&mut self, id: WatcherId, request: &Request, sent_ns: u64, now_ns: u64) -> Decision {
        // What lay unread, while this process stood still or the watcher's line was slow, says who was there then, and not who is there now.
        self.heard(id, sent_ns.min(now_ns));
        if let Some(refusal) = self.last_hold.refusal(request, sent_ns, now_ns) {
            return Decision::Stale(refusal);
        }
        match request {
            Request::Hello { name, .. } => {
                // It goes to logs and terminals of others.
                let name = printable(name);
                if let Some(identity) = self.watchers.get_mut(&id).filter(|_| !name.is_empty()) {
                    identity.name = name;
                }
                Decision::Done(None)
            }
            Request::Alive | Request::NoteRefusal { .. } => Decision::Done(None),
            Request::TakeOver => self.take_over(id, now_ns),
            Request::Acknowledge { .. } | Request::Mark { .. } => Decision::Send,
            Request::Trip {
                action: Ask::Alive | Ask::Status | Ask::Pause,
            } => Decision::Send,
            Request::Hold => {
                self.crawl_ended();
                Decision::Send
            }
            Request::Drive
            | Request::Arm
            | Request::Crawl { .. }
            | Request::Stop
            | Request::Reset
            | Request::Trip { .. } => {
                if let Some(refusal) = self.refusal(id, now_ns) {
                    return Decision::Refused(refusal);
                }
                let driver = self.driver.get_or_insert(Driver::new(id, now_ns));
                match request {
                    Request::Drive => return Decision::Done(None),
                    // From now on, whatever the controller will answer: whoever leaves before the answer leaves a worm that holds.
                    Request::Crawl { .. } => driver.permitted_ns = Some(now_ns),
                    Request::Stop => driver.permitted_ns = None,
                    _ => {}
                }
                Decision::Send
            }
        }
    }

    /// The crawl has ended or never began: another command, an alarm, a fault, a refusal.
    pub(super) fn crawl_ended(&mut self) {
        if let Some(driver) = &mut self.driver {
            driver.permitted_ns = None;
        }
    }

    /// What is due now.
    pub(super) fn due(&mut self, now_ns: u64) -> Option<Effect> {
        let driver = self.driver.as_mut()?;
        let silent_ns = now_ns.saturating_sub(driver.heard_ns);
        if silent_ns >= SILENCE_NS {
            let name = name_of(&self.watchers, driver.id);
            let attended = self.driver.take()?.permitted_ns;
            return attended.map(|_| Effect::Hold(Departure::silent(name, silent_ns)));
        }
        let permitted_ns = driver.permitted_ns.as_mut()?;
        if now_ns.saturating_sub(*permitted_ns) < RENEWAL_NS {
            return None;
        }
        *permitted_ns = now_ns;
        Some(Effect::Renew)
    }

    /// Who drives.
    pub(super) fn driver(&self, now_ns: u64) -> Option<wire::Driver> {
        let driver = self.driver.as_ref()?;
        let identity = self.watchers.get(&driver.id)?;
        Some(wire::Driver {
            watcher: driver.id,
            name: identity.name.clone(),
            user: identity.user,
            since_ms: now_ns.saturating_sub(driver.since_ns) / 1_000_000,
            attends: driver.permitted_ns.is_some(),
        })
    }

    /// A watcher in words, for the record.
    pub(super) fn who(&self, id: WatcherId) -> String {
        self.watchers.get(&id).map_or_else(
            || format!("watcher {id}"),
            |identity| format!("{} (user {}, process {})", identity.name, identity.user, identity.pid),
        )
    }

    /// The name of a watcher.
    pub(super) fn name(&self, id: WatcherId) -> String {
        name_of(&self.watchers, id)
    }

    /// How many watchers there are.
    pub(super) fn watchers(&self) -> usize {
        self.watchers.len()
    }

    fn take_over(&mut self, id: WatcherId, now_ns: u64) -> Decision {
        let former = match &self.driver {
            Some(driver) if driver.id == id => return Decision::Done(None),
            Some(driver) => format!(" from {}", self.who(driver.id)),
            None => String::new(),
        };
        let driver = Driver {
            // A crawl goes on, attended by the new driver from now on.
            permitted_ns: self.driver.as_ref().and_then(|driver| driver.permitted_ns),
            ..Driver::new(id, now_ns)
        };
        self.driver = Some(driver);
        Decision::Done(Some(format!("{} took over{former}", self.who(id))))
    }

    /// Why this watcher may not command.
    fn refusal(&self, id: WatcherId, now_ns: u64) -> Option<String> {
        let driver = self.driver.as_ref().filter(|driver| driver.id != id)?;
        Some(format!(
            "{} drives since {:.0} s ago: take over first (hold is open to everyone)",
            name_of(&self.watchers, driver.id),
            seconds(now_ns.saturating_sub(driver.since_ns))
        ))
    }
}

impl Driver {
    fn new(id: WatcherId, now_ns: u64) -> Self {
        Self {
            id,
            since_ns: now_ns,
            heard_ns: now_ns,
            permitted_ns: None,
        }
    }
}

fn name_of(watchers: &BTreeMap<WatcherId, Identity>, id: WatcherId) -> String {
    watchers
        .get(&id)
        .map_or_else(|| format!("watcher {id}"), |identity| identity.name.clone())
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    /// What happens, and what follows from it.
    enum Step {
        Ask(WatcherId, Request, Outcome),
        /// It was asked for at this time, ms, and is read only now.
        AskedAt(u64, WatcherId, Request, Outcome),
        Leave(WatcherId, Option<&'static str>),
        /// Alive is heard.
        Alive(WatcherId),
        CrawlEnded,
        /// What is due: nothing, a renewal, or a hold with these words.
        Due(Due),
    }

    #[derive(Debug, PartialEq, Eq)]
    enum Outcome {
        Sent,
        Done,
        Refused,
        Stale,
    }

    #[derive(Debug, PartialEq, Eq)]
    enum Due {
        Nothing,
        Renewal,
        Hold,
    }

    fn two_watchers() -> Drive {
        let mut drive = Drive::default();
        for (id, name) in [(1, "ann"), (2, "ben")] {
            let name = name.to_owned();
            drive.join(
                id,
                Identity {
                    name,
                    user: 1000,
                    pid: 7,
                },
            );
        }
        drive
    }

    fn ask(drive: &mut Drive, id: WatcherId, request: &Request, sent_ns: u64, now_ns: u64) -> Outcome {
        match drive.request(id, request, sent_ns, now_ns) {
            Decision::Send => Outcome::Sent,
            Decision::Done(_) => Outcome::Done,
            Decision::Refused(why) => {
                assert!(why.contains("drives since"), "{why}");
                Outcome::Refused
            }
            Decision::Stale(why) => {
                assert!(why.contains("ask again"), "{why}");
                Outcome::Stale
            }
        }
    }

    fn play(name: &str, steps: Vec<(u64, Step)>) -> Drive {
        let mut drive = two_watchers();
        for (number, (at_ms, step)) in steps.into_iter().enumerate() {
            let now_ns = at_ms * MS;
            let here = format!("{name}, step {number} at {at_ms} ms");
            match step {
                Step::Ask(id, request, expected) => {
                    assert_eq!(ask(&mut drive, id, &request, now_ns, now_ns), expected, "{here}");
                }
                Step::AskedAt(sent_ms, id, request, expected) => {
                    let outcome = ask(&mut drive, id, &request, sent_ms * MS, now_ns);
                    assert_eq!(outcome, expected, "{here}");
                }
                Step::Leave(id, expected) => match (drive.leave(id), expected) {
                    (None, None) => {}
                    (Some(Effect::Hold(why)), Some(part)) => assert!(why.to_string().contains(part), "{here}: {why}"),
                    (found, _) => panic!("{here}: {found:?}"),
                },
                Step::Alive(id) => {
                    let heard = ask(&mut drive, id, &Request::Alive, now_ns, now_ns);
                    assert_eq!(heard, Outcome::Done, "{here}");
                }
                Step::CrawlEnded => drive.crawl_ended(),
                Step::Due(expected) => {
                    let due = match drive.due(now_ns) {
                        None => Due::Nothing,
                        Some(Effect::Renew) => Due::Renewal,
                        Some(Effect::Hold(_)) => Due::Hold,
                    };
                    assert_eq!(due, expected, "{here}");
                }
            }
        }
        drive
    }

    #[test]
    fn one_drives_and_anyone_may_halt() {
        use Outcome::{Done, Refused, Sent};
        use Step::{Alive, Ask, CrawlEnded, Leave};
        let crawl = || Request::Crawl { cycles_per_s: None };
        let due = |due| Step::Due(due);
        let driver = |drive: &Drive| drive.driver(0).map(|driver| (driver.watcher, driver.attends));

        let drive = play(
            "the first who commands drives, and a second one does not",
            vec![
                (0, Ask(1, Request::Arm, Sent)),
                (10, Ask(2, crawl(), Refused)),
                (20, Ask(2, Request::Stop, Refused)),
                (30, Ask(2, Request::Reset, Refused)),
                (40, Ask(2, Request::Drive, Refused)),
                (50, Ask(1, Request::Drive, Done)),
                (60, Ask(2, Request::Hold, Sent)),
                (70, Ask(2, Request::Acknowledge { alarms: Vec::new() }, Sent)),
                (80, Ask(1, Request::Stop, Sent)),
            ],
        );
        assert_eq!(driver(&drive), Some((1, false)));

        let drive = play(
            "a crawl is renewed while its driver is heard, and held when it is not",
            vec![
                (0, Ask(1, crawl(), Sent)),
                (200, due(Due::Nothing)),
                (249, Alive(1)),
                (250, due(Due::Renewal)),
                (499, due(Due::Nothing)),
                (500, due(Due::Renewal)),
                (800, Alive(2)),
                (998, due(Due::Renewal)),
                (999, due(Due::Hold)),
                (1500, due(Due::Nothing)),
                (1501, Alive(1)),
                (1600, due(Due::Nothing)),
            ],
        );
        assert_eq!(driver(&drive), None, "who was silent drives no more");

        let drive = play(
            "a driver that leaves leaves a worm that holds, even before the controller has answered",
            vec![
                (0, Ask(1, crawl(), Sent)),
                (1, Leave(1, Some("ann, who drove"))),
                (2, due(Due::Nothing)),
            ],
        );
        assert_eq!(driver(&drive), None);

        play(
            "who does not crawl leaves nothing to hold",
            vec![
                (0, Ask(1, Request::Arm, Sent)),
                (10, Leave(2, None)),
                (20, Leave(1, None)),
                (30, Leave(1, None)),
            ],
        );

        let drive = play(
            "whoever holds ends the renewals; only a new crawl begins them",
            vec![
                (0, Ask(1, crawl(), Sent)),
                (100, Ask(2, Request::Hold, Sent)),
                (300, Alive(1)),
                (400, due(Due::Nothing)),
                (500, Ask(1, crawl(), Sent)),
                (750, due(Due::Renewal)),
                (760, CrawlEnded),
                (1100, due(Due::Nothing)),
                (1200, Leave(1, None)),
            ],
        );
        assert_eq!(driver(&drive), None);

        let drive = play(
            "what comes late begins nothing and takes no seat, and a hold is never late",
            vec![
                (13_000, Step::AskedAt(0, 1, crawl(), Outcome::Stale)),
                (13_000, Step::AskedAt(0, 2, Request::TakeOver, Outcome::Stale)),
                (13_010, Step::AskedAt(0, 2, Request::Hold, Sent)),
                (13_300, due(Due::Nothing)),
                (13_310, Leave(1, None)),
            ],
        );
        assert_eq!(driver(&drive), None);

        let drive = play(
            "a word that lay unread says who was there then, and does not prolong a crawl",
            vec![
                (0, Ask(1, crawl(), Sent)),
                (700, Step::AskedAt(200, 1, Request::Alive, Done)),
                (700, Step::AskedAt(100, 1, Request::Alive, Done)),
                (949, due(Due::Renewal)),
                (950, due(Due::Hold)),
            ],
        );
        assert_eq!(driver(&drive), None);

        let drive = play(
            "a takeover is explicit, and takes the crawl with it",
            vec![
                (0, Ask(1, crawl(), Sent)),
                (100, Ask(2, Request::TakeOver, Done)),
                (110, Ask(1, crawl(), Refused)),
                (120, Leave(1, None)),
                (350, due(Due::Renewal)),
                (849, due(Due::Renewal)),
                (850, due(Due::Hold)),
            ],
        );
        assert_eq!(driver(&drive), None);

        let drive = play(
            "who comes back by itself moves nothing",
            vec![
                (0, Ask(1, crawl(), Sent)),
                (10, Leave(1, Some("ann"))),
                (20, Ask(2, Request::Alive, Done)),
                (
                    30,
                    Ask(
                        2,
                        Request::Hello {
                            version: 1,
                            name: "ann\n\x1b".to_owned(),
                        },
                        Done,
                    ),
                ),
                (400, due(Due::Nothing)),
            ],
        );
        assert_eq!(driver(&drive), None);
        assert!(drive.is_attended(30 * MS + SILENCE_NS - 1) && !drive.is_attended(30 * MS + SILENCE_NS));
        assert_eq!(drive.who(2), "ann (user 1000, process 7)");
    }
}
