//! The exact search finds what looking at every row finds.

mod fixtures;

use std::ops::Range;

use fixtures::{Numbers, Question, SIX, drawn, drawn_clips, questions, recorded};
use kinematics::{PointSet, control_points};
use model::Motion;
use motion_db::{Clip, ControlTable, MotionDatabase, Neighbour, Query, Scratch, WindowIndex};
use sample_motion::Action;

/// Panics unless `found` is `expected`, up to rows whose distances are the same to single precision.
fn check_same(found: &[Neighbour], expected: &[Neighbour], what: &str) {
    assert_eq!(found.len(), expected.len(), "{what}");
    let close = |a: f64, b: f64| (a - b).abs() <= 1e-5 * a.max(b) + 1e-6;
    for (i, (f, e)) in found.iter().zip(expected).enumerate() {
        assert!(close(f.distance_squared, e.distance_squared), "{what}, place {i}: {f:?} is not {e:?}");
        let is_tie = |n: &Neighbour| n.row == f.row && close(n.distance_squared, f.distance_squared);
        // The last places may go to either of two rows that are equally far.
        let is_last = close(f.distance_squared, expected[expected.len() - 1].distance_squared);
        assert!(
            f.row == e.row || expected.iter().any(is_tie) || is_last,
            "{what}, place {i}: {f:?}, not {e:?}"
        );
    }
    for pair in found.windows(2) {
        assert!(pair[0].distance_squared <= pair[1].distance_squared, "{what}");
        assert!(pair[0].row != pair[1].row, "{what}: row {} twice", pair[0].row);
    }
}

/// Asks every question in every way: with and without control points, exclusions and hints.
fn check_all(database: &MotionDatabase, index: &WindowIndex, asked: &Motion, ks: &[usize]) {
    let kinematics = database.kinematics(asked.skeleton());
    let points = PointSet::new(&kinematics, control_points(asked.skeleton(), &SIX).unwrap());
    let table = ControlTable::new(database, index, asked.skeleton(), &kinematics, &points, &[], &[]);
    let mut weights = vec![1.0f32; 3 * SIX.len() + 1];
    // A point that was not measured, and the unlikeness of skeletons.
    weights[3..6].fill(0.0);
    weights[3 * SIX.len()] = 4.0;
    let mut scratch = Scratch::default();
    let mut found = Vec::new();
    let mut numbers = Numbers::new(3);
    let clip = |i: usize| index.clip_rows(i % database.clips().len());
    let two_clips: Vec<Range<usize>> =
        if database.clips().len() > 2 { vec![clip(0), clip(2)] } else { vec![] };
    let mut last = Vec::new();
    for (q, question) in questions(database, index, asked, 17).iter().enumerate() {
        let random: Vec<usize> = {
            let mut rows: Vec<usize> = (0..40).map(|_| numbers.below(index.num_rows())).collect();
            rows.sort_unstable();
            rows
        };
        // Beyond the last row, and out of order.
        let wrong = [index.num_rows() - 1, index.num_rows(), 3, usize::MAX];
        for controls in [None, Some((&table, &question.controls[..], &weights[..]))] {
            for exclude in [&[][..], &two_clips[..]] {
                for &k in ks {
                    let ask = |hints: &[usize], scratch: &mut Scratch, found: &mut Vec<Neighbour>| {
                        let query = Query { features: &question.features, controls, exclude, hints };
                        index.nearest(&query, k, scratch, found);
                    };
                    let query = Query { features: &question.features, controls, exclude, hints: &[] };
                    let expected = index.nearest_brute_force(&query, k);
                    let right: Vec<usize> = {
                        let mut rows: Vec<usize> = expected.iter().map(|n| n.row).collect();
                        rows.sort_unstable();
                        rows
                    };
                    let what = |hints: &str| format!("question {q}, {hints} hints, k {k}, {exclude:?}");
                    ask(&[], &mut scratch, &mut found);
                    check_same(&found, &expected, &what("no"));
                    let without = found.clone();
                    let hints =
                        [("right", &right[..]), ("random", &random), ("wrong", &wrong), ("last", &last)];
                    for (name, hints) in hints {
                        ask(hints, &mut scratch, &mut found);
                        // Hints speed the search up and change nothing, not even the last bit.
                        assert_eq!(found, without, "{}", what(name));
                    }
                    let excluded = |n: &Neighbour| exclude.iter().any(|r| r.contains(&n.row));
                    assert!(!found.iter().any(excluded));
                    last = right;
                }
            }
        }
    }
}

#[test]
fn drawn_windows_are_found_as_by_brute_force() {
    let clips = drawn_clips(150);
    let asked = drawn(Action::Run, 1, 99, 150);
    let database = MotionDatabase::build(&clips).unwrap();
    for window in [1, 2, 5] {
        let index = WindowIndex::new(&database, window).unwrap();
        check_all(&database, &index, &asked.motion, &[1, 16, 64]);
        // What is in the database finds itself, at distance 0.
        check_all(&database, &index, &clips[3].motion, &[1, 7]);
    }
}

#[test]
fn asking_for_more_than_there_is_gives_all_there_is() {
    let clips = [drawn(Action::Walk, 0, 1, 20), drawn(Action::Run, 0, 2, 15)];
    let database = MotionDatabase::build(&clips).unwrap();
    let index = WindowIndex::new(&database, 2).unwrap();
    assert_eq!(index.num_rows(), 18 + 13);
    check_all(&database, &index, &drawn(Action::Walk, 0, 3, 60).motion, &[0, 1, 30, 31, 32, 500]);
}

#[test]
fn equal_windows_come_in_the_order_of_their_rows() {
    let walk = drawn(Action::Walk, 0, 1, 60);
    let database = MotionDatabase::build(&[walk.clone(), walk.clone(), walk.clone()]).unwrap();
    let index = WindowIndex::new(&database, 2).unwrap();
    let (mut scratch, mut found) = (Scratch::default(), Vec::new());
    for question in questions(&database, &index, &walk.motion, 17) {
        let query = Query { features: &question.features, controls: None, exclude: &[], hints: &[] };
        index.nearest(&query, 3, &mut scratch, &mut found);
        let rows: Vec<usize> = found.iter().map(|n| n.row).collect();
        assert_eq!(rows, [rows[0], rows[0] + 58, rows[0] + 116]);
        assert!(found.iter().all(|n| n.distance_squared < 1e-6));
    }
}

#[test]
fn recorded_windows_are_found_as_by_brute_force() {
    let test = "recorded_windows_are_found_as_by_brute_force";
    let Some(folder) = testkit::shared::find("data/motion/five-actions", test) else { return };
    let mut clips: Vec<Clip> = recorded(&folder, 6);
    let asked = clips.swap_remove(3);
    let database = MotionDatabase::build(&clips).unwrap();
    let index = WindowIndex::new(&database, 2).unwrap();
    check_all(&database, &index, &asked.motion, &[1, 64]);
}

#[test]
fn a_search_takes_no_memory_once_it_has_run() {
    let database = MotionDatabase::build(&drawn_clips(100)).unwrap();
    let index = WindowIndex::new(&database, 2).unwrap();
    let asked = questions(&database, &index, &drawn(Action::Walk, 1, 50, 100).motion, 17);
    let (mut scratch, mut found) = (Scratch::default(), Vec::new());
    let mut ask = |question: &Question| {
        let query = Query { features: &question.features, controls: None, exclude: &[], hints: &[] };
        index.nearest(&query, 64, &mut scratch, &mut found);
    };
    ask(&asked[0]);
    let counted = allocation_counter::measure(|| asked.iter().for_each(&mut ask));
    assert_eq!(counted.count_total, 0, "{counted:?}");
}
