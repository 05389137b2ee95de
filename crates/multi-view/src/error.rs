/// What is wrong with a session of several cameras.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A name of a file leads to no camera, or to several.
    #[error(
        "{source_name} belongs to {found} of the calibration, which has {cameras}; name the file after its camera, or say \
         which it is (marey run --camera {source_name}=CAMERA)"
    )]
    Camera {
        /// the file, or the folder of an archive
        source_name: String,
        /// "no camera", or the cameras that it may be
        found: String,
        /// the cameras there are
        cameras: String,
    },
    /// Two files claim one camera.
    #[error("{first} and {second} both belong to camera {camera}, expected one")]
    Twice {
        /// the camera
        camera: String,
        /// a file
        first: String,
        /// another
        second: String,
    },
    /// The map names something that isn't there.
    #[error("--camera FILE=CAMERA (camera_files) has {found:?}, expected {expected}")]
    Map {
        /// what it names
        found: String,
        /// what there is
        expected: String,
    },
    /// A parameter out of its range.
    #[error("{name} is {found}, expected {expected}")]
    Parameter {
        /// its name
        name: &'static str,
        /// the value found
        found: String,
        /// the range
        expected: &'static str,
    },
    /// An invalid parameter of the background model.
    #[error(
        "background{mark}{error}",
        // what begins with a parameter's name goes on the way to it
        mark = if matches!(.0, background::Error::Parameter { .. }) { "." } else { ": " },
        error = .0
    )]
    Background(#[from] background::Error),
    /// A clip of silhouettes that is damaged or truncated.
    #[error("not a clip of silhouettes: {0}")]
    Clip(String),
    /// Invalid matches of points, or a file of them that is damaged or truncated.
    #[error("not a clip of point matches: {0}")]
    Matches(String),
    /// A frame that is not in a clip.
    #[error("frame {found} is not in the clip of frames {start} to {end}")]
    Frame {
        /// the frame asked for
        found: usize,
        /// first frame
        start: usize,
        /// just after the last
        end: usize,
    },
}
