use formats::FileRole;
use queue::{Artefact, JobError};
use serde::{Deserialize, Serialize};

/// An uploaded file as a job sees it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct InputFile {
    /// Name given by the user.
    pub name: String,
    /// What it is for.
    pub role: FileRole,
    /// Where it is in the object store.
    pub store_key: String,
    /// Size, bytes.
    pub bytes: u64,
    /// BLAKE3 of the content, hex.
    pub blake3: String,
}

/// Something an earlier job wrote.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Object {
    /// Where it is in the object store.
    pub store_key: String,
    /// BLAKE3 of the content, hex.
    pub blake3: String,
}

impl From<&Artefact> for Object {
    fn from(artefact: &Artefact) -> Self {
        Self { store_key: artefact.store_key.clone(), blake3: artefact.blake3.clone() }
    }
}

/// The artefact of that name.
///
/// # Errors
/// To be tried again if there is none: the jobs that were waited for have left it.
pub fn named<'a>(artefacts: &'a [Artefact], name: &str) -> Result<&'a Artefact, JobError> {
    let found = artefacts.iter().find(|artefact| artefact.name == name);
    found.ok_or_else(|| JobError::retry(format!("{name} is missing")))
}

/// A camera's name as a part of a file's.
pub fn file_part(camera: &str, index: usize) -> String {
    let kept: String =
        camera.chars().take(60).map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    // names that differ in other signs must not collide
    if kept == camera { kept } else { format!("{kept}_{index}") }
}
