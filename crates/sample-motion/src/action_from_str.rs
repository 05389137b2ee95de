use std::str::FromStr;

use crate::{Action, Error};

impl FromStr for Action {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self, Error> {
        Self::ALL
            .into_iter()
            .find(|action| action.name() == name)
            .ok_or_else(|| Error::UnknownAction { found: name.to_owned() })
    }
}
