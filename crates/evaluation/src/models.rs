//! Latent variable models that have not seen the trials they are used for.

use std::{collections::BTreeSet, ops::ControlFlow};

use motion_db::{ClipInfo, MotionDatabase, trial_name};
use rayon::prelude::*;
use regression::gplvm::{Gplvm, TrainingOptions};
use sparse::{Method, train_gplvm};

use crate::{Error, Protocol, SparseEvaluation};

/// Models that are trained: each leaves out every n-th trial (or performer). One for each trial would cost a minute a trial.
const FOLDS: usize = 5;

/// A model for each fold of the trials; none if no method needs one.
pub(crate) struct Models {
    folds: Vec<Gplvm>,
    /// the fold of each trial
    trial_folds: Vec<usize>,
}

impl Models {
    /// Trains what the sweep's methods need, on the threads of `pool`. A trial's model has seen nothing that the protocol leaves out for it;
    /// nor what it leaves out for the other trials of its fold.
    pub fn train(
        evaluation: &SparseEvaluation<'_>,
        database: &MotionDatabase,
        pool: &rayon::ThreadPool,
    ) -> Result<Self, Error> {
        if !evaluation.sweep.methods.contains(&Method::Gplvm) {
            return Ok(Self { folds: Vec::new(), trial_folds: Vec::new() });
        }
        let trial_folds = folds(evaluation);
        let used: BTreeSet<usize> = trial_folds.iter().copied().collect();
        let trained: Vec<_> = pool.install(|| {
            let folds: Vec<usize> = (0..=used.last().copied().unwrap_or(0)).collect();
            folds
                .par_iter()
                .map(|fold| {
                    let is_left_out = |other: &ClipInfo| {
                        evaluation.test.iter().zip(&trial_folds).any(|(clip, f)| {
                            f == fold && evaluation.protocol.leaves_out(&clip.name, &clip.subject, other)
                        })
                    };
                    let mut go_on = |_, _| ControlFlow::Continue(());
                    let rest = database.without(is_left_out)?;
                    train_gplvm(&rest, &TrainingOptions::default(), &|_| false, &mut go_on)
                })
                .collect()
        });
        let folds = trained.into_iter().collect::<Result<Vec<_>, _>>();
        Ok(Self { folds: folds.map_err(|source| Error::Training { source })?, trial_folds })
    }

    /// The model for a trial.
    pub fn for_trial(&self, trial: usize) -> Option<&Gplvm> {
        self.folds.get(*self.trial_folds.get(trial)?)
    }
}

/// The fold of each trial: what must be left out together is in one.
fn folds(evaluation: &SparseEvaluation<'_>) -> Vec<usize> {
    let mut groups: Vec<&str> = Vec::new();
    let fold = evaluation.test.iter().map(|clip| {
        let group = match evaluation.protocol {
            Protocol::TrialOut => trial_name(&clip.name),
            Protocol::SubjectOut => &clip.subject,
            Protocol::TrialIn => "",
        };
        let place = groups.iter().position(|g| *g == group).unwrap_or_else(|| {
            groups.push(group);
            groups.len() - 1
        });
        place % FOLDS
    });
    fold.collect()
}
