//! The gRPC server as a whole: a frame refined, and what is refused.

use body::{BodyModel, Posed};
use formats::{calibration, image_files};
use model::Mesh;
use proto::v1::{
    CameraSilhouette, Pose, RefineFrameRequest, RefineOptions, RefineStage,
    refinement_client::RefinementClient,
};
use testkit::sandbox::{Sandbox, Service};
use tonic::{Code, transport::Channel};
use vision::scene::{Ring, silhouettes};

async fn serve() -> (Sandbox, Service, RefinementClient<Channel>) {
    let sandbox = Sandbox::new().await;
    let service = sandbox.serve(refinement::start, |_| {}).await;
    let client = RefinementClient::new(service.channel().await);
    (sandbox, service, client)
}

/// A drawn body with an arm lifted: the request without a start, its pose and joints.
fn request() -> (RefineFrameRequest, Vec<f64>, Posed) {
    let model = BodyModel::shipped();
    let alpha = vec![0.8, -0.3];
    let mut pose = vec![0.0; model.rig().num_dofs()];
    (pose[0], pose[4]) = (0.1, 0.6);
    pose[model.rig().dof_index("l_shoulder_abd").unwrap()] = 0.9;
    let mut posed = Posed::default();
    model.shape(&alpha).pose(&model, &pose, &mut posed);
    let mesh = Mesh::new(posed.vertices.clone(), model.faces().to_vec()).unwrap();
    let cameras = Ring { cameras: 4, size: 402, focal: 530.0, ..Ring::default() }.cameras();
    let views = cameras.iter().zip(silhouettes(&mesh, &cameras)).map(|(camera, mask)| CameraSilhouette {
        camera: camera.name.clone(),
        image: image_files::write_silhouette(&mask),
    });
    let request = RefineFrameRequest {
        body_model_id: "shipped".to_owned(),
        alpha,
        start: None,
        silhouettes: views.collect(),
        calibration: calibration::write(&cameras).into_bytes(),
        calibration_name: "ring.json".to_owned(),
        options: None,
    };
    (request, pose, posed)
}

fn largest_distance(answer: &proto::v1::RefineFrameResponse, truth: &Posed) -> f64 {
    let found = answer.joint_positions.iter().map(|p| nalgebra::Vector3::new(p.x_m, p.y_m, p.z_m));
    found.zip(&truth.joints).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

#[tokio::test]
async fn a_pose_is_found_with_and_without_a_start() {
    let (_sandbox, service, mut client) = serve().await;
    let (request, pose, truth) = request();
    let found = client.refine_frame(request.clone()).await.unwrap().into_inner();
    assert_eq!((found.limbs.len(), found.overlaps.len()), (10, 4));
    assert_eq!((found.joint_names.len(), found.dof_names.len()), (truth.joints.len(), pose.len()));
    assert!(found.overlaps.iter().all(|view| view.overlap > Some(0.9)), "{:?}", found.overlaps);
    let off = largest_distance(&found, &truth);
    assert!(off < 0.05, "{off} m");

    // an arm that hangs has to be searched for
    let mut start = pose.clone();
    let model = BodyModel::shipped();
    start[model.rig().dof_index("l_shoulder_abd").unwrap()] = -0.3;
    start[model.rig().dof_index("l_shoulder_flex").unwrap()] = 0.9;
    let options = RefineOptions { frame: 7, ..RefineOptions::default() };
    let with_start =
        RefineFrameRequest { start: Some(Pose { values: start }), options: Some(options), ..request.clone() };
    let found = client.refine_frame(with_start.clone()).await.unwrap().into_inner();
    let again = client.refine_frame(with_start).await.unwrap().into_inner();
    assert_eq!(found, again);
    assert_ne!(found.stage(), RefineStage::Unseen);
    let off = largest_distance(&found, &truth);
    assert!(off < 0.05, "{off} m");
    service.stop().await;
}

#[tokio::test]
async fn requests_that_make_no_sense_are_refused_with_what_was_expected() {
    let (_sandbox, service, mut client) = serve().await;
    let (request, pose, _) = request();
    let with = |change: &dyn Fn(&mut RefineFrameRequest)| {
        let mut changed = request.clone();
        change(&mut changed);
        changed
    };
    let options = |particles, iterations| RefineOptions { particles, iterations, ..RefineOptions::default() };
    let refused = [
        (with(&|r| r.silhouettes.truncate(1)), "2 to 64"),
        (with(&|r| r.alpha = vec![f64::NAN]), "alpha"),
        (with(&|r| r.alpha = vec![0.0; 99]), "99"),
        (with(&|r| r.start = Some(Pose { values: vec![0.0; 3] })), "3 numbers"),
        (with(&|r| r.start = Some(Pose { values: vec![f64::NAN; pose.len()] })), "finite"),
        (with(&|r| r.options = Some(options(1, 0))), "particles"),
        (with(&|r| r.options = Some(options(u32::MAX, 0))), "particles"),
        (with(&|r| r.options = Some(options(2000, 200))), "40000"),
        (with(&|r| r.silhouettes[1].camera = "nine".into()), "nine"),
        (with(&|r| r.silhouettes[1].camera = "cam0".into()), "twice"),
        (with(&|r| r.silhouettes[0].image.truncate(30)), "cam0"),
        (with(&|r| r.calibration.truncate(9)), "ring.json"),
        (with(&|r| r.body_model_id = "mine".into()), "UUID"),
    ];
    for (request, said) in refused {
        let status = client.refine_frame(request).await.unwrap_err();
        assert_eq!(status.code(), Code::InvalidArgument, "{status}");
        assert!(status.message().contains(said), "{} does not say {said}", status.message());
    }
    let empty = image_files::write_silhouette(&model::Silhouette::empty(402, 402));
    let nobody = with(&|r| r.silhouettes.iter_mut().for_each(|view| view.image.clone_from(&empty)));
    let status = client.refine_frame(nobody).await.unwrap_err();
    assert_eq!(status.code(), Code::InvalidArgument, "{status}");
    service.stop().await;
}
