//! Which clip lies in which shard.

use std::{cmp::Reverse, collections::BinaryHeap};

/// The shard of each clip, so that all have about as many poses: the longest clip first, each into the emptiest shard.
/// There are no more shards than clips. The same sizes give the same shards.
pub(crate) fn assign(sizes: &[usize], num_shards: usize) -> Vec<usize> {
    let num_shards = num_shards.clamp(1, sizes.len().max(1));
    let mut longest_first: Vec<usize> = (0..sizes.len()).collect();
    longest_first.sort_by_key(|&clip| (Reverse(sizes[clip]), clip));
    let mut emptiest: BinaryHeap<Reverse<(usize, usize)>> =
        (0..num_shards).map(|s| Reverse((0, s))).collect();
    let mut shards = vec![0; sizes.len()];
    for clip in longest_first {
        let Some(Reverse((size, shard))) = emptiest.pop() else { break };
        shards[clip] = shard;
        emptiest.push(Reverse((size + sizes[clip], shard)));
    }
    shards
}

#[cfg(test)]
mod tests {
    use super::assign;

    #[test]
    fn shards_are_about_alike_and_none_is_empty() {
        let sizes: Vec<usize> = (0..100).map(|i| 100 + (i * 37) % 300).collect();
        let shards = assign(&sizes, 7);
        let mut totals = [0; 7];
        for (size, shard) in sizes.iter().zip(&shards) {
            totals[*shard] += size;
        }
        let (least, most) = (totals.iter().min().unwrap(), totals.iter().max().unwrap());
        assert!(most - least <= 100, "{totals:?}");
        assert_eq!(assign(&[5, 5], 3), [0, 1], "no more shards than clips");
        assert_eq!(assign(&[1, 2, 3], 1), [0, 0, 0]);
        assert_eq!(assign(&[], 4), [0usize; 0]);
    }
}
