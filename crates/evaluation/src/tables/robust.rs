//! Tables of what else was varied: parameters, noise, gaps.

use super::{
    axes::{Axes, Axis},
    note,
    table::{Cell, Table},
};
use crate::{Row, summary::ALL};

fn head(row: &Row, axis: Axis) -> Vec<Cell> {
    vec![
        Cell::text(row.case.method.to_string()),
        Cell::text(row.case.points.to_string()),
        Cell::Text(axis.value(&row.case)),
    ]
}

/// Parameters set otherwise, and the change of the RMS.
pub fn variants(rows: &[Row], axes: &Axes) -> Table {
    let free = [Axis::Variant, Axis::Points];
    let columns = [
        "method",
        "points",
        "variant",
        "RMS deg",
        "change",
        "MAE deg",
        "geod deg",
        "MPJPE cm",
        "aligned cm",
        "frames/s",
    ];
    let mut table = Table::new("Parameters compared", note(rows) + &axes.held(&free), 3, columns);
    let chosen: Vec<&Row> =
        rows.iter().filter(|r| r.action == ALL && axes.is_beside(&r.case, &free)).collect();
    for row in &chosen {
        let is_given = |r: &&&Row| {
            r.case.method == row.case.method && r.case.points == row.case.points && r.case.variant.is_empty()
        };
        let change = chosen.iter().find(is_given).filter(|_| !row.case.variant.is_empty());
        let mut cells = head(row, Axis::Variant);
        cells.extend([
            Cell::Spread(row.rms_deg, row.rms_deg_std, 2),
            Cell::maybe(change.map(|given| row.rms_deg - given.rms_deg), 2),
            Cell::Number(row.mae_deg, 2),
            Cell::Number(row.geodesic_deg, 2),
            Cell::Number(row.mpjpe_cm, 2),
            Cell::Number(row.mpjpe_aligned_cm, 2),
            Cell::Number(row.frames_per_second, 0),
        ]);
        table.push(cells);
    }
    table
}

/// Noise on the control points.
pub fn noise(rows: &[Row], axes: &Axes) -> Table {
    let free = [Axis::Noise, Axis::Points, Axis::Variant];
    let text =
        note(rows) + &axes.held(&free) + " Gaussian noise on every coordinate of every point and frame.";
    let columns =
        ["method", "points", "noise", "variant", "RMS deg", "MAE deg", "geod deg", "MPJPE cm", "aligned cm"];
    let mut table = Table::new("Noise", text, 4, columns);
    for row in rows.iter().filter(|r| r.action == ALL && axes.is_beside(&r.case, &free)) {
        let mut cells = head(row, Axis::Noise);
        cells.extend([
            Cell::Text(Axis::Variant.value(&row.case)),
            Cell::Spread(row.rms_deg, row.rms_deg_std, 2),
            Cell::Number(row.mae_deg, 2),
            Cell::Number(row.geodesic_deg, 2),
            Cell::Number(row.mpjpe_cm, 2),
            Cell::Number(row.mpjpe_aligned_cm, 2),
        ]);
        table.push(cells);
    }
    table
}

/// Gaps in the measurement; `None` without any.
pub fn gaps(rows: &[Row]) -> Option<Table> {
    let with_gaps: Vec<&Row> = rows.iter().filter(|r| r.action == ALL && r.gap.is_some()).collect();
    let row = with_gaps.first()?;
    let text = format!(
        "Protocol {}. In brackets: the same frames of the same trials with nothing hidden. After: the half second after the \
         gap. Recovered: from then on at most a quarter and half a degree worse than without the gap for a tenth of a second; \
         the time is the median over the trials that did. Trials shorter than the gap and a second are left out.",
        row.protocol
    );
    let columns = [
        "method",
        "points",
        "hidden",
        "variant",
        "inside deg",
        "inside cm",
        "after deg",
        "trials",
        "recovered",
        "after s",
    ];
    let mut table = Table::new("Points hidden for a while", text, 4, columns);
    for row in with_gaps {
        let Some(gap) = row.gap else { continue };
        let mean = gap.mean;
        let mut cells = head(row, Axis::Gap);
        let noise =
            if row.case.noise_mm > 0.0 { format!(", noise {} mm", row.case.noise_mm) } else { String::new() };
        cells.extend([
            Cell::Text(Axis::Variant.value(&row.case) + &noise),
            Cell::Spread(mean.inside_deg, mean.inside_undisturbed_deg, 2),
            Cell::Spread(mean.inside_cm, mean.inside_undisturbed_cm, 2),
            Cell::Spread(mean.after_deg, mean.after_undisturbed_deg, 2),
            Cell::Number(gap.trials as f64, 0),
            Cell::Number(gap.recovered as f64, 0),
            Cell::maybe(mean.recovery_s, 2),
        ]);
        table.push(cells);
    }
    Some(table)
}
