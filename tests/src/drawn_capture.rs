//! Captures drawn with pictures: a clothed person of the body model in a bright room, as video cameras would see them.
//!
//! Nobody was filmed: the person is a body of the shipped model, the motion is drawn from the sample motion.

use std::{fs, path::Path};

use anyhow::Context;
use body::{BodyModel, Limb, Posed, Shape, Wanted};
use evaluation::Recording;
use formats::{image_files, trc};
use model::{Camera, Image, PointTrajectories};
use nalgebra::{Rotation3, Vector2, Vector3};
use rayon::prelude::*;
use sample_motion::{Action, DrawOptions, Model};
use video::{FrameWriter, WriteOptions};
use vision::{DepthBuffer, Topology, View, scene::Ring};

/// Frames of drawn motion from one picture to the next: 30 pictures a second.
const STEP: usize = 2;
const FRAME_RATE: f64 = 30.0;
/// Each pixel is the mean of so many squared.
const SAMPLES: usize = 2;
/// How far from the pelvis the person's shadow reaches, metres.
const SHADOW_M: f64 = 1.6;
/// Where the light comes from.
const LIGHT: Vector3<f64> = Vector3::new(0.35, 0.8, 0.45);

const WALL: [f64; 3] = [226.0, 230.0, 234.0];
const FLOOR: [f64; 3] = [212.0, 204.0, 192.0];
const SKIN: [f64; 3] = [205.0, 148.0, 116.0];
const HAIR: [f64; 3] = [74.0, 52.0, 40.0];
const SHIRT: [f64; 3] = [34.0, 122.0, 138.0];
const STRIPE: [f64; 3] = [22.0, 92.0, 106.0];
const TROUSERS: [f64; 3] = [58.0, 62.0, 92.0];
const SHOES: [f64; 3] = [190.0, 66.0, 48.0];

/// A capture to be drawn.
#[derive(Debug, Clone, Copy)]
pub struct DrawnCapture {
    /// how many stand around the person
    pub cameras: usize,
    /// width and height of the videos, pixels
    pub size: u32,
    /// how many, at 30 a second
    pub frames: usize,
    /// what the person does
    pub action: Action,
    /// other motion
    pub seed: u64,
}

impl DrawnCapture {
    /// Writes it into a folder as people upload it: `calib.toml`, `cam01.mp4` and so on, `plates/cam01.png` and so on; and
    /// `points.trc`, where joints of the body truly are.
    pub fn write(&self, folder: &Path) -> anyhow::Result<()> {
        let model = BodyModel::shipped();
        let wanted = Wanted { stature_m: Some(1.78), mass_kg: Some(72.0), ..Wanted::default() };
        let shape = model.shape(&model.alpha_for(&wanted)?);
        let options = DrawOptions { frames: (self.frames * STEP).max(8), subject: self.seed };
        let motion = Model::bundled().draw(self.action, self.seed, &options)?;
        let mut poses = Recording::new(&model, &shape, &motion, STEP)?.poses;
        poses.truncate(self.frames);
        let cameras = self.ring();
        fs::create_dir_all(folder.join("plates"))?;
        fs::write(folder.join("calib.toml"), pose2sim(&cameras))?;
        let points = points(&model, &shape, &poses)?;
        fs::write(folder.join("points.trc"), trc::write("points.trc", &points))?;
        let clothes = Clothes::new(&model, &shape);
        let film = |camera: &Camera| {
            let room = Room::new(camera);
            let plate = folder.join("plates").join(format!("{}.png", camera.name));
            fs::write(&plate, image_files::write_image(&clothes.picture(&room, None, 0)))
                .with_context(|| plate.display().to_string())?;
            let options = WriteOptions { rate: FRAME_RATE, ..WriteOptions::default() };
            let path = folder.join(format!("{}.mp4", camera.name));
            let mut writer = FrameWriter::create(path, camera.size, &options)?;
            for (frame, pose) in poses.iter().enumerate() {
                let mut posed = Posed::default();
                shape.pose(&model, pose, &mut posed);
                writer.write(&clothes.picture(&room, Some(&posed), frame as u64 + 1))?;
            }
            Ok(writer.finish()?)
        };
        cameras.par_iter().map(film).collect()
    }

    fn ring(&self) -> Vec<Camera> {
        let ring = Ring {
            cameras: self.cameras,
            size: self.size,
            focal: 1.3 * f64::from(self.size),
            distance_m: 4.0,
            heights_m: [1.2, 1.5],
            target: Vector3::new(0.0, 0.9, 0.0),
            start: 0.6,
        };
        let mut cameras = ring.cameras();
        for (index, camera) in cameras.iter_mut().enumerate() {
            camera.name = format!("cam{:02}", index + 1);
        }
        cameras
    }
}

/// A calibration as Pose2Sim writes it, in metres with y up.
fn pose2sim(cameras: &[Camera]) -> String {
    let mut toml = String::from("unit = \"m\"\nup = \"y\"\n");
    for camera in cameras {
        let [width, height] = camera.size;
        let (f, c, t) = (camera.focal, camera.principal, camera.camera_from_world.translation.vector);
        let r = camera.camera_from_world.rotation.scaled_axis();
        toml.push_str(&format!(
            "\n[{name}]\nname = \"{name}\"\nsize = [{width}, {height}]\n\
             matrix = [[{}, 0.0, {}], [0.0, {}, {}], [0.0, 0.0, 1.0]]\ndistortions = [0.0, 0.0, 0.0, 0.0]\n\
             rotation = [{}, {}, {}]\ntranslation = [{}, {}, {}]\nfisheye = false\n",
            f.x,
            c.x,
            f.y,
            c.y,
            r.x,
            r.y,
            r.z,
            t.x,
            t.y,
            t.z,
            name = camera.name,
        ));
    }
    toml
}

/// Where the wrists, ankles, shoulders, hips, neck and pelvis are.
fn points(model: &BodyModel, shape: &Shape, poses: &[Vec<f64>]) -> anyhow::Result<PointTrajectories> {
    let wanted = ["pelvis", "neck", "l_shoulder", "r_shoulder", "l_wrist", "r_wrist", "l_hip", "r_hip"];
    let joints = model.rig().joints();
    let is_wanted = |name: &str| wanted.contains(&name) || name.ends_with("ankle");
    let indices: Vec<usize> = (0..joints.len()).filter(|&i| is_wanted(&joints[i].name)).collect();
    let names = indices.iter().map(|&i| joints[i].name.clone()).collect();
    let mut posed = Posed::default();
    let mut positions = Vec::new();
    for pose in poses {
        shape.pose(model, pose, &mut posed);
        positions.extend(indices.iter().map(|&i| posed.joints[i]));
    }
    Ok(PointTrajectories::new(names, FRAME_RATE, positions)?)
}

/// What is worn where.
struct Clothes<'a> {
    model: &'a BodyModel,
    topology: Topology,
    /// vertices at rest, metres
    rest: &'a [Vector3<f64>],
    /// heights at rest of crown and waist, metres
    crown: f64,
    waist: f64,
}

impl<'a> Clothes<'a> {
    fn new(model: &'a BodyModel, shape: &'a Shape) -> Self {
        let rest = &shape.vertices[..];
        let hip = model.rig().joints().iter().position(|joint| joint.name == "l_hip").unwrap_or(0);
        Self {
            model,
            topology: Topology::new(model.faces(), model.num_vertices()),
            rest,
            crown: rest.iter().map(|v| v.y).fold(0.0, f64::max),
            waist: shape.joints[hip].y + 0.10,
        }
    }

    /// What the room's camera sees of a posed body, or of nobody.
    fn picture(&self, room: &Room, posed: Option<&Posed>, seed: u64) -> Image {
        let view = View::new(&room.fine);
        let mut depths = DepthBuffer::new();
        let normals = posed.map(|posed| {
            depths.draw(&view, &posed.vertices, &self.topology);
            normals(&posed.vertices, self.model.faces())
        });
        let [width, height] = room.size;
        let mut image = Image::black(width, height);
        for y in 0..height {
            for x in 0..width {
                let behind = room.colour(x, y, posed);
                let mut sum = Vector3::zeros();
                for (i, j) in (0..SAMPLES * SAMPLES).map(|k| (k % SAMPLES, k / SAMPLES)) {
                    let (u, v) = (x * SAMPLES + i, y * SAMPLES + j);
                    let body = posed.zip(normals.as_deref()).zip(depths.face(u as isize, v as isize));
                    let ray = || room.fine.ray(Vector2::new(u as f64, v as f64)).unwrap_or_default();
                    sum += match body {
                        Some(((posed, normals), face)) => {
                            self.skin(face, posed, normals, view.position, ray())
                        }
                        None => behind,
                    };
                }
                let noise = 3.0 * (lattice([x as i64, y as i64, 0], seed) - 0.5);
                let colour = sum / (SAMPLES * SAMPLES) as f64;
                image.set(x, y, std::array::from_fn(|c| (colour[c] + noise).clamp(0.0, 255.0).round() as u8));
            }
        }
        image
    }

    fn skin(
        &self,
        face: u32,
        posed: &Posed,
        normals: &[Vector3<f64>],
        eye: Vector3<f64>,
        ray: Vector3<f64>,
    ) -> Vector3<f64> {
        let corners = self.model.faces()[face as usize].map(|corner| corner as usize);
        let [a, b, c] = corners.map(|i| posed.vertices[i]);
        let flat = (b - a).cross(&(c - a));
        let point = eye + ray * ((a - eye).dot(&flat) / ray.dot(&flat));
        let v = (point - a).cross(&(c - a)).dot(&flat) / flat.norm_squared();
        let w = (b - a).cross(&(point - a)).dot(&flat) / flat.norm_squared();
        let blend = |values: &[Vector3<f64>]| {
            let [p, q, r] = corners.map(|i| values[i]);
            p * (1.0 - v - w) + q * v + r * w
        };
        let (rest, normal) = (blend(self.rest), blend(normals).normalize());
        let lit = 0.52 + 0.16 * normal.y + 0.42 * normal.dot(&LIGHT.normalize()).max(0.0);
        let weave = 0.9 + 0.2 * noise(&rest, 0.018);
        Vector3::from(self.cloth(self.model.limbs()[corners[0]], &rest)) * (lit * weave)
    }

    fn cloth(&self, limb: Limb, rest: &Vector3<f64>) -> [f64; 3] {
        let below_crown = self.crown - rest.y;
        match limb {
            Limb::Head if below_crown < 0.06 || (rest.z < 0.01 && below_crown < 0.17) => HAIR,
            Limb::Head | Limb::LeftLowerArm | Limb::RightLowerArm => SKIN,
            Limb::Torso if rest.y < self.waist => TROUSERS,
            Limb::Torso | Limb::LeftUpperArm | Limb::RightUpperArm => {
                if (rest.y / 0.09).rem_euclid(1.0) < 0.3 { STRIPE } else { SHIRT }
            }
            _ if rest.y < 0.085 => SHOES,
            _ => TROUSERS,
        }
    }
}

/// The camera of a picture with `SAMPLES` times as many pixels along each side.
fn finer(camera: &Camera) -> Camera {
    let factor = SAMPLES as f64;
    let mut fine = camera.clone();
    fine.size = camera.size.map(|side| side * SAMPLES as u32);
    fine.focal = camera.focal * factor;
    fine.principal = camera.principal * factor + Vector2::repeat((factor - 1.0) / 2.0);
    fine
}

/// Normals of vertices: the mean of their faces', by area.
fn normals(vertices: &[Vector3<f64>], faces: &[[u32; 3]]) -> Vec<Vector3<f64>> {
    let mut normals = vec![Vector3::zeros(); vertices.len()];
    for face in faces {
        let [a, b, c] = face.map(|corner| vertices[corner as usize]);
        let normal = (b - a).cross(&(c - a));
        face.iter().for_each(|&corner| normals[corner as usize] += normal);
    }
    normals
}

/// The empty room as a camera sees it.
struct Room {
    /// the camera, with `SAMPLES` times as many pixels along each side
    fine: Camera,
    size: [usize; 2],
    /// the colour at each pixel, and the place of the floor that is seen there
    pixels: Vec<(Vector3<f64>, Option<Vector3<f64>>)>,
}

impl Room {
    fn new(camera: &Camera) -> Self {
        let size = camera.size.map(|side| side as usize);
        let eye = camera.position();
        let pixel = |index: usize| {
            let ray = camera.ray(Vector2::new((index % size[0]) as f64, (index / size[0]) as f64));
            empty(eye, ray.unwrap_or_else(Vector3::y))
        };
        Self { fine: finer(camera), size, pixels: (0..size[0] * size[1]).map(pixel).collect() }
    }

    /// The colour at a pixel, with the person's soft shadow.
    fn colour(&self, x: usize, y: usize, posed: Option<&Posed>) -> Vector3<f64> {
        let (colour, place) = self.pixels[y * self.size[0] + x];
        let (Some(posed), Some(place)) = (posed, place) else { return colour };
        if (posed.joints[0].xz() - place.xz()).norm() > SHADOW_M {
            return colour;
        }
        let near: f64 = posed.joints.iter().map(|joint| shadow(joint, &place)).sum();
        colour * (1.0 - 0.22 * (1.0 - (-near).exp()))
    }
}

/// The floor of boards and the wall into which it bends, as a ray from an eye meets them; and the place of the floor.
fn empty(eye: Vector3<f64>, ray: Vector3<f64>) -> (Vector3<f64>, Option<Vector3<f64>>) {
    let wall = Vector3::from(WALL) * (1.0 + 0.06 * ray.y);
    if ray.y >= -1e-6 {
        return (wall, None);
    }
    let place = eye - ray * (eye.y / ray.y);
    let boards = Rotation3::from_axis_angle(&Vector3::y_axis(), 0.5) * place;
    let seam = if (boards.x / 0.4).rem_euclid(1.0) < 0.03 { 0.95 } else { 1.0 };
    let board = 0.98 + 0.04 * lattice([(boards.x / 0.4).floor() as i64, 0, 0], 77);
    let far = ((place.xz().norm() - 3.0) / 3.0).clamp(0.0, 1.0);
    let far = far * far * (3.0 - 2.0 * far);
    (Vector3::from(FLOOR) * (seam * board) * (1.0 - far) + wall * far, Some(place))
}

/// How much of the light a joint takes from a place of the floor: little from high up.
fn shadow(joint: &Vector3<f64>, place: &Vector3<f64>) -> f64 {
    let width = 0.12 + 0.25 * joint.y;
    (-(joint.xz() - place.xz()).norm_squared() / (2.0 * width * width)).exp() * 0.02 / (width * width)
}

/// Smooth noise of one wavelength (metres), in [0, 1].
fn noise(at: &Vector3<f64>, wavelength: f64) -> f64 {
    let at = at / wavelength;
    let corner = at.map(f64::floor);
    let t = (at - corner).map(|t| t * t * (3.0 - 2.0 * t));
    let corner_value = |i: usize| {
        let bit = [i & 1, i >> 1 & 1, i >> 2 & 1];
        let weight: f64 = (0..3).map(|axis| if bit[axis] == 1 { t[axis] } else { 1.0 - t[axis] }).product();
        weight * lattice(std::array::from_fn(|axis| corner[axis] as i64 + bit[axis] as i64), 5)
    };
    (0..8).map(corner_value).sum()
}

/// A number in [0, 1) for a place of the lattice.
fn lattice(place: [i64; 3], seed: u64) -> f64 {
    let mut hash = seed.wrapping_mul(0x1656_67b1_9e37_79f9) ^ 0x2545_f491_4f6c_dd1d;
    for number in place {
        hash = (hash ^ number as u64).wrapping_mul(0xff51_afd7_ed55_8ccd);
        hash = (hash ^ hash >> 32).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }
    (hash >> 40) as f64 / (1u64 << 24) as f64
}
