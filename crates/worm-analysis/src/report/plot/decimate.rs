//! Thins lines to what a picture can show.

use super::axis::Axis;

/// The parts of a line between its gaps; a gap is a point that cannot be drawn.
pub(super) fn pieces(points: impl IntoIterator<Item = (f64, f64)>) -> Vec<Vec<(f64, f64)>> {
    let mut pieces = Vec::new();
    let mut piece = Vec::new();
    for (x, y) in points {
        if Axis::is_drawable(x) && Axis::is_drawable(y) {
            piece.push((x, y));
        } else if !piece.is_empty() {
            pieces.push(std::mem::take(&mut piece));
        }
    }
    if !piece.is_empty() {
        pieces.push(piece);
    }
    pieces
}

/// The first, lowest, highest and last point in every column of a picture so many columns wide, in their order: the line
/// drawn through them is the one through all points. `piece` must grow in x.
pub(super) fn thinned(piece: &[(f64, f64)], x: &Axis, columns: usize) -> Vec<(f64, f64)> {
    let column = |point: &(f64, f64)| (x.fraction(point.0) * columns as f64).floor();
    let mut kept = Vec::new();
    for group in piece.chunk_by(|one, next| column(one) == column(next)) {
        let by_height = |one: &usize, other: &usize| group[*one].1.total_cmp(&group[*other].1);
        let lowest = (0..group.len()).min_by(by_height).unwrap_or(0);
        let highest = (0..group.len()).max_by(by_height).unwrap_or(0);
        let mut places = [0, lowest, highest, group.len() - 1];
        places.sort_unstable();
        let mut last_kept = None;
        for place in places {
            if last_kept != Some(place) {
                kept.push(group[place]);
            }
            last_kept = Some(place);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn gaps_split_a_line() {
        let y = [f64::NAN, 1.0, 2.0, f64::INFINITY, f64::NAN, 3.0];
        let pieces = pieces(y.iter().enumerate().map(|(x, y)| (x as f64, *y)));
        assert_eq!(pieces, [vec![(1.0, 1.0), (2.0, 2.0)], vec![(5.0, 3.0)]]);
    }

    proptest! {
        #[test]
        fn thinning_keeps_order_ends_and_extremes(y in prop::collection::vec(-1.0..1.0f64, 1..400), columns in 1usize..50) {
            let piece: Vec<(f64, f64)> = y.iter().enumerate().map(|(x, y)| (x as f64, *y)).collect();
            let axis = Axis::between(0.0, y.len() as f64, 5);
            let kept = thinned(&piece, &axis, columns);
            prop_assert!(kept.len() <= 4 * (columns + 1));
            prop_assert!(kept.is_sorted_by(|one, next| one.0 < next.0));
            prop_assert_eq!(kept.first(), piece.first());
            prop_assert_eq!(kept.last(), piece.last());
            let highest = |points: &[(f64, f64)]| points.iter().map(|point| point.1).fold(f64::MIN, f64::max);
            prop_assert_eq!(highest(&kept), highest(&piece));
        }
    }
}
