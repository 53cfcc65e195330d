//! Tables for the terminal.

/// One row: its name, then its figures.
pub(super) type Row = Vec<String>;

/// Rows with their columns under each other: words to the left, figures to the right.
pub(super) fn aligned(rows: &[Row]) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| {
        let widths = rows.iter().filter_map(|row| row.get(column));
        widths.map(|field| field.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let line = |row: &Row| {
        let mut line = String::new();
        for (column, (field, width)) in row.iter().zip(&widths).enumerate() {
            line += &match column {
                0 => format!("{field:<width$}"),
                _ => format!("  {field:>width$}"),
            };
        }
        line
    };
    rows.iter().map(line).collect::<Vec<_>>().join("\n")
}
