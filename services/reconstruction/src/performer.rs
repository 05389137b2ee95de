//! The skeleton of a performer of whom only the paths of some points were uploaded.

use crate::error::InputError;
use jobs::sparse::FittedReport;
use motion_db::MotionDatabase;
use skeleton_fit::{FitSettings, LIMBS, LimbScale, Sizes, fit_skeleton};
use sparse::Session;

/// The session on a skeleton fitted to its points, and what the user is told. Where nothing can be fitted it stays on the
/// skeleton that it has.
pub(crate) fn fit(
    database: &MotionDatabase,
    session: Session,
    warnings: &mut Vec<String>,
) -> Result<(Session, Option<FittedReport>), InputError> {
    let fitted = fit_skeleton(database, &session.points, &session.trajectories, &FitSettings::default());
    let fitted = match fitted {
        Ok(fitted) => fitted,
        Err(error) => {
            warnings.push(format!(
                "no skeleton file, and none could be fitted ({error}): the motion database's own is used"
            ));
            return Ok((session, None));
        }
    };
    let [arms, legs, trunk] = fitted.scales;
    let percent =
        |limb: LimbScale| format!("{:+.0} ± {:.0} %", 100.0 * (limb.scale - 1.0), 100.0 * limb.sigma);
    let sizes = Sizes::from_skeleton(&fitted.skeleton);
    warnings.push(format!(
        "no skeleton file: one was fitted, {:.2} m high in its rest pose (less than the stature); compared with the mean of the \
         {} performers of the database: arms {}, legs {}, trunk {}",
        sizes.height_m,
        fitted.performers,
        percent(arms),
        percent(legs),
        percent(trunk)
    ));
    let (performers, spans) = (fitted.performers, fitted.spans);
    let session = Session {
        skeleton: fitted.skeleton.into(),
        points: fitted.points,
        trajectories: session.trajectories,
    };
    const { assert!(LIMBS.len() == 3) };
    Ok((session, Some(FittedReport { sizes, arms, legs, trunk, performers, spans })))
}
