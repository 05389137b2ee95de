//! What is done for a body besides finding its pose: a skeleton for a performer without one, and feet that stand.

mod feet;
mod positions;
mod skeletons;

pub use feet::{FeetResult, FootNumbers, evaluate_feet};
pub use skeletons::{SkeletonResult, SkeletonSource, SkeletonTrial, evaluate_skeletons};
