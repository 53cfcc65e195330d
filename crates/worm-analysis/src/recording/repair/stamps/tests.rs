//! Times that do not grow, and times that are missing.

use super::{increasing, missing};

fn even(samples: usize) -> Vec<f64> {
    (0..samples).map(|sample| sample as f64 / 100.0).collect()
}

#[test]
fn single_wrong_times_are_left_out_and_a_clock_set_back_is_not() {
    let mut time_s = even(400);
    assert!(increasing(&time_s).is_some_and(|kept| kept.iter().all(|kept| *kept)));
    time_s[50] = time_s[49]; // doubled
    time_s[200] = 9.0; // ahead of all
    time_s[300] = 0.5; // back
    let kept = increasing(&time_s).expect("three single ones");
    let left_out: Vec<usize> = (0..400).filter(|&sample| !kept[sample]).collect();
    assert_eq!(left_out.len(), 3);
    assert!(left_out.contains(&200) && left_out.contains(&300));
    assert!(left_out.contains(&50) || left_out.contains(&49));

    let mut back = even(400);
    back[200..].iter_mut().for_each(|time_s| *time_s -= 0.03);
    assert_eq!(increasing(&back), None, "a clock set back by three samples");
    let mut many = even(400);
    (10..400).step_by(40).for_each(|sample| many[sample] = many[sample - 1]);
    assert_eq!(increasing(&many), None, "ten of 400");
}

#[test]
fn missing_samples_are_counted_where_the_rate_is_even() {
    assert_eq!(missing(&even(100)), None);
    let mut holes = even(100);
    holes.drain(70..72);
    holes.remove(30);
    let found = missing(&holes).expect("holes");
    assert_eq!(found.samples, 3);
    assert!(
        (found.from_s - 0.29).abs() < 1e-9 && (found.to_s - 0.72).abs() < 1e-9,
        "{found:?}"
    );
    let uneven: Vec<f64> = (0..100)
        .map(|sample| f64::from(sample) + 0.4 * f64::from(sample % 3))
        .collect();
    assert_eq!(missing(&uneven), None, "no even rate");
}
