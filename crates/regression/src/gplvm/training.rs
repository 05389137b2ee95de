use std::ops::ControlFlow;

use crate::gplvm::active_set::choose_active;
use crate::gplvm::lbfgs::{Lbfgs, Verdict};
use crate::gplvm::model::Gplvm;
use crate::gplvm::objective::{Objective, Unknowns};
use crate::gplvm::training_set::TrainingSet;
use crate::{Error, Result};

/// How a model is trained. The defaults were tuned on the tuning part of the five-actions recordings (docs/methods.md).
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TrainingOptions {
    /// latent dimensions (1 to 8)
    pub latent_dims: usize,
    /// size of the active set (16 to 1000, and not more than there are poses); time grows with its cube
    pub active: usize,
    /// most steps of the optimiser (1 to 2000)
    pub max_iterations: usize,
}

impl Default for TrainingOptions {
    fn default() -> Self {
        Self { latent_dims: 5, active: 300, max_iterations: 200 }
    }
}

impl TrainingOptions {
    /// Most latent dimensions.
    pub const MOST_LATENT_DIMS: usize = 8;

    /// Checks every value against its range.
    ///
    /// # Errors
    /// [`Error::Option`] names the first one out of range.
    pub fn check(&self) -> Result<()> {
        let ranges = [
            ("latent_dims", self.latent_dims, 1..=Self::MOST_LATENT_DIMS, "1 to 8"),
            ("active", self.active, 16..=1000, "16 to 1000"),
            ("max_iterations", self.max_iterations, 1..=2000, "1 to 2000"),
        ];
        for (name, found, range, expected) in ranges {
            if !range.contains(&found) {
                return Err(Error::Option { name, found, expected });
            }
        }
        Ok(())
    }
}

/// Trains a model. `progress` is called with the number of steps done and planned, and may stop it. About 20 ms a step
/// at 300 active poses of 62 numbers; memory is that of the training set and a few matrices of the active set's size.
///
/// # Errors
/// If options or training set are out of range, or `progress` stops it.
pub fn train(
    set: &TrainingSet,
    options: &TrainingOptions,
    progress: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
) -> Result<Gplvm> {
    options.check()?;
    set.check()?;
    let total = options.max_iterations;
    let stopped = |iterations| Error::Stopped { iterations, total };
    if progress(0, total).is_break() {
        return Err(stopped(0));
    }
    let active = choose_active(set, options.active);
    let objective = Objective::new(&active, set.dofs, options.latent_dims);
    let mut unknowns = Unknowns::from_principal_components(&active, 2 * set.dofs, options.latent_dims);
    let mut lbfgs = Lbfgs::new(unknowns.values.len());
    let mut was_stopped = None;
    lbfgs.minimise(
        &mut unknowns.values,
        total,
        &mut |x, gradient| objective.value(x, gradient),
        &mut |done| {
            if progress(done, total).is_break() {
                was_stopped = Some(done);
                return Verdict::Stop;
            }
            Verdict::GoOn
        },
    );
    match was_stopped {
        Some(done) => Err(stopped(done)),
        None => objective.model(&unknowns.values),
    }
}
