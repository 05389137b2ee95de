use std::collections::BTreeSet;

use serde::{Serialize, Serializer, ser::SerializeMap};

use crate::JobReport;

/// The jobs of a run by stage, in the order in which they were done.
#[derive(Debug, Clone, Default)]
pub struct Timings<'a> {
    stages: Vec<(&'static str, Reports<'a>)>,
    frames_per_second: Option<f64>,
}

/// The jobs of a stage.
#[derive(Debug, Clone, Serialize)]
#[serde(untagged)]
enum Reports<'a> {
    /// of a stage that is always one job
    One(&'a JobReport),
    /// of one that is as many as there is work for
    All(Vec<&'a JobReport>),
}

impl<'a> Timings<'a> {
    /// With the one job of a stage.
    #[must_use]
    pub fn one(mut self, stage: &'static str, job: &'a JobReport) -> Self {
        self.stages.push((stage, Reports::One(job)));
        self
    }

    /// With all jobs of a stage.
    #[must_use]
    pub fn all(mut self, stage: &'static str, jobs: impl IntoIterator<Item = &'a JobReport>) -> Self {
        self.stages.push((stage, Reports::All(jobs.into_iter().collect())));
        self
    }

    /// With the frames that these jobs computed in a second, together and by themselves.
    #[must_use]
    pub fn speed<'b>(mut self, jobs: impl IntoIterator<Item = &'b JobReport>) -> Self {
        let sum =
            |(frames, seconds): (usize, f64), job: &JobReport| (frames + job.frames, seconds + job.seconds);
        let (frames, seconds) = jobs.into_iter().fold((0, 0.0), sum);
        self.frames_per_second = Some(if seconds > 0.0 { frames as f64 / seconds } else { 0.0 });
        self
    }

    /// The worker processes, each once.
    pub(super) fn workers(&self) -> BTreeSet<&'a str> {
        let jobs = self.stages.iter().flat_map(|(_, reports)| match reports {
            Reports::One(job) => std::slice::from_ref(job),
            Reports::All(jobs) => jobs.as_slice(),
        });
        jobs.map(|job| job.worker.as_str()).collect()
    }
}

impl Serialize for Timings<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        for (stage, reports) in &self.stages {
            map.serialize_entry(stage, reports)?;
        }
        if let Some(speed) = self.frames_per_second {
            map.serialize_entry("frames_per_second", &speed)?;
        }
        map.end()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_stage_is_one_job_or_a_list_and_every_worker_is_named_once() {
        let job =
            |worker: &str, frames| JobReport { worker: worker.to_owned(), attempt: 1, seconds: 2.0, frames };
        let (plan, chunks) = (job("a", 0), [job("b", 30), job("a", 50)]);
        let timings = Timings::default().one("plan", &plan).all("chunks", &chunks).speed(&chunks);
        let found = serde_json::to_value(&timings).unwrap();
        assert_eq!(found["plan"]["worker"], "a");
        assert_eq!(found["chunks"].as_array().map(Vec::len), Some(2));
        assert_eq!(found["frames_per_second"], json!(20.0));
        assert_eq!(timings.workers().into_iter().collect::<Vec<_>>(), ["a", "b"]);
    }
}
