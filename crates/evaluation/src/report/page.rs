//! The page around tables and plots.

use std::fmt::Write as _;

use crate::tables::{Cell, Table};

/// What a report is about.
#[derive(Debug, Clone)]
pub struct About {
    /// the page's title
    pub title: String,
    /// in a sentence or two: what was done
    pub introduction: String,
    /// what must be known, as name and value
    pub facts: Vec<(String, String)>,
    /// the command that made it
    pub command: String,
    /// the parameters, as name and value
    pub parameters: Vec<(String, String)>,
    /// what the reader must not overlook; empty if nothing
    pub warning: String,
}

/// Text as HTML.
pub fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            // Not allowed in a document, and nothing to be seen.
            c if c.is_control() && !c.is_whitespace() => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

/// The whole document: `sections` are HTML.
pub fn page(about: &About, sections: &[String]) -> String {
    let mut out = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n<title>{title}</title>\n\
         <style>\n{style}</style>\n</head>\n<body>\n<h1>{title}</h1>\n<p>{introduction}</p>\n",
        title = escaped(&about.title),
        style = include_str!("style.css"),
        introduction = escaped(&about.introduction),
    );
    if !about.warning.is_empty() {
        let _ = writeln!(out, "<p class=\"warning\">{}</p>", escaped(&about.warning));
    }
    out += &definitions(&about.facts);
    sections.iter().for_each(|section| out.push_str(section));
    let _ = write!(
        out,
        "<h2>How it was made</h2>\n<pre>{}</pre>\n<details><summary>All parameters</summary>\n{}</details>\n",
        escaped(&about.command),
        definitions(&about.parameters)
    );
    out += "</body>\n</html>\n";
    out
}

fn definitions(list: &[(String, String)]) -> String {
    let mut out = String::from("<dl>\n");
    for (name, value) in list {
        let _ = writeln!(out, "<dt>{}</dt><dd>{}</dd>", escaped(name), escaped(value));
    }
    out + "</dl>\n"
}

/// A part of the page under its own heading; `body` is HTML.
pub fn section(title: &str, note: &str, body: &str) -> String {
    let note =
        if note.is_empty() { String::new() } else { format!("<p class=\"note\">{}</p>\n", escaped(note)) };
    format!("<h2>{}</h2>\n{note}{body}", escaped(title))
}

/// A table under its title.
pub fn table_section(table: &Table) -> String {
    section(&table.title, &table.note, &table_html(table, &[]))
}

/// The table's cells, and after each row the HTML of `extra`, if there is any.
pub fn table_html(table: &Table, extra: &[String]) -> String {
    let class = |column: usize| if column < table.text_columns { " class=\"words\"" } else { "" };
    let mut out = String::from("<div class=\"scroll\"><table>\n<tr>");
    for (i, column) in table.columns.iter().enumerate() {
        let _ = write!(out, "<th{}>{}</th>", class(i), escaped(column));
    }
    if !extra.is_empty() {
        out += "<th></th>";
    }
    out += "</tr>\n";
    for (r, row) in table.rows.iter().enumerate() {
        let words = || row[..table.text_columns.min(row.len())].iter();
        let says = |text: &str| words().any(|c| matches!(c, Cell::Text(t) if t.starts_with(text)));
        let kind = match () {
            () if says("paper") => " class=\"paper\"",
            () if words().any(|c| matches!(c, Cell::Text(t) if t == "all")) => " class=\"all\"",
            () => "",
        };
        let _ = write!(out, "<tr{kind}>");
        for (i, cell) in row.iter().enumerate() {
            let _ = write!(out, "<td{}>{}</td>", class(i), escaped(&cell.shown()));
        }
        if let Some(html) = extra.get(r) {
            let _ = write!(out, "<td>{html}</td>");
        }
        out += "</tr>\n";
    }
    out + "</table></div>\n"
}
