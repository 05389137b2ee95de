//! Body models and bodies of theirs as files.

use axum::{
    http::{HeaderMap, header},
    response::{IntoResponse, Response},
};
use body::{UnknownSex, Wanted, shipped};
use formats::media_type;
use serde::Deserialize;
use utoipa::IntoParams;

use super::download::{self, Object};
use crate::{
    access::Reader,
    error::{Error, Result},
    extract::{Path, Query},
    versioned::{self, BodyModel, Latest, Versioned},
};

/// Download a body model
///
/// The file of a model that is ready: mean, components, rig and skin.
#[utoipa::path(
    get, path = "/v1/body-models/{body_model}/model", tag = "body models",
    params(("body_model" = String, Path, description = "id, name (its latest version that is ready), name@version or shipped")),
    responses((status = 200, content_type = "application/octet-stream"), (status = 206), (status = 304)),
)]
pub(super) async fn file(
    Reader(by): Reader,
    Path(which): Path<String>,
    headers: HeaderMap,
) -> Result<Response> {
    let model: BodyModel = versioned::look(&by, &which, Latest::Ready).await?;
    let ready = model.ready()?;
    let name = format!("{}-{}.marey-body", ready.name, ready.version);
    let Some(store_key) = &ready.store_key else {
        return Ok(whole(&name, media_type::BINARY, shipped().bytes.clone()));
    };
    let object = Object {
        name: &name,
        store_key,
        bytes: model.version().bytes.unwrap_or_default(),
        blake3: &ready.blake3,
        media_type: media_type::BINARY,
    };
    download::send(&by.app, &headers, &object).await
}

/// Which body is wanted of a model; the mean when nothing is said.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct BodyQuery {
    /// stature, metres
    stature_m: Option<f64>,
    /// mass, kilograms
    mass_kg: Option<f64>,
    /// age, years
    age_years: Option<f64>,
    /// `female` or `male`
    sex: Option<String>,
}

/// Download a body of a model as GLB
///
/// With skeleton and skin, for Blender and three.js: the mean body, or the most probable one with the given measurements.
#[utoipa::path(
    get, path = "/v1/body-models/{body_model}/body.glb", tag = "body models",
    params(
        ("body_model" = String, Path, description = "id, name (its latest version that is ready), name@version or shipped"),
        BodyQuery,
    ),
    responses((status = 200, content_type = "model/gltf-binary")),
)]
pub(super) async fn glb(
    Reader(by): Reader,
    Path(which): Path<String>,
    Query(query): Query<BodyQuery>,
) -> Result<Response> {
    let sex = query.sex.as_deref().map(str::parse).transpose();
    let sex = sex.map_err(|error: UnknownSex| Error::Unprocessable(error.to_string()))?;
    let wanted =
        Wanted { stature_m: query.stature_m, mass_kg: query.mass_kg, age_years: query.age_years, sex };
    let found: BodyModel = versioned::look(&by, &which, Latest::Ready).await?;
    let ready = found.ready()?;
    let stored = match &ready.store_key {
        None => None,
        Some(key) => Some(by.app.store.get(&key.parse()?, body::MAX_BYTES as u64).await?),
    };
    let made = tokio::task::spawn_blocking(move || -> Result<Vec<u8>> {
        let model = match stored {
            None => shipped().model.clone(),
            Some(bytes) => body::BodyModel::from_bytes(&bytes)
                .map_err(|e| Error::Internal(format!("body model: {e}")))?
                .into(),
        };
        let alpha = model.alpha_for(&wanted).map_err(|e| Error::Unprocessable(e.to_string()))?;
        body::glb(&model, &model.shape(&alpha), None).map_err(|e| Error::Internal(e.to_string()))
    });
    let bytes = made.await.map_err(|e| Error::Internal(format!("task: {e}")))??;
    Ok(whole(&format!("{}-{}.glb", ready.name, ready.version), media_type::GLB, bytes))
}

/// An answer that is a file which is in no store. Names of models need no quoting.
fn whole(name: &str, media_type: &'static str, bytes: Vec<u8>) -> Response {
    let disposition = format!("attachment; filename=\"{name}\"");
    ([(header::CONTENT_TYPE, media_type.to_owned()), (header::CONTENT_DISPOSITION, disposition)], bytes)
        .into_response()
}
