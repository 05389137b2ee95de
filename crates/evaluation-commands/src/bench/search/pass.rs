use std::time::Instant;

use motion_db::{Neighbour, Query, Scratch, SearchMode, WindowIndex};
use serde::Serialize;

use super::questions::Run;

/// How each frame is searched.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Search {
    /// every window, starting from nothing
    ExactCold,
    /// every window, the successors of the last matches first
    ExactTracking,
    /// lists alone
    FastCold,
    /// from the last matches along the graph
    FastTracking,
}

/// What a way of searching took, and how much it found of what there was.
#[derive(Debug, Serialize)]
pub struct Measured {
    pub queries: usize,
    pub median_ms: f64,
    pub mean_ms: f64,
    pub p99_ms: f64,
    /// share of the exact neighbours that were found; 1 for the exact search
    pub recall: f64,
    /// recall of the run of frames with the lowest
    pub worst_run_recall: f64,
    /// share of the queries that were followed along the graph
    pub tracked: f64,
}

/// Rows of the exact neighbours: per run and query, in rising order.
pub type Truth = Vec<Vec<Vec<usize>>>;

/// Asks all queries in one way, one thread, each query timed by itself. The first pass gives the truth, the others are
/// compared with it. The first frame of a run has nothing to follow and is not counted where one tracks.
pub fn measure(index: &WindowIndex, runs: &[Run], k: usize, search: Search, truth: &mut Truth) -> Measured {
    let is_first = truth.is_empty();
    let tracks = matches!(search, Search::ExactTracking | Search::FastTracking);
    let (mut scratch, mut found, mut hints) = (Scratch::default(), Vec::<Neighbour>::new(), Vec::new());
    let (mut times, mut hits, mut worst, mut tracked) = (Vec::new(), 0, 1.0f64, 0);
    for (r, run) in runs.iter().enumerate() {
        hints.clear();
        let mut run_rows = Vec::new();
        let (mut run_hits, mut run_queries) = (0, 0);
        for (q, features) in run.queries().enumerate() {
            let query = Query { features, controls: None, exclude: &[], hints: &hints };
            let begin = Instant::now();
            let way = match search {
                Search::ExactCold | Search::ExactTracking => {
                    index.nearest(&query, k, &mut scratch, &mut found);
                    SearchMode::Exact
                }
                Search::FastCold | Search::FastTracking => {
                    index.nearest_fast(&query, k, &mut scratch, &mut found)
                }
            };
            let seconds = begin.elapsed().as_secs_f64();
            if is_first {
                let mut rows: Vec<usize> = found.iter().map(|n| n.row).collect();
                rows.sort_unstable();
                run_rows.push(rows);
            }
            if !tracks || q > 0 {
                times.push(seconds);
                tracked += usize::from(way == SearchMode::Tracked);
                run_queries += 1;
                let expected = if is_first { &run_rows[q] } else { &truth[r][q] };
                run_hits += found.iter().filter(|n| expected.binary_search(&n.row).is_ok()).count();
            }
            hints.clear();
            if tracks {
                hints.extend(found.iter().map(|n| n.row + 1));
                hints.sort_unstable();
            }
        }
        if is_first {
            truth.push(run_rows);
        }
        if run_queries > 0 {
            worst = worst.min(run_hits as f64 / (run_queries * k) as f64);
        }
        hits += run_hits;
    }
    times.sort_by(f64::total_cmp);
    let count = times.len().max(1);
    let at = |share: f64| 1e3 * times.get((share * count as f64) as usize).copied().unwrap_or(0.0);
    Measured {
        queries: times.len(),
        median_ms: at(0.5),
        mean_ms: 1e3 * times.iter().sum::<f64>() / count as f64,
        p99_ms: at(0.99),
        recall: hits as f64 / (count * k) as f64,
        worst_run_recall: worst,
        tracked: tracked as f64 / count as f64,
    }
}
