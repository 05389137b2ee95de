//! How far a long evaluation is: a bar on a terminal, a line now and then elsewhere.

use std::{
    io::IsTerminal,
    sync::Mutex,
    time::{Duration, Instant},
};

use indicatif::{ProgressBar, ProgressStyle};

/// Elsewhere than on a terminal a line comes no oftener than this.
const PAUSE: Duration = Duration::from_secs(5);

/// Counts what is done.
pub struct Progress {
    /// hidden elsewhere than on a terminal
    bar: ProgressBar,
    what: &'static str,
    lines: Option<Mutex<Lines>>,
}

impl Progress {
    /// Nothing of `total` is done; `what`: such as "trials".
    pub fn new(total: usize, what: &'static str) -> anyhow::Result<Self> {
        let style = ProgressStyle::with_template(&format!(
            "{{bar:30}} {{pos}}/{{len}} {what}  {{msg}}  {{eta}} left"
        ))?;
        let bar = ProgressBar::new(total as u64).with_style(style);
        bar.tick();
        let lines = (!std::io::stderr().is_terminal()).then(|| Mutex::new(Lines::new(Instant::now())));
        Ok(Self { bar, what, lines })
    }

    /// One more is done.
    pub fn inc(&self) {
        self.bar.inc(1);
        self.say();
    }

    /// So many of so many are done.
    pub fn set(&self, done: usize, total: usize) {
        self.bar.set_length(total as u64);
        self.bar.set_position(done as u64);
        self.say();
    }

    /// Something to show beside the bar.
    pub fn note(&self, text: String) {
        self.bar.set_message(text);
    }

    /// Takes the bar away.
    pub fn finish(self) {
        self.bar.finish_and_clear();
    }

    fn say(&self) {
        let Some(lines) = &self.lines else { return };
        let (done, total) = (self.bar.position(), self.bar.length().unwrap_or(0));
        // who panicked while counting has said enough
        if let Some(line) = lines.lock().ok().and_then(|mut lines| lines.next(done, total, Instant::now())) {
            eprintln!("{line} {}", self.what);
        }
    }
}

/// When lines were said.
struct Lines {
    last: Instant,
}

impl Lines {
    fn new(begin: Instant) -> Self {
        Self { last: begin }
    }

    /// What is to be said, if it is time.
    fn next(&mut self, done: u64, total: u64, now: Instant) -> Option<String> {
        if now.duration_since(self.last) < PAUSE {
            return None;
        }
        self.last = now;
        Some(format!("{done} of {total}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_comes_every_few_seconds() {
        let begin = Instant::now();
        let mut lines = Lines::new(begin);
        let said: Vec<_> =
            (1..=120).filter_map(|i| lines.next(i, 120, begin + Duration::from_millis(100 * i))).collect();
        assert_eq!(said, ["50 of 120", "100 of 120"]);
    }
}
