//! Messages of older versions: what has been recorded once can be read.

use super::channel::Channel;
use std::borrow::Cow;

/// The members that messages of an older type lack, as JSON, with what stands for "not known" in them; nothing for a type that is not
/// an older one of the channel's.
pub(super) fn lacking_members(channel: Channel, type_name: &str) -> Option<&'static str> {
    match (channel, type_name) {
        (Channel::State, "wormd_state_v1") => Some("\"motor_time_s\":null,\"host_paused_ns\":0,"),
        (Channel::Cycle, "wormd_cycle_v1") => Some("\"host_paused_s\":0.0,"),
        _ => None,
    }
}

/// A message with the members that it lacks.
pub(super) fn completed<'t>(text: &'t [u8], lacking: Option<&str>) -> Cow<'t, [u8]> {
    match (text.split_first(), lacking) {
        (Some((b'{', rest)), Some(lacking)) => [b"{", lacking.as_bytes(), rest].concat().into(),
        _ => text.into(),
    }
}
