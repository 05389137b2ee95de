use queue::{Handler, JobContext, JobError, JobId, Outcome};
use store::{Key, Store};

use crate::objects;

/// A handler whose jobs write files of a version (an index, a model) beside their artefacts: they stay where they are when the
/// run is deleted.
pub trait MakesVersion: Handler {
    /// The prefix of all that job `id` writes there, one of [`store::key`].
    fn version_prefix(job: &Self::Job, id: JobId) -> Key;
}

/// Runs a handler after it has removed what earlier attempts left of a version.
pub(crate) struct CleanStart<H> {
    pub store: Store,
    pub handler: H,
}

impl<H: MakesVersion> Handler for CleanStart<H> {
    type Job = H::Job;

    async fn run(&self, context: JobContext, job: H::Job) -> Result<Outcome, JobError> {
        let prefix = H::version_prefix(&job, context.id());
        objects::clean_up_earlier_attempts(&self.store, &context, &prefix).await;
        self.handler.run(context, job).await
    }
}
