//! Every duration as a histogram over its floor's, both axes logarithmic, so that one late tick among a million shows.

use super::words::{NOT_MEASURED, with_unit};
use crate::latency::{Durations, Outcome};
use worm_analysis::report::page::{Figure, Key, Mark, Panel};
use worm_analysis::report::plot::{
    Axis, BLUE, Colour, DrawError, INK, MUTED, Row, Sheet, Stroke, Svg, VERMILION, draw,
};

const LOOP: Colour = BLUE;
const FLOOR: Colour = VERMILION;
/// Opacity of the area, so that the floor's line shows on it.
const PALE: f64 = 0.3;

/// Bars over the whole width of a picture.
const BARS: usize = 90;
/// Shortest duration that is resolved, µs: shorter ones are in the first bar.
const SHORTEST_US: f64 = 0.01;
/// Where the bars begin: low enough that a count of one shows.
const FOOT: f64 = 0.5;
/// The axis of counts reaches at least this far, so that it has a scale.
const MIN_TOP: f64 = 100.0;

/// Room that the label of a percentile takes, as a fraction of the width: one that would overlap another is left out.
const NAME: f64 = 0.06;

/// One picture: a duration, and its floor where it has one.
struct Histogram<'a> {
    title: &'a str,
    durations: &'a Durations,
    floor: Option<&'a Durations>,
    height: f64,
    shows_percentiles: bool,
}

/// The wake lateness over the bare sleeper's.
pub(super) fn wake(outcome: &Outcome) -> Result<Figure, DrawError> {
    let histogram = Histogram {
        title: "wake lateness",
        durations: &outcome.wake_us,
        floor: Some(&outcome.floor_wake_us),
        height: 270.0,
        shows_percentiles: true,
    };
    Ok(Figure {
        id: "wake",
        title: "How late the loop runs, and how late a bare sleeper does",
        keys: keys("bare sleeper, in the same run"),
        panels: vec![histogram.panel()?],
        caption: "Where the line follows the edge of the area, the loop is as punctual as the machine lets it be; what the area \
                  has beyond the line, the loop adds. Single late ticks far out differ by chance. Both axes are \
                  logarithmic: a count of one shows beside a count of a million."
            .to_owned(),
    })
}

/// The parts of a tick, and what follows it.
pub(super) fn parts(outcome: &Outcome) -> Result<Figure, DrawError> {
    let alone = [
        ("bus exchange", &outcome.bus_us, None),
        ("computation and publishing", &outcome.own_work_us, None),
        ("tick period", &outcome.period_us, None),
        (
            "waking the listeners",
            &outcome.notify_us,
            Some(&outcome.floor_notify_us),
        ),
        (
            "delivery, woken by the event",
            &outcome.delivery_us,
            Some(&outcome.floor_delivery_us),
        ),
        (
            "delivery, never asleep",
            &outcome.polled_delivery_us,
            Some(&outcome.floor_polled_delivery_us),
        ),
        ("from stall to alarm", &outcome.alarm_us, None),
    ];
    // Nobody blocks the cam of a real worm, so a missing stall is no gap in the measurement.
    let shown = alone
        .into_iter()
        .filter(|(_, durations, _)| !durations.is_empty() || !std::ptr::eq(*durations, &outcome.alarm_us));
    let panels = shown.map(|(title, durations, floor)| {
        let histogram = Histogram {
            title,
            durations,
            floor,
            height: 150.0,
            shows_percentiles: false,
        };
        histogram.panel()
    });
    Ok(Figure {
        id: "parts",
        title: "The parts of a tick, and what follows it",
        keys: keys("the same without wormd: bare notifier, bare iceoryx2 pairs"),
        panels: panels.collect::<Result<_, _>>()?,
        caption: "Delivery runs from before the state is published until a subscriber has it in hand: the estimator, which sleeps \
                  until its event wakes it, or one that never sleeps. Each picture has its own axes."
            .to_owned(),
    })
}

fn keys(floor: &str) -> Vec<Key> {
    vec![Key::new(Mark::Box, LOOP, "wormd"), Key::new(Mark::Line, FLOOR, floor)]
}

impl Histogram<'_> {
    fn panel(&self) -> Result<Panel, DrawError> {
        let quantity = "count by µs, both logarithmic";
        Ok(Panel::new(self.title, quantity, self.picture()?))
    }

    fn picture(&self) -> Result<Svg, DrawError> {
        let both = || std::iter::once(self.durations).chain(self.floor);
        let ends = both().flat_map(Durations::bars).map(|(us, _)| us.max(SHORTEST_US));
        let (shortest, longest) = ends.fold((f64::INFINITY, 0.0f64), |(low, high), us| (low.min(us), high.max(us)));
        let x = Axis::logarithmic(shortest, longest);
        let counts = binned(self.durations, &x);
        let floor = self.floor.map(|floor| binned(floor, &x)).unwrap_or_default();
        let max = counts.iter().chain(&floor).copied().max().unwrap_or(0);
        let sheet = Sheet {
            description: self.description(),
            x_label: Some("µs".to_owned()),
            rows: vec![Row::new(
                Axis::logarithmic(1.2 * FOOT, MIN_TOP.max(max as f64)),
                self.height,
            )],
            x,
        };
        draw(&sheet, |_, plot| {
            let x = &sheet.x;
            if self.durations.is_empty() {
                plot.text_beside(x.low(), MIN_TOP.sqrt(), MUTED, NOT_MEASURED)?;
            }
            let outline = outline(&counts, x);
            plot.ribbon(outline.iter().map(|(x, y)| (*x, [FOOT, *y])), LOOP, PALE)?;
            plot.line(outline, Stroke::new(LOOP, 1.2))?;
            plot.line(self::outline(&floor, x), Stroke::new(FLOOR, 1.5))?;
            let percentiles = self.durations.measured().filter(|_| self.shows_percentiles);
            if let Some(us) = percentiles {
                let mut named = f64::NEG_INFINITY;
                for (name, us) in [("p50", us.p50), ("p99", us.p99), ("max", us.max)] {
                    plot.vertical_line(us, FOOT, sheet.rows[0].y.high(), Stroke::new(INK, 1.0).dashed())?;
                    if fraction(us, x) - named > NAME {
                        plot.label_above(us, INK, name)?;
                        named = fraction(us, x);
                    }
                }
            }
            Ok(())
        })
    }

    /// What the picture shows, for readers who cannot see it.
    fn description(&self) -> String {
        let summary = |durations: &Durations| match durations.measured() {
            Some(us) => format!(
                "median {}, 99th percentile {}, largest {}",
                with_unit(us.p50),
                with_unit(us.p99),
                with_unit(us.max)
            ),
            None => NOT_MEASURED.to_owned(),
        };
        let floor = self.floor.map(|floor| format!("; floor: {}", summary(floor)));
        format!(
            "Histogram of {}: {}{}",
            self.title,
            summary(self.durations),
            floor.unwrap_or_default()
        )
    }
}

/// Where a bar begins; the last one's end is the beginning of one more.
fn edge(bar: usize, x: &Axis) -> f64 {
    x.low() * (x.high() / x.low()).powf(bar as f64 / BARS as f64)
}

/// Where a duration lies between the ends of the axis.
fn fraction(us: f64, x: &Axis) -> f64 {
    (us.max(x.low()) / x.low()).ln() / (x.high() / x.low()).ln()
}

/// How many durations are in each bar of the picture.
fn binned(durations: &Durations, x: &Axis) -> Vec<u64> {
    let mut counts = vec![0; BARS];
    for (us, count) in durations.bars() {
        counts[((fraction(us, x) * BARS as f64) as usize).min(BARS - 1)] += count;
    }
    counts
}

/// The bars' common outline, from the foot up and down again; broken where there are none.
fn outline(counts: &[u64], x: &Axis) -> Vec<(f64, f64)> {
    let mut points = Vec::new();
    let is_empty = |bar: usize| counts.get(bar).is_none_or(|count| *count == 0);
    for (bar, count) in counts.iter().enumerate().filter(|(_, count)| **count > 0) {
        let (from, to) = (edge(bar, x), edge(bar + 1, x));
        if bar == 0 || is_empty(bar - 1) {
            points.push((from, FOOT));
        }
        points.extend([(from, *count as f64), (to, *count as f64)]);
        if is_empty(bar + 1) {
            points.extend([(to, FOOT), (to, f64::NAN)]);
        }
    }
    points
}
