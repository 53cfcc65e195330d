//! Messages of older versions, so that every log stays readable.

use super::channel::Channel;
use std::borrow::Cow;

/// The members that messages of an older type lack, as JSON, with the value for "not known"; nothing if it is not an older type of the
/// channel.
pub(super) fn lacking_members(channel: Channel, type_name: &str) -> Option<&'static str> {
    match (channel, type_name) {
        (Channel::State, "wormd_state_v1") => Some("\"motor_time_s\":null,\"host_paused_ns\":0,"),
        (Channel::Cycle, "wormd_cycle_v1") => Some("\"host_paused_s\":0.0,"),
        _ => None,
    }
}

/// The message, with the members that it lacks.
pub(super) fn completed<'t>(text: &'t [u8], lacking: Option<&str>) -> Cow<'t, [u8]> {
    match (text.split_first(), lacking) {
        (Some((b'{', rest)), Some(lacking)) => [b"{", lacking.as_bytes(), rest].concat().into(),
        _ => text.into(),
    }
}
