use nalgebra::Vector3;

use crate::MAX_COMPONENTS;
use crate::subject::Subject;

/// A registered scan: a body in the template's topology and about in its pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scan<'a> {
    /// what errors call it: the file
    pub name: &'a str,
    /// metres, shape `[vertices]`
    pub vertices: &'a [Vector3<f64>],
    /// its own faces, if it came with any; they must be the template's
    pub faces: Option<&'a [[u32; 3]]>,
    /// what is known of the person
    pub subject: Subject,
}

/// What is done to scans before they are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Alignment {
    /// nothing
    AsTheyStand,
    /// turned to face as the template does, set on the floor, the pelvis over the origin
    Turned,
    /// that, and the pose that each stands in is taken out
    Unposed,
}

/// How to learn.
#[derive(Debug, Clone, PartialEq)]
pub struct LearnOptions {
    /// components to keep, at most [`MAX_COMPONENTS`] and one less than scans
    pub components: usize,
    /// what is done to the scans before they are compared
    pub alignment: Alignment,
    /// who the model is learned from and by whom
    pub description: String,
}

impl Default for LearnOptions {
    fn default() -> Self {
        Self { components: MAX_COMPONENTS, alignment: Alignment::Unposed, description: String::new() }
    }
}
