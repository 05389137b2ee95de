//! Success rates as a table, and the paper's claim.

use evaluation::recovery::{FOUND_M, LARGE_WITHOUT, Method, Recovered, Strategy, WITH_PRIOR};
use evaluation::{
    PairedDifference, Proportion, Verdict,
    tables::{Cell as Value, Table},
};
use serde::Serialize;

/// A difference of success rates that doesn't matter.
const MARGIN: f64 = 0.1;

#[derive(Serialize)]
pub struct Json {
    pub command: String,
    pub note: String,
    pub starts: usize,
    pub cameras: usize,
    pub noise: bool,
    pub seed: u64,
    pub cells: Vec<Cell>,
}

/// Limbs turned by some degrees.
#[derive(Serialize)]
pub struct Cell {
    limbs: &'static str,
    turned_deg: f64,
    /// starts that are no farther off than 50 mm
    disturbed: Proportion,
    methods: Vec<MethodCell>,
    /// the search of 25 × 10 with the prior less that of 100 × 15 without: alone, and after local optimisation
    claim: [Claim; 2],
}

#[derive(Serialize)]
struct MethodCell {
    name: &'static str,
    evaluations: usize,
    /// of the search alone
    search: Option<Proportion>,
    /// at the end
    found: Proportion,
    /// largest distance of a joint, metres, of each start
    searched_m: Vec<f64>,
    final_m: Vec<f64>,
}

#[derive(Serialize)]
struct Claim {
    #[serde(flatten)]
    difference: PairedDifference,
    verdict: Verdict,
}

impl Claim {
    fn from_pairs(pairs: impl IntoIterator<Item = (bool, bool)>) -> Self {
        let difference = PairedDifference::from_pairs(pairs);
        Self { difference, verdict: difference.verdict(MARGIN) }
    }

    fn text(&self) -> String {
        let PairedDifference { difference, interval: [low, high], only } = self.difference;
        let verdict = match self.verdict {
            Verdict::Equal => "equal",
            Verdict::Better => "the prior is better",
            Verdict::Worse => "the prior is worse",
            Verdict::Undecided => "undecided",
        };
        format!(
            "{:+.0} points ({:+.0} to {:+.0}), {} : {} starts, {verdict}",
            100.0 * difference,
            100.0 * low,
            100.0 * high,
            only[0],
            only[1]
        )
    }
}

impl Cell {
    /// `recovered` has shape `[methods][starts]`.
    pub fn new(
        limbs: &'static str,
        turned_deg: f64,
        methods: &[Method<'_>],
        recovered: Vec<Vec<Recovered>>,
    ) -> Self {
        let cell = |method: &Method<'_>, recovered: &Vec<Recovered>| MethodCell {
            name: method.name,
            evaluations: method.evaluations(),
            search: matches!(method.strategy, Strategy::Search(_))
                .then(|| Proportion::from_tries(recovered.iter().map(Recovered::is_found_by_search))),
            found: Proportion::from_tries(recovered.iter().map(Recovered::is_found)),
            searched_m: recovered.iter().map(|start| start.searched_m).collect(),
            final_m: recovered.iter().map(|start| start.final_m).collect(),
        };
        let methods: Vec<_> =
            methods.iter().zip(&recovered).map(|(method, found)| cell(method, found)).collect();
        let claim = [0, 1].map(|end| Claim::from_pairs(pairs(&methods, end)));
        let start = methods.first().map_or(&[][..], |local| &local.searched_m);
        let disturbed = Proportion::from_tries(start.iter().map(|&metres| metres <= FOUND_M));
        Self { limbs, turned_deg, disturbed, methods, claim }
    }
}

/// Whether each start was found by the two searches of the claim: alone, or (`end` = 1) after local optimisation.
fn pairs(methods: &[MethodCell], end: usize) -> Vec<(bool, bool)> {
    let is_found = |name: &str| {
        let method = methods.iter().find(|method| method.name == name);
        let metres = method.map_or(&[][..], |m| if end == 0 { &m.searched_m } else { &m.final_m });
        metres.iter().map(|&metres| metres <= FOUND_M).collect::<Vec<_>>()
    };
    is_found(WITH_PRIOR).into_iter().zip(is_found(LARGE_WITHOUT)).collect()
}

/// Percent with the interval.
fn percent(found: Proportion) -> Value {
    let [low, high] = found.interval;
    Value::text(format!("{:3.0} ({:.0}-{:.0})", 100.0 * found.share, 100.0 * low, 100.0 * high))
}

/// One line a cell and method.
pub fn table(cells: &[Cell], note: String) -> Table {
    let columns = ["limbs", "turned", "method", "search alone, %", "then locally, %", "energies"];
    let text = format!(
        "{note}. Percent of {} starts with all joints within {:.0} mm, with 95 % intervals (Wilson); the same starts in every line.",
        cells.first().map_or(0, |cell| cell.disturbed.tries),
        1000.0 * FOUND_M
    );
    let mut table = Table::new("Recovery", text, 5, columns);
    for cell in cells {
        let head = |method: &str| {
            vec![Value::text(cell.limbs), Value::text(format!("{}°", cell.turned_deg)), Value::text(method)]
        };
        table.push([head("none: the start"), vec![Value::Empty, percent(cell.disturbed)]].concat());
        for method in &cell.methods {
            let search = method.search.map_or(Value::Empty, percent);
            let energies = if method.evaluations == 0 {
                Value::Empty
            } else {
                Value::Number(method.evaluations as f64, 0)
            };
            table.push([head(method.name), vec![search, percent(method.found), energies]].concat());
        }
    }
    table
}

/// Says of each cell, and of all together, whether 25 × 10 with the prior equals 100 × 15 without.
pub fn print_claim(cells: &[Cell]) {
    println!(
        "\n{WITH_PRIOR} less {LARGE_WITHOUT}, the same starts; equal means that the 95 % interval of the difference lies within \
         {:.0} points:",
        100.0 * MARGIN
    );
    let line = |limbs: &str, turned: String, [search, end]: &[Claim; 2]| {
        println!("{limbs:<5}{turned:>4}  search alone  {}", search.text());
        println!("{:9}  then locally  {}", "", end.text());
    };
    for cell in cells {
        line(cell.limbs, format!("{}°", cell.turned_deg), &cell.claim);
    }
    let all = |end| Claim::from_pairs(cells.iter().flat_map(|cell| pairs(&cell.methods, end)));
    if cells.len() > 1 {
        line("all", String::new(), &[all(0), all(1)]);
    }
}
