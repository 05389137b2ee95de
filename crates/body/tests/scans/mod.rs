//! The registered scans of the shared data, for tests and the command that learns the shipped model.
#![allow(dead_code, reason = "each test uses some of it")]

use std::{fs, path::Path};

use body::{BodyModel, ModelParts, RigFile, Scan, Sex, Shape, Skin, Subject, Template, TemplateParts};
use nalgebra::Vector3;

/// Numbers of an NPY file.
pub fn numbers(path: &Path) -> Vec<f64> {
    let bytes = fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    formats::npy::read(&bytes).unwrap_or_else(|e| panic!("{}: {e}", path.display())).values
}

fn points(numbers: &[f64], scale: f64) -> Vec<Vector3<f64>> {
    numbers.as_chunks::<3>().0.iter().map(|&p| Vector3::from(p) * scale).collect()
}

/// A body that isn't one of the model's, in the rest pose: a scan itself. Its joints are the regressor's.
pub fn shape_of(model: &BodyModel, vertices: &[Vector3<f64>]) -> Shape {
    assert_eq!(vertices.len(), model.num_vertices());
    Shape {
        alpha: vec![0.0; model.num_components()],
        vertices: vertices.to_vec(),
        joints: model.regressor().joints(vertices),
    }
}

/// Scans, what is known of the people, and the template of `bodies` in the shared data.
pub struct Scans {
    pub template: Template,
    pub file: RigFile,
    /// true positions, metres, shape `[scans][joints]`
    pub joints: Vec<Vec<Vector3<f64>>>,
    /// metres, shape `[scans][vertices]`
    pub scans: Vec<Vec<Vector3<f64>>>,
    /// subject and pose of every scan, as in `scans.csv`
    pub names: Vec<[String; 2]>,
    /// of the scans in the base pose, which come first
    pub subjects: Vec<Subject>,
}

impl Scans {
    pub fn read(bodies: &Path) -> Self {
        let corners: Vec<u32> = numbers(&bodies.join("scans/faces.npy")).iter().map(|&x| x as u32).collect();
        let faces = corners.as_chunks::<3>().0.to_vec();
        let vertices = points(&numbers(&bodies.join("scans/vertices.npy")), 1e-4);
        let joints: Vec<u8> = numbers(&bodies.join("rig/skin_joints.npy")).iter().map(|&x| x as u8).collect();
        let joints = joints.as_chunks::<4>().0;
        let weights: Vec<f32> =
            numbers(&bodies.join("rig/skin_weights.npy")).iter().map(|&x| x as f32).collect();
        let file = RigFile::parse(&fs::read(bodies.join("rig/rig.json")).unwrap()).unwrap();
        let skin = Skin::new(joints, weights.as_chunks::<4>().0, file.rig().unwrap().num_joints()).unwrap();
        let scans: Vec<Vec<_>> = vertices.chunks_exact(joints.len()).map(<[_]>::to_vec).collect();
        let subjects = rows(&bodies.join("scans/subjects.csv")).into_iter().map(|row| Subject {
            sex: Some(if row[1] == "male" { Sex::Male } else { Sex::Female }),
            age_years: row[2].parse().ok(),
        });
        let names =
            rows(&bodies.join("scans/scans.csv")).into_iter().map(|row| [row[1].clone(), row[2].clone()]);
        Self {
            subjects: subjects.collect(),
            names: names.collect(),
            joints: points(&numbers(&bodies.join("scans/joints.npy")), 1.0)
                .chunks_exact(file.rig().unwrap().num_joints())
                .map(<[_]>::to_vec)
                .collect(),
            template: Template::new(TemplateParts {
                faces: &faces,
                rest: &mean(&scans[..114]),
                rig: Some(&file),
                skin: Some(&skin),
                known_joints: &[],
            })
            .unwrap(),
            file,
            scans,
        }
    }

    /// The scans in the base pose.
    pub fn base(&self) -> Vec<Scan<'_>> {
        let scan = |(i, &subject): (usize, &Subject)| Scan {
            name: &self.names[i][0],
            vertices: &self.scans[i],
            faces: None,
            subject,
        };
        self.subjects.iter().enumerate().map(scan).collect()
    }

    /// A model whose mean is one scan and whose components lead from it to others.
    pub fn model_of(&self, mean: usize, others: &[usize]) -> BodyModel {
        let difference = |&other: &usize| -> Vec<_> {
            self.scans[other].iter().zip(&self.scans[mean]).map(|(a, b)| a - b).collect()
        };
        BodyModel::new(ModelParts {
            description: "differences of scans".into(),
            faces: self.template.faces.clone(),
            mean: self.scans[mean].clone(),
            components: others.iter().map(difference).collect(),
            variance_kept: vec![0.0; others.len()],
            rig: self.template.rig.clone(),
            regressor: self.template.regressor.clone(),
            skin: self.template.skin.clone(),
        })
        .unwrap()
    }
}

fn mean(scans: &[Vec<Vector3<f64>>]) -> Vec<Vector3<f64>> {
    let mut sum = vec![Vector3::zeros(); scans[0].len()];
    scans.iter().for_each(|scan| sum.iter_mut().zip(scan).for_each(|(sum, v)| *sum += v));
    sum.into_iter().map(|v| v / scans.len() as f64).collect()
}

/// Cells of a CSV file, without the first row.
fn rows(path: &Path) -> Vec<Vec<String>> {
    let text = fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    text.lines().skip(1).map(|line| line.split(',').map(str::to_owned).collect()).collect()
}
