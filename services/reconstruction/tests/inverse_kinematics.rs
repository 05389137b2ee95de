//! Inverse kinematics by gRPC: bodies and skeletons, with silhouettes and without, and what is refused.

use body::{BodyModel, Posed};
use formats::{calibration, image_files};
use model::{Camera, Mesh};
use nalgebra::Vector3;
use proto::v1::{
    self, InverseKinematicsMethod as Method, reconstruction_client::ReconstructionClient,
    solve_inverse_kinematics_request::Performer,
};
use testkit::sandbox::{Sandbox, Service};
use tonic::{Code, transport::Channel};
use vision::scene::{Ring, silhouettes};

const FRAMES: usize = 6;
const MEASURED: [(&str, &str); 6] = [
    ("left_wrist", "l_wrist"),
    ("right_wrist", "r_wrist"),
    ("left_ankle", "l_ankle"),
    ("right_ankle", "r_ankle"),
    ("root", "pelvis"),
    ("neck", "neck"),
];
const INNER: [&str; 4] = ["l_elbow", "r_elbow", "l_knee", "r_knee"];

async fn serve() -> (Sandbox, Service, ReconstructionClient<Channel>) {
    let sandbox = Sandbox::new().await;
    let service = sandbox.serve(reconstruction::start, |_| {}).await;
    let client = ReconstructionClient::new(service.channel().await);
    (sandbox, service, client)
}

/// A body that moves, what two cameras see of it, and its joints.
struct Capture {
    request: v1::SolveInverseKinematicsRequest,
    joints: Vec<Vec<Vector3<f64>>>,
}

fn point(p: &Vector3<f64>) -> v1::Point {
    v1::Point { x_m: p.x, y_m: p.y, z_m: p.z }
}

fn capture() -> Capture {
    let model = BodyModel::shipped();
    let shape = model.shape(&[]);
    let ring = Ring { cameras: 4, size: 320, focal: 400.0, start: 0.3, ..Ring::default() };
    let cameras: Vec<Camera> = ring.cameras().into_iter().take(2).collect();
    let mut posed = Posed::default();
    let (mut frames, mut joints) = (Vec::new(), Vec::new());
    for frame in 0..FRAMES {
        let mut pose = vec![0.0; model.rig().num_dofs()];
        pose[4] = 1.5 + 0.05 * frame as f64;
        for (value, dof) in pose.iter_mut().zip(model.rig().dofs()) {
            let Some([low, high]) = dof.limits else { continue };
            let is_hinge = dof.name.contains("elbow") || dof.name.contains("knee");
            *value = (if is_hinge { 1.0 } else { 0.2 } + 0.02 * frame as f64).clamp(low, high);
        }
        shape.pose(&model, &pose, &mut posed);
        let mesh = Mesh { vertices: posed.vertices.clone(), faces: model.faces().to_vec() };
        let seen = cameras.iter().zip(silhouettes(&mesh, &cameras));
        let seen = seen.map(|(camera, silhouette)| v1::CameraSilhouette {
            camera: camera.name.clone(),
            image: image_files::write_silhouette(&silhouette),
        });
        let targets = MEASURED.iter().map(|(name, joint)| v1::ControlPointSample {
            name: (*name).to_owned(),
            position: Some(point(&posed.joints[model.rig().joint_index(joint).unwrap()])),
        });
        frames.push(v1::InverseKinematicsFrame { targets: targets.collect(), silhouettes: seen.collect() });
        joints.push(posed.joints.clone());
    }
    let body = v1::BodyDescription {
        body_model_id: "shipped".to_owned(),
        alpha: vec![0.0],
        ..v1::BodyDescription::default()
    };
    let request = v1::SolveInverseKinematicsRequest {
        performer: Some(Performer::Body(body)),
        frames,
        calibration: calibration::write(&cameras).into(),
        calibration_name: "calibration.json".to_owned(),
        ..v1::SolveInverseKinematicsRequest::default()
    };
    Capture { request, joints }
}

/// Mean distance of elbows and knees from the true ones, millimetres.
fn error(answer: &v1::SolveInverseKinematicsResponse, joints: &[Vec<Vector3<f64>>]) -> f64 {
    let mut sum = 0.0;
    for (frame, truth) in answer.frames.iter().zip(joints) {
        for name in INNER {
            let joint = answer.joint_names.iter().position(|n| n == name).unwrap();
            let found = frame.joint_positions[joint];
            sum += (Vector3::new(found.x_m, found.y_m, found.z_m) - truth[joint]).norm();
        }
    }
    1000.0 * sum / (INNER.len() * joints.len()) as f64
}

#[tokio::test]
async fn silhouettes_put_elbows_and_knees_where_they_are() {
    let (_sandbox, service, mut client) = serve().await;
    let Capture { request, joints } = capture();
    let answer = client.solve_inverse_kinematics(request.clone()).await.unwrap().into_inner();
    assert_eq!((answer.method(), answer.frames.len()), (Method::ImageConstrained, FRAMES));
    assert_eq!(answer.dof_names.len(), answer.frames[0].pose.as_ref().unwrap().values.len());
    for frame in &answer.frames {
        assert!(frame.residual_m.unwrap() < 0.005 && frame.overlap.unwrap() > 0.3, "{frame:?}");
    }
    let image = error(&answer, &joints);
    let blind = v1::SolveInverseKinematicsRequest { method: Method::Plain.into(), ..request.clone() };
    let answer = client.solve_inverse_kinematics(blind).await.unwrap().into_inner();
    let plain = error(&answer, &joints);
    println!("elbows and knees: {image:.1} mm, without images {plain:.1} mm");
    assert!(image < 0.6 * plain && image < 30.0, "{image} {plain}");
    assert!(answer.frames[0].overlap.is_none());

    // without silhouettes there is another default
    let mut without = request;
    without.frames.iter_mut().for_each(|frame| frame.silhouettes.clear());
    let answer = client.solve_inverse_kinematics(without).await.unwrap().into_inner();
    assert_eq!(answer.method(), Method::Priority);
    service.stop().await;
}

#[tokio::test]
async fn a_skeleton_file_is_solved_in_its_own_channels() {
    let (_sandbox, service, mut client) = serve().await;
    let model = BodyModel::shipped();
    let skeleton = model.skeleton(&model.shape(&[])).unwrap();
    let Capture { mut request, .. } = capture();
    request.performer = Some(Performer::SkeletonAsf(formats::asf::write(&skeleton)));
    let answer = client.solve_inverse_kinematics(request).await.unwrap().into_inner();
    assert_eq!(answer.dof_names.len(), skeleton.num_dofs());
    assert!(
        answer.frames[FRAMES - 1].residual_m.unwrap() < 0.02,
        "{:?}",
        answer.frames[FRAMES - 1].residual_m
    );
    service.stop().await;
}

#[tokio::test]
async fn what_can_not_be_solved_is_refused_with_what_was_found() {
    let (_sandbox, service, mut client) = serve().await;
    let Capture { request, .. } = capture();
    let body = |change: &dyn Fn(&mut v1::BodyDescription)| {
        let mut body = v1::BodyDescription { body_model_id: "shipped".into(), ..Default::default() };
        change(&mut body);
        v1::SolveInverseKinematicsRequest { performer: Some(Performer::Body(body)), ..request.clone() }
    };
    let whole = |change: &dyn Fn(&mut v1::SolveInverseKinematicsRequest)| {
        let mut changed = request.clone();
        change(&mut changed);
        changed
    };
    let frames =
        |change: &dyn Fn(&mut Vec<v1::InverseKinematicsFrame>)| whole(&|request| change(&mut request.frames));
    let cases = [
        (frames(&|f| f.clear()), Code::InvalidArgument, "found 0 frames, expected 1 to 600"),
        (whole(&|r| r.steps = 201), Code::InvalidArgument, "steps is 201"),
        (whole(&|r| r.performer = None), Code::InvalidArgument, "performer"),
        (whole(&|r| r.calibration.clear()), Code::InvalidArgument, "calibration"),
        (whole(&|r| r.calibration = b"{}".to_vec()), Code::InvalidArgument, "frame 0: calibration.json"),
        (
            frames(&|f| f[0].targets[0].name = "tail".into()),
            Code::InvalidArgument,
            "the skeleton has no \"tail\"",
        ),
        (frames(&|f| f.iter_mut().for_each(|f| f.targets.clear())), Code::InvalidArgument, "control points"),
        (
            frames(&|f| {
                for position in f.iter_mut().flat_map(|f| &mut f.targets).filter_map(|t| t.position.as_mut())
                {
                    *position = v1::Point {
                        x_m: 1000.0 * position.x_m,
                        y_m: 1000.0 * position.y_m,
                        z_m: 1000.0 * position.z_m,
                    };
                }
            }),
            Code::InvalidArgument,
            "expected positions in metres (they are probably in millimetres)",
        ),
        (frames(&|f| f[1].silhouettes[0].camera = "phone".into()), Code::InvalidArgument, "frame 1"),
        (frames(&|f| f[2].silhouettes[0].image = vec![1, 2]), Code::InvalidArgument, "frame 2"),
        (body(&|b| b.stature_m = Some(4.0)), Code::InvalidArgument, "stature"),
        (body(&|b| b.alpha = vec![f64::NAN]), Code::InvalidArgument, "alpha is NaN"),
        (body(&|b| b.sex = "x".into()), Code::InvalidArgument, "sex is x, expected female or male"),
        (body(&|b| b.body_model_id = "mine".into()), Code::InvalidArgument, "body_model_id"),
        (body(&|b| b.body_model_id = uuid::Uuid::nil().to_string()), Code::NotFound, "does not exist"),
        (
            whole(&|r| r.performer = Some(Performer::SkeletonAsf("x".into()))),
            Code::InvalidArgument,
            "skeleton_asf: ",
        ),
    ];
    for (request, code, message) in cases {
        let status = client.solve_inverse_kinematics(request).await.unwrap_err();
        assert_eq!(status.code(), code, "{status}");
        assert!(status.message().contains(message), "{message:?} is not in {status}");
    }
    service.stop().await;
}
