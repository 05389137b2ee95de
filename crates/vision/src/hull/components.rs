use model::Mesh;

/// The piece of a mesh that encloses the largest volume, with the vertices it needs; and the volumes of the pieces of at
/// least a thousandth of that, cubic metres, largest first (cavities have none).
pub(super) fn largest_component(mesh: Mesh) -> (Mesh, Vec<f64>) {
    let mut parents: Vec<u32> = (0..mesh.vertices.len() as u32).collect();
    for &[a, b, c] in &mesh.faces {
        join(&mut parents, a, b);
        join(&mut parents, a, c);
    }
    let mut six_volumes = vec![0.0; mesh.vertices.len()];
    for face in &mesh.faces {
        let [a, b, c] = mesh.corners(face);
        six_volumes[root(&mut parents, face[0]) as usize] += a.dot(&b.cross(&c));
    }
    let mut pieces: Vec<(f64, u32)> =
        six_volumes.iter().zip(0u32..).filter(|(volume, _)| **volume > 0.0).map(|(v, i)| (*v, i)).collect();
    pieces.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let Some(&(most, largest)) = pieces.first() else { return (Mesh::default(), Vec::new()) };
    pieces.retain(|(six_volume, _)| *six_volume >= 0.001 * most);
    let mut kept = Mesh::default();
    let mut new_index = vec![u32::MAX; mesh.vertices.len()];
    for face in &mesh.faces {
        if root(&mut parents, face[0]) != largest {
            continue;
        }
        kept.faces.push(face.map(|corner| {
            let index = &mut new_index[corner as usize];
            if *index == u32::MAX {
                *index = kept.vertices.len() as u32;
                kept.vertices.push(mesh.vertices[corner as usize]);
            }
            *index
        }));
    }
    (kept, pieces.into_iter().map(|(six_volume, _)| six_volume / 6.0).collect())
}

fn root(parents: &mut [u32], mut vertex: u32) -> u32 {
    while parents[vertex as usize] != vertex {
        let above = parents[parents[vertex as usize] as usize];
        parents[vertex as usize] = above;
        vertex = above;
    }
    vertex
}

/// The smaller number becomes the root, so that the result doesn't depend on the order.
fn join(parents: &mut [u32], a: u32, b: u32) {
    let (a, b) = (root(parents, a), root(parents, b));
    parents[a.max(b) as usize] = a.min(b);
}
