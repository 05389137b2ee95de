use model::shown;
use posterior::SolverParameters;
use regression::gplvm::GplvmParameters;
use regression::{LpcaParameters, LpcrParameters};
use serde::{Deserialize, Serialize};

use crate::{Error, Result};

/// How the next pose is predicted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// weighted ridge regression on the neighbours
    #[default]
    LocalRegression,
    /// successor of the nearest example: the plain baseline
    Nearest,
    /// principal components of the neighbours' successors, and smoothness (Chai & Hodgins 2005;
    /// docs/papers.md#local-principal-components)
    Lpca,
    /// least squares on the principal components of the neighbours' windows (Liu et al. 2011, 2014;
    /// docs/papers.md#principal-component-regression)
    Lpcr,
    /// a global latent variable model trained beforehand (Grochow et al. 2004; docs/papers.md#latent-variable-model); see
    /// [`crate::train_gplvm`]
    Gplvm,
}

impl Method {
    /// All methods.
    pub const ALL: [Self; 5] = [Self::LocalRegression, Self::Nearest, Self::Lpca, Self::Lpcr, Self::Gplvm];

    /// The name by which it is asked for.
    pub fn name(self) -> &'static str {
        match self {
            Self::LocalRegression => "local-regression",
            Self::Nearest => "nearest",
            Self::Lpca => "lpca",
            Self::Lpcr => "lpcr",
            Self::Gplvm => "gplvm",
        }
    }
}

impl std::str::FromStr for Method {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        Self::ALL.into_iter().find(|method| method.name() == name).ok_or_else(|| Error::Parameter {
            name: "method",
            found: name.to_owned(),
            expected: "local-regression, nearest, lpca, lpcr or gplvm",
        })
    }
}

impl std::fmt::Display for Method {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

/// Which covariance the prior has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Covariance {
    /// that of the leave-one-out residuals
    #[default]
    Full,
    /// its diagonal: an independent σ a DOF, as the papers have it
    Diagonal,
}

/// How a frame's neighbours are searched.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Search {
    /// all of them: every window is considered
    Exact,
    /// nearly all of them, along the neighbour graph from those of the frame before
    #[default]
    Fast,
}

/// Everything that a reconstruction can choose. Missing fields take their defaults; unknown ones are refused.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Parameters {
    /// how the next pose is predicted
    pub method: Method,
    /// window length m, frames at 60 a second (1 to 16)
    pub window: usize,
    /// number of neighbours K (2 to 1024)
    pub neighbours: usize,
    /// how they are searched
    pub search: Search,
    /// whether control points join the neighbour search and the regression
    pub control_points_in_query: bool,
    /// degrees that one centimetre between control points counts for in the search and the regression
    pub control_weight: f64,
    /// degrees that one centimetre between the performer's skeleton and a clip's counts for in the search
    pub skeleton_weight: f64,
    /// metres between control points that a metre between skeletons counts for in the search for a start
    pub start_skeleton_weight: f64,
    /// standard deviation of a control point's coordinate, metres
    pub control_sigma_m: f64,
    /// which covariance the prior has
    pub covariance: Covariance,
    /// constant part of the ridge, degrees
    pub ridge_deg: f64,
    /// part of the ridge that grows with the squared distance of the nearest neighbour
    pub ridge_distance: f64,
    /// kernel width h² relative to the neighbours' median squared distance
    pub bandwidth: f64,
    /// least standard deviation of a coordinate under the prior, degrees (angles) and centimetres (translations)
    pub min_sigma_deg: f64,
    /// method lpca: share of the variance of the neighbours' successors that its components keep
    pub lpca_variance: f64,
    /// method lpca: standard deviation of the pose about where the last two poses lead, degrees and centimetres
    pub lpca_smooth_deg: f64,
    /// method lpcr: most principal components
    pub lpcr_components: usize,
    /// method gplvm: standard deviation of the pose about where the last two poses lead, degrees and centimetres
    pub gplvm_smooth_deg: f64,
    /// method gplvm: standard deviation about what the model says, besides the model's own, degrees and centimetres
    pub gplvm_sigma_deg: f64,
    /// most steps of the solver a frame
    pub max_steps: usize,
    /// start poses that are tried
    pub start_candidates: usize,
    /// frames over which start poses are compared
    pub start_frames: usize,
    /// energy per measured coordinate (1 on average if all is well) above which a frame counts as lost
    pub lost_energy: f64,
    /// lost frames in a row after which other start poses are tried
    pub lost_frames: usize,
    /// frames that one job reconstructs
    pub chunk_frames: usize,
    /// frames that a job reconstructs before its own, to forget how it started
    pub warm_up_frames: usize,
    /// frames over which neighbouring chunks are blended
    pub blend_frames: usize,
    /// whether the zero pose of a performer who is not in the database is learned from their first frames
    pub learn_zero_pose: bool,
    /// frames that it is learned from
    pub zero_pose_frames: usize,
    /// whether a frame is also compared with what was measured 0.1 s and 0.2 s before and after it: better, but not for
    /// live streams
    pub smooth: bool,
    /// whether a session without a skeleton gets one that is fitted to its points, or else the database's own
    pub fit_skeleton: bool,
    /// whether standing feet are kept from sliding
    pub foot_contacts: bool,
}

impl Default for Parameters {
    fn default() -> Self {
        Self {
            method: Method::default(),
            window: 2,
            neighbours: 64,
            search: Search::default(),
            control_points_in_query: true,
            control_weight: 1.0,
            skeleton_weight: 2.0,
            start_skeleton_weight: 0.3,
            control_sigma_m: 0.0015,
            covariance: Covariance::default(),
            ridge_deg: 3.0,
            ridge_distance: 1.0,
            bandwidth: 1.0,
            min_sigma_deg: 1.0,
            lpca_variance: 1.0,
            lpca_smooth_deg: 6.0,
            lpcr_components: 4,
            gplvm_smooth_deg: 6.0,
            gplvm_sigma_deg: 3.0,
            learn_zero_pose: true,
            zero_pose_frames: 120,
            smooth: false,
            max_steps: 12,
            start_candidates: 8,
            start_frames: 24,
            lost_energy: 30.0,
            lost_frames: 5,
            chunk_frames: 600,
            warm_up_frames: 120,
            blend_frames: 30,
            fit_skeleton: true,
            foot_contacts: true,
        }
    }
}

impl Parameters {
    /// Checks every value against its range.
    ///
    /// # Errors
    /// [`Error::Parameter`] names the first one out of range.
    pub fn check(&self) -> Result<()> {
        let count = |name, value: usize, low: usize, high: usize, expected| {
            if (low..=high).contains(&value) {
                return Ok(());
            }
            Err(Error::Parameter { name, found: value.to_string(), expected })
        };
        let number = |name, value: f64, low: f64, high: f64, expected| {
            if value >= low && value <= high {
                return Ok(());
            }
            Err(Error::Parameter { name, found: shown(value), expected })
        };
        count("window", self.window, 1, 16, "1 to 16 frames")?;
        count("neighbours", self.neighbours, 2, 1024, "2 to 1024")?;
        count("lpcr_components", self.lpcr_components, 0, 1024, "0 to 1024")?;
        count("max_steps", self.max_steps, 1, 100, "1 to 100")?;
        count("start_candidates", self.start_candidates, 1, 64, "1 to 64")?;
        count("start_frames", self.start_frames, 1, 240, "1 to 240 frames")?;
        count("zero_pose_frames", self.zero_pose_frames, 1, 6_000, "1 to 6000 frames")?;
        count("lost_frames", self.lost_frames, 1, 10_000, "1 to 10000 frames")?;
        count("chunk_frames", self.chunk_frames, 60, 100_000, "60 to 100000 frames")?;
        count("warm_up_frames", self.warm_up_frames, 0, 6_000, "0 to 6000 frames")?;
        count("blend_frames", self.blend_frames, 0, 60, "0 to 60 frames")?;
        number("control_weight", self.control_weight, 0.0, 1e3, "0 to 1000 degrees per centimetre")?;
        number("skeleton_weight", self.skeleton_weight, 0.0, 1e3, "0 to 1000 degrees per centimetre")?;
        number(
            "start_skeleton_weight",
            self.start_skeleton_weight,
            0.0,
            1e3,
            "0 to 1000 degrees per centimetre",
        )?;
        number("control_sigma_m", self.control_sigma_m, 1e-5, 1.0, "0.00001 to 1 m")?;
        number("ridge_deg", self.ridge_deg, 1e-3, 1e3, "0.001 to 1000 degrees")?;
        number("ridge_distance", self.ridge_distance, 0.0, 1e3, "0 to 1000")?;
        number("bandwidth", self.bandwidth, 1e-3, 1e3, "0.001 to 1000")?;
        number("min_sigma_deg", self.min_sigma_deg, 1e-3, 90.0, "0.001 to 90 degrees")?;
        number("lpca_variance", self.lpca_variance, 0.0, 1.0, "0 to 1")?;
        number("lpca_smooth_deg", self.lpca_smooth_deg, 1e-3, 1e6, "0.001 to 1000000 degrees")?;
        number("gplvm_smooth_deg", self.gplvm_smooth_deg, 1e-3, 1e6, "0.001 to 1000000 degrees")?;
        number("gplvm_sigma_deg", self.gplvm_sigma_deg, 1e-3, 90.0, "0.001 to 90 degrees")?;
        number("lost_energy", self.lost_energy, 1.0, 1e12, "1 to 1e12")
    }

    pub(crate) fn regression(&self) -> regression::Parameters {
        regression::Parameters {
            ridge: self.ridge_deg * self.ridge_deg,
            ridge_distance: self.ridge_distance,
            bandwidth: self.bandwidth,
            min_sigma: self.min_sigma_deg,
        }
    }

    pub(crate) fn lpca(&self) -> LpcaParameters {
        LpcaParameters { variance: self.lpca_variance, smooth_sigma: self.lpca_smooth_deg }
    }

    pub(crate) fn lpcr(&self) -> LpcrParameters {
        LpcrParameters { components: self.lpcr_components }
    }

    pub(crate) fn gplvm(&self) -> GplvmParameters {
        GplvmParameters { smooth_sigma: self.gplvm_smooth_deg, sigma: self.gplvm_sigma_deg }
    }

    pub(crate) fn solver(&self) -> SolverParameters {
        SolverParameters { max_steps: self.max_steps, ..SolverParameters::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_in_range() {
        Parameters::default().check().unwrap();
    }

    #[test]
    fn a_parameter_out_of_range_is_named() {
        let parameters = Parameters { control_sigma_m: f64::NAN, ..Parameters::default() };
        let message = parameters.check().unwrap_err().to_string();
        assert_eq!(message, "control_sigma_m is NaN, expected 0.00001 to 1 m");
    }
}
