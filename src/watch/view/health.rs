//! How the loop is: ticks, times, recording, charge.

use crate::watch::picture::Picture;
use crate::watch::recording;
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Color, Stylize};
use ratatui::text::Line;
use ratatui::widgets::{Block, Paragraph};

pub(super) fn draw(frame: &mut Frame<'_>, area: Rect, picture: &Picture) {
    let held_hz = picture.timing.map(|timing| (1e9 / timing.period_ns as f64).round());
    let rate_hz = held_hz.filter(|hz| hz.is_finite()).unwrap_or(picture.subject.rate_hz);
    let mut lines = vec![
        Line::raw(format!("{} ticks at {rate_hz} Hz", picture.ticks())),
        Line::raw(format!(
            "{} overruns, {} link faults",
            picture.timing.map_or(0, |timing| timing.overruns),
            picture.state.map_or(0, |state| state.link_failures),
        )),
        Line::raw("µs         p50     p99      max").bold(),
    ];
    let durations = picture
        .statistics
        .map(|it| [("wake", it.wake_us), ("bus", it.bus_us), ("compute", it.compute_us)]);
    for (name, us) in durations.into_iter().flatten() {
        lines.push(Line::raw(format!(
            "{name:<8}{:>6.0}{:>8.0}{:>9.0}",
            us.p50, us.p99, us.max
        )));
    }
    if let Some(statistics) = picture.statistics.filter(|it| it.host_pauses > 0) {
        lines.push(Line::raw(format!(
            "{} host pauses, {:.2} s",
            statistics.host_pauses, statistics.host_paused_s
        )));
    }
    lines.extend(picture.recording.as_ref().map(|status| {
        let line = Line::raw(recording::progress_text(status));
        if recording::has_stopped(status) {
            line.fg(Color::Red)
        } else {
            line
        }
    }));
    // The range knows the charge best; before the first gait cycle there is none.
    let share = match &picture.range {
        Some(range) => Some(range.charge_share),
        None => picture.estimate.map(|estimate| estimate.battery_fraction),
    };
    if let Some(share) = share.filter(|share| share.is_finite()) {
        lines.push(Line::raw(format!("battery {:.0} %", share * 100.0)));
    }
    frame.render_widget(Paragraph::new(lines).block(Block::bordered().title(" loop ")), area);
}
