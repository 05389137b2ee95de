//! The gRPC server as a whole: bodies described and drawn, hulls carved, and what is refused.

use body::BodyModel;
use formats::{calibration, image_files, ply};
use model::{Camera, Mesh};
use proto::v1::{self, CameraSilhouette, MeshFormat, shape_init_client::ShapeInitClient};
use testkit::sandbox::{Sandbox, Service};
use tonic::{Code, transport::Channel};
use vision::scene::{Ring, silhouettes};

async fn serve() -> (Sandbox, Service, ShapeInitClient<Channel>) {
    let sandbox = Sandbox::new().await;
    let service = sandbox.serve(shape_init::start, |_| {}).await;
    let client = ShapeInitClient::new(service.channel().await);
    (sandbox, service, client)
}

fn sample(stature_m: Option<f64>) -> v1::SampleBodyRequest {
    v1::SampleBodyRequest {
        body_model_id: "shipped".to_owned(),
        stature_m,
        format: MeshFormat::Ply.into(),
        ..Default::default()
    }
}

#[tokio::test]
async fn the_shipped_model_is_described_and_bodies_are_drawn_from_it() {
    let (_sandbox, service, mut client) = serve().await;
    let request = v1::DescribeBodyModelRequest { body_model_id: "shipped".to_owned() };
    let described = client.describe_body_model(request).await.unwrap().into_inner();
    let shipped = BodyModel::shipped();
    assert_eq!(described.num_vertices as usize, shipped.num_vertices());
    assert_eq!(described.variance_kept, shipped.variance_kept());
    assert_eq!(described.dof_names.len(), shipped.rig().num_dofs());
    assert_eq!((described.joint_parents[0], described.joint_names.len()), (-1, shipped.rig().num_joints()));

    let drawn = client.sample_body(sample(Some(1.83))).await.unwrap().into_inner();
    let measured = drawn.measurements.unwrap().stature_m;
    assert!((measured - 1.83).abs() < 1e-3, "stature {measured} m");
    let mesh = ply::read(&drawn.mesh).unwrap().value;
    assert_eq!(mesh.vertices.len(), shipped.num_vertices());

    // what was drawn comes again from its coefficients
    let again = v1::SampleBodyRequest { alpha: drawn.alpha, ..sample(None) };
    let again = client.sample_body(again).await.unwrap().into_inner();
    assert_eq!(again.mesh, drawn.mesh);
    service.stop().await;
}

#[tokio::test]
async fn a_hull_is_carved_from_silhouettes_and_holds_the_body() {
    let (_sandbox, service, mut client) = serve().await;
    let model = BodyModel::shipped();
    let mesh = model.shape(&[]).mesh(&model);
    let (calibration, silhouettes) = seen(&mesh);
    let request = v1::PreviewHullRequest {
        calibration: calibration.into_bytes(),
        calibration_name: "ring.json".to_owned(),
        silhouettes,
        cell_m: 0.02,
        format: MeshFormat::Ply.into(),
    };
    let hull = client.preview_hull(request.clone()).await.unwrap().into_inner();
    let carved = ply::read(&hull.mesh).unwrap().value;
    let (low, high) = height(&carved);
    let (foot, crown) = height(&mesh);
    assert!((low - foot).abs() < 0.06 && (high - crown).abs() < 0.06, "{low} to {high} m");
    // a hull of eight views is larger than the body, but not twice as large
    let body_m3 = model.shape(&[]).measurements(&model).mass_kg / 1000.0;
    let hull_m3 = hull.pieces_m3[0];
    assert!((0.9 * body_m3..2.0 * body_m3).contains(&hull_m3), "{hull_m3} m³, the body has {body_m3}");

    let mut wrong = request.clone();
    wrong.silhouettes[3].camera = "nine".to_owned();
    let status = client.preview_hull(wrong).await.unwrap_err();
    assert_eq!(status.code(), Code::InvalidArgument);
    assert!(status.message().contains("\"nine\"") && status.message().contains("cam0"), "{status}");
    let mut cut = request;
    cut.silhouettes[0].image.truncate(40);
    let status = client.preview_hull(cut).await.unwrap_err();
    assert_eq!(status.code(), Code::InvalidArgument, "{status}");
    service.stop().await;
}

#[tokio::test]
async fn bodies_that_nobody_has_are_refused_with_what_was_expected() {
    let (_sandbox, service, mut client) = serve().await;
    let unknown = v1::SampleBodyRequest { body_model_id: uuid::Uuid::now_v7().to_string(), ..sample(None) };
    assert_eq!(client.sample_body(unknown).await.unwrap_err().code(), Code::NotFound);
    let refused = [
        (v1::SampleBodyRequest { alpha: vec![f64::NAN], ..sample(None) }, "alpha"),
        (v1::SampleBodyRequest { alpha: vec![0.0; 99], ..sample(None) }, "99"),
        (v1::SampleBodyRequest { alpha: vec![1.0], ..sample(Some(1.8)) }, "one of the two"),
        (v1::SampleBodyRequest { sex: "robot".to_owned(), ..sample(None) }, "female or male"),
        (sample(Some(f64::INFINITY)), "stature"),
    ];
    for (request, said) in refused {
        let status = client.sample_body(request).await.unwrap_err();
        assert_eq!(status.code(), Code::InvalidArgument, "{status}");
        assert!(status.message().contains(said), "{} does not say {said}", status.message());
    }
    let hull = v1::PreviewHullRequest { cell_m: 1e-9, ..Default::default() };
    let status = client.preview_hull(hull).await.unwrap_err();
    assert!(status.code() == Code::InvalidArgument && status.message().contains("cell_m"), "{status}");
    service.stop().await;
}

/// Eight cameras around a body: the calibration, and what they see.
fn seen(mesh: &Mesh) -> (String, Vec<CameraSilhouette>) {
    let cameras: Vec<Camera> = Ring::default().cameras();
    let masks = silhouettes(mesh, &cameras);
    let views = cameras.iter().zip(&masks).map(|(camera, mask)| CameraSilhouette {
        camera: camera.name.clone(),
        image: image_files::write_silhouette(mask),
    });
    (calibration::write(&cameras), views.collect())
}

fn height(mesh: &Mesh) -> (f64, f64) {
    let heights = mesh.vertices.iter().map(|vertex| vertex.y);
    heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), y| (low.min(y), high.max(y)))
}
