//! What is in a motion database: what people are told of it.

use jobs::motion_database::{Clip, PartClip, Share};
use std::collections::BTreeMap;

/// Most warnings that are kept; a bad archive has one a file.
const MAX_WARNINGS: usize = 100;

/// How much of `clips` goes by each name.
pub(crate) fn shares(clips: &[Clip], name: impl Fn(&Clip) -> &str) -> Vec<Share> {
    let mut by_name: BTreeMap<&str, (usize, usize)> = BTreeMap::new();
    for clip in clips {
        let (num_clips, num_poses) = by_name.entry(name(clip)).or_default();
        *num_clips += 1;
        *num_poses += clip.num_poses;
    }
    let share =
        |(name, (num_clips, num_poses)): (&str, _)| Share { name: name.to_owned(), num_clips, num_poses };
    by_name.into_iter().map(share).collect()
}

/// The first of many warnings, and how many there are.
pub(crate) fn shortened(mut warnings: Vec<String>) -> Vec<String> {
    if warnings.len() > MAX_WARNINGS {
        let more = warnings.len() - MAX_WARNINGS;
        warnings.truncate(MAX_WARNINGS);
        warnings.push(format!("and {more} more"));
    }
    warnings
}

/// Names that no two trials of a database share: `walk`, `walk_2`, `walk_3`.
#[derive(Debug, Default)]
pub(crate) struct Names {
    /// the number that the next of that name gets
    next: BTreeMap<String, usize>,
}

impl Names {
    pub fn unique(&mut self, name: &str) -> String {
        let mut number = self.next.get(name).copied().unwrap_or(1);
        loop {
            let candidate = if number == 1 { name.to_owned() } else { format!("{name}_{number}") };
            number += 1;
            if number == 2 || !self.next.contains_key(&candidate) {
                self.next.insert(name.to_owned(), number);
                self.next.entry(candidate.clone()).or_insert(2);
                return candidate;
            }
        }
    }
}

/// Names of a part's clips in the whole database: a trial keeps its name unless another has it, and what was made of
/// it is named after it.
pub(crate) fn names(clips: &[PartClip], names: &mut Names) -> Vec<String> {
    let mut trial = (None, String::new());
    let name = |clip: &PartClip| {
        let own = motion_db::trial_name(&clip.name);
        if trial.0 != Some(clip.file) {
            trial = (Some(clip.file), names.unique(own));
        }
        format!("{}{}", trial.1, clip.name.strip_prefix(own).unwrap_or_default())
    };
    clips.iter().map(name).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trials_of_one_name_are_kept_apart_and_what_is_made_of_them_stays_with_them() {
        let clip = |file, name: &str| PartClip {
            file,
            name: name.to_owned(),
            subject: String::new(),
            action: String::new(),
            num_poses: 10,
        };
        let mut known = Names::default();
        assert_eq!(known.unique("run"), "run");
        let part =
            [clip(0, "walk"), clip(0, "walk~mirror"), clip(1, "walk~x0.8"), clip(2, "run"), clip(3, "run_2")];
        let found = names(&part, &mut known);
        assert_eq!(found, ["walk", "walk~mirror", "walk_2~x0.8", "run_2", "run_2_2"]);
        assert_eq!(names(&[clip(0, "walk")], &mut known), ["walk_3"]);
    }

    #[test]
    fn shares_add_up() {
        let clip = |action: &str, num_poses| Clip {
            name: String::new(),
            subject: "7".to_owned(),
            action: action.to_owned(),
            num_poses,
        };
        let clips = [clip("walk", 10), clip("run", 5), clip("walk", 1)];
        let share = |name: &str, num_clips, num_poses| Share { name: name.to_owned(), num_clips, num_poses };
        assert_eq!(shares(&clips, |c| &c.action), [share("run", 1, 5), share("walk", 2, 11)]);
        assert_eq!(shares(&clips, |c| &c.subject), [share("7", 3, 16)]);
    }
}
