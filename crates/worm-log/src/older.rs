//! Messages of older versions, so that every log stays readable.

use super::channel::Channel;
use std::borrow::Cow;

/// What states have since version 3; a macro, for `concat!` takes no constant.
macro_rules! not_in_state_v2 {
    () => {
        "\"hold_reason\":\"none\",\"acknowledged_mask\":0,\"acknowledged_by\":null,\"emergency_stop\":null,"
    };
}

/// The members that messages of an older type lack, as JSON, with the value for "not known"; nothing if it is not an older type of the
/// channel.
pub(super) fn lacking_members(channel: Channel, type_name: &str) -> Option<&'static str> {
    match (channel, type_name) {
        (Channel::State, "wormd_state_v1") => Some(concat!(
            "\"motor_time_s\":null,\"host_paused_ns\":0,",
            not_in_state_v2!()
        )),
        (Channel::State, "wormd_state_v2") => Some(not_in_state_v2!()),
        (Channel::Cycle, "wormd_cycle_v1") => Some("\"host_paused_s\":0.0,"),
        _ => None,
    }
}

/// Whether a type of an older version has the first fields of the present one, with the same numbers, and no others: Protocol Buffers read
/// it then as a message whose newer fields are zero.
pub(super) fn is_beginning(channel: Channel, type_name: &str) -> bool {
    matches!(
        (channel, type_name),
        (Channel::CommandRecord, "wormd_command_record_v1")
    )
}

/// The message, with the members that it lacks.
pub(super) fn completed<'t>(text: &'t [u8], lacking: Option<&str>) -> Cow<'t, [u8]> {
    match (text.split_first(), lacking) {
        (Some((b'{', rest)), Some(lacking)) => [b"{", lacking.as_bytes(), rest].concat().into(),
        _ => text.into(),
    }
}
