//! What can be told of positions before the gait is known: their noise, their outliers, and where there are any.

use super::running_median::running_median;

/// Samples of the running median that outliers are told by.
const MEDIAN_SAMPLES: usize = 5;
/// Distance from the running median, in standard deviations of the noise, that makes an outlier, besides what a corner of the
/// path may show: this share of the stroke.
const OUTLIER: (f64, f64) = (8.0, 0.06);

/// Standard deviation of the noise on one position, m, by second differences: robust against everything that moves smoothly.
pub(crate) fn noise_by_differences(measured_m: &[Vec<f64>]) -> f64 {
    let mut sizes: Vec<f64> = measured_m
        .iter()
        .flat_map(|series| {
            series
                .windows(3)
                .map(|three| (three[0] - 2.0 * three[1] + three[2]).abs())
        })
        .filter(|size| size.is_finite())
        .collect();
    if sizes.is_empty() {
        return 0.0;
    }
    let middle = sizes.len() / 2;
    let (_, median, _) = sizes.select_nth_unstable_by(middle, f64::total_cmp);
    // Of a normal distribution, half lies within 0.6745 standard deviations; the second difference has variance 6.
    *median / (0.674_489_75 * 6f64.sqrt())
}

/// Replaces outliers by `NaN`; how many there were.
pub(crate) fn leave_out_outliers(series: &mut [f64], filled: &[f64], noise_m: f64) -> usize {
    let seen: Vec<usize> = (0..series.len()).filter(|&sample| filled[sample].is_finite()).collect();
    let values: Vec<f64> = seen.iter().map(|&sample| filled[sample]).collect();
    if values.is_empty() {
        return 0;
    }
    let mut middle = running_median(&values, MEDIAN_SAMPLES);
    // At the ends the window shrinks to the value itself, which would never be found out: the whole window nearest judges it.
    let half = MEDIAN_SAMPLES / 2;
    if values.len() >= MEDIAN_SAMPLES {
        let last = middle.len() - 1 - half;
        let (first_m, last_m) = (middle[half], middle[last]);
        middle[..half].fill(first_m);
        middle[last + 1..].fill(last_m);
    }
    let reach = |shift: usize| {
        let mut sizes: Vec<f64> = middle
            .windows(shift + 1)
            .map(|pair| (pair[shift] - pair[0]).abs())
            .collect();
        sizes.sort_by(f64::total_cmp);
        sizes
            .get((sizes.len().saturating_sub(1) as f64 * 0.98) as usize)
            .copied()
            .unwrap_or(0.0)
    };
    // At a corner the running median cuts by what the cell moves in half its window.
    let allowed_m = OUTLIER.0 * noise_m + reach(MEDIAN_SAMPLES / 2) + OUTLIER.1 * reach(1);
    let mut outliers = 0;
    for (&sample, middle_m) in seen.iter().zip(middle) {
        if (series[sample] - middle_m).abs() > allowed_m {
            series[sample] = f64::NAN;
            outliers += 1;
        }
    }
    outliers
}

/// The samples between the first and the last in which every filled series has a value.
pub(crate) fn usable_range(filled_m: &[Vec<f64>]) -> std::ops::Range<usize> {
    let whole = |sample: &usize| filled_m.iter().all(|series| series[*sample].is_finite());
    let samples = filled_m[0].len();
    let first = (0..samples).find(whole).unwrap_or(0);
    let last = (0..samples).rev().find(whole).unwrap_or(samples - 1);
    first..last + 1
}
