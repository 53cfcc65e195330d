//! Where a cell stands in the play of its drive.

use super::{CYCLE_S, effect, paper};
use crate::{Crawl, Mechanics, Physics};

const PLAY_M: f64 = 0.4e-3;
/// Load that has a cell at its flank well within an increment, with so little damping, N.
const PRESSED_N: f64 = 0.02;

/// The load has the cell against one flank or the other, and crosses twice in a cycle: in the cell's own step, and while others step.
#[test]
fn the_load_decides_which_flank_a_cell_stands_at() {
    let physics = Physics::of(paper(20.0)).with([&effect("backlash", &[PLAY_M, 1.0])]);
    let mechanics = Mechanics::new(&physics);
    let mut crawl = Crawl::at_rest(&mechanics, 0.0, &[0.12, 0.08, 0.04, 0.0], None).expect("it holds");
    let mut crossings = [0; 4];
    let mut flank = [0.0; 4];
    let parts = 4000;
    for part in 1..=2 * parts {
        let phase = f64::from(part) / f64::from(parts);
        crawl
            .advance_to(&mechanics, phase, CYCLE_S / f64::from(parts))
            .expect("it holds");
        for cell in 0..4 {
            let load_n = crawl.contact_force_n(cell) + mechanics.standing_n[cell];
            let behind_m = crawl.cell[cell].behind_m;
            assert!(
                behind_m.abs() <= 0.5 * PLAY_M,
                "cell {cell} is {behind_m} m from the middle"
            );
            if behind_m.abs() < 0.5 * PLAY_M {
                continue;
            }
            if load_n.abs() > PRESSED_N {
                assert_eq!(behind_m.signum(), load_n.signum(), "cell {cell} at phase {phase}");
            }
            // In the second cycle.
            crossings[cell] += i32::from(part > parts && flank[cell] * behind_m < 0.0);
            flank[cell] = behind_m;
        }
    }
    assert_eq!(crossings, [2; 4]);
}

/// Without play a cell keeps its place in the drive, whatever its damping there would be.
#[test]
fn no_play_is_the_rigid_drive() {
    let positions_m = |damping_n_s_per_m: f64| {
        let physics = Physics::of(paper(20.0)).with([&effect("backlash", &[0.0, damping_n_s_per_m])]);
        let mechanics = Mechanics::new(&physics);
        let mut crawl = Crawl::at_rest(&mechanics, 0.0, &[0.12, 0.08, 0.04, 0.0], None).expect("it holds");
        crawl.advance_to(&mechanics, 1.7, 1.7 * CYCLE_S).expect("it holds");
        crawl.positions_m().to_vec()
    };
    assert_eq!(positions_m(1.0), positions_m(300.0));
}
