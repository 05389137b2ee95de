//! The fast search finds nearly all that the exact one finds.

mod fixtures;

use std::collections::HashSet;

use fixtures::{Numbers, Question, SIX, drawn, drawn_clips, questions, recorded};
use kinematics::{PointSet, control_points};
use motion_db::{
    Augment, Clip, ControlTable, MotionDatabase, Neighbour, Query, Scratch, SearchMode, WindowIndex,
    trial_name,
};
use sample_motion::Action;

const K: usize = 64;

fn query<'a>(question: &'a Question, hints: &'a [usize]) -> Query<'a> {
    Query { features: &question.features, controls: None, exclude: &[], hints }
}

fn successors(found: &[Neighbour]) -> Vec<usize> {
    let mut rows: Vec<usize> = found.iter().map(|n| n.row + 1).collect();
    rows.sort_unstable();
    rows
}

fn hits(found: &[Neighbour], expected: &[Neighbour]) -> usize {
    let expected: HashSet<usize> = expected.iter().map(|n| n.row).collect();
    found.iter().filter(|n| expected.contains(&n.row)).count()
}

/// Recordings of the five actions, those of every fourth performer apart.
fn held_out(test: &str) -> Option<(Vec<Clip>, Vec<Clip>)> {
    let folder = testkit::shared::find("data/motion/five-actions", test)?;
    let clips = recorded(&folder, 2);
    let mut performers: Vec<String> = clips.iter().map(|c| c.subject.clone()).collect();
    performers.sort();
    performers.dedup();
    let asks: Vec<&String> = performers.iter().step_by(4).collect();
    let (asking, database) = clips.iter().cloned().partition(|c: &Clip| asks.contains(&&c.subject));
    Some((database, asking))
}

#[test]
fn of_the_windows_nearest_to_other_performers_99_of_100_are_found() {
    let test = "of_the_windows_nearest_to_other_performers_99_of_100_are_found";
    let Some((clips, asking)) = held_out(test) else { return };
    let database = MotionDatabase::build(&clips).unwrap();
    let index = WindowIndex::new(&database, 2).unwrap();
    let (mut scratch, mut found, mut exact) = (Scratch::default(), Vec::new(), Vec::new());
    let mut counts = [[0usize; 3]; 4];
    for clip in asking.iter().step_by(3) {
        let skeleton = clip.motion.skeleton();
        let kinematics = database.kinematics(skeleton);
        let points = PointSet::new(&kinematics, control_points(skeleton, &SIX).unwrap());
        let table = ControlTable::new(&database, &index, skeleton, &kinematics, &points, &[], &[]);
        let mut weights = vec![1.0f32; 3 * SIX.len() + 1];
        weights[3 * SIX.len()] = 4.0;
        let mut hints = [Vec::new(), Vec::new()];
        for question in questions(&database, &index, &clip.motion, 1).iter().take(60) {
            for with_controls in [0, 1] {
                let controls = (with_controls == 1).then_some((&table, &question.controls[..], &weights[..]));
                let mut ask = |hints: &[usize], found: &mut Vec<Neighbour>| {
                    let query = Query { features: &question.features, controls, exclude: &[], hints };
                    index.nearest_fast(&query, K, &mut scratch, found)
                };
                ask(&[], &mut found);
                let tracked_from = std::mem::take(&mut hints[with_controls]);
                let cold = found.clone();
                let way = ask(&tracked_from, &mut found);
                hints[with_controls] = successors(&found);
                let query = Query { features: &question.features, controls, exclude: &[], hints: &[] };
                index.nearest(&query, K, &mut scratch, &mut exact);
                for (tracking, found) in [(0, &cold), (1, &found)] {
                    let count = &mut counts[2 * with_controls + tracking];
                    count[0] += hits(found, &exact);
                    count[1] += K;
                    count[2] += usize::from(tracking == 1 && way == SearchMode::Tracked);
                    // What is found is found at its distance, to the last bit.
                    for n in found {
                        let same = exact.iter().find(|e| e.row == n.row);
                        assert!(same.is_none_or(|e| e.distance_squared == n.distance_squared));
                    }
                }
            }
        }
    }
    for ([hit, all, tracked], what) in counts.iter().zip(["cold", "tracking", "points", "points, tracking"]) {
        let recall = *hit as f64 / *all as f64;
        println!("{what}: recall {recall:.4} of {} queries, {tracked} tracked", all / K);
        assert!(recall >= 0.99, "{what}: {recall}");
    }
    assert!(2 * counts[1][2] > counts[1][1] / K, "{counts:?}: most queries are tracked");
}

/// A database large enough for the structure of the fast search, and questions of a walk that it does not hold.
fn drawn_database() -> (MotionDatabase, WindowIndex, Vec<Question>) {
    let database = MotionDatabase::build(&drawn_clips(500)).unwrap();
    let index = WindowIndex::new(&database, 2).unwrap();
    let asked = questions(&database, &index, &drawn(Action::Walk, 1, 99, 120).motion, 1);
    (database, index, asked)
}

#[test]
fn a_graph_that_has_lost_the_way_is_noticed() {
    let (_, index, asked) = drawn_database();
    let (mut scratch, mut global, mut found) = (Scratch::default(), Vec::new(), Vec::new());
    let mut numbers = Numbers::new(9);
    let mut last = Vec::new();
    let mut tracked = 0;
    for question in &asked {
        assert_eq!(
            index.nearest_fast(&query(question, &[]), K, &mut scratch, &mut global),
            SearchMode::Global
        );
        // Somewhere else in the database: the windows of a boxing trial, or a place that the track was left for long ago.
        let boxing: Vec<usize> = (0..K).map(|_| index.clip_rows(3).start + numbers.below(400)).collect();
        let mut wrong = boxing.clone();
        wrong.sort_unstable();
        let way = index.nearest_fast(&query(question, &wrong), K, &mut scratch, &mut found);
        assert_eq!(way, SearchMode::Global);
        assert_eq!(found, global, "as if there had been no hints");
        // The successors of the last matches lead on.
        if !last.is_empty() {
            let way = index.nearest_fast(&query(question, &last), K, &mut scratch, &mut found);
            tracked += usize::from(way == SearchMode::Tracked);
        }
        last = successors(&global);
    }
    assert!(10 * tracked > 9 * (asked.len() - 1), "{tracked} of {}", asked.len());
}

#[test]
fn hints_beyond_the_last_row_and_out_of_order_do_no_harm() {
    let (_, index, asked) = drawn_database();
    let (mut scratch, mut found) = (Scratch::default(), Vec::new());
    let wrong = [index.num_rows() - 1, index.num_rows(), 3, 3, usize::MAX, 0];
    for question in &asked {
        index.nearest_fast(&query(question, &wrong), K, &mut scratch, &mut found);
        assert_eq!(found.len(), K);
        assert!(found.is_sorted_by(|a, b| (a.distance_squared, a.row) < (b.distance_squared, b.row)));
    }
}

#[test]
fn the_answer_depends_on_the_question_alone() {
    let (_, index, asked) = drawn_database();
    let answers = |order: &mut dyn Iterator<Item = usize>| {
        let (mut scratch, mut found) = (Scratch::default(), Vec::new());
        let mut answers = vec![Vec::new(); asked.len()];
        for q in order {
            let hints = [10 * q, 10 * q + 1, 40 * q];
            index.nearest_fast(&query(&asked[q], &hints), K, &mut scratch, &mut found);
            answers[q] = found.clone();
        }
        answers
    };
    assert_eq!(answers(&mut (0..asked.len())), answers(&mut (0..asked.len()).rev()));
}

#[test]
fn excluded_windows_are_never_found_and_those_beside_them_are() {
    let (database, index, asked) = drawn_database();
    let (mut scratch, mut found, mut exact) = (Scratch::default(), Vec::new(), Vec::new());
    // Whole clips, and a part that ends within segments.
    let part = index.clip_rows(4).start + 13..index.clip_rows(4).start + 171;
    let exclude = [index.clip_rows(0), part, index.clip_rows(8)];
    let (mut hit, mut all) = (0, 0);
    for question in asked.iter().step_by(3) {
        let hints = successors(&exact);
        let ask = Query { features: &question.features, controls: None, exclude: &exclude, hints: &hints };
        index.nearest_fast(&ask, K, &mut scratch, &mut found);
        index.nearest(&ask, K, &mut scratch, &mut exact);
        assert!(found.iter().all(|n| !exclude.iter().any(|r| r.contains(&n.row))));
        hit += hits(&found, &exact);
        all += K;
    }
    assert!(hit as f64 >= 0.98 * all as f64, "{hit} of {all}");
    assert_eq!(database.clips().len(), 12);
}

#[test]
fn small_databases_and_large_numbers_are_searched_exactly() {
    let database = MotionDatabase::build(&drawn_clips(100)).unwrap();
    let small = WindowIndex::new(&database, 2).unwrap();
    let (_, index, _) = drawn_database();
    let (mut scratch, mut found, mut exact) = (Scratch::default(), Vec::new(), Vec::new());
    for (index, k) in [(&small, K), (&index, 2_000)] {
        let features = index.features(7).to_vec();
        let ask = Query { features: &features, controls: None, exclude: &[], hints: &[] };
        assert_eq!(index.nearest_fast(&ask, k, &mut scratch, &mut found), SearchMode::Exact);
        index.nearest(&ask, k, &mut scratch, &mut exact);
        assert_eq!(found, exact);
    }
}

#[test]
fn tracking_takes_no_memory_once_it_has_run() {
    let (_, index, asked) = drawn_database();
    let (mut scratch, mut found) = (Scratch::default(), Vec::new());
    let mut hints = Vec::new();
    let mut track = |asked: &[Question]| {
        for question in asked {
            index.nearest_fast(&query(question, &hints), K, &mut scratch, &mut found);
            hints.clear();
            hints.extend(found.iter().map(|n| n.row + 1));
            hints.sort_unstable();
        }
    };
    track(&asked);
    let counted = allocation_counter::measure(|| track(&asked));
    assert_eq!(counted.count_total, 0, "{counted:?}");
}

/// Where a window is, whatever index holds it.
fn place(database: &MotionDatabase, index: &WindowIndex, row: usize) -> (String, usize) {
    let pose = index.target(row);
    let clip = &database.clips()[database.clip_at(pose)];
    (clip.name.clone(), pose - clip.first_pose)
}

#[test]
fn the_nearest_of_several_indexes_together_are_those_of_one() {
    let clips: Vec<Clip> = drawn_clips(80).iter().flat_map(|c| Augment::all().clips(c).unwrap()).collect();
    let built = MotionDatabase::build(&clips).unwrap();
    // Shards keep what was recorded, so the whole must too.
    let mut whole = built.emptied();
    for (i, clip) in built.clips().iter().enumerate() {
        whole.append_from(&built, i, &clip.name).unwrap();
    }
    let index = WindowIndex::new(&whole, 2).unwrap();
    // Trials are divided among three; each shard has principal axes of its own.
    let mut shards = [whole.emptied(), whole.emptied(), whole.emptied()];
    for (i, clip) in whole.clips().iter().enumerate() {
        let shard = trial_name(&clip.name).len() + i / 7;
        shards[shard % 3].append_from(&whole, i, &clip.name).unwrap();
    }
    let shards = shards.map(|database| {
        let index = WindowIndex::new(&database, 2).unwrap();
        (database, index)
    });
    let motion = drawn(Action::Jump, 2, 77, 100).motion;
    let asked = questions(&whole, &index, &motion, 9);
    let by_shard: Vec<Vec<Question>> =
        shards.iter().map(|(database, index)| questions(database, index, &motion, 9)).collect();
    let (mut scratch, mut found) = (Scratch::default(), Vec::new());
    for (q, question) in asked.iter().enumerate() {
        index.nearest(&query(question, &[]), K, &mut scratch, &mut found);
        let expected: Vec<_> =
            found.iter().map(|n| (n.distance_squared, place(&whole, &index, n.row))).collect();
        let mut merged = Vec::new();
        for ((database, index), asked) in shards.iter().zip(&by_shard) {
            index.nearest(&query(&asked[q], &[]), K, &mut scratch, &mut found);
            merged.extend(found.iter().map(|n| (n.distance_squared, place(database, index, n.row))));
        }
        merged.sort_by(|a, b| a.0.total_cmp(&b.0).then_with(|| a.1.cmp(&b.1)));
        merged.truncate(K);
        let last = expected[K - 1].0;
        let close = |a: f64, b: f64| (a - b).abs() <= 1e-4 * a.max(b) + 1e-4;
        for (found, expected_here) in merged.iter().zip(&expected) {
            assert!(close(found.0, expected_here.0), "question {q}: {found:?}, {expected_here:?}");
            let is_there = expected.iter().any(|e| e.1 == found.1);
            assert!(is_there || close(found.0, last), "question {q}: {found:?} is not among the nearest");
        }
    }
}
