use serde::{Deserialize, Serialize};

/// Sex of a person, where scans tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Sex {
    /// female
    Female,
    /// male
    Male,
}

/// A word that is not a sex.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("sex is {found:?}, expected female or male")]
pub struct UnknownSex {
    /// the word
    pub found: String,
}

impl std::str::FromStr for Sex {
    type Err = UnknownSex;

    fn from_str(word: &str) -> Result<Self, UnknownSex> {
        match word {
            "female" => Ok(Self::Female),
            "male" => Ok(Self::Male),
            found => Err(UnknownSex { found: found.to_owned() }),
        }
    }
}

/// What is known of a scanned person besides the scan.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Subject {
    /// sex
    pub sex: Option<Sex>,
    /// age, years
    pub age_years: Option<f64>,
}
