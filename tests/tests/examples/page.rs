//! The examples of a page as one shell script, line for line, so that a failing line has the page's own number.

use anyhow::{Context, Result, bail, ensure};

/// What stands above a block that the tests can't run, followed by the reason.
const NOT_RUN: &str = "<!-- not run by the tests: ";
/// What stands above a block that is a file, followed by its name.
const SAVED_AS: &str = "<!-- saved as ";
/// Blocks in these languages show what something looks like, and are not run.
const SHOWN: [&str; 6] = ["text", "json", "toml", "csv", "html", "xml"];

/// Examples taken from a page.
#[derive(Debug, PartialEq, Eq)]
pub struct Script {
    /// as many lines as the page has
    pub text: String,
    /// how many blocks are run
    pub num_blocks: usize,
    /// whether the page has a block in Python
    pub has_python: bool,
}

/// Turns a page into a script; without its blocks in Python where there is none.
///
/// # Errors
/// If a block is in a language that is neither run nor known as shown, a mark has no reason or no block, or a fence is open.
pub fn script(page: &str, python: bool) -> Result<Script> {
    let mut script = Script { text: String::new(), num_blocks: 0, has_python: false };
    let mut mark: Option<&str> = None;
    let mut open: Option<Block> = None;
    for (number, line) in (1..).zip(page.lines()) {
        let at = || format!("line {number}: {line}");
        let taken = match (&open, line.strip_prefix("```")) {
            (None, Some(language)) => {
                let mut block = Block::new(language.trim(), mark.take()).with_context(at)?;
                script.has_python |= matches!(block, Block::Python);
                if matches!(block, Block::Python) && !python {
                    block = Block::Left;
                }
                script.num_blocks += usize::from(matches!(block, Block::Shell | Block::Python));
                let first = block.first_line();
                open = Some(block);
                first
            }
            (Some(block), Some("")) => {
                let last = block.last_line();
                open = None;
                last
            }
            (Some(block), _) => if block.is_taken() { line } else { "" }.to_owned(),
            (None, None) => {
                let is_mark = line.starts_with(NOT_RUN) || line.starts_with(SAVED_AS);
                ensure!(mark.is_none() || line.is_empty(), "{}: a mark stands above no block", at());
                mark = if is_mark { Some(line) } else { mark };
                String::new()
            }
        };
        script.text.push_str(&taken);
        script.text.push('\n');
    }
    ensure!(open.is_none() && mark.is_none(), "a block or a mark is open at the end");
    Ok(script)
}

enum Block {
    Shell,
    Python,
    File(String),
    Left,
}

impl Block {
    fn new(language: &str, mark: Option<&str>) -> Result<Self> {
        let said = |prefix: &str| {
            let rest = mark?.strip_prefix(prefix)?.strip_suffix("-->")?.trim();
            (!rest.is_empty()).then(|| rest.to_owned())
        };
        if let Some(name) = said(SAVED_AS) {
            return Ok(Self::File(name));
        }
        if said(NOT_RUN).is_some() {
            return Ok(Self::Left);
        }
        ensure!(mark.is_none(), "the mark {mark:?} says nothing");
        match language {
            "sh" => Ok(Self::Shell),
            "python" => Ok(Self::Python),
            shown if SHOWN.contains(&shown) => Ok(Self::Left),
            _ => bail!("a block in {language:?} is neither run nor marked with {NOT_RUN:?} and a reason"),
        }
    }

    fn is_taken(&self) -> bool {
        !matches!(self, Self::Left)
    }

    fn first_line(&self) -> String {
        match self {
            Self::Shell | Self::Left => String::new(),
            Self::Python => "timeout 60 python3 - <<'END_OF_BLOCK'".to_owned(),
            Self::File(name) => format!("cat > '{name}' <<'END_OF_BLOCK'"),
        }
    }

    fn last_line(&self) -> String {
        match self {
            Self::Shell | Self::Left => String::new(),
            Self::Python | Self::File(_) => "END_OF_BLOCK".to_owned(),
        }
    }
}

#[test]
fn blocks_keep_their_lines_and_marked_ones_are_left_out() {
    let page = "# Page\n\n```sh\nmarey up\n```\n<!-- not run by the tests: needs docker -->\n\n```sh\ndocker\n```\n\
                <!-- saved as a.toml -->\n```toml\nx = 1\n```\n```json\n{}\n```\n";
    let found = script(page, true).unwrap();
    let expected =
        "\n\n\nmarey up\n\n\n\n\n\n\n\ncat > 'a.toml' <<'END_OF_BLOCK'\nx = 1\nEND_OF_BLOCK\n\n\n\n";
    assert_eq!(found, Script { text: expected.to_owned(), num_blocks: 1, has_python: false });
}

#[test]
fn blocks_in_python_are_left_out_where_there_is_none() {
    let page = "```python\nprint()\n```\n";
    assert_eq!(script(page, true).unwrap().num_blocks, 1);
    let without = script(page, false).unwrap();
    assert_eq!(without, Script { text: "\n\n\n".to_owned(), num_blocks: 0, has_python: true });
}

#[test]
fn blocks_that_are_neither_run_nor_marked_are_refused() {
    for (page, named) in [
        ("```rust\nf();\n```\n", "\"rust\""),
        ("```\n$ marey\n```\n", "\"\""),
        ("<!-- not run by the tests: -->\n```sh\nx\n```\n", "says nothing"),
        ("<!-- not run by the tests: it is long -->\ntext\n", "above no block"),
        ("```sh\nmarey up\n", "open at the end"),
    ] {
        let error = format!("{:#}", script(page, true).unwrap_err());
        assert!(error.contains(named), "{page}: {error}");
    }
}
