//! Tables of what is known of scans: comma-separated, the first line names the columns.

use std::collections::HashMap;

use formats::archive::Entry;

use crate::{Error, Result, Sex, Subject};

/// Most rows of a table.
const MAX_ROWS: usize = 100_000;

/// A table as text.
pub(crate) struct Table {
    columns: HashMap<String, usize>,
    rows: Vec<Vec<String>>,
    file: String,
}

impl Table {
    /// Reads a table; every row has as many cells as the first line.
    pub fn read(entry: &Entry) -> Result<Self> {
        let text = std::str::from_utf8(&entry.bytes)
            .map_err(|_| Error::content(&entry.name, "bytes that are not text", "comma-separated text"))?;
        let cells = |line: &str| -> Vec<String> {
            line.split(',').map(|cell| cell.trim().trim_matches('"').to_owned()).collect()
        };
        let mut lines = text.trim_start_matches('\u{feff}').lines().filter(|line| !line.trim().is_empty());
        let names = cells(lines.next().unwrap_or_default());
        let mut rows = Vec::new();
        for line in lines {
            let row = cells(line);
            if row.len() != names.len() || rows.len() == MAX_ROWS {
                let found = format!("row {} with {} cells", rows.len() + 1, row.len());
                let expected = format!("{} cells as in the first line, at most {MAX_ROWS} rows", names.len());
                return Err(Error::content(&entry.name, found, expected));
            }
            rows.push(row);
        }
        let columns =
            names.into_iter().enumerate().map(|(index, name)| (name.to_lowercase(), index)).collect();
        Ok(Self { columns, rows, file: entry.name.clone() })
    }

    pub fn rows(&self) -> impl Iterator<Item = Row<'_>> {
        self.rows.iter().map(|cells| Row { table: self, cells })
    }
}

/// A row of a table.
#[derive(Clone, Copy)]
pub(crate) struct Row<'a> {
    table: &'a Table,
    cells: &'a [String],
}

impl<'a> Row<'a> {
    /// A cell by the name of its column; empty where the table has no such column.
    pub fn get(&self, column: &str) -> &'a str {
        self.table.columns.get(column).map_or("", |&index| &self.cells[index])
    }

    /// A number; `None` where the cell is empty.
    pub fn number<T: std::str::FromStr>(&self, column: &str) -> Result<Option<T>> {
        match self.get(column) {
            "" => Ok(None),
            text => text.parse().map(Some).map_err(|_| {
                Error::content(&self.table.file, format!("{text:?} in column {column}"), "a number")
            }),
        }
    }

    /// What is said of a person.
    pub fn subject(&self) -> Result<Subject> {
        let sex = match self.get("sex").to_lowercase().as_str() {
            "" => None,
            "female" | "f" | "woman" => Some(Sex::Female),
            "male" | "m" | "man" => Some(Sex::Male),
            other => {
                return Err(Error::content(
                    &self.table.file,
                    format!("{other:?} in column sex"),
                    "male or female",
                ));
            }
        };
        Ok(Subject { sex, age_years: self.number("age_years")? })
    }
}

/// People by name, from `subjects.csv`.
pub(crate) fn subjects(table: Option<&Entry>) -> Result<HashMap<String, Subject>> {
    let Some(entry) = table else { return Ok(HashMap::new()) };
    let table = Table::read(entry)?;
    table.rows().map(|row| Ok((row.get("subject").to_owned(), row.subject()?))).collect()
}
