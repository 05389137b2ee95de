//! The file of a trained model: 8 letters, u32 version, u32 dofs, latent dimensions and active poses, then f64: γ, β⁻¹,
//! μ, w⁻², latent points, features; last a BLAKE3 checksum of all before. Little-endian.

use crate::gplvm::model::Gplvm;
use crate::gplvm::stored::Stored;
use crate::gplvm::training::TrainingOptions;
use crate::{Error, Result};

const MAGIC: &[u8; 8] = b"MAREYGPL";
const VERSION: u32 = 1;
const HEADER: usize = 8 + 4 * 4;
const CHECKSUM: usize = 32;
const MOST_DOFS: usize = 4096;
const MOST_LATENT_DIMS: usize = TrainingOptions::MOST_LATENT_DIMS;
const MOST_ACTIVE: usize = 1000;

impl Gplvm {
    /// The model as a file; read by [`Self::from_bytes`].
    pub fn to_bytes(&self) -> Vec<u8> {
        let stored = &self.stored;
        let mut bytes = MAGIC.to_vec();
        for count in [VERSION as usize, stored.dofs, stored.latent_dims, self.active()] {
            bytes.extend_from_slice(&(count as u32).to_le_bytes());
        }
        let numbers = [stored.inverse_width, stored.noise];
        let parts = [&numbers[..], &stored.mean, &stored.variances, &stored.latent, &stored.features];
        for number in parts.into_iter().flatten() {
            bytes.extend_from_slice(&number.to_le_bytes());
        }
        let checksum = blake3::hash(&bytes);
        bytes.extend_from_slice(checksum.as_bytes());
        bytes
    }

    /// Reads what [`Self::to_bytes`] wrote.
    ///
    /// # Errors
    /// If the bytes are something else, of another version, damaged, or contradict themselves.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        let wrong = |found: String| Error::Bytes { found };
        if !bytes.starts_with(MAGIC) {
            return Err(wrong("other first letters".to_owned()));
        }
        if bytes.len() < HEADER + CHECKSUM {
            return Err(wrong(format!("{} bytes, expected at least {}", bytes.len(), HEADER + CHECKSUM)));
        }
        let (body, checksum) = bytes.split_at(bytes.len() - CHECKSUM);
        let header = body[MAGIC.len()..HEADER].as_chunks::<4>().0;
        let [version, dofs, latent_dims, active] =
            [0, 1, 2, 3].map(|i| u32::from_le_bytes(header[i]) as usize);
        if version != VERSION as usize {
            return Err(wrong(format!("version {version}, expected {VERSION}")));
        }
        let is_in_range = (1..=MOST_DOFS).contains(&dofs)
            && (1..=MOST_LATENT_DIMS).contains(&latent_dims)
            && (1..=MOST_ACTIVE).contains(&active);
        if !is_in_range {
            return Err(wrong(format!(
                "{active} poses of {dofs} numbers in {latent_dims} dimensions, expected at most {MOST_ACTIVE}, \
                 {MOST_DOFS} and {MOST_LATENT_DIMS}"
            )));
        }
        let width = 2 * dofs;
        let expected = 2 + 2 * width + active * (latent_dims + width);
        let (numbers, rest) = body[HEADER..].as_chunks::<8>();
        if numbers.len() != expected || !rest.is_empty() {
            let found = body.len() - HEADER;
            return Err(wrong(format!("{found} bytes of numbers, expected {}", 8 * expected)));
        }
        if blake3::hash(body).as_bytes() != checksum {
            return Err(wrong("a wrong checksum: the file is damaged".to_owned()));
        }
        let numbers: Vec<f64> = numbers.iter().map(|b| f64::from_le_bytes(*b)).collect();
        if let Some(i) = numbers.iter().position(|v| !v.is_finite()) {
            return Err(wrong(format!("{} as number {i}, expected a finite number", numbers[i])));
        }
        let (inverse_width, noise) = (numbers[0], numbers[1]);
        let (mean, rest) = numbers[2..].split_at(width);
        let (variances, rest) = rest.split_at(width);
        let (latent, features) = rest.split_at(active * latent_dims);
        let is_positive = inverse_width > 0.0 && noise > 0.0;
        if !is_positive || variances.iter().any(|v| *v < 0.0) || variances[..dofs].contains(&0.0) {
            return Err(wrong("a variance or width that is not positive".to_owned()));
        }
        Self::new(Stored {
            dofs,
            latent_dims,
            inverse_width,
            noise,
            mean: mean.to_vec(),
            variances: variances.to_vec(),
            latent: latent.to_vec(),
            features: features.to_vec(),
        })
    }
}
