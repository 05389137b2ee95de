use body::ROOT_DOFS;
use rayon::prelude::*;

/// How often centres move to the middle of what is nearest to them.
const ROUNDS: usize = 4;
/// Share of the poses that lie nearer to the centres than the one that becomes the next: the farthest are odd ones.
const FAR: f64 = 0.95;
/// Poses of a cluster among which its middle is looked for.
const CANDIDATES: usize = 200;

/// Indices of `count` poses, increasing, that stand for all: k-medoids over the angles (the root doesn't count), from centres that
/// are far from each other. As in the k-centre method (Gonzalez 1985; docs/papers.md#other-sources) every centre is far from all
/// before it; but the farthest 5 % are passed over, or each odd pose would stand for itself. Nothing is drawn at random.
pub fn covering<P: AsRef<[f64]> + Sync>(poses: &[P], count: usize) -> Vec<usize> {
    if poses.len() <= count || count == 0 {
        return (0..poses.len().min(count)).collect();
    }
    let mut centres = far_apart(poses, count);
    for _ in 0..ROUNDS {
        let nearest: Vec<usize> = poses
            .par_iter()
            .map(|pose| {
                let squared = |centre: &usize| squared(pose.as_ref(), poses[*centre].as_ref());
                least(centres.iter().map(squared)).0
            })
            .collect();
        let mut clusters = vec![Vec::new(); count];
        nearest.iter().enumerate().for_each(|(pose, &cluster)| clusters[cluster].push(pose));
        let medoid = |(cluster, &centre): (&Vec<usize>, &usize)| {
            // a large cluster is looked at in part
            let some: Vec<usize> =
                cluster.iter().copied().step_by(cluster.len().div_ceil(CANDIDATES).max(1)).collect();
            let cost = |&candidate: &usize| -> f64 {
                some.iter().map(|&pose| squared(poses[pose].as_ref(), poses[candidate].as_ref())).sum()
            };
            some.get(least(some.iter().map(cost)).0).copied().unwrap_or(centre)
        };
        let moved: Vec<usize> = clusters.par_iter().zip(&centres).map(medoid).collect();
        if moved == centres {
            break;
        }
        centres = moved;
    }
    centres.sort_unstable();
    centres
}

/// The pose nearest to the mean, then always one that is far from all before it.
fn far_apart<P: AsRef<[f64]> + Sync>(poses: &[P], count: usize) -> Vec<usize> {
    let width = poses[0].as_ref().len();
    let mut mean = vec![0.0; width];
    for pose in poses {
        mean.iter_mut().zip(pose.as_ref()).for_each(|(mean, x)| *mean += x / poses.len() as f64);
    }
    let mut centres = vec![least(poses.iter().map(|pose| squared(pose.as_ref(), &mean))).0];
    let mut distances = vec![f64::INFINITY; poses.len()];
    let mut order: Vec<usize> = (0..poses.len()).collect();
    let next = ((poses.len() - 1) as f64 * FAR) as usize;
    while centres.len() < count {
        let last = poses[centres[centres.len() - 1]].as_ref();
        distances
            .par_iter_mut()
            .zip(poses)
            .for_each(|(distance, pose)| *distance = distance.min(squared(pose.as_ref(), last)));
        let by_distance = |a: &usize, b: &usize| distances[*a].total_cmp(&distances[*b]).then(a.cmp(b));
        let (_, &mut far, _) = order.select_nth_unstable_by(next, by_distance);
        centres.push(far);
    }
    centres
}

/// Index of the least number, the first of equal ones, and the number.
fn least(numbers: impl Iterator<Item = f64>) -> (usize, f64) {
    numbers.enumerate().fold(
        (0, f64::INFINITY),
        |best, (index, number)| if number < best.1 { (index, number) } else { best },
    )
}

/// Squared distance of two poses' angles.
pub fn squared(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).skip(ROOT_DOFS).map(|(a, b)| (a - b) * (a - b)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pose(angles: [f64; 2]) -> Vec<f64> {
        [&[9.0; ROOT_DOFS][..], &angles].concat()
    }

    #[test]
    fn each_of_three_clusters_is_stood_for_by_its_middle() {
        let mut poses = Vec::new();
        for centre in [[0.0, 0.0], [5.0, 0.0], [0.0, 5.0]] {
            for off in [-0.4, 0.0, 0.4] {
                poses.push(pose([centre[0] + off, centre[1]]));
                // what the root does is nothing
                poses.push([&[off; ROOT_DOFS][..], &[centre[0], centre[1] + off]].concat());
            }
        }
        let chosen = covering(&poses, 3);
        let angles: Vec<_> = chosen.iter().map(|&i| [poses[i][6], poses[i][7]]).collect();
        assert_eq!(angles, [[0.0, 0.0], [5.0, 0.0], [0.0, 5.0]]);
        assert_eq!(covering(&poses, 3), chosen);
    }

    #[test]
    fn few_poses_are_all_chosen() {
        let poses = [pose([0.0, 1.0]), pose([1.0, 1.0])];
        assert_eq!(covering(&poses, 5), [0, 1]);
        assert_eq!(covering(&poses, 1).len(), 1);
        assert!(covering(&poses, 0).is_empty());
    }
}
