//! A simulated worm as motion capture sees it: somewhere in a laboratory, markers aside of the cells, in no order.

use std::fmt::Write;
use worm_analysis::recording::Recording;

/// How the canal lies in the laboratory.
#[derive(Debug, Clone, Copy)]
pub struct Laboratory {
    /// Up the canal, of length 1.
    pub axis: [f64; 3],
    /// Across the canal, of length 1.
    pub across: [f64; 3],
}

impl Laboratory {
    pub const fn along_x() -> Self {
        Self {
            axis: [1.0, 0.0, 0.0],
            across: [0.0, 1.0, 0.0],
        }
    }

    /// Rotated by two angles, rad.
    pub fn askew(turn: f64, tilt: f64) -> Self {
        Self {
            axis: [tilt.cos() * turn.cos(), tilt.cos() * turn.sin(), tilt.sin()],
            across: [-turn.sin(), turn.cos(), 0.0],
        }
    }

    /// Where the marker of a cell is, m.
    pub fn place(&self, cell: usize, along_m: f64) -> [f64; 3] {
        let aside_m = 0.003 * ((cell * 5) % 7) as f64 - 0.01;
        let corner_m = [0.3, -0.12, 0.04];
        std::array::from_fn(|axis| corner_m[axis] + along_m * self.axis[axis] + aside_m * self.across[axis])
    }
}

/// Cells in the order in which their markers are listed: one that follows no rule.
pub const LISTED: [usize; 4] = [2, 0, 3, 1];

/// What a Vicon file looks like.
#[derive(Debug, Clone, Copy)]
pub struct Style {
    pub unit: &'static str,
    pub per_metre: f64,
    pub semicolons: bool,
    pub other_sections: bool,
}

pub const PLAIN: Style = Style {
    unit: "mm",
    per_metre: 1e3,
    semicolons: false,
    other_sections: false,
};

/// A recording of four cells at 60 Hz as Vicon Nexus would export it, with a marker on the wall and one that was never seen.
pub fn as_vicon(recording: &Recording, laboratory: Laboratory, style: Style) -> String {
    let mut text = String::new();
    if style.other_sections {
        text.push_str("Devices\n1200\n,,Force\nFrame,Sub Frame,Fx\n,,N\n1,0,0.5\n1,1,0.5\n\n");
    }
    text.push_str("Trajectories\n60\n,");
    for cell in LISTED {
        write!(text, ",Worm:c{},,", cell + 1).expect("a string");
    }
    text.push_str(",Wall,,,Lost,,\nFrame,Sub Frame");
    text.push_str(&",X,Y,Z".repeat(6));
    text.push_str("\n,");
    text.push_str(&format!(",{0},{0},{0}", style.unit).repeat(6));
    text.push('\n');
    for sample in 0..recording.samples() {
        write!(text, "{},0", sample + 101).expect("a string");
        for cell in LISTED {
            let along_m = recording.position_m[cell][sample];
            for part_m in laboratory.place(cell, along_m) {
                if along_m.is_nan() {
                    text.push(',');
                } else {
                    write!(text, ",{}", part_m * style.per_metre).expect("a string");
                }
            }
        }
        writeln!(text, ",1.5,2.5,3.5,,,").expect("a string");
    }
    if style.semicolons {
        text = text.replace(',', ";").replace('.', ",");
    }
    if style.other_sections {
        text.push_str("\nModel Outputs\n60\n,,Angle\nFrame,Sub Frame,X\n,,deg\n1,0,3\n");
    }
    text
}
