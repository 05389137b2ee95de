//! Tables of what the errors do not say: stated uncertainty and feet.

use super::{
    axes::{Axes, Axis},
    note,
    table::{Cell, Table},
};
use crate::{DofGroup, Row, WITHIN_ONE, WITHIN_TWO, summary::ALL};

const FREE: [Axis; 3] = [Axis::Points, Axis::Variant, Axis::Gap];

fn head(row: &Row) -> Vec<Cell> {
    let mut variant = Axis::Variant.value(&row.case);
    if row.case.occlusion.is_some() {
        variant = format!("{variant}, hidden {}", Axis::Gap.value(&row.case));
    }
    vec![
        Cell::text(row.case.method.to_string()),
        Cell::text(row.case.points.to_string()),
        Cell::Text(variant),
    ]
}

/// Shares of truths within one and two stated standard deviations, per cent; `None` if none were stated.
pub fn calibration(rows: &[Row], axes: &Axes) -> Option<Table> {
    let stated: Vec<&Row> = rows
        .iter()
        .filter(|r| r.action == ALL && r.calibration.is_some() && axes.is_beside(&r.case, &FREE))
        .collect();
    if stated.is_empty() {
        return None;
    }
    let text = format!(
        "{}{} Per cent of the true coordinates that lie within one and two of the standard deviations stated for them, over \
         coordinates and frames. Errors as large as stated give {:.1} and {:.1} %; higher means that the stated ones are too large.",
        note(rows),
        axes.held(&FREE),
        100.0 * WITHIN_ONE,
        100.0 * WITHIN_TWO
    );
    let columns =
        ["method", "points", "variant", "coordinates", "within 1 sd, %", "within 2 sd, %", "compared"];
    let mut table = Table::new("Stated uncertainty", text, 4, columns);
    for row in stated {
        let Some(calibration) = row.calibration else { continue };
        let groups = DofGroup::ALL.iter().map(|group| group.name()).zip(calibration.groups);
        let all = [("all joint angles", calibration.joint_angles())];
        for (name, count) in all.into_iter().chain(groups).filter(|(_, count)| count.total > 0) {
            let mut cells = head(row);
            cells.extend([
                Cell::text(name),
                Cell::Number(100.0 * count.share_within_one(), 1),
                Cell::Number(100.0 * count.share_within_two(), 1),
                Cell::Number(count.total as f64, 0),
            ]);
            table.push(cells);
        }
    }
    Some(table)
}

/// Foot slide; `None` where no foot was found or none stands.
pub fn foot_slide(rows: &[Row], axes: &Axes) -> Option<Table> {
    let standing = |r: &&Row| r.foot_slide.is_some_and(|slide| slide.contact_frames > 0);
    let chosen: Vec<&Row> =
        rows.iter().filter(|r| r.action == ALL && axes.is_beside(&r.case, &FREE)).filter(standing).collect();
    if chosen.is_empty() {
        return None;
    }
    let text = format!(
        "{}{} Mean horizontal speed of the ball of a standing foot, cm/s. A foot stands while it is low and slow in the true \
         motion; in the last columns, while it is in the result.",
        note(rows),
        axes.held(&FREE)
    );
    let columns = [
        "method",
        "points",
        "variant",
        "truth cm/s",
        "result cm/s",
        "frames",
        "by the result's own contacts cm/s",
        "own frames",
    ];
    let mut table = Table::new("Foot slide", text, 3, columns);
    for row in chosen {
        let Some(slide) = row.foot_slide else { continue };
        let mut cells = head(row);
        cells.extend([
            Cell::Number(slide.truth_cm_s, 1),
            Cell::Number(slide.found_cm_s, 1),
            Cell::Number(slide.contact_frames as f64, 0),
            Cell::Number(slide.own_cm_s, 1),
            Cell::Number(slide.own_contact_frames as f64, 0),
        ]);
        table.push(cells);
    }
    Some(table)
}
