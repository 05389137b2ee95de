use model::counted;

/// Why no pose and shape could be found. Messages are for the person who recorded.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A body is found from two sides at least.
    #[error("the person is seen by {}, expected at least {least}", counted(found, "camera"))]
    TooFewViews {
        /// cameras with a silhouette that isn't empty
        found: usize,
        /// cameras needed
        least: usize,
    },
    /// All cameras look from about the same side.
    #[error(
        "all cameras look from the same side (within {degrees:.0}°), expected views from at least 30° apart"
    )]
    SameSide {
        /// largest angle between two of them, degrees
        degrees: f64,
    },
    /// Nobody is in any silhouette.
    #[error("nobody is in the silhouettes of this frame, expected one person")]
    Nobody,
    /// A silhouette is not of the size of its camera's image.
    #[error(
        "the silhouette of camera {camera} has {} x {} pixels, its calibration says {} x {}: the video was scaled or cropped, or it \
         is the wrong calibration",
        found[0], found[1], expected[0], expected[1]
    )]
    Size {
        /// name of the camera
        camera: String,
        /// width and height of the silhouette
        found: [usize; 2],
        /// width and height of the camera's image
        expected: [usize; 2],
    },
    /// An invalid calibration.
    #[error(transparent)]
    Camera(#[from] model::Error),
    /// A view doesn't agree with the others.
    #[error(
        "camera {camera} does not fit the other cameras: it sees background where they see the person. It was moved after \
         calibration, its silhouette misses parts of the person, or it is from a different moment; leave it out or repair it"
    )]
    ViewDisagrees {
        /// name of the camera
        camera: String,
    },
    /// The views have no person in common.
    #[error(
        "the cameras do not see the same person at the same place: only {} % of the silhouettes can be explained. Expected: \
         cameras that were not moved after calibration, silhouettes of the right cameras, of the same moment",
        (explained * 100.0).round()
    )]
    ViewsDoNotMeet {
        /// mean share of the silhouettes that the hull of all views covers
        explained: f64,
    },
    /// More than one person.
    #[error(
        "two people or things are in the silhouettes (the second has {} % of the volume of the first), expected one person: \
         mask the others out",
        (share * 100.0).round()
    )]
    TwoPeople {
        /// volume of the second piece of the hull as a share of the first
        share: f64,
    },
    /// What is seen is too small or too large for a person.
    #[error(
        "what the cameras see is {height_m:.2} m tall, expected a person of 0.5 to 2.8 m: is the calibration in metres?"
    )]
    Height {
        /// of the visual hull, metres
        height_m: f64,
    },
    /// No view shows the whole person.
    #[error(
        "the person is cut off by the image's border in every camera ({camera} shows most), expected at least two views of the \
         whole person"
    )]
    CutOff {
        /// the camera whose silhouette touches the border least
        camera: String,
    },
    /// The best body found doesn't look like the silhouettes.
    #[error(
        "no body was found that looks like the silhouettes: the best covers {} % of them, worst in camera {camera}. Expected: \
         one upright person, silhouettes without shadows and furniture, and the right calibration",
        (iou * 100.0).round()
    )]
    NotFound {
        /// mean intersection over union of all views
        iou: f64,
        /// the camera where it is least
        camera: String,
    },
    /// The visual hull could not be carved for another reason.
    #[error(transparent)]
    Hull(vision::Error),
    /// The model cannot be used here.
    #[error("the body model has {found}, expected {expected}")]
    Model {
        /// what was found
        found: String,
        /// what was expected
        expected: String,
    },
}
