//! Qualisys Track Manager's `.qca.txt`: XML; millimetres, z up; focal lengths, principal points and sensor in 1/64 pixel.

use nalgebra::{Matrix3, Vector3};
use roxmltree::{Document, Node};

use super::{FileCamera, FileCameras, UpAxis, up::Stated};
use crate::{Error, Place, Result, read::Warnings, text::quote};

/// Steps of the sensor's coordinates in a pixel.
const SUBPIXELS: f64 = 64.0;

pub(super) fn read(text: &str, warnings: &mut Warnings) -> Result<FileCameras> {
    let document = Document::parse(text).map_err(|error| {
        let line = error.pos().row as usize;
        Error::at_line(line, format!("text that is not XML ({error})"), "the XML of a Qualisys calibration")
    })?;
    let root = document.root_element();
    if !root.has_tag_name("calibration") {
        let name = quote(root.tag_name().name().as_bytes());
        return Err(Error::at_line(
            line(root).unwrap_or(1),
            name,
            "calibration, the root of a Qualisys calibration",
        ));
    }
    let cameras = root
        .children()
        .filter(|node| node.has_tag_name("cameras"))
        .flat_map(|node| node.children())
        .filter(|node| node.has_tag_name("camera"));
    let mut found = Vec::new();
    for (index, node) in cameras.enumerate() {
        if node.attribute("active") == Some("0") {
            let serial = node.attribute("serial").unwrap_or_default();
            warnings.add(place(node), format!("camera {serial:.40}: left out, as it was not active"));
            continue;
        }
        found.push(camera(index, node, warnings)?);
    }
    Ok(FileCameras { cameras: found, up: Stated::Certain(UpAxis::Z), metres: Some(1e-3) })
}

fn line(node: Node<'_, '_>) -> Option<usize> {
    usize::try_from(node.document().text_pos_at(node.range().start).row).ok()
}

fn place(node: Node<'_, '_>) -> Place {
    line(node).map_or(Place::File, Place::Line)
}

fn camera(index: usize, node: Node<'_, '_>, warnings: &mut Warnings) -> Result<FileCamera> {
    let serial = node.attribute("serial").filter(|serial| !serial.is_empty());
    let name = serial.map_or_else(|| format!("cam{index}"), str::to_owned);
    let child = |name: &'static str| {
        node.children().find(|child| child.has_tag_name(name)).ok_or_else(|| Error::Unexpected {
            place: place(node),
            found: format!("a camera without {name}"),
            expected: "fov_video, transform and intrinsic".into(),
        })
    };
    let (view, transform, intrinsic) = (child("fov_video")?, child("transform")?, child("intrinsic")?);

    let (left, top) = (number(view, "left")?, number(view, "top")?);
    let sides = [number(view, "right")? - left + 1.0, number(view, "bottom")? - top + 1.0];
    if !sides.iter().all(|side| (1.0..=32768.0).contains(side)) {
        return Err(Error::Unexpected {
            place: place(view),
            found: format!("a picture of {} x {} pixels", sides[0], sides[1]),
            expected: "sides of 1 to 32768 pixels".into(),
        });
    }
    let pixels = |name| number(intrinsic, name).map(|steps| steps / SUBPIXELS);
    let matrix = Matrix3::new(
        pixels("focalLengthU")?,
        optional(intrinsic, "skew")?,
        pixels("centerPointU")? - left,
        0.0,
        pixels("focalLengthV")?,
        pixels("centerPointV")? - top,
        0.0,
        0.0,
        1.0,
    );
    // Qualisys writes "tangental"
    let tangential = |index: u8| {
        let names = [format!("tangentalDistortion{index}"), format!("tangentialDistortion{index}")];
        let name = names.iter().find(|name| intrinsic.attribute(name.as_str()).is_some());
        name.map_or(Ok(0.0), |name| number(intrinsic, name))
    };
    let radial = |index: u8| optional(intrinsic, &format!("radialDistortion{index}"));
    let distortion = vec![radial(1)?, radial(2)?, tangential(1)?, tangential(2)?, radial(3)?];

    // rows: the camera's axes in the world; y points up and z back
    let mut axes = Matrix3::zeros();
    for row in 0..3 {
        for column in 0..3 {
            axes[(row, column)] = number(transform, &format!("r{}{}", row + 1, column + 1))?;
        }
    }
    let rotation = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0)) * axes;
    let position = Vector3::new(number(transform, "x")?, number(transform, "y")?, number(transform, "z")?);

    let turned = optional(node, "viewrotation")?;
    if turned != 0.0 {
        let message = format!(
            "camera {name}: shown turned by {turned} degrees (viewrotation); the calibration is that of the picture of \
             {} x {} pixels as the sensor sees it",
            sides[0], sides[1]
        );
        warnings.add(place(node), message);
    }
    Ok(FileCamera {
        place: place(node),
        name,
        // within the range checked above
        size: Some(sides.map(|side| side.round() as u32)),
        matrix,
        distortion,
        rotation,
        translation: -(rotation * position),
    })
}

fn number(node: Node<'_, '_>, name: &str) -> Result<f64> {
    let text = node.attribute(name).unwrap_or_default();
    text.trim().parse::<f64>().ok().filter(|value| value.is_finite()).ok_or_else(|| Error::Unexpected {
        place: place(node),
        found: format!("{} {name}={}", node.tag_name().name(), quote(text.as_bytes())),
        expected: "a number".into(),
    })
}

/// A number that may be missing: 0 then.
fn optional(node: Node<'_, '_>, name: &str) -> Result<f64> {
    if node.attribute(name).is_some() { number(node, name) } else { Ok(0.0) }
}
