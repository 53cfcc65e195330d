//! The worms of one robot as the laptop offers them, and what others are told of that.

use super::offer::Offer;
use crate::failure::Failure;
use crate::relay::wire::{Event, Line, Network};
use crate::topics::fleet_list::ListedRobot;
use crate::topics::{Instance, PublishedList};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};
use worm_estimator::config::Config;

/// How often a worm that cannot be offered is tried again.
const RETRY: Duration = Duration::from_secs(2);
/// Most worms that a robot may have.
const MAX_WORMS: usize = 256;

/// The worms of a robot.
pub(crate) struct Offers {
    robot: String,
    /// `topics.root` of the worms as they are offered.
    root: Option<String>,
    /// The bridge that was heard last.
    bridge: Option<String>,
    places: BTreeMap<String, Place>,
    /// Where others read how it stands.
    list: Arc<PublishedList>,
    /// Whether that could be written of late.
    is_listed: bool,
}

/// A worm's place: offered, perhaps with an event for the next frame, or to be tried again.
enum Place {
    Offered(Box<Offer>, Option<Event>),
    Refused(Instant, String),
}

impl Offers {
    /// None is known yet.
    pub(crate) fn new(robot: &str, root: Option<String>, list: Arc<PublishedList>) -> Self {
        Self {
            robot: robot.to_owned(),
            root,
            bridge: None,
            places: BTreeMap::new(),
            list,
            is_listed: true,
        }
    }

    /// The offered ones, by name.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (&str, &Offer)> {
        self.places.iter().filter_map(|(worm, place)| match place {
            Place::Offered(offer, _) => Some((worm.as_str(), &**offer)),
            Place::Refused(..) => None,
        })
    }

    /// The same, to be changed.
    pub(crate) fn iter_mut(&mut self) -> impl Iterator<Item = (&str, &mut Offer)> {
        self.places.iter_mut().filter_map(|(worm, place)| match place {
            Place::Offered(offer, _) => Some((worm.as_str(), &mut **offer)),
            Place::Refused(..) => None,
        })
    }

    /// One that is offered.
    pub(crate) fn get_mut(&mut self, worm: &str) -> Option<&mut Offer> {
        match self.places.get_mut(worm)? {
            Place::Offered(offer, _) => Some(offer),
            Place::Refused(..) => None,
        }
    }

    /// Takes a line of a worm's relay, where the worm is offered.
    pub(crate) fn take_line(&mut self, worm: &str, line: Line, network: &Network) -> Result<(), Failure> {
        match self.places.get_mut(worm) {
            Some(Place::Offered(offer, event)) => {
                let event = event.take_if(|_| matches!(line, Line::Frame(_)));
                offer.take_line(line, network, event)
            }
            // Not offered here, or not announced.
            _ => Ok(()),
        }
    }

    /// Puts an event into the next frame of each.
    pub(crate) fn note(&mut self, noted: &Event) {
        for place in self.places.values_mut() {
            if let Place::Offered(_, event) = place {
                *event = Some(noted.clone());
            }
        }
    }

    /// Takes which worms the robot's bridge has, and offers those that are not offered yet. True where one is offered from now on.
    pub(crate) fn take_worms(&mut self, worms: &[String], bridge: Option<&str>) -> bool {
        if self.bridge.as_deref() != bridge {
            self.bridge = bridge.map(str::to_owned);
        }
        let mut tried = Vec::new();
        for worm in worms.iter().take(MAX_WORMS) {
            let is_due = match self.places.get(worm) {
                None => true,
                Some(Place::Offered(..)) => false,
                Some(Place::Refused(since, _)) => since.elapsed() >= RETRY,
            };
            if is_due {
                self.offer(worm);
                tried.push(worm);
            }
        }
        // Whom the robot does not serve any more.
        self.places.retain(|worm, _| worms.contains(worm));
        if !tried.is_empty() {
            self.list(true, None);
        }
        // A worm of this computer that begins looks for the list, and this for its lock: one of the two sees the other.
        tried.iter().for_each(|worm| self.give_way(worm));
        tried.iter().any(|worm| self.get_mut(worm).is_some())
    }

    fn offer(&mut self, worm: &str) {
        let place = match self.open(worm) {
            Ok(offer) => Place::Offered(Box::new(offer), None),
            Err(failure) => self.refuse(worm, failure.to_string()),
        };
        self.places.insert(worm.to_owned(), place);
    }

    fn open(&self, worm: &str) -> Result<Offer, Failure> {
        let mut config = Config::default();
        config.worm.name = worm.to_owned();
        if let Some(root) = &self.root {
            config.topics.root.clone_from(root);
        }
        // The name comes from the network, and becomes that of a folder.
        if let Some(problem) = config.problems().first() {
            return Err(Failure::unusable(problem.to_string()));
        }
        let instance = Instance::of(&config).map_err(Failure::unusable)?;
        let outcome = Offer::open(instance.clone(), &self.robot);
        if outcome.is_err() {
            instance.remove_folder_if_empty();
        }
        outcome
    }

    fn refuse(&self, worm: &str, why: String) -> Place {
        let is_known = matches!(self.places.get(worm), Some(Place::Refused(_, known)) if *known == why);
        if !is_known {
            tracing::warn!("{worm} of {} is not offered: {why}", self.robot);
        }
        Place::Refused(Instant::now(), why)
    }

    /// Takes the offer back where a worm of its name has begun on this computer.
    fn give_way(&mut self, worm: &str) {
        if let Some(why) = self.get_mut(worm).and_then(|offer| offer.clash()) {
            let place = self.refuse(worm, why);
            self.places.insert(worm.to_owned(), place);
            self.list(true, None);
        }
    }

    /// Offers once more what another process has removed: nobody could drive or hold it. True where there was such a worm.
    pub(crate) fn offer_again(&mut self) -> bool {
        let gone = self.iter().filter(|(_, offer)| !offer.is_in_place());
        let gone: Vec<_> = gone.map(|(worm, _)| worm.to_owned()).collect();
        for worm in &gone {
            tracing::warn!(
                "the socket of {worm} of {} is gone, which another process has removed: the worm is offered once more",
                self.robot
            );
            // Its lock, where it is still there, is to be free.
            self.places.remove(worm);
            self.offer(worm);
        }
        !gone.is_empty()
    }

    /// Leaves for others how it stands with the robot: whether it was ever heard, and why it is not.
    pub(crate) fn list(&mut self, was_heard: bool, problem: Option<String>) {
        let worms = self.places.iter().map(|(worm, place)| match place {
            Place::Offered(..) => (worm.clone(), None),
            Place::Refused(_, why) => (worm.clone(), Some(why.clone())),
        });
        let standing = ListedRobot {
            was_heard,
            problem,
            bridge: self.bridge.clone(),
            worms: worms.collect(),
        };
        let told = self.list.tell(&self.robot, standing);
        if let Err(error) = &told
            && self.is_listed
        {
            tracing::error!(
                "the list of robots cannot be written ({error}): a page about all worms may leave out {} while it is not reached",
                self.robot
            );
        }
        self.is_listed = told.is_ok();
    }
}
