//! Everything that is varied, on drawn motion: results, tables and report.

use evaluation::{
    ALL, Protocol, Row, SparseEvaluation, Sweep, TrialResult, Variant, evaluate_sparse,
    report::{About, run_report, sparse_report},
    shuffle_by_name, summarise,
    tables::{Cell, Table, tables},
};
use motion_db::Clip;
use sample_motion::{Action, DrawOptions, Model};
use sparse::{Method, Parameters};

fn clips() -> Vec<Clip> {
    let clip = |seed: u64| {
        let action = [Action::Walk, Action::Run][seed as usize % 2];
        let subject = seed / 2;
        let motion = Model::bundled().draw(action, seed, &DrawOptions { frames: 120, subject }).unwrap();
        // A name that would break a page if it were not escaped.
        let name = format!("{subject}_<{seed}>&");
        Clip { name, subject: subject.to_string(), action: action.to_string(), motion }
    };
    (0..4).map(clip).collect()
}

fn sweep() -> Sweep {
    let window = |window| Parameters { window, ..Parameters::default() };
    let diagonal = Parameters { covariance: sparse::Covariance::Diagonal, ..Parameters::default() };
    let variant = |name: &str, parameters| Variant { name: name.to_owned(), parameters };
    Sweep {
        variants: vec![
            variant("", window(2)),
            variant("covariance=diagonal", diagonal),
            variant("", window(1)),
        ],
        database_sizes: vec![Some(150), None],
        noises_m: vec![0.0, 0.01],
        noise_is_known: true,
        occlusions: vec![None, Some("all:0.5s".parse().unwrap())],
        ..Sweep::new(&[Method::LocalRegression, Method::Nearest], &[4], Parameters::default())
    }
}

fn evaluate(sweep: Sweep, threads: usize) -> Vec<TrialResult> {
    let mut train = clips();
    let test = clips();
    shuffle_by_name(&mut train);
    let evaluation = SparseEvaluation {
        train: &train,
        test: &test[..2],
        protocol: Protocol::TrialOut,
        sweep,
        max_frames: 120,
        threads,
    };
    evaluate_sparse(&evaluation, &|| 0.0, &|_, _| {}).unwrap()
}

fn about() -> About {
    About {
        title: "A <report> & more".to_owned(),
        introduction: "Made by a test.".to_owned(),
        facts: vec![("protocol".to_owned(), "trial-out".to_owned())],
        command: "marey evaluate sparse --train 'a & b'".to_owned(),
        parameters: vec![("window".to_owned(), "2".to_owned())],
        warning: "Synthetic.".to_owned(),
    }
}

/// Panics where tags do not close in the order in which they open, or an attribute or an `&` is not as it should be.
fn assert_well_formed(html: &str) {
    let mut open: Vec<&str> = Vec::new();
    let mut rest = html.strip_prefix("<!DOCTYPE html>").expect("a document type");
    while let Some(at) = rest.find('<') {
        let text = &rest[..at];
        for (i, _) in text.match_indices('&') {
            let entity = text[i..].split(';').next().unwrap_or_default();
            let known = ["&amp", "&lt", "&gt", "&quot"].contains(&entity);
            assert!(known || open.last() == Some(&"style"), "{entity:?}");
        }
        let end = at + rest[at..].find('>').expect("a tag that ends");
        let tag = &rest[at + 1..end];
        rest = &rest[end + 1..];
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name), "closed by </{name}>");
            continue;
        }
        assert_eq!(tag.matches('"').count() % 2, 0, "{tag}");
        let name = tag.split([' ', '/']).next().unwrap_or_default();
        assert!(!name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric()), "<{tag}>");
        if !tag.ends_with('/') {
            open.push(name);
        }
    }
    assert_eq!(open, Vec::<&str>::new());
}

fn assert_self_contained(html: &str) {
    for word in ["http", "src=", "href=", "url(", "@import", "<script", "NaN", "inf"] {
        assert!(!html.contains(word), "{word} in the page: {:?}", html.find(word).map(|i| &html[i..i + 60]));
    }
}

fn named<'a>(tables: &'a [Table], title: &str) -> &'a Table {
    tables.iter().find(|t| t.title.starts_with(title)).unwrap_or_else(|| panic!("no table {title}"))
}

fn column(table: &Table, name: &str) -> usize {
    table.columns.iter().position(|c| c == name).unwrap_or_else(|| panic!("no column {name}"))
}

#[test]
fn results_do_not_depend_on_the_number_of_threads_and_make_tables_and_a_report() {
    let results = evaluate(sweep(), 3);
    assert_eq!(results, evaluate(sweep(), 1));
    // Two databases, three variants, two noises, with and without gap, two methods, two trials.
    assert_eq!(results.len(), 2 * 3 * 2 * 2 * 2 * 2);
    let rows = summarise(&results, Protocol::TrialOut);
    let tables = tables(&rows, true);
    the_tables_have_the_rows(&rows, &tables);
    the_papers_are_beside(&tables);
    noise_and_gaps_cost(&rows);
    let html = sparse_report(&about(), Protocol::TrialOut, &results, &rows, true);
    assert_well_formed(&html);
    assert_self_contained(&html);
    for words in
        ["Error over time", "Around the gaps", "Worst trials", "0_&lt;0&gt;&amp;", "trial-out", "Foot slide"]
    {
        assert!(html.contains(words), "{words} is not in the report");
    }
    let run = run_report(&about(), &results[0].comparison, results[0].foot_slide.as_ref());
    assert_well_formed(&run);
    assert_self_contained(&run);
}

fn the_tables_have_the_rows(rows: &[Row], tables: &[Table]) {
    let errors = named(tables, "Errors by action");
    assert_eq!(errors.rows.len(), rows.len());
    for name in ["window", "variant", "poses", "noise", "hidden", "action"] {
        assert!(column(errors, name) < errors.text_columns, "{name}");
    }
    let rms = column(errors, "RMS deg (sd)");
    for (row, cells) in rows.iter().zip(&errors.rows) {
        assert_eq!(cells[rms], Cell::Spread(row.rms_deg, row.rms_deg_std, 2));
    }
    for table in tables {
        assert!(table.note.contains("trial-out"), "{} names no protocol", table.title);
        assert!(table.rows.iter().all(|cells| cells.len() == table.columns.len()), "{}", table.title);
        assert!(!table.rows.is_empty() && table.markdown().lines().count() > 4, "{}", table.title);
    }
    assert_eq!(named(tables, "Parameters compared").rows.len(), 2 * 2, "two methods, two variants");
    assert_eq!(named(tables, "Noise").rows.len(), 2 * 2 * 2, "two methods, two noises, two variants");
}

fn the_papers_are_beside(tables: &[Table]) {
    let windows = named(tables, "Window length, beside");
    assert_eq!(windows.columns[3..], ["m = 2", "m = 1"]);
    let paper: Vec<&Vec<Cell>> =
        windows.rows.iter().filter(|r| r[2] == Cell::text("paper, degrees")).collect();
    assert_eq!(paper.len(), 1, "of local regression alone");
    assert_eq!(paper[0][3..], [Cell::Number(2.04, 2), Cell::Number(2.96, 2)]);
    let databases = named(tables, "Database size, beside");
    // 150 poses ask for two clips of 120.
    assert_eq!(databases.columns[3..5], ["240 poses", "480 poses"]);
    assert!(databases.columns.contains(&"paper, Liu 1.2 M".to_owned()));
    let points = named(tables, "Control points, beside");
    let paper = points.rows.iter().find(|r| r[1] == Cell::text("paper")).unwrap();
    assert_eq!(paper[2..], [Cell::Number(2.67, 2)]);
}

fn noise_and_gaps_cost(rows: &[Row]) {
    let plain = |r: &&Row| {
        let case = &r.case;
        r.action == ALL && case.variant.is_empty() && case.window == 2 && case.database_poses == 480
    };
    for method in [Method::LocalRegression, Method::Nearest] {
        let row = |noise_mm: f64, hidden: bool| {
            let found = rows.iter().filter(plain).find(|r| {
                r.case.method == method && r.case.noise_mm == noise_mm && r.case.occlusion.is_some() == hidden
            });
            found.unwrap()
        };
        assert!(row(10.0, false).mpjpe_cm > row(0.0, false).mpjpe_cm, "{method}: noise is no gain");
        assert!(row(0.0, false).gap.is_none());
        let gap = row(0.0, true).gap.unwrap();
        assert_eq!(gap.trials, 2);
        assert!(gap.mean.inside_cm > gap.mean.inside_undisturbed_cm, "{method}: {gap:?}");
    }
}

#[test]
fn a_trial_too_short_for_a_gap_is_left_out_of_it_alone() {
    let sweep = Sweep {
        occlusions: vec![None, Some("one:5s".parse().unwrap())],
        ..Sweep::new(&[Method::Nearest], &[6], Parameters::default())
    };
    let results = evaluate(sweep, 1);
    assert_eq!(results.len(), 2);
    assert!(results.iter().all(|r| r.case.occlusion.is_none()));
}

#[test]
fn a_trial_that_is_in_the_database_is_found_in_it() {
    let clips = clips();
    let rms = |protocol| {
        let evaluation = SparseEvaluation {
            train: &clips,
            test: &clips[..1],
            protocol,
            sweep: Sweep::new(&[Method::Nearest], &[6], Parameters::default()),
            max_frames: 60,
            threads: 1,
        };
        evaluate_sparse(&evaluation, &|| 0.0, &|_, _| {}).unwrap()[0].comparison.errors.rms_deg
    };
    let (inside, outside) = (rms(Protocol::TrialIn), rms(Protocol::TrialOut));
    assert!(inside < 1.0 && outside > 3.0, "{inside} and {outside} degrees");
}
