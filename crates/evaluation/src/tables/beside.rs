//! Tables laid out as the papers' own, with the papers' rows in them.

use model::counted;

use super::{
    axes::{Axes, Axis},
    note, papers,
    table::{Cell, Table},
};
use crate::{Case, Row, summary::ALL};

const PAPERS: &str = " The papers: local regression and its baselines as printed by Mousas et al. (2014) and Liu et al. \
                      (docs/papers.md), trial out, on their own choice of CMU trials; they do not say whether RMS or mean absolute.";

/// A line for each measure of a group of rows, a column for each value on an axis.
struct Grid<'a> {
    rows: Vec<&'a Row>,
    axis: Axis,
    columns: Vec<&'a Case>,
}

impl<'a> Grid<'a> {
    fn new(rows: &'a [Row], axes: &Axes, free: &[Axis], axis: Axis) -> Self {
        let rows: Vec<&Row> =
            rows.iter().filter(|r| r.action == ALL && axes.is_beside(&r.case, free)).collect();
        let mut columns: Vec<&Case> = Vec::new();
        for row in &rows {
            if !columns.iter().any(|c| axis.value(c) == axis.value(&row.case)) {
                columns.push(&row.case);
            }
        }
        Self { rows, axis, columns }
    }

    /// The methods and numbers of points that there are, in order.
    fn groups(&self, by_points: bool) -> Vec<&'a Case> {
        let mut groups: Vec<&Case> = Vec::new();
        for row in &self.rows {
            let is_same =
                |c: &&Case| c.method == row.case.method && (!by_points || c.points == row.case.points);
            if !groups.iter().any(is_same) {
                groups.push(&row.case);
            }
        }
        groups
    }

    /// The cells of one line: `value` of the row in each column.
    fn line(&self, group: &Case, by_points: bool, value: impl Fn(&Row) -> Cell) -> Vec<Cell> {
        let cell = |column: &&Case| {
            let row = self.rows.iter().find(|r| {
                r.case.method == group.method
                    && (!by_points || r.case.points == group.points)
                    && self.axis.value(&r.case) == self.axis.value(column)
            });
            row.map_or(Cell::Empty, |r| value(r))
        };
        self.columns.iter().map(cell).collect()
    }
}

/// Mousas et al., table 1: methods by numbers of control points.
pub fn points(rows: &[Row], axes: &Axes, beside_papers: bool) -> Table {
    let grid = Grid::new(rows, axes, &[Axis::Points], Axis::Points);
    let mut columns = vec!["method".to_owned(), "error, degrees".to_owned()];
    columns.extend(grid.columns.iter().map(|c| counted(c.points, "point")));
    let title =
        if beside_papers { "Control points, beside table 1 of Mousas et al." } else { "Control points" };
    let papers = if beside_papers { PAPERS } else { "" };
    let mut table = Table::new(title, note(rows) + &axes.held(&[Axis::Points]) + papers, 2, columns);
    for group in grid.groups(false) {
        let method = group.method.to_string();
        let head = |what: &str| vec![Cell::text(method.clone()), Cell::text(what)];
        table.push([head("RMS"), grid.line(group, false, |r| Cell::Number(r.rms_deg, 2))].concat());
        table.push([head("mean absolute"), grid.line(group, false, |r| Cell::Number(r.mae_deg, 2))].concat());
        let paper_cell = |case: &&Case| Cell::maybe(papers::for_points(&method, case.points), 2);
        if beside_papers && papers::METHODS.contains(&method.as_str()) {
            table.push([head("paper"), grid.columns.iter().map(paper_cell).collect()].concat());
        }
    }
    table
}

/// Liu et al., table 1: windows.
pub fn windows(rows: &[Row], axes: &Axes, beside_papers: bool) -> Table {
    let free = [Axis::Window, Axis::Points];
    let grid = Grid::new(rows, axes, &free, Axis::Window);
    let mut columns = vec!["method".to_owned(), "points".to_owned(), "measure".to_owned()];
    columns.extend(grid.columns.iter().map(|c| format!("m = {}", c.window)));
    let title = if beside_papers { "Window length, beside table 1 of Liu et al." } else { "Window length" };
    let papers = if beside_papers { PAPERS } else { "" };
    let mut table = Table::new(title, note(rows) + &axes.held(&free) + papers, 3, columns);
    for group in grid.groups(true) {
        let method = group.method.to_string();
        let head = |what: &str| {
            vec![Cell::text(method.clone()), Cell::text(group.points.to_string()), Cell::text(what)]
        };
        table.push([head("RMS, degrees"), grid.line(group, true, |r| Cell::Number(r.rms_deg, 2))].concat());
        let mae = grid.line(group, true, |r| Cell::Number(r.mae_deg, 2));
        table.push([head("mean absolute, degrees"), mae].concat());
        let speed = grid.line(group, true, |r| Cell::Number(r.frames_per_second, 0));
        table.push([head("frames/s"), speed].concat());
        if beside_papers && method == papers::METHODS[3] {
            let paper_cell = |decimals, value: fn((f64, f64)) -> f64| {
                let cell =
                    |c: &&Case| Cell::maybe(papers::for_window(&method, c.window).map(value), decimals);
                grid.columns.iter().map(cell).collect()
            };
            table.push([head("paper, degrees"), paper_cell(2, |(error, _)| error)].concat());
            table.push([head("paper, frames/s"), paper_cell(0, |(_, speed)| speed)].concat());
        }
    }
    table
}

/// Table 2 of Mousas et al. and of Liu et al.: sizes of the database.
pub fn databases(rows: &[Row], axes: &Axes, beside_papers: bool) -> Table {
    let free = [Axis::Database, Axis::Points];
    let grid = Grid::new(rows, axes, &free, Axis::Database);
    let mut columns = vec!["method".to_owned(), "points".to_owned(), "measure".to_owned()];
    columns.extend(grid.columns.iter().map(|c| counted(c.database_poses, "pose")));
    let title = if beside_papers {
        "Database size, beside table 2 of Mousas et al. and Liu et al."
    } else {
        "Database size"
    };
    let mut text = note(rows) + &axes.held(&free);
    text +=
        " Databases are whole clips in an order mixed by their names; each holds all of the smaller ones.";
    if beside_papers {
        columns.extend(papers::DATABASES.iter().map(|(name, _)| format!("paper, {name}")));
        text += PAPERS;
    }
    let mut table = Table::new(title, text, 3, columns);
    for group in grid.groups(true) {
        let method = group.method.to_string();
        let head = |what: &str| {
            vec![Cell::text(method.clone()), Cell::text(group.points.to_string()), Cell::text(what)]
        };
        let mut rms = [head("RMS, degrees"), grid.line(group, true, |r| Cell::Number(r.rms_deg, 2))].concat();
        if beside_papers && group.points == 6 {
            let databases = 0..papers::DATABASES.len();
            rms.extend(databases.map(|i| Cell::maybe(papers::for_database(&method, i), 2)));
        }
        table.push(rms);
        let mae = grid.line(group, true, |r| Cell::Number(r.mae_deg, 2));
        table.push([head("mean absolute, degrees"), mae].concat());
        table.push([head("MPJPE, cm"), grid.line(group, true, |r| Cell::Number(r.mpjpe_cm, 2))].concat());
        let speed = grid.line(group, true, |r| Cell::Number(r.frames_per_second, 0));
        table.push([head("frames/s"), speed].concat());
    }
    table
}
