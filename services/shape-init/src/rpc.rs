//! `marey.v1.ShapeInit`: bodies and hulls at once.

use std::sync::Arc;

use camera_jobs::{ShapeError, views};
use jobs::inverse_kinematics::BodyDescription;
use proto::v1::{self, MeshFormat, shape_init_server::ShapeInit};
use service::{FileError, compute::Slots};
use tonic::{Request, Response, Status};

use crate::{InputError, Shared, error::CallError, hull::hull};

/// Largest request, bytes: silhouettes as PNG take some kilobytes each, photographs of masks a megabyte.
pub(crate) const MAX_REQUEST_BYTES: usize = 32 << 20;
/// Most silhouettes of a preview.
const MAX_VIEWS: usize = 64;
const CELL_M: f64 = 0.01;

pub(crate) struct Rpc {
    shared: Arc<Shared>,
    slots: Slots,
}

impl Rpc {
    pub fn new(shared: Arc<Shared>) -> Self {
        Self { shared, slots: Slots::default() }
    }

    async fn sample(&self, request: v1::SampleBodyRequest) -> Result<v1::SampleBodyResponse, CallError> {
        let (_, model) =
            self.shared.models.for_request(&request.body_model_id).await.map_err(CallError::from)?;
        let sampled = self.slots.run(move || {
            let described = BodyDescription {
                alpha: request.alpha.clone(),
                stature_m: request.stature_m,
                mass_kg: request.mass_kg,
                age_years: request.age_years,
                sex: camera_jobs::sex(&request.sex).map_err(ShapeError::from)?,
            };
            let shape = camera_jobs::shape(&model, &described)?;
            let mesh = match request.format() {
                MeshFormat::Glb => body::glb(&model, &shape, None).map_err(InputError::from)?,
                MeshFormat::Ply => formats::ply::write(&shape.mesh(&model)),
            };
            let m = shape.measurements(&model);
            let measurements = v1::BodyMeasurements {
                stature_m: m.stature_m,
                mass_kg: m.mass_kg,
                arm_span_m: m.arm_span_m,
                inseam_m: m.inseam_m,
                chest_m: m.chest_m,
                waist_m: m.waist_m,
                hip_m: m.hip_m,
            };
            Ok(v1::SampleBodyResponse { mesh, alpha: shape.alpha, measurements: Some(measurements) })
        });
        sampled.await
    }

    async fn preview(&self, request: v1::PreviewHullRequest) -> Result<v1::PreviewHullResponse, CallError> {
        let cell_m = if request.cell_m == 0.0 { CELL_M } else { request.cell_m };
        if !(0.004..=0.1).contains(&cell_m) {
            return Err(out_of_range("cell_m", &cell_m.to_string(), "0.004 to 0.1").into());
        }
        if !(2..=MAX_VIEWS).contains(&request.silhouettes.len()) {
            let (what, found) = ("silhouettes", request.silhouettes.len());
            return Err(proto::Error::Count { what, found, expected: "2 to 64" }.into());
        }
        let carved = self.slots.run(move || -> Result<_, CallError> {
            let seen = views(&request.calibration_name, &request.calibration, &request.silhouettes)?;
            let found = hull(&seen.views, cell_m)?;
            let mesh = match request.format() {
                MeshFormat::Glb => {
                    formats::glb::write_mesh("hull", &found.mesh).map_err(FileError::in_file("hull"))?
                }
                MeshFormat::Ply => formats::ply::write(&found.mesh),
            };
            Ok(v1::PreviewHullResponse { mesh, pieces_m3: found.pieces_m3, warnings: seen.warnings })
        });
        carved.await
    }
}

#[tonic::async_trait]
impl ShapeInit for Rpc {
    async fn describe_body_model(
        &self,
        request: Request<v1::DescribeBodyModelRequest>,
    ) -> Result<Response<v1::DescribeBodyModelResponse>, Status> {
        let which = request.into_inner().body_model_id;
        let (file, model) = self.shared.models.for_request(&which).await.map_err(CallError::from)?;
        let rig = model.rig();
        let parent = |parent: Option<usize>| parent.map_or(-1, |p| i32::try_from(p).unwrap_or(i32::MAX));
        let count = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        Ok(Response::new(v1::DescribeBodyModelResponse {
            description: model.description().to_owned(),
            num_vertices: count(model.num_vertices()),
            num_faces: count(model.faces().len()),
            variance_kept: model.variance_kept().to_vec(),
            joint_names: rig.joints().iter().map(|joint| joint.name.clone()).collect(),
            joint_parents: rig.joints().iter().map(|joint| parent(joint.parent)).collect(),
            dof_names: rig.dofs().iter().map(|dof| dof.name.clone()).collect(),
            blake3: file.blake3,
        }))
    }

    async fn sample_body(
        &self,
        request: Request<v1::SampleBodyRequest>,
    ) -> Result<Response<v1::SampleBodyResponse>, Status> {
        Ok(Response::new(self.sample(request.into_inner()).await?))
    }

    async fn preview_hull(
        &self,
        request: Request<v1::PreviewHullRequest>,
    ) -> Result<Response<v1::PreviewHullResponse>, Status> {
        Ok(Response::new(self.preview(request.into_inner()).await?))
    }
}

fn out_of_range(field: &'static str, found: &str, expected: &'static str) -> proto::Error {
    proto::Error::OutOfRange { field, found: found.to_owned(), expected }
}
