use pulp::Arch;

use crate::Threads;
use crate::column::Column;
use crate::lead::{LEAD, Lead, step_distance};

/// Lists are as many as the root of the number of segments, times this: looking at all lists then costs about as much as
/// looking into those that matter.
const LISTS_PER_ROOT: f64 = 3.4;
/// Segments that the centroids are learned from, for each list.
const SAMPLE_PER_LIST: usize = 24;
const ROUNDS: usize = 8;
const SEGMENTS_A_PIECE: usize = 512;

/// Segments sorted into lists about centroids (k-means on the leading features).
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Lists {
    /// shape `[lists, 32]`
    pub centroids: Column<Lead>,
    /// first segment of each list, and the number of segments, shape `[lists + 1]`
    pub starts: Column<u32>,
}

impl Lists {
    /// The lists, and the segments in the order of the lists. Sums of whole numbers: the same on any number of threads.
    pub fn new(lead: &[Lead], threads: &impl Threads) -> (Self, Vec<u32>) {
        let count = ((lead.len() as f64).sqrt() * LISTS_PER_ROOT) as usize;
        let count = count.clamp(1, lead.len());
        let mut centroids: Vec<Lead> = (0..count).map(|i| lead[i * lead.len() / count]).collect();
        let step = (lead.len() / (count * SAMPLE_PER_LIST)).max(1);
        let sample: Vec<Lead> = lead.iter().copied().step_by(step).collect();
        for _ in 0..ROUNDS {
            let nearest = nearest_centroids(&sample, &centroids, threads);
            let mut sums = vec![[0i64; LEAD]; count];
            let mut sizes = vec![0i64; count];
            for (lead, &list) in sample.iter().zip(&nearest) {
                sizes[list as usize] += 1;
                sums[list as usize].iter_mut().zip(lead).for_each(|(sum, v)| *sum += i64::from(*v));
            }
            for ((centroid, sum), size) in centroids.iter_mut().zip(&sums).zip(&sizes) {
                // A list that nothing is nearest to keeps its centroid.
                if *size > 0 {
                    centroid.iter_mut().zip(sum).for_each(|(c, sum)| *c = (sum / size) as i16);
                }
            }
        }
        let nearest = nearest_centroids(lead, &centroids, threads);
        let mut starts = vec![0u32; count + 1];
        nearest.iter().for_each(|&list| starts[list as usize + 1] += 1);
        (0..count).for_each(|i| starts[i + 1] += starts[i]);
        let mut order: Vec<u32> = (0..lead.len() as u32).collect();
        order.sort_by_key(|&s| (nearest[s as usize], s));
        (Self { centroids: centroids.into(), starts: starts.into() }, order)
    }

    pub fn len(&self) -> usize {
        self.centroids.len()
    }

    pub fn segments(&self, list: usize) -> std::ops::Range<usize> {
        self.starts[list] as usize..self.starts[list + 1] as usize
    }
}

fn nearest_centroids(leads: &[Lead], centroids: &[Lead], threads: &impl Threads) -> Vec<u32> {
    let mut nearest = vec![0u32; leads.len()];
    threads.for_each_piece(&mut nearest, SEGMENTS_A_PIECE, |piece, out| {
        Arch::new().dispatch(|| {
            for (lead, out) in leads[piece * SEGMENTS_A_PIECE..].iter().zip(out) {
                let distances = centroids.iter().map(|c| step_distance(c, lead));
                *out = distances.enumerate().min_by_key(|(_, d)| *d).map_or(0, |(i, _)| i as u32);
            }
        });
    });
    nearest
}
