use model::shown;
use serde::{Deserialize, Serialize};

/// Most speeds of one augmentation.
const MAX_WARPS: usize = 8;
/// Speeds at which motion still is motion of a person.
const WARPS: std::ops::RangeInclusive<f64> = 0.25..=4.0;

/// What a motion database holds beside its recordings: motion made from them, so that more is like what people do.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Augment {
    /// Every clip with left and right exchanged.
    pub mirror: bool,
    /// Every clip at these speeds: 0.8 is slower, 1.25 faster.
    pub warps: Vec<f64>,
}

/// An augmentation that makes no sense.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Too many speeds.
    #[error("augment.warps has {found} speeds, expected at most {MAX_WARPS}")]
    TooManyWarps {
        /// How many there are.
        found: usize,
    },
    /// No speed of motion.
    #[error("augment.warps has {}, expected speeds of 0.25 to 4 other than 1", shown(*found))]
    Warp {
        /// The speed.
        found: f64,
    },
    /// A speed that is there twice.
    #[error("augment.warps has {found} twice")]
    WarpTwice {
        /// The speed.
        found: f64,
    },
}

impl Augment {
    /// Whether nothing is added.
    pub fn is_none(&self) -> bool {
        !self.mirror && self.warps.is_empty()
    }

    /// How many clips are made of one, itself among them.
    pub fn copies(&self) -> usize {
        (1 + self.warps.len()) * (1 + usize::from(self.mirror))
    }

    /// Whether it makes sense.
    ///
    /// # Errors
    /// Says what does not.
    pub fn check(&self) -> Result<(), Error> {
        if self.warps.len() > MAX_WARPS {
            return Err(Error::TooManyWarps { found: self.warps.len() });
        }
        for (i, &found) in self.warps.iter().enumerate() {
            if !WARPS.contains(&found) || found == 1.0 {
                return Err(Error::Warp { found });
            }
            if self.warps[..i].contains(&found) {
                return Err(Error::WarpTwice { found });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speeds_that_are_none_are_refused() {
        let check = |warps: &[f64]| Augment { mirror: true, warps: warps.to_vec() }.check();
        assert_eq!(check(&[0.8, 1.25]), Ok(()));
        for bad in [f64::NAN, 0.0, -1.0, 1.0, f64::INFINITY, 5.0] {
            assert!(check(&[bad]).is_err(), "{bad}");
        }
        assert_eq!(check(&[0.8, 0.8]), Err(Error::WarpTwice { found: 0.8 }));
        assert_eq!(check(&[0.5; 9]), Err(Error::TooManyWarps { found: 9 }));
        assert_eq!(Augment { mirror: true, warps: vec![0.8, 1.25] }.copies(), 6);
    }
}
