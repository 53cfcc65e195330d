//! The ghost of the worm, in words.

use crate::trip::words::span;
use worm_plan::ghost::{Doing, Prediction, Score};

/// Where the worm is expected: `predicted: crawls on, 120 to 180 mm further, 2.31 m from home, over in 12 to 15 min`.
pub(crate) fn text(ghost: &Prediction) -> String {
    let doing = match ghost.doing {
        Doing::Rests => "rests",
        Doing::Crawls => "crawls on",
        Doing::Returns => "on its way home",
        Doing::Holds => "holds by now",
        Doing::Arrived => "has arrived",
    };
    // Rounded, what is little less than nothing is nothing: adding zero takes its sign.
    let [low_mm, high_mm] = [ghost.moved_m.low, ghost.moved_m.high].map(|m| (1e3 * m).round() + 0.0);
    let mut text = format!("predicted: {doing}, moved by {low_mm:.0} to {high_mm:.0} mm");
    if let Some(place_m) = ghost.place_m {
        text += &format!(
            ", {:.2} to {:.2} m from home",
            place_m.low.max(0.0),
            place_m.high.max(0.0)
        );
    }
    if let Some(left_s) = ghost.left_s {
        text += &format!(", over in {}", span(left_s.low, left_s.high));
    }
    text
}

/// How well it was hit.
pub(crate) fn score_text(score: &Score) -> String {
    format!(
        "after {:.0} s of silence the worm is {:.0} mm further, {:+.1} mm from its ghost ({:+.1} σ, {} the interval)",
        score.silent_s,
        1e3 * score.moved_m,
        1e3 * score.error_m,
        score.error_sigmas,
        if score.is_inside { "inside" } else { "outside" },
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use worm_plan::ghost::Expected;

    #[test]
    fn little_less_than_nothing_is_nothing() {
        let rests = Prediction {
            silent_s: 2.0,
            doing: Doing::Rests,
            moved_m: Expected {
                mean: 0.0,
                low: -2e-4,
                high: 2e-4,
            },
            place_m: None,
            left_s: None,
        };
        assert_eq!(text(&rests), "predicted: rests, moved by 0 to 0 mm");
    }
}
