/// The gain α of steps along ∇h: the paper leaves it "configuration dependent".
///
/// It is the inverse of the curvature met along the last step (Barzilai and Borwein 1988;
/// docs/papers.md#image-constrained-inverse-kinematics): with s the last step and y the change of the gradient since,
/// α = −s·s / s·y. Where h curves upwards or nothing is known, it doubles.
#[derive(Debug, Clone)]
pub(crate) struct Gain {
    first: f64,
    greatest: f64,
    current: f64,
    /// the direction and gain chosen last and the time before, shape `[dofs]`
    last: Vec<f64>,
    before: Vec<f64>,
    gain_before: f64,
    steps: usize,
}

impl Gain {
    pub fn new(dofs: usize, first: f64, greatest: f64) -> Self {
        let none = || vec![0.0; dofs];
        Self { first, greatest, current: first, last: none(), before: none(), gain_before: 0.0, steps: 0 }
    }

    /// Forgets what was met: another frame begins.
    pub fn restart(&mut self) {
        self.current = self.first;
        self.steps = 0;
    }

    /// Begins a step: what was chosen last was done.
    pub fn measure(&mut self) {
        std::mem::swap(&mut self.last, &mut self.before);
        self.gain_before = self.current;
        self.steps += 1;
    }

    /// The gain for a step along `direction`, shape `[free]`. May be asked again in the same step with other coordinates
    /// free.
    pub fn choose(&mut self, free: &[usize], direction: &[f64]) -> f64 {
        self.last.fill(0.0);
        for (&dof, &value) in free.iter().zip(direction) {
            self.last[dof] = value;
        }
        if self.steps > 1 {
            let before = dense::inner_product(&self.before, &self.before);
            let along = dense::inner_product(&self.before, &self.last);
            // s = α b, y = l − b: −s·s / s·y = α b·b / (b·b − b·l)
            let fall = before - along;
            let gain = if fall > 1e-3 * before { self.gain_before * before / fall } else { self.greatest };
            self.current = gain.min(2.0 * self.gain_before).min(self.greatest);
        }
        self.current
    }
}
