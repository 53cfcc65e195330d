//! Messages of older versions, so that every log stays readable.

use super::channel::Channel;
use std::borrow::Cow;

/// What states have since version 4, and since version 3; macros, for `concat!` takes no constants.
macro_rules! not_in_state_v3 {
    () => {
        "\"pitch_rad\":null,"
    };
}
macro_rules! not_in_state_v2 {
    () => {
        concat!(
            "\"hold_reason\":\"none\",\"acknowledged_mask\":0,\"acknowledged_by\":null,\"emergency_stop\":null,",
            not_in_state_v3!()
        )
    };
}

/// What `inferred` has since version 3.
macro_rules! not_in_inferred_v2 {
    () => {
        concat!(
            "\"contradicting_marks\":0,\"slide_sigma_m\":null,",
            "\"friction_loss_sigma\":null,\"load_rise_sigma_n\":null,\"mark_off_m\":null,\"mark_off_sigma_m\":null,"
        )
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
        (Channel::State, "wormd_state_v3") => Some(not_in_state_v3!()),
        (Channel::Inferred, "wormd_inferred_v1") => Some(concat!("\"slope_is_measured\":0,", not_in_inferred_v2!())),
        (Channel::Inferred, "wormd_inferred_v2") => Some(not_in_inferred_v2!()),
        (Channel::Cycle, "wormd_cycle_v1") => Some("\"host_paused_s\":0.0,"),
        _ => None,
    }
}

/// Of a type of an older version that has the first fields of the present one, with the same numbers, and no others: the newer fields that
/// are not known then. Protocol Buffers read the rest of them as zero, which is right for those.
pub(super) fn unknown_fields(channel: Channel, type_name: &str) -> Option<&'static [&'static str]> {
    match (channel, type_name) {
        (Channel::State, "wormd_state_v3") => Some(&["pitch_rad"]),
        (Channel::Inferred, "wormd_inferred_v1" | "wormd_inferred_v2") => Some(&[
            "slide_sigma_m",
            "friction_loss_sigma",
            "load_rise_sigma_n",
            "mark_off_m",
            "mark_off_sigma_m",
        ]),
        (Channel::CommandRecord, "wormd_command_record_v1") => Some(&[]),
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
