use std::fmt::Write as _;

use serde::{Serialize, Serializer};

/// One cell of a table.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    /// nothing to be said
    Empty,
    /// words
    Text(String),
    /// a number and the decimals it is shown with
    Number(f64, usize),
    /// a mean, its standard deviation, and the decimals both are shown with
    Spread(f64, f64, usize),
}

impl Cell {
    /// Words.
    pub fn text(words: impl Into<String>) -> Self {
        Self::Text(words.into())
    }

    /// A number, or nothing.
    pub fn maybe(value: Option<f64>, decimals: usize) -> Self {
        value.map_or(Self::Empty, |v| Self::Number(v, decimals))
    }

    /// As it is shown.
    pub fn shown(&self) -> String {
        match self {
            Self::Empty => String::new(),
            Self::Text(text) => text.clone(),
            Self::Number(value, decimals) => format!("{value:.decimals$}"),
            Self::Spread(mean, sd, decimals) => format!("{mean:.decimals$} ({sd:.decimals$})"),
        }
    }
}

impl Serialize for Cell {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Empty => serializer.serialize_none(),
            Self::Text(text) => serializer.serialize_str(text),
            Self::Number(value, _) => serializer.serialize_f64(*value),
            Self::Spread(mean, sd, _) => [mean, sd].serialize(serializer),
        }
    }
}

/// A table: what it is, how to read it, and its cells.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Table {
    /// what it shows
    pub title: String,
    /// the protocol, and what else must be known to read it
    pub note: String,
    /// names of the columns
    pub columns: Vec<String>,
    /// how many of the first columns are words
    pub text_columns: usize,
    /// the cells; every row is as long as `columns`
    pub rows: Vec<Vec<Cell>>,
}

impl Table {
    /// An empty table whose first `text_columns` columns are words, the others numbers.
    pub fn new<S: Into<String>>(
        title: impl Into<String>,
        note: impl Into<String>,
        text_columns: usize,
        columns: impl IntoIterator<Item = S>,
    ) -> Self {
        let columns = columns.into_iter().map(Into::into).collect();
        Self { title: title.into(), note: note.into(), columns, text_columns, rows: Vec::new() }
    }

    /// Adds a row; what is missing at its end is empty.
    pub fn push(&mut self, mut row: Vec<Cell>) {
        row.resize(self.columns.len(), Cell::Empty);
        self.rows.push(row);
    }

    /// Columns and rows as aligned text, without title and note.
    pub fn text(&self) -> String {
        let shown: Vec<Vec<String>> = std::iter::once(self.columns.clone())
            .chain(self.rows.iter().map(|row| row.iter().map(Cell::shown).collect()))
            .collect();
        let width = |column: usize| shown.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
        let widths: Vec<usize> = (0..self.columns.len()).map(width).collect();
        let mut out = String::new();
        for row in &shown {
            let mut line = String::new();
            for (column, (cell, &width)) in row.iter().zip(&widths).enumerate() {
                let _ = if column < self.text_columns {
                    write!(line, "{cell:<width$}  ")
                } else {
                    write!(line, "{cell:>width$}  ")
                };
            }
            let _ = writeln!(out, "{}", line.trim_end());
        }
        out
    }

    /// Title, note and cells as Markdown.
    pub fn markdown(&self) -> String {
        let escape = |text: &str| text.replace('\\', "\\\\").replace('|', "\\|").replace(['\n', '\r'], " ");
        let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
        let mut out = format!("### {}\n\n", escape(&self.title));
        if !self.note.is_empty() {
            let _ = write!(out, "{}\n\n", escape(&self.note));
        }
        out += &line(self.columns.iter().map(|c| escape(c)).collect());
        let rule = |column| if column < self.text_columns { "---" } else { "---:" }.to_owned();
        out += &line((0..self.columns.len()).map(rule).collect());
        for row in &self.rows {
            out += &line(row.iter().map(|cell| escape(&cell.shown())).collect());
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        let mut table = Table::new("Errors | all", "trial-out", 1, ["method", "RMS", "paper"]);
        table.push(vec![Cell::text("a|b"), Cell::Spread(1.25, 0.5, 1), Cell::Number(2.0, 2)]);
        table.push(vec![Cell::text("nearest"), Cell::maybe(None, 2)]);
        table
    }

    #[test]
    fn text_is_aligned_and_rows_are_filled_up() {
        assert_eq!(table().text(), "method         RMS  paper\na|b      1.2 (0.5)   2.00\nnearest\n");
    }

    #[test]
    fn markdown_keeps_bars_inside_their_cells() {
        assert_eq!(
            table().markdown(),
            "### Errors \\| all\n\ntrial-out\n\n| method | RMS | paper |\n| --- | ---: | ---: |\n\
             | a\\|b | 1.2 (0.5) | 2.00 |\n| nearest |  |  |\n"
        );
    }

    #[test]
    fn json_has_the_numbers_unrounded() {
        let json = serde_json::to_value(table()).unwrap();
        assert_eq!(json["rows"][0], serde_json::json!(["a|b", [1.25, 0.5], 2.0]));
        assert_eq!(json["rows"][1], serde_json::json!(["nearest", null, null]));
    }
}
