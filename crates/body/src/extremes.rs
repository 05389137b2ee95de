use nalgebra::Vector3;

/// The lowest and the highest vertex.
pub fn lowest_and_highest(vertices: &[Vector3<f64>]) -> [usize; 2] {
    let (mut lowest, mut highest) = (0, 0);
    for (index, vertex) in vertices.iter().enumerate() {
        if vertex.y < vertices[lowest].y {
            lowest = index;
        }
        if vertex.y > vertices[highest].y {
            highest = index;
        }
    }
    [lowest, highest]
}

/// Lowest and highest coordinate y.
pub fn heights(vertices: &[Vector3<f64>]) -> [f64; 2] {
    vertices.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], vertex| {
        [low.min(vertex.y), high.max(vertex.y)]
    })
}
