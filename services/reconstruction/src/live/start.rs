//! What a stream is to start with: everything that is looked up, read and checked before its first frame.

use super::LiveRpc;
use crate::{InputError, error::CallError, priors::Prior};
use model::Skeleton;
use motion_db::ControlTable;
use proto::v1::{self, LiveDelivery};
use service::{FileError, compute};
use sparse::{Method, Parameters, Session, control_points};
use std::sync::Arc;

/// Frames from one state to the next, unless the client says otherwise.
const STATE_EVERY: u32 = 60;
/// Largest skeleton file, bytes.
const MAX_SKELETON_BYTES: usize = 1 << 20;

/// A stream about to start.
pub(super) struct Start {
    pub prior: Prior,
    pub session: Session,
    pub parameters: Parameters,
    pub table: Arc<ControlTable>,
    pub is_every: bool,
    pub joint_positions: bool,
    pub state: Vec<u8>,
    pub state_every: u64,
}

impl LiveRpc {
    /// Reads a start, and gets what it names.
    pub(super) async fn prepare(&self, start: v1::LiveStart) -> Result<Start, CallError> {
        let id = proto::id("database_id", &start.database_id)?;
        let delivery = LiveDelivery::try_from(start.delivery)
            .map_err(|_| out_of_range("delivery", start.delivery, "latest or every"))?;
        if start.skeleton_asf.len() > MAX_SKELETON_BYTES {
            let found = format!("{} bytes long", start.skeleton_asf.len());
            return Err(out_of_range("skeleton_asf", found, "at most 1 MiB"));
        }
        let parameters = parameters(&start.parameters_json)?;
        let file = self.shared.motion_database(id).await?;
        let prior = self.shared.priors.get(&file, parameters.window).await.map_err(CallError::Prior)?;
        let key = key(&file.blake3, parameters.window, &start);
        let database = prior.database.clone();
        let (asf, points) = (start.skeleton_asf, start.points);
        let session = compute::run(move || -> Result<_, CallError> {
            let skeleton = skeleton(&asf, database.skeleton())?;
            let points = control_points(&skeleton, &points).map_err(crate::InputError::from)?;
            Ok(Session::without_frames(skeleton, points)?)
        })
        .await?;
        let table = self.table(key, &prior, &session).await?;
        Ok(Start {
            prior,
            session,
            parameters,
            table,
            is_every: delivery == LiveDelivery::Every,
            joint_positions: start.joint_positions,
            state: start.state,
            state_every: if start.state_every == 0 { STATE_EVERY } else { start.state_every }.into(),
        })
    }

    /// The control points in every pose of the database: made once for all streams that have them in common.
    async fn table(
        &self,
        key: blake3::Hash,
        prior: &Prior,
        session: &Session,
    ) -> Result<Arc<ControlTable>, CallError> {
        let numbers = prior.database.num_poses() * (6 * session.points.len() + 1);
        let bytes = (numbers * size_of::<f32>()) as u64;
        let (prior, session) = (prior.clone(), session.clone());
        let make = move || sparse::control_table(&prior.database, &prior.index, &session);
        self.tables.get_or_load(key, async { Ok((compute::run(make).await?, bytes)) }).await
    }
}

fn key(database: &str, window: usize, start: &v1::LiveStart) -> blake3::Hash {
    let mut hasher = blake3::Hasher::new();
    let texts = [database, &start.skeleton_asf].into_iter().chain(start.points.iter().map(String::as_str));
    for text in texts {
        hasher.update(&(text.len() as u64).to_le_bytes());
        hasher.update(text.as_bytes());
    }
    hasher.update(&(window as u64).to_le_bytes());
    hasher.finalize()
}

fn skeleton(asf: &str, borrowed: &Arc<Skeleton>) -> Result<Arc<Skeleton>, CallError> {
    if asf.is_empty() {
        return Ok(borrowed.clone());
    }
    let in_file = FileError::in_file("skeleton_asf");
    Ok(formats::asf::read(asf.as_bytes()).map_err(in_file).map_err(InputError::from)?.value.skeleton)
}

fn parameters(json: &str) -> Result<Parameters, CallError> {
    if json.is_empty() {
        return Ok(Parameters::default());
    }
    let parameters: Parameters =
        serde_json::from_str(json).map_err(|e| out_of_range("parameters_json", e, "parameters as JSON"))?;
    parameters.check()?;
    let refuse = |name, found: &str, expected| {
        Err(sparse::Error::Parameter { name, found: found.to_owned(), expected }.into())
    };
    if parameters.smooth {
        return refuse(
            "smooth",
            "true",
            "false: smoothing needs future frames, which a live stream does not have",
        );
    }
    if parameters.method == Method::Gplvm {
        return refuse("method", "gplvm", "another one for a live stream: gplvm works for runs only");
    }
    Ok(parameters)
}

fn out_of_range(field: &'static str, found: impl ToString, expected: &'static str) -> CallError {
    proto::Error::OutOfRange { field, found: found.to_string(), expected }.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_that_do_nothing_live_are_refused() {
        for (json, expected) in [
            (r#"{"smooth": true}"#, "smooth is true, expected false"),
            (r#"{"method": "gplvm"}"#, "method is gplvm, expected another one"),
        ] {
            let error = parameters(json).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
        assert!(parameters(r#"{"smooth": false, "method": "lpca"}"#).is_ok());
        assert!(parameters("").is_ok());
    }
}
