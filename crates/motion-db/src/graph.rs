use pulp::Arch;

use crate::Threads;
use crate::lead::{Lead, step_distance};
use crate::lists::Lists;

/// Neighbours of a segment in the graph.
pub(crate) const DEGREE: usize = 16;
/// Stands where a segment has fewer neighbours.
pub(crate) const NOBODY: u32 = u32::MAX;
/// Lists that the neighbours of a list's segments are looked for in.
const NEAR_LISTS: usize = 12;
/// Nearest segments that the neighbours are chosen from.
const CHOICE: usize = 6 * DEGREE;
const SEGMENTS_A_PIECE: usize = 256;

/// The neighbour graph of Chai & Hodgins 2005 (docs/papers.md#local-principal-components), of segments instead of
/// poses: 16 neighbours of each segment, shape `[segments, 16]`.
///
/// Neighbours are sought among the segments of near lists. Those come first that are nearer to the segment than to any
/// neighbour before them, so that they lie in different directions; recordings that were played at other speeds are
/// near to each other and would otherwise be all there is.
pub(crate) fn neighbour_graph(lead: &[Lead], lists: &Lists, threads: &impl Threads) -> Vec<u32> {
    let near = near_lists(lists);
    let mut graph = vec![NOBODY; lead.len() * DEGREE];
    threads.for_each_piece(&mut graph, SEGMENTS_A_PIECE * DEGREE, |piece, out| {
        let (mut found, mut kept) = (Vec::new(), Vec::with_capacity(DEGREE));
        for (i, out) in out.chunks_exact_mut(DEGREE).enumerate() {
            let segment = piece * SEGMENTS_A_PIECE + i;
            let own = &lead[segment];
            let list = lists.starts.partition_point(|&start| start as usize <= segment) - 1;
            found.clear();
            Arch::new().dispatch(|| {
                for &list in &near[list] {
                    let others = lists.segments(list as usize).filter(|other| *other != segment);
                    found.extend(others.map(|other| (step_distance(own, &lead[other]), other as u32)));
                }
            });
            if found.len() > CHOICE {
                found.select_nth_unstable(CHOICE - 1);
                found.truncate(CHOICE);
            }
            found.sort_unstable();
            choose(&found, lead, &mut kept);
            for (out, (_, other)) in out.iter_mut().zip(&kept) {
                *out = *other;
            }
        }
    });
    graph
}

/// Of segments in the order of their distance, first those in new directions, then the nearest of the others.
fn choose(found: &[(u32, u32)], lead: &[Lead], kept: &mut Vec<(u32, u32)>) {
    kept.clear();
    for candidate in found {
        let (distance, other) = *candidate;
        let is_new =
            kept.iter().all(|(_, k)| step_distance(&lead[other as usize], &lead[*k as usize]) > distance);
        if is_new {
            kept.push(*candidate);
            if kept.len() == DEGREE {
                return;
            }
        }
    }
    for candidate in found {
        if kept.len() == DEGREE {
            return;
        }
        if !kept.contains(candidate) {
            kept.push(*candidate);
        }
    }
}

/// The lists whose centroids are nearest to each list's, itself first.
fn near_lists(lists: &Lists) -> Vec<Vec<u32>> {
    let centroids = &*lists.centroids;
    let near = |own: usize| {
        let mut all: Vec<(u32, u32)> = centroids
            .iter()
            .enumerate()
            .map(|(i, c)| (if i == own { 0 } else { step_distance(&centroids[own], c) }, i as u32))
            .collect();
        all.sort_unstable();
        all.truncate(NEAR_LISTS);
        all.into_iter().map(|(_, i)| i).collect()
    };
    (0..lists.len()).map(near).collect()
}
