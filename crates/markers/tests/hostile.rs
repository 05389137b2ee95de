//! Nonsensical maps and files: a value or an error, never a panic.

use markers::{MarkerMap, detect, fits, template};
use model::PointTrajectories;
use nalgebra::Vector3;
use proptest::prelude::*;

const MAP: &str = r#"
name = "mine"
prefix = "S:"
sigma_mm = 15
[points]
head = "TOP"
root = ["LASI", "RASI"]
left_wrist = { markers = ["A", "B"], weights = [3, 1], offset_mm = [1, -2, 3.5], sigma_mm = 4 }
[[points.left_ankle]]
markers = ["LANK"]
offset_mm = [42, 15, 0]
"#;

fn trajectories(names: Vec<String>, frames: usize, gone: u64) -> PointTrajectories {
    let is_gone = |i: usize| gone.rotate_left((i % 64) as u32) & 1 == 1;
    let positions = (0..frames * names.len())
        .map(|i| if is_gone(i) { Vector3::repeat(f64::NAN) } else { Vector3::new(i as f64, 1.0, -2.0) });
    PointTrajectories::new(names, 60.0, positions.collect()).unwrap()
}

fn check(map: &MarkerMap, file: &PointTrajectories) {
    let Ok(mapped) = map.apply(file, &[]) else { return };
    assert_eq!(mapped.trajectories.num_frames(), file.num_frames());
    assert_eq!(mapped.trajectories.num_points(), mapped.points.len());
    for frame in 0..file.num_frames() {
        for point in 0..mapped.points.len() {
            if let Some(sigma) = mapped.trajectories.sigma(frame, point) {
                assert!(sigma > 0.0 && sigma.is_finite());
            }
        }
    }
}

#[test]
fn a_map_cut_or_changed_anywhere_is_read_or_refused() {
    let names = ["S:TOP", "S:LASI", "S:RASI", "S:A", "S:B", "S:LANK"].map(str::to_owned).to_vec();
    let file = trajectories(names, 4, 0b1011);
    check(&MarkerMap::parse(MAP).unwrap(), &file);
    for end in 0..MAP.len() {
        if let Ok(map) = MarkerMap::parse(&MAP[..end]) {
            check(&map, &file);
        }
        for with in ["\"", "[", "]", "{", "=", "\n", "9", "e999", "nan", "\u{0}", "é"] {
            let changed = format!("{}{with}{}", &MAP[..end], &MAP[end + 1..]);
            if let Ok(map) = MarkerMap::parse(&changed) {
                check(&map, &file);
            }
        }
    }
    // deep and wide ones
    assert!(MarkerMap::parse(&format!("[points]\na = {}", "[".repeat(60_000))).is_err());
    assert!(MarkerMap::parse(&format!("{} = 1\n[points]\na = 'b'", ["a"; 20_000].join("."))).is_err());
    let wide: String = (0..65).map(|i| format!("p{i} = 'A'\n")).collect();
    assert!(MarkerMap::parse(&format!("[points]\n{wide}")).unwrap_err().to_string().contains("1 to 64"));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn files_of_any_names_and_gaps_are_mapped_or_refused(
        names in prop::collection::btree_set("[LR]?[:_.A-Ea-zé]{0,4}(ASI|PSI|FHD|BHD|WRA|WRB|ANK)?", 1..24),
        gone in any::<u64>(),
        frames in 0..6_usize,
    ) {
        let names: Vec<String> = names.into_iter().collect();
        let file = trajectories(names.clone(), frames, gone);
        for map in markers::presets() {
            check(map, &file);
        }
        let found = fits(&names);
        let detected = detect(&names).ok();
        for fit in found.first().into_iter().chain(&detected) {
            check(&fit.with_prefix(), &file);
            // what the program writes for people to edit, it reads
            let text = template(&names, Some(fit));
            prop_assert!(MarkerMap::parse(&text).is_ok(), "{text}");
        }
    }
}

#[test]
fn a_written_map_makes_the_points_of_the_set_it_was_made_from() {
    for preset in markers::presets() {
        let names: Vec<String> = preset.markers.iter().map(|name| format!("Anna:{name}")).collect();
        let file = trajectories(names.clone(), 3, 0);
        let fit = detect(&names).unwrap_or_else(|e| panic!("{}: {e}", preset.name));
        assert_eq!((fit.map.name.as_str(), fit.prefix.as_str()), (preset.name.as_str(), "Anna:"));
        let text = template(&names, Some(&fit));
        let written =
            MarkerMap::parse(&text).unwrap_or_else(|e| panic!("{e}\n{text}")).apply(&file, &[]).unwrap();
        let direct = fit.with_prefix().apply(&file, &[]).unwrap();
        assert_eq!(written.points.len(), direct.points.len(), "{text}");
        for (a, b) in written.points.iter().zip(&direct.points) {
            assert_eq!((&a.name, &a.markers), (&b.name, &b.markers));
            assert!((Vector3::from(a.offset_m) - Vector3::from(b.offset_m)).norm() < 1e-9, "{text}");
        }
        for frame in 0..3 {
            for point in 0..direct.points.len() {
                let (a, b) =
                    (written.trajectories.frame(frame)[point], direct.trajectories.frame(frame)[point]);
                assert!((a - b).norm() < 1e-6);
                assert_eq!(written.trajectories.sigma(frame, point), direct.trajectories.sigma(frame, point));
            }
        }
    }
    let nothing = template(&["a\"b\n".to_owned()], None);
    assert!(
        nothing.contains("# left_wrist") && MarkerMap::parse(&nothing).is_err(),
        "nothing is filled in yet"
    );
}

/// Every set as its makers name it is known as itself: none is taken for another, and none is a rival.
#[test]
fn every_set_is_known_as_itself() {
    for preset in markers::presets() {
        let fit = detect(&preset.markers).unwrap_or_else(|e| panic!("{}: {e}", preset.name));
        assert_eq!(fit.map.name, preset.name);
        assert_eq!(fit.num_whole(), preset.points().count());
    }
}
