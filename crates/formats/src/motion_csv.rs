//! CSV of a motion: `frame,time,<joint.channel>,…`, one row a frame.

use model::{ChannelKind, Motion};

use crate::text::{Names, push_number};

/// Writes the channel values of a motion, degrees and metres; frames count from 0 and times, seconds, start at 0.
///
/// Columns are named `joint.tx` … `joint.rz`, in the order of the skeleton's DOFs.
pub fn write(motion: &Motion) -> String {
    let skeleton = motion.skeleton();
    let mut out = String::from("frame,time");
    let mut taken = Names::default();
    for name in skeleton.dof_names() {
        out.push(',');
        out.push_str(&taken.unique_word(&name, &[',', ';', '"', '#']));
    }
    out.push('\n');
    let kinds: Vec<_> = skeleton.channels().map(|(_, c)| c.kind).collect();
    for (frame, pose) in motion.poses().enumerate() {
        out.push_str(&format!("{frame},{}", frame as f64 / motion.frame_rate()));
        for (value, kind) in pose.iter().zip(&kinds) {
            out.push(',');
            let value = match kind {
                ChannelKind::Rotation => value.to_degrees(),
                ChannelKind::Translation => *value,
            };
            push_number(&mut out, value);
        }
        out.push('\n');
    }
    out
}

#[cfg(test)]
mod tests {
    use model::{Axis, Channel, Joint, Motion, Skeleton};

    #[test]
    fn degrees_and_metres_have_a_column_each() {
        let root = Joint::root("the hips", vec![Channel::translation(Axis::Y), Channel::rotation(Axis::X)]);
        let skeleton = Skeleton::new("s", vec![root]).unwrap();
        let values = vec![0.9, std::f64::consts::FRAC_PI_2, 1.0, -0.25_f64.to_radians()];
        let motion = Motion::new(skeleton.into(), 50.0, values).unwrap();
        assert_eq!(super::write(&motion), "frame,time,the_hips.ty,the_hips.rx\n0,0,0.9,90\n1,0.02,1,-0.25\n");
    }
}
