use kinematics::{Kinematics, PointSet, State};
use nalgebra::Vector3;

/// A measured position of a control point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measurement {
    /// position, metres, in the frame in which the pose is sought
    pub position: Vector3<f64>,
    /// standard deviation of each coordinate, metres
    pub sigma: f64,
}

/// The likelihood term: squared distances of the measured points, each over its variance.
#[derive(Debug, Clone)]
pub struct ControlPoints {
    points: PointSet,
    state: State,
    positions: Vec<Vector3<f64>>,
    all_rows: Vec<f64>,
}

impl ControlPoints {
    /// The term of `points` on `kinematics`, with the memory it needs.
    pub fn new(kinematics: &Kinematics, points: PointSet) -> Self {
        Self {
            state: kinematics.state(),
            positions: vec![Vector3::zeros(); points.len()],
            all_rows: vec![0.0; 3 * points.len() * kinematics.num_dofs()],
            points,
        }
    }

    /// Variances of the measured coordinates, metres², packed into `out`; returns their number (three a measured point).
    pub fn variances(&self, measured: &[Option<Measurement>], out: &mut [f64]) -> usize {
        let mut rows = 0;
        for m in measured.iter().flatten() {
            out[rows..rows + 3].fill(m.sigma * m.sigma);
            rows += 3;
        }
        rows
    }

    /// The coordinates that move each measured point, in rising order.
    pub fn moved_by(&self, measured: &[Option<Measurement>]) -> impl Iterator<Item = &[usize]> + Clone {
        let points = measured.iter().enumerate();
        points.filter_map(|(point, m)| m.as_ref().map(|_| self.points.moved_by(point)))
    }

    /// Residuals `c − f(x)` of the measured points, metres, packed into `out`; returns their number of rows (three a
    /// measured point) and the energy. `measured` has shape `[points]`, `None` where a point was not measured.
    pub fn residuals(
        &mut self,
        kinematics: &Kinematics,
        x: &[f64],
        measured: &[Option<Measurement>],
        out: &mut [f64],
    ) -> (usize, f64) {
        self.points.positions(kinematics, x, &mut self.state, &mut self.positions);
        let mut rows = 0;
        let mut energy = 0.0;
        for (position, measurement) in self.positions.iter().zip(measured) {
            let Some(m) = measurement else { continue };
            let residual = m.position - position;
            out[rows..rows + 3].copy_from_slice(residual.as_slice());
            rows += 3;
            energy += residual.norm_squared() / (m.sigma * m.sigma);
        }
        (rows, energy)
    }

    /// Derivative `∂f/∂x` of the measured points at the coordinates last given to [`Self::residuals`], packed
    /// row-major, shape `[rows, dofs]`.
    pub fn jacobian(&mut self, kinematics: &Kinematics, measured: &[Option<Measurement>], out: &mut [f64]) {
        self.points.jacobian(kinematics, &self.state, &self.positions, &mut self.all_rows);
        let block = 3 * kinematics.num_dofs();
        let mut row = 0;
        for (rows, measurement) in self.all_rows.chunks_exact(block).zip(measured) {
            if measurement.is_some() {
                out[row..row + block].copy_from_slice(rows);
                row += block;
            }
        }
    }
}
