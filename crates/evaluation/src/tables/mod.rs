//! Rows as tables: what was measured, and beside it what the papers print.

mod axes;
mod beside;
mod body;
pub mod papers;
mod robust;
mod table;

pub use table::{Cell, Table};

use crate::{Case, Row, summary::ALL};
use axes::{Axes, Axis};
use model::counted;

/// All tables that the rows give, for reports. `beside_papers`: whether the motion was recorded, so that the papers' figures say something
/// beside it.
pub fn tables(rows: &[Row], beside_papers: bool) -> Vec<Table> {
    let Some(axes) = Axes::from_rows(rows) else { return Vec::new() };
    let mut tables = vec![errors_table(rows)];
    tables.extend(comparison_tables(rows, beside_papers));
    if beside_papers && !axes.varies(Axis::Points) {
        // One number of points is in the table of errors already: only beside the paper is there more to say.
        tables.insert(1, beside::points(rows, &axes, true));
    }
    tables
}

/// The case that others are set beside: most control points, the first method and parameters, windows of two frames if there are any, the
/// largest database, least noise, nothing hidden.
pub fn reference(rows: &[Row]) -> Option<Case> {
    Axes::from_rows(rows).map(|axes| axes.reference)
}

/// The tables that set cases beside one another and beside the papers, without the table of errors; none for a single case.
pub fn comparison_tables(rows: &[Row], beside_papers: bool) -> Vec<Table> {
    let Some(axes) = Axes::from_rows(rows) else { return Vec::new() };
    let mut tables = Vec::new();
    if axes.varies(Axis::Points) {
        tables.push(beside::points(rows, &axes, beside_papers));
    }
    if axes.varies(Axis::Window) {
        tables.push(beside::windows(rows, &axes, beside_papers));
    }
    if axes.varies(Axis::Database) {
        tables.push(beside::databases(rows, &axes, beside_papers));
    }
    if axes.varies(Axis::Variant) {
        tables.push(robust::variants(rows, &axes));
    }
    if axes.varies(Axis::Noise) {
        tables.push(robust::noise(rows, &axes));
    }
    tables.extend(robust::gaps(rows));
    tables.extend(body::calibration(rows, &axes));
    tables.extend(body::foot_slide(rows, &axes));
    tables
}

/// The rows as a table in plain text, with the standard deviation of the RMS alone.
pub fn table(rows: &[Row]) -> String {
    errors(rows, |mean, _, decimals| Cell::Number(mean, decimals)).text()
}

/// The rows as a table, every mean with its standard deviation over the trials.
pub fn errors_table(rows: &[Row]) -> Table {
    errors(rows, Cell::Spread)
}

fn errors(rows: &[Row], mean: fn(f64, f64, usize) -> Cell) -> Table {
    let axes = Axes::from_rows(rows);
    let varied: Vec<Axis> = [Axis::Window, Axis::Variant, Axis::Database, Axis::Noise, Axis::Gap]
        .into_iter()
        .filter(|axis| axes.as_ref().is_some_and(|axes| axes.varies(*axis)))
        .collect();
    let mut columns = vec!["method", "points"];
    columns.extend(varied.iter().map(|axis| axis.name()));
    columns.push("action");
    let text_columns = columns.len();
    columns.extend([
        "trials",
        "frames",
        "RMS deg (sd)",
        "MAE deg",
        "geod deg",
        "MPJPE cm",
        "aligned cm",
        "frames/s",
    ]);
    let mut table = Table::new("Errors by action", note(rows), text_columns, columns);
    for r in rows {
        let mut cells = vec![Cell::text(r.case.method.to_string()), Cell::text(r.case.points.to_string())];
        cells.extend(varied.iter().map(|axis| Cell::Text(axis.value(&r.case))));
        cells.push(Cell::text(r.action.clone()));
        cells.extend([
            Cell::Number(r.trials as f64, 0),
            Cell::Number(r.frames as f64, 0),
            Cell::Spread(r.rms_deg, r.rms_deg_std, 2),
            mean(r.mae_deg, r.mae_deg_std, 2),
            mean(r.geodesic_deg, r.geodesic_deg_std, 2),
            mean(r.mpjpe_cm, r.mpjpe_cm_std, 2),
            mean(r.mpjpe_aligned_cm, r.mpjpe_aligned_cm_std, 2),
            Cell::Number(r.frames_per_second, 0),
        ]);
        table.push(cells);
    }
    table
}

/// Protocol and numbers of trials and frames, as every table has them.
fn note(rows: &[Row]) -> String {
    let Some(row) = rows.iter().filter(|r| r.action == ALL).max_by_key(|r| r.trials) else {
        return String::new();
    };
    format!(
        "Protocol {}; {}, {}; means over trials (standard deviation over trials).",
        row.protocol,
        counted(row.trials, "trial"),
        counted(row.frames, "frame")
    )
}
