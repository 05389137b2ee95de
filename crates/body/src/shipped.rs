use std::sync::{Arc, OnceLock};

use crate::BodyModel;

/// The model that comes with the program, read once a process.
#[derive(Debug, Clone)]
pub struct Shipped {
    /// the model
    pub model: Arc<BodyModel>,
    /// its file
    pub bytes: Vec<u8>,
    /// BLAKE3 of the file, hexadecimal: says in a run's report which one it was
    pub blake3: String,
}

/// The shipped model.
pub fn shipped() -> &'static Shipped {
    static SHIPPED: OnceLock<Shipped> = OnceLock::new();
    SHIPPED.get_or_init(|| {
        let model = BodyModel::shipped();
        let bytes = model.to_bytes();
        let blake3 = blake3::hash(&bytes).to_hex().to_string();
        Shipped { model: model.into(), bytes, blake3 }
    })
}
