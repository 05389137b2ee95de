//! How well each frame is known, as a table.

use std::fmt::Write as _;

use jobs::file_part;
use tracking::Stage;

use crate::finished::Finished;

/// `quality.csv`: a row a frame. `frame` counts as the cameras do, `time` is in seconds from the first row, overlaps are
/// intersections over union, and cells are empty where there is nothing to say.
pub(crate) fn quality(finished: &Finished) -> String {
    let mut out = String::from("frame,time,stage,overlap");
    for (index, camera) in finished.cameras.iter().enumerate() {
        // writing to a String can't fail
        let _ = write!(out, ",overlap_{}", file_part(camera, index));
    }
    out.push_str(",worst_limb,worst_limb_error_m,misaligned_limbs,effective_sample_size\n");
    for (row, tracked) in finished.tracked.frames.iter().enumerate() {
        let number = |value: Option<f64>| value.map_or(String::new(), |value| format!("{value:.4}"));
        let is_seen = tracked.stage != Stage::Unseen;
        let time = row as f64 / finished.frame_rate;
        let _ = write!(out, "{},{time:.6},{}", tracked.frame, tracked.stage.name());
        let _ = write!(out, ",{}", number(is_seen.then(|| tracked.mean_iou())));
        for overlap in &tracked.ious {
            let _ = write!(out, ",{}", number(*overlap));
        }
        let limbs = &tracked.misalignment.limbs;
        let worst = limbs.iter().max_by(|a, b| a.error_m.total_cmp(&b.error_m)).filter(|_| is_seen);
        let _ = write!(out, ",{}", worst.map_or("", |limb| limb.limb.name()));
        let _ = write!(out, ",{}", number(worst.map(|limb| limb.error_m)));
        let misaligned: Vec<&str> = tracked.misalignment.misaligned().map(|limb| limb.name()).collect();
        let size = tracked.effective_sample_size;
        let _ = writeln!(out, ",{},{}", misaligned.join(";"), number(size));
    }
    out
}
