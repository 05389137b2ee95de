use jobs::{Object, multi_view::TrackingSession};
use queue::JobError;
use service::{
    Resources,
    objects::{self, Input},
};

/// Largest report of a session, bytes: a clip of ten minutes takes a few hundred.
const MAX_BYTES: u64 = 64 << 20;

/// What is known of a session whose person is followed.
///
/// # Errors
/// As [`objects::read_json`].
pub async fn tracking_session(resources: &Resources, object: &Object) -> Result<TrackingSession, JobError> {
    let Object { store_key, blake3 } = object;
    let input = Input { name: "the session's artefact", store_key, blake3 };
    objects::read_json(&resources.store, input, MAX_BYTES).await
}
