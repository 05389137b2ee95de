//! Runs by inverse kinematics: one job solves measured points, and silhouettes of cameras where there are any.

pub use body::Sex;
pub use inverse_kinematics::Method;
use queue::Job;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::{
    CameraChoice, JobReport, PointChoice, SessionInputs,
    body_model::BodyModelFile,
    run_json::{LearnedFrom, Request, Subject},
};

/// The kind of such runs.
pub const RUN_KIND: &str = "inverse-kinematics";

/// Whose body it is: coefficients of the body model, or simple measurements.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BodyDescription {
    /// coefficients, standard deviations; with any, nothing else may be given
    pub alpha: Vec<f64>,
    /// metres
    pub stature_m: Option<f64>,
    /// kilograms
    pub mass_kg: Option<f64>,
    /// years
    pub age_years: Option<f64>,
    /// `female` or `male`
    pub sex: Option<Sex>,
}

/// How a session is solved by inverse kinematics.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct InverseKinematics {
    /// what is wanted
    pub solver: Method,
    /// most steps of one solve
    pub steps: usize,
    /// frames a second that are solved; `None`: the cameras', or else those of the points' file
    #[serde(default)]
    pub frame_rate: Option<f64>,
    /// whose body
    #[serde(default)]
    pub body: BodyDescription,
    /// which measured points
    #[serde(flatten)]
    pub choice: PointChoice,
}

/// Solves a session's measured points, and silhouettes that jobs before it have made, for the poses of a body. Taken by the
/// reconstruction service.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SolveInverseKinematics {
    /// The session.
    #[serde(flatten)]
    pub inputs: SessionInputs,
    /// The bodies that people may have.
    pub body_model: BodyModelFile,
    /// All resolved. Called as in `PlanMultiView`, with which such runs begin where there are cameras: their parameters look alike.
    #[serde(rename = "inverse_kinematics")]
    pub how: InverseKinematics,
    /// With cameras, their plan.
    #[serde(rename = "planned", default, skip_serializing_if = "Option::is_none")]
    pub cameras: Option<CamerasPlanned>,
}

impl Job for SolveInverseKinematics {
    const KIND: &'static str = "solve-inverse-kinematics";
    const VERSION: i32 = 2;

    /// Version 1 had two other names.
    fn upgrade(version: i32, mut payload: Value) -> Option<Value> {
        if version != 1 {
            return None;
        }
        let fields = payload.as_object_mut()?;
        for (before, now) in [("how", "inverse_kinematics"), ("cameras", "planned")] {
            if let Some(value) = fields.remove(before) {
                fields.insert(now.to_owned(), value);
            }
        }
        Some(payload)
    }
}

impl Request for SolveInverseKinematics {
    fn run_kind(&self) -> &'static str {
        RUN_KIND
    }

    fn subject(&self) -> Subject<'_> {
        self.inputs.subject()
    }

    fn learned_from(&self) -> LearnedFrom<'_> {
        LearnedFrom { body_model: Some(&self.body_model), ..LearnedFrom::default() }
    }

    fn reading(&self) -> Value {
        let cameras = self.cameras.as_ref();
        json!({
            "up": self.inputs.up,
            "points": self.how.choice,
            "cameras": cameras.map(|planned| &planned.choice),
        })
    }

    fn parameters(&self) -> serde_json::Result<Value> {
        let InverseKinematics { solver, steps, frame_rate, body, choice: _ } = &self.how;
        let silhouettes = self.cameras.as_ref().and_then(|planned| planned.parameters.as_ref());
        Ok(json!({
            "solver": solver,
            "steps": steps,
            "frame_rate": frame_rate,
            "body": body,
            "silhouettes": silhouettes.map(silhouette_parameters).transpose()?,
        }))
    }
}

/// The parameters of a camera run that decide its silhouettes.
fn silhouette_parameters(parameters: &multi_view::Parameters) -> serde_json::Result<Value> {
    let mut parameters = serde_json::to_value(parameters)?;
    if let Some(fields) = parameters.as_object_mut() {
        fields.retain(|name, _| multi_view::Parameters::OF_SILHOUETTES.contains(&name.as_str()));
    }
    Ok(parameters)
}

/// What the plan of the cameras hands on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CamerasPlanned {
    /// First frame that there are silhouettes of.
    pub first_frame: usize,
    /// Which cameras.
    #[serde(default)]
    pub choice: CameraChoice,
    /// How their silhouettes were made.
    #[serde(default)]
    pub parameters: Option<multi_view::Parameters>,
    /// What was doubtful about the files.
    pub warnings: Vec<String>,
    /// What the plan itself took.
    pub plan: JobReport,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_choice_of_points_is_said_where_sparse_runs_say_it() {
        let request: SolveInverseKinematics = serde_json::from_value(json!({
            "session_id": uuid::Uuid::nil(), "files": [],
            "body_model": { "id": uuid::Uuid::nil(), "name": "shipped", "version": 1, "store_key": "", "blake3": "" },
            "inverse_kinematics": { "solver": "plain", "steps": 15, "points": ["head"], "marker_set": "none" },
        }))
        .unwrap();
        let reading = request.reading();
        assert_eq!(reading["points"]["points"], json!(["head"]));
        assert_eq!(reading["points"]["marker_set"], "none");
        let parameters = request.parameters().unwrap();
        assert_eq!(parameters["solver"], "plain");
        assert_eq!(parameters["points"], Value::Null, "said once, with how the files are read");
    }

    #[test]
    fn parameters_of_silhouettes_are_those_that_decide_them() {
        let shown = silhouette_parameters(&multi_view::Parameters::default()).unwrap();
        let names: std::collections::BTreeSet<&str> =
            shown.as_object().unwrap().keys().map(String::as_str).collect();
        assert_eq!(names, multi_view::Parameters::OF_SILHOUETTES.into());
    }

    #[test]
    fn a_job_of_an_older_program_is_understood() {
        let how = json!({ "solver": "plain", "steps": 15, "points": ["head"] });
        let plan = json!({ "worker": "w", "attempt": 1, "seconds": 0.5, "frames": 0 });
        let older = json!({
            "session_id": uuid::Uuid::nil(), "files": [],
            "body_model": { "id": uuid::Uuid::nil(), "name": "shipped", "version": 1, "store_key": "", "blake3": "" },
            "how": how, "cameras": { "first_frame": 3, "warnings": [], "plan": plan },
        });
        let upgraded = SolveInverseKinematics::upgrade(1, older).unwrap();
        let job: SolveInverseKinematics = serde_json::from_value(upgraded).unwrap();
        assert_eq!(job.how.steps, 15);
        assert_eq!(job.cameras.unwrap().first_frame, 3);
        assert_eq!(SolveInverseKinematics::upgrade(3, json!({})), None);
    }
}
