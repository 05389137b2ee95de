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

/// What is known of a scanned person besides the scan.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Subject {
    /// sex
    pub sex: Option<Sex>,
    /// age, years
    pub age_years: Option<f64>,
}
