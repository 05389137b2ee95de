//! Which takes are reconstructed, and which are learned from.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};

use model::counted;

use crate::take::{Take, Takes};

/// Takes that are held out, at most: the standard error of their mean is less than a fifth of their spread.
const MOST: usize = 32;
/// Of so many takes of a performer one is held out, at most.
const SHARE: usize = 5;

/// Takes divided into two.
#[derive(Debug)]
pub struct HeldOut {
    /// to be reconstructed
    pub tested: Vec<Take>,
    /// to learn from
    pub learned: Vec<Take>,
}

/// Takes to learn from that are read before the demo starts.
const READ: usize = 3;
/// AMC files without a skeleton that are named.
const NAMED: usize = 5;

impl HeldOut {
    /// Divides the takes of a folder, and says which of its files are none.
    ///
    /// # Errors
    /// If it is no folder, or too few takes are in it.
    pub fn in_folder(folder: &Path) -> anyhow::Result<Self> {
        let Takes { takes, without_skeleton } = Take::find_all(folder)?;
        let in_folder = || folder.display().to_string();
        if without_skeleton.is_empty() {
            return Self::choose(takes).with_context(in_folder);
        }
        let without_skeleton = format!(
            "no ASF file with the skeleton of {}: {}",
            counted(without_skeleton.len(), "AMC file"),
            named(folder, &without_skeleton)
        );
        if takes.is_empty() {
            bail!(
                "{}: found {without_skeleton}; expected one beside them, such as 16.asf for 16_15.amc",
                in_folder()
            );
        }
        eprintln!("warning: {}: {without_skeleton}; left out", in_folder());
        Self::choose(takes).with_context(in_folder)
    }

    /// That there is motion in what is tested, all of it, and in the first of what is learned from: known before anything is
    /// started.
    ///
    /// # Errors
    /// Says which file can't be read, and why.
    pub fn check(&self) -> anyhow::Result<()> {
        self.learned.iter().take(READ).chain(&self.tested).try_for_each(|take| {
            let read = take.read();
            read.map(|_| ()).with_context(|| format!("{}: can't be read", take.motion.display()))
        })
    }

    /// Divides takes in the order of their names: out of each five takes of a performer one is held out, evenly until there are
    /// enough. The same every time, whatever their motion. All performers stay among those learned from.
    ///
    /// # Errors
    /// If there are fewer than three.
    pub fn choose(mut takes: Vec<Take>) -> anyhow::Result<Self> {
        if takes.len() < 3 {
            let found = counted(takes.len(), "recorded trial");
            bail!("found {found} (ASF with AMC, or BVH), expected at least 3");
        }
        // where actions come in turn, so do those of every fifth take; by letters 100 would follow 1
        takes.sort_by_cached_key(|take| parts(&take.name));
        let mut candidates = Vec::new();
        let mut before = 0;
        for own in takes.chunk_by(|a, b| a.performer() == b.performer()) {
            // the middle ones of each five; of few takes one
            let first = if own.len() < SHARE { own.len() / 2 } else { SHARE / 2 };
            if own.len() > 2 {
                candidates.extend((first..own.len()).step_by(SHARE).map(|index| before + index));
            }
            before += own.len();
        }
        if candidates.is_empty() {
            candidates.push(takes.len() / 2);
        }
        let count = candidates.len().min(MOST);
        let chosen: Vec<usize> = (0..count).map(|i| candidates[i * candidates.len() / count]).collect();
        let (mut tested, mut learned) = (Vec::new(), Vec::new());
        for (index, take) in takes.into_iter().enumerate() {
            if chosen.contains(&index) { tested.push(take) } else { learned.push(take) }
        }
        Ok(Self { tested, learned })
    }
}

fn named(folder: &Path, files: &[PathBuf]) -> String {
    let name = |path: &PathBuf| path.strip_prefix(folder).unwrap_or(path).display().to_string();
    let mut names: Vec<String> = files.iter().take(NAMED).map(name).collect();
    if files.len() > NAMED {
        names.push(format!("and {} more", files.len() - NAMED));
    }
    names.join(", ")
}

/// A name in parts that are numbers or none.
fn parts(name: &str) -> Vec<(String, u64)> {
    let mut parts = vec![(String::new(), 0_u64)];
    let mut was_digit = false;
    for letter in name.chars() {
        let digit = letter.to_digit(10);
        if was_digit && digit.is_none() {
            parts.push((String::new(), 0));
        }
        was_digit = digit.is_some();
        let index = parts.len() - 1;
        match digit {
            Some(digit) => parts[index].1 = parts[index].1.saturating_mul(10).saturating_add(digit.into()),
            None => parts[index].0.push(letter),
        }
    }
    parts
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    fn takes(counts: &[usize]) -> Vec<Take> {
        let name = |(performer, count): (usize, &usize)| {
            (0..*count).map(move |number| format!("{}_{number:03}", performer + 1)).collect::<Vec<_>>()
        };
        let take = |name: String| Take {
            motion: format!("{name}.amc").into(),
            name,
            skeleton: None,
            indices: Vec::new(),
        };
        counts.iter().enumerate().flat_map(name).map(take).collect()
    }

    #[test]
    fn every_performer_is_tested_and_learned_from_and_no_trial_is_both() -> anyhow::Result<()> {
        for counts in [&[40, 40, 40, 40][..], &[3, 4, 5], &[200, 1, 1, 12]] {
            let HeldOut { tested, learned } = HeldOut::choose(takes(counts))?;
            assert!(tested.len() <= MOST && !tested.is_empty());
            assert_eq!(tested.len() + learned.len(), counts.iter().sum::<usize>());
            assert!(tested.iter().all(|take| learned.iter().all(|other| other.motion != take.motion)));
            let mut numbers = BTreeMap::<&str, usize>::new();
            for take in &tested {
                *numbers.entry(take.performer()).or_default() += 1;
            }
            for (performer, count) in counts.iter().enumerate().filter(|(_, count)| **count > 2) {
                let tested = numbers.get(format!("{}", performer + 1).as_str()).copied().unwrap_or(0);
                assert!(tested >= 1 && tested <= count.div_ceil(SHARE), "{counts:?}: {numbers:?}");
            }
        }
        Ok(())
    }

    #[test]
    fn actions_that_come_in_turn_are_tested_alike() -> anyhow::Result<()> {
        // as `marey sample` names them: each performer does four actions, then the next one
        let name = |number: usize| format!("synthetic{}_{:02}", number / 4 % 4 + 1, number + 1);
        let take = |name: String| Take {
            motion: format!("{name}.amc").into(),
            name,
            skeleton: None,
            indices: Vec::new(),
        };
        let HeldOut { tested, .. } = HeldOut::choose((0..160).map(name).map(take).collect())?;
        let mut actions = [0; 4];
        for take in &tested {
            let number: usize = take.name.rsplit('_').next().unwrap_or_default().parse()?;
            actions[(number - 1) % 4] += 1;
        }
        assert_eq!(actions, [8; 4]);
        Ok(())
    }

    #[test]
    fn few_trials_of_many_performers_still_leave_one_to_test() -> anyhow::Result<()> {
        let HeldOut { tested, learned } = HeldOut::choose(takes(&[1, 1, 1]))?;
        assert_eq!((tested.len(), learned.len()), (1, 2));
        assert!(HeldOut::choose(takes(&[2])).is_err());
        Ok(())
    }
}
