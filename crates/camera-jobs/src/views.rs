use formats::{calibration, calibration::fit_to_image, image_files};
use proto::v1::CameraSilhouette;
use service::FileError;

use crate::View;

/// What a request says that cameras saw.
#[derive(Debug, Clone)]
pub struct Views {
    /// every camera with its silhouette, in the order of the request
    pub views: Vec<View>,
    /// what was assumed of them
    pub warnings: Vec<String>,
}

/// Reads the calibration (`name` helps to tell its kind) and the masks of a request.
///
/// # Errors
/// With the name of the camera or file that can't be read, or is missing from the calibration.
pub fn views(name: &str, calibration: &[u8], silhouettes: &[CameraSilhouette]) -> Result<Views, FileError> {
    let read = calibration::read(name, calibration, &calibration::Options::default())
        .map_err(FileError::in_file(name))?;
    let mut warnings: Vec<String> = read.warnings.into_iter().map(|w| w.message).collect();
    let mut views: Vec<View> = Vec::new();
    for given in silhouettes {
        let camera = read.value.iter().find(|camera| camera.name == given.camera).ok_or_else(|| {
            let names: Vec<&str> = read.value.iter().map(|camera| camera.name.as_str()).collect();
            FileError::unexpected("silhouettes", format!("camera {:?}", given.camera), names.join(", "))
        })?;
        if views.iter().any(|(other, _)| other.name == given.camera) {
            let found = format!("camera {:?} twice", given.camera);
            return Err(FileError::unexpected("silhouettes", found, "every camera once"));
        }
        let in_file = FileError::in_file(&given.camera);
        let mask =
            image_files::read_silhouette(&given.image, &image_files::Limits::default()).map_err(&in_file)?;
        // sides were limited just now
        let size = [mask.value.width() as u32, mask.value.height() as u32];
        let fitted = fit_to_image(camera, size).map_err(&in_file)?;
        warnings.extend(mask.warnings.into_iter().chain(fitted.warnings).map(|w| w.message));
        views.push((fitted.value, mask.value));
    }
    Ok(Views { views, warnings })
}
