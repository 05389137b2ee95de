//! GLB, read back with another library.

use std::f64::consts::PI;

use formats::glb::{self, Animation, Joint, SkinnedMesh};
use model::Mesh;
use nalgebra::{UnitQuaternion, Vector3};

/// A bar of two boxes' corners, bent by its second joint.
fn body() -> SkinnedMesh {
    let mut vertices = Vec::new();
    for y in [0.0, 1.0, 2.0] {
        vertices.extend([[-0.1, y, 0.0], [0.1, y, 0.0], [0.0, y, 0.1]].map(Vector3::from));
    }
    let mut faces = Vec::new();
    for ring in 0..2_u32 {
        for side in 0..3 {
            let (a, b) = (3 * ring + side, 3 * ring + (side + 1) % 3);
            faces.extend([[a, a + 3, b], [b, a + 3, b + 3]]);
        }
    }
    let mesh = Mesh::new(vertices, faces).unwrap();
    let joint =
        |name: &str, parent, y| Joint { name: name.into(), parent, rest_position: Vector3::new(0.0, y, 0.0) };
    SkinnedMesh {
        normals: mesh.normals(),
        joints: vec![joint("hips", None, 0.0), joint("spine", Some(0), 1.0), joint("head", Some(1), 2.0)],
        joint_indices: vec![[0, 1, 2, 0]; 3]
            .into_iter()
            .chain(vec![[1, 0, 0, 0]; 3])
            .chain(vec![[2, 1, 1, 0]; 3])
            .collect(),
        weights: vec![[1.0, 0.0, 0.0, 0.0]; 3]
            .into_iter()
            .chain(vec![[0.5, 0.5, 0.0, 0.0]; 3])
            .chain(vec![[1.0, 0.5, 0.5, 0.0]; 3])
            .collect(),
        mesh,
    }
}

fn animation() -> Animation {
    let times = vec![0.0, 0.5, 1.0];
    let about_z = |angle: f64| UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
    let flipped = UnitQuaternion::new_unchecked(-about_z(0.4).into_inner());
    let identity = UnitQuaternion::identity();
    Animation {
        times,
        rotations: vec![
            identity,
            about_z(0.2),
            identity,
            identity,
            flipped,
            identity,
            identity,
            about_z(PI / 2.0),
            identity,
        ],
        translations: vec![Vector3::zeros(), Vector3::y(), Vector3::new(0.5, 1.0, 0.0)],
    }
}

#[test]
fn a_mesh_is_read_back_by_another_library() {
    let mesh = body().mesh;
    let bytes = glb::write_mesh("hull", &mesh).unwrap();
    let (document, buffers, _) = gltf::import_slice(&bytes).unwrap();
    let read = document.meshes().next().unwrap();
    assert_eq!(read.name(), Some("hull"));
    let primitive = read.primitives().next().unwrap();
    let reader = primitive.reader(|buffer| Some(&buffers[buffer.index()]));
    let positions: Vec<_> = reader.read_positions().unwrap().collect();
    assert_eq!(positions.len(), 9);
    assert!(
        positions
            .iter()
            .zip(&mesh.vertices)
            .all(|(a, b)| a.iter().zip(b.iter()).all(|(a, b)| *a == *b as f32))
    );
    let indices: Vec<_> = reader.read_indices().unwrap().into_u32().collect();
    assert_eq!(indices, mesh.faces.as_flattened());
    for normal in reader.read_normals().unwrap() {
        let length: f32 = normal.iter().map(|x| x * x).sum();
        assert!((length - 1.0).abs() < 1e-5);
    }
    let bounds = primitive.bounding_box();
    assert_eq!((bounds.min, bounds.max), ([-0.1, 0.0, 0.0], [0.1, 2.0, 0.1]));
    assert_eq!(bytes.len() % 4, 0);
}

#[test]
fn a_skeleton_with_skin_and_motion_is_read_back_by_another_library() {
    let bytes = glb::write_skinned("body", &body(), Some(&animation())).unwrap();
    let (document, buffers, _) = gltf::import_slice(&bytes).unwrap();
    let bytes = |buffer: gltf::Buffer<'_>| Some(&*buffers[buffer.index()].0);
    let skin = document.skins().next().unwrap();
    let names: Vec<_> = skin.joints().map(|joint| joint.name().unwrap().to_owned()).collect();
    assert_eq!(names, ["hips", "spine", "head"]);
    assert_eq!(skin.joints().next().unwrap().children().next().unwrap().name(), Some("spine"));
    // a joint's place times its inverse bind matrix is the identity in the rest pose
    let reader = skin.reader(bytes);
    for (matrix, joint) in reader.read_inverse_bind_matrices().unwrap().zip(body().joints) {
        let place = joint.rest_position;
        assert_eq!(matrix[3], [-place.x as f32, -place.y as f32, -place.z as f32, 1.0]);
    }
    let mut place = Vector3::zeros();
    for (joint, expected) in skin.joints().zip(body().joints) {
        let (offset, rotation, _) = joint.transform().decomposed();
        place += Vector3::from(offset.map(f64::from));
        assert_eq!((place, rotation), (expected.rest_position, [0.0, 0.0, 0.0, 1.0]));
    }
    let primitive = document.meshes().next().unwrap().primitives().next().unwrap();
    let reader = primitive.reader(bytes);
    let joints: Vec<_> = reader.read_joints(0).unwrap().into_u16().collect();
    let weights: Vec<_> = reader.read_weights(0).unwrap().into_f32().collect();
    assert_eq!((joints[0], weights[0]), ([0; 4], [1.0, 0.0, 0.0, 0.0]));
    assert_eq!((joints[3], weights[3]), ([1, 0, 0, 0], [0.5, 0.5, 0.0, 0.0]));
    // one joint given twice is one joint
    assert_eq!((joints[6], weights[6]), ([2, 1, 0, 0], [0.5, 0.5, 0.0, 0.0]));

    let animation = document.animations().next().unwrap();
    assert_eq!(animation.channels().count(), 4);
    let spine = animation.channels().nth(2).unwrap();
    assert_eq!(spine.target().node().name(), Some("spine"));
    let reader = spine.reader(bytes);
    assert_eq!(reader.read_inputs().unwrap().collect::<Vec<_>>(), [0.0, 0.5, 1.0]);
    let gltf::animation::util::ReadOutputs::Rotations(rotations) = reader.read_outputs().unwrap() else {
        panic!("rotations")
    };
    let rotations: Vec<_> = rotations.into_f32().collect();
    assert!((rotations[2][2] - (PI / 4.0).sin() as f32).abs() < 1e-6);
    assert!(rotations.iter().all(|rotation| rotation[3] > 0.0), "the short way: {rotations:?}");
    let root = animation.channels().next().unwrap();
    let gltf::animation::util::ReadOutputs::Translations(places) = root.reader(bytes).read_outputs().unwrap()
    else {
        panic!("translations")
    };
    assert_eq!(places.last().unwrap(), [0.5, 1.0, 0.0]);
}

#[test]
fn what_does_not_fit_together_is_refused() {
    let message = |change: &dyn Fn(&mut SkinnedMesh)| {
        let mut changed = body();
        change(&mut changed);
        glb::write_skinned("body", &changed, Some(&animation())).unwrap_err().to_string()
    };
    assert_eq!(message(&|body| body.normals.truncate(8)), "file: found 8 normals, expected 9");
    assert!(message(&|body| body.weights[2] = [0.0; 4]).contains("vertex 2 without weights"));
    assert!(message(&|body| body.weights[2][0] = f32::NAN).contains("weight NaN of joint 0 at vertex 2"));
    assert!(message(&|body| body.joint_indices[1][0] = 3).contains("joints below 3"));
    assert!(message(&|body| body.joints[1].parent = Some(2)).contains("joint 1 (spine) with parent Some(2)"));
    assert!(message(&|body| body.joints.truncate(0)).contains("joints below 0"));
    assert!(message(&|body| body.mesh.faces.clear()).contains("a mesh without faces"));
    let mut motion = animation();
    motion.times[1] = 2.0;
    let error = glb::write_skinned("body", &body(), Some(&motion)).unwrap_err().to_string();
    assert!(error.contains("3 times that do not rise"), "{error}");
}
