//! The topics: which type travels under which name, who writes it, and how much of it is kept.

use super::role::{BlackBox, Controller, Estimator, Recorder, Role, Trip};
use super::services::{EventService, Services, TopicService};
use iceoryx2::prelude::ZeroCopySend;
use std::fmt::Debug;
use worm_estimator::message::{
    Alarm, BlackBoxStatus, CommandRecord, Cycle, Estimate, FieldAccess, FieldValue, Inferred, Layout, Range,
    RecordingStatus, State, Timing, TripStatus,
};

/// A message that is published on a topic of its own.
pub trait Topic: sealed::Carried {
    /// The last part of the service's name, `worm/<name>/…`.
    const NAME: &'static str;
    /// Samples that a subscriber can fall behind before it loses the oldest.
    const BUFFER: usize;
    /// Last samples that a late joiner gets.
    const HISTORY: usize;
    /// The role that publishes it.
    type Owner: Role;

    /// Number of the sample, growing by one with each, where the topic has one.
    fn number(&self) -> Option<u64>;
}

/// A topic as programs in other languages need it.
#[derive(Debug, Clone, Copy)]
pub struct TopicDescription {
    /// [`Topic::NAME`].
    pub name: &'static str,
    /// What travels on it.
    pub layout: Layout,
    /// [`Topic::BUFFER`].
    pub buffer: usize,
    /// [`Topic::HISTORY`].
    pub history: usize,
    /// Whether an event of the same name wakes its listeners.
    pub is_announced: bool,
    /// The field that [`Topic::number`] returns.
    pub number_field: Option<&'static str>,
}

impl TopicDescription {
    fn of<T: Topic + FieldAccess>() -> Self {
        // The message whose fields are their own places says which of them is the number.
        let mut places = T::empty();
        for place in 0..T::FIELDS.len() {
            places.set_field(place, FieldValue::U64(place as u64));
        }
        let number = places.number().and_then(|place| usize::try_from(place).ok());
        Self {
            name: T::NAME,
            layout: T::LAYOUT,
            buffer: T::BUFFER,
            history: T::HISTORY,
            is_announced: ANNOUNCED.contains(&T::NAME),
            number_field: number.and_then(|place| T::FIELDS.get(place)).map(|field| field.name),
        }
    }
}

/// A topic whose subscribers can sleep until there is something new.
pub trait Announced: Topic + sealed::Announced {}

pub(super) mod sealed {
    use super::*;

    /// Ties a message to its service.
    ///
    /// # Safety
    /// Every pattern of bytes is a valid value: plain numbers and arrays of them, without padding.
    pub unsafe trait Carried: ZeroCopySend + Copy + Debug + Send + Sync + 'static {
        fn service(services: &Services) -> &TopicService<Self>;
    }

    pub trait Announced {
        fn event(services: &Services) -> &EventService;
    }
}

macro_rules! topics {
    ($($message:ident { $field:ident, owner: $owner:ident, buffer: $buffer:literal, history: $history:literal, number: $number:expr })+) => {
        $(impl Topic for $message {
            const NAME: &'static str = stringify!($field);
            const BUFFER: usize = $buffer;
            const HISTORY: usize = $history;
            type Owner = $owner;

            fn number(&self) -> Option<u64> {
                let number: fn(&Self) -> Option<u64> = $number;
                number(self)
            }
        }

        // SAFETY: `message` has f64, u64, u32 and i32 fields, arrays of them and of bytes, and no padding.
        unsafe impl sealed::Carried for $message {
            fn service(services: &Services) -> &TopicService<Self> { &services.$field }
        })+

        /// All topics, as programs in other languages need them.
        pub fn describe_topics() -> Vec<TopicDescription> {
            vec![$(TopicDescription::of::<$message>()),+]
        }
    };
}

topics! {
    State { state, owner: Controller, buffer: 1024, history: 1, number: |state| Some(state.sequence) }
    Timing { timing, owner: Controller, buffer: 1024, history: 1, number: |timing| Some(timing.sequence) }
    Estimate { estimate, owner: Estimator, buffer: 256, history: 1, number: |_| None }
    Cycle { cycle, owner: Estimator, buffer: 64, history: 16, number: |cycle| Some(cycle.index) }
    Alarm { alarm, owner: Estimator, buffer: 64, history: 32, number: |alarm| Some(alarm.sequence) }
    Range { range, owner: Estimator, buffer: 64, history: 1, number: |range| Some(range.index) }
    CommandRecord { command, owner: Controller, buffer: 256, history: 32, number: |record| Some(record.sequence) }
    TripStatus { trip, owner: Trip, buffer: 32, history: 1, number: |trip| Some(trip.sequence) }
    RecordingStatus { recording, owner: Recorder, buffer: 16, history: 1, number: |status| Some(status.sequence) }
    Inferred { inferred, owner: Estimator, buffer: 64, history: 1, number: |inferred| Some(inferred.sequence) }
    BlackBoxStatus { black_box, owner: BlackBox, buffer: 16, history: 1, number: |status| Some(status.sequence) }
}

macro_rules! announced {
    ($($message:ident = $field:ident,)+) => {
        $(impl sealed::Announced for $message {
            fn event(services: &Services) -> &EventService { &services.$field }
        }
        impl Announced for $message {})+

        /// Names of the topics with an event.
        const ANNOUNCED: &[&str] = &[$($message::NAME),+];
    };
}

announced! {
    State = state_event,
    Alarm = alarm_event,
}
