use crate::gplvm::training_set::TrainingSet;

/// Poses among which the active set is sought, at most.
const CANDIDATES: usize = 6_000;
/// Rounds of k-means.
const ROUNDS: usize = 6;
/// What a unit of velocity (per frame) weighs against one of pose.
const VELOCITY_WEIGHT: f64 = 4.0;

/// Chooses `count` poses that stand for all (fewer, if there are fewer): those nearest to the centres of k-means. Returns their features, pose and velocity, row-major, shape
/// `[count, 2 · dofs]`.
///
/// Grochow et al. choose by the model's own variance; for a set as mixed as this one, that picks outliers first.
pub fn choose_active(set: &TrainingSet, count: usize) -> Vec<f64> {
    let width = 2 * set.dofs;
    let step = set.len().div_ceil(CANDIDATES).max(1);
    let mut rows = Vec::with_capacity(set.len().div_ceil(step) * width);
    for i in (0..set.len()).step_by(step) {
        rows.extend_from_slice(&set.poses[i * set.dofs..(i + 1) * set.dofs]);
        rows.extend(set.velocities[i * set.dofs..(i + 1) * set.dofs].iter().map(|v| v * VELOCITY_WEIGHT));
    }
    let mut chosen = medoids(&rows, width, count);
    chosen.sort_unstable();
    let mut active = Vec::with_capacity(chosen.len() * width);
    for i in chosen {
        let (pose, velocity) = rows[i * width..(i + 1) * width].split_at(set.dofs);
        active.extend_from_slice(pose);
        active.extend(velocity.iter().map(|v| v / VELOCITY_WEIGHT));
    }
    active
}

/// Rows nearest to the centres of `count` clusters, every row at most once.
fn medoids(rows: &[f64], width: usize, count: usize) -> Vec<usize> {
    let total = rows.len() / width;
    let count = count.min(total);
    let row = |i: usize| &rows[i * width..(i + 1) * width];
    let mut centres = first_centres(rows, width, count);
    let mut nearest = vec![(0, 0.0); total];
    for round in 0..=ROUNDS {
        for (i, nearest) in nearest.iter_mut().enumerate() {
            *nearest = nearest_centre(row(i), &centres);
        }
        if round == ROUNDS {
            break;
        }
        let mut members = vec![0usize; count];
        let mut sums = vec![0.0; centres.len()];
        for (i, (c, _)) in nearest.iter().enumerate() {
            members[*c] += 1;
            sums[c * width..(c + 1) * width].iter_mut().zip(row(i)).for_each(|(s, v)| *s += v);
        }
        for (c, &members) in members.iter().enumerate() {
            let centre = &mut centres[c * width..(c + 1) * width];
            if members > 0 {
                centre.iter_mut().zip(&sums[c * width..]).for_each(|(v, s)| *v = s / members as f64);
                continue;
            }
            // A centre that lost all its rows goes to the row that is worst off.
            let worst = (0..total).max_by(|a, b| nearest[*a].1.total_cmp(&nearest[*b].1)).unwrap_or(0);
            centre.copy_from_slice(row(worst));
            nearest[worst].1 = 0.0;
        }
    }
    let mut best: Vec<Option<(usize, f64)>> = vec![None; count];
    for (i, &(c, distance)) in nearest.iter().enumerate() {
        if best[c].is_none_or(|(_, least)| distance < least) {
            best[c] = Some((i, distance));
        }
    }
    best.into_iter().flatten().map(|(i, _)| i).collect()
}

/// Half of the centres evenly spread over the rows, the other half each the row farthest from those before.
fn first_centres(rows: &[f64], width: usize, count: usize) -> Vec<f64> {
    let total = rows.len() / width;
    let row = |i: usize| &rows[i * width..(i + 1) * width];
    let even = count.div_ceil(2);
    let mut centres: Vec<f64> = (0..even).flat_map(|c| row(c * total / even)).copied().collect();
    let mut distances: Vec<f64> = (0..total).map(|i| nearest_centre(row(i), &centres).1).collect();
    for _ in even..count {
        let farthest = (0..total).max_by(|a, b| distances[*a].total_cmp(&distances[*b])).unwrap_or(0);
        let centre = row(farthest);
        centres.extend_from_slice(centre);
        for (i, distance) in distances.iter_mut().enumerate() {
            *distance = distance.min(nearest_centre(row(i), centre).1);
        }
    }
    centres
}

/// Index and squared distance of the centre nearest to `row`.
pub fn nearest_centre(row: &[f64], centres: &[f64]) -> (usize, f64) {
    let mut nearest = (0, f64::INFINITY);
    for (c, centre) in centres.chunks_exact(row.len()).enumerate() {
        let mut distance = 0.0;
        // In pieces, to stop early.
        for (a, b) in row.chunks(32).zip(centre.chunks(32)) {
            distance += a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
            if distance >= nearest.1 {
                break;
            }
        }
        if distance < nearest.1 {
            nearest = (c, distance);
        }
    }
    nearest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_active_set_has_a_pose_of_every_cluster() {
        let poses: Vec<f64> = (0..90).map(|i| (i % 3) as f64 * 100.0 + (i as f64 * 0.7).sin()).collect();
        let set = TrainingSet { dofs: 1, velocities: vec![0.0; poses.len()], poses };
        let active = choose_active(&set, 3);
        let mut found: Vec<i64> = active.chunks_exact(2).map(|r| (r[0] / 100.0).round() as i64).collect();
        found.sort_unstable();
        assert_eq!(found, [0, 1, 2]);
    }

    #[test]
    fn no_pose_is_active_twice() {
        let set = TrainingSet { dofs: 1, poses: (0..20).map(f64::from).collect(), velocities: vec![0.0; 20] };
        let active = choose_active(&set, 400);
        let mut poses: Vec<f64> = active.chunks_exact(2).map(|r| r[0]).collect();
        poses.dedup();
        assert_eq!(poses.len(), 20);
    }
}
