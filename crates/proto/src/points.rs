//! Points and frames of control points.

use crate::{Error, v1};
use model::PointTrajectories;
use nalgebra::Vector3;

/// Most different control points in one message.
pub const MAX_POINTS: usize = 256;

/// A point on the wire.
pub fn to_wire(point: &Vector3<f64>) -> v1::Point {
    v1::Point { x_m: point.x, y_m: point.y, z_m: point.z }
}

/// Trajectories of all points named in any frame, in the order in which they first appear; frames without a
/// sample of a point have it as not measured. `frame_rate` in frames per second.
///
/// # Errors
/// A sample without position, a coordinate that is not finite, two samples of one point in a frame, no frame or
/// no point at all, more than [`MAX_POINTS`] names, or a rate that is not positive.
pub fn trajectories(frames: &[v1::ControlPointFrame], frame_rate: f64) -> Result<PointTrajectories, Error> {
    let mut names: Vec<String> = Vec::new();
    for name in frames.iter().flat_map(|f| &f.samples).map(|s| &s.name) {
        if !names.contains(name) {
            names.push(name.clone());
        }
        if names.len() > MAX_POINTS {
            let expected = "at most 256";
            return Err(Error::Count { what: "control points", found: names.len(), expected });
        }
    }
    if names.is_empty() {
        return Err(Error::Missing { field: "control points" });
    }
    let mut positions = vec![Vector3::repeat(f64::NAN); frames.len() * names.len()];
    for (index, frame) in frames.iter().enumerate() {
        let row = &mut positions[index * names.len()..][..names.len()];
        for sample in &frame.samples {
            let (column, position) = read_sample(index, sample, &names)?;
            if row[column].x.is_finite() {
                return Err(Error::DuplicatePoint { frame: index, name: sample.name.clone() });
            }
            row[column] = position;
        }
    }
    PointTrajectories::new(names, frame_rate, positions)
        .map_err(|_| out_of_range("frame_rate_hz", frame_rate, "a positive number"))
}

/// The frames of trajectories, without what was not measured.
pub fn frames(trajectories: &PointTrajectories) -> Vec<v1::ControlPointFrame> {
    let frame = |index: usize| {
        let samples = trajectories.names().iter().zip(trajectories.frame(index));
        let samples = samples.filter(|(_, p)| p.x.is_finite());
        let sample = |(name, p): (&String, _)| v1::ControlPointSample {
            name: name.clone(),
            position: Some(to_wire(p)),
        };
        v1::ControlPointFrame { samples: samples.map(sample).collect() }
    };
    (0..trajectories.num_frames()).map(frame).collect()
}

fn read_sample(
    frame: usize,
    sample: &v1::ControlPointSample,
    names: &[String],
) -> Result<(usize, Vector3<f64>), Error> {
    let point = sample.position.as_ref().ok_or(Error::Missing { field: "position of a control point" })?;
    for (axis, found) in [("x_m", point.x_m), ("y_m", point.y_m), ("z_m", point.z_m)] {
        if !found.is_finite() {
            return Err(Error::NotFinite { frame, what: format!("{axis} of {:?}", sample.name), found });
        }
    }
    let column = names.iter().position(|n| *n == sample.name).ok_or(Error::Missing { field: "name" })?;
    Ok((column, Vector3::new(point.x_m, point.y_m, point.z_m)))
}

fn out_of_range(field: &'static str, found: impl ToString, expected: &'static str) -> Error {
    Error::OutOfRange { field, found: found.to_string(), expected }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(name: &str, x_m: f64) -> v1::ControlPointSample {
        v1::ControlPointSample { name: name.into(), position: Some(v1::Point { x_m, y_m: 1.0, z_m: 2.0 }) }
    }

    fn frame(samples: &[v1::ControlPointSample]) -> v1::ControlPointFrame {
        v1::ControlPointFrame { samples: samples.to_vec() }
    }

    #[test]
    fn frames_come_back_as_they_went() {
        let wire = vec![
            frame(&[sample("left_wrist", 0.1)]),
            frame(&[]),
            frame(&[sample("left_wrist", 0.2), sample("root", 0.3)]),
        ];
        let read = trajectories(&wire, 60.0).unwrap();
        assert_eq!(read.names(), ["left_wrist", "root"]);
        assert_eq!(read.position(0, 1), None);
        assert_eq!(read.position(2, 1), Some(Vector3::new(0.3, 1.0, 2.0)));
        assert_eq!(frames(&read), wire);
    }

    #[test]
    fn what_makes_no_sense_is_refused_with_the_frame() {
        let twice = frame(&[sample("root", 0.0), sample("root", 1.0)]);
        assert_eq!(
            trajectories(&[frame(&[]), twice], 60.0).unwrap_err().to_string(),
            "frame 1 has two samples of point \"root\""
        );
        let nan = frame(&[sample("root", f64::NAN)]);
        let message = trajectories(&[nan], 60.0).unwrap_err().to_string();
        assert_eq!(message, "frame 0: x_m of \"root\" is NaN, expected a finite number");
        assert!(trajectories(&[frame(&[])], 60.0).is_err());
        assert!(trajectories(&[frame(&[sample("root", 0.0)])], -1.0).is_err());
        let without = v1::ControlPointSample { name: "root".into(), position: None };
        assert!(trajectories(&[frame(&[without])], 60.0).is_err());
        let many: Vec<_> = (0..300).map(|i| sample(&i.to_string(), 0.0)).collect();
        assert!(trajectories(&[frame(&many)], 60.0).is_err());
    }
}
