use formats::media_type::JSON;
use jobs::run_json::{RUN_JSON, Request, RunReport};
use queue::JobError;
use serde::Serialize;

use crate::ResultFile;

/// `run.json`; `own`: the parts that runs of this kind have beside the head, an object.
///
/// # Errors
/// To be tried again if it is no JSON.
pub fn run_json(
    report: &RunReport<'_>,
    request: &impl Request,
    own: impl Serialize,
) -> Result<ResultFile, JobError> {
    Ok(ResultFile::ready(RUN_JSON, JSON, report.to_json(request, own)?))
}
