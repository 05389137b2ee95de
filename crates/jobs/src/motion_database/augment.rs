use model::shown;
use serde::{Deserialize, Serialize};

/// Most speeds of one augmentation.
const MAX_SPEEDS: usize = 8;
/// Speeds at which motion still is motion of a person.
const SPEEDS: std::ops::RangeInclusive<f64> = 0.25..=4.0;

/// What a motion database holds beside its recordings: motion made from them, so that more is like what people do.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Augment {
    /// Every clip with left and right exchanged.
    pub mirror: bool,
    /// Every clip at these speeds: 0.8 is slower, 1.25 faster. `warps` in requests, payloads and rows.
    #[serde(rename = "warps")]
    pub speeds: Vec<f64>,
}

/// An augmentation that makes no sense.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Too many speeds.
    #[error("augment.warps has {found} speeds, expected at most {MAX_SPEEDS}")]
    TooManySpeeds {
        /// How many there are.
        found: usize,
    },
    /// No speed of motion.
    #[error("augment.warps has {}, expected speeds of 0.25 to 4 other than 1", shown(*found))]
    Speed {
        /// The speed.
        found: f64,
    },
    /// A speed that is there twice.
    #[error("augment.warps has {found} twice")]
    SpeedTwice {
        /// The speed.
        found: f64,
    },
}

impl Augment {
    /// Whether nothing is added.
    pub fn is_none(&self) -> bool {
        !self.mirror && self.speeds.is_empty()
    }

    /// How many clips are made of one, itself among them.
    pub fn copies(&self) -> usize {
        (1 + self.speeds.len()) * (1 + usize::from(self.mirror))
    }

    /// Whether it makes sense.
    ///
    /// # Errors
    /// Says what does not.
    pub fn check(&self) -> Result<(), Error> {
        if self.speeds.len() > MAX_SPEEDS {
            return Err(Error::TooManySpeeds { found: self.speeds.len() });
        }
        for (i, &found) in self.speeds.iter().enumerate() {
            if !SPEEDS.contains(&found) || found == 1.0 {
                return Err(Error::Speed { found });
            }
            if self.speeds[..i].contains(&found) {
                return Err(Error::SpeedTwice { found });
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
        let check = |speeds: &[f64]| Augment { mirror: true, speeds: speeds.to_vec() }.check();
        assert_eq!(check(&[0.8, 1.25]), Ok(()));
        for bad in [f64::NAN, 0.0, -1.0, 1.0, f64::INFINITY, 5.0] {
            assert!(check(&[bad]).is_err(), "{bad}");
        }
        assert_eq!(check(&[0.8, 0.8]), Err(Error::SpeedTwice { found: 0.8 }));
        assert_eq!(check(&[0.5; 9]), Err(Error::TooManySpeeds { found: 9 }));
        assert_eq!(Augment { mirror: true, speeds: vec![0.8, 1.25] }.copies(), 6);
    }
}
