//! Files that claim to be huge must not make the readers allocate for it. The only test of its process, so that the
//! process's peak is the readers'.

use formats::{BvhOptions, PointsOptions, amc, archive, asf, bvh, c3d, npy, ply, points_csv, trc};

/// Peak memory of this process, bytes; 0 where the system doesn't tell.
fn peak() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    line.and_then(|l| l.trim().trim_end_matches(" kB").parse::<u64>().ok()).unwrap_or(0) * 1024
}

#[test]
fn huge_claims_of_small_files_take_little_memory() {
    let before = peak();
    let bvh = "HIERARCHY\nROOT r\n{\nOFFSET 0 0 0\nCHANNELS 1 Xrotation\n}\nMOTION\nFrames: 1000000000\n\
               Frame Time: 0.1\n5\n";
    assert_eq!(bvh::read(bvh.as_bytes(), &BvhOptions::default()).unwrap().value.num_frames(), 1);
    let trc = "PathFileType\t4\nDataRate\tNumFrames\tNumMarkers\tUnits\n100\t1000000000\t1000000000\tmm\n\
               Frame#\tTime\ta\n\t\tX1\n1\t0\t1\t2\t3\n";
    let many = format!("{trc}2\t10000000\t1\t2\t3\n");
    assert_eq!(trc::read(trc.as_bytes(), &PointsOptions::default()).unwrap().value.num_frames(), 1);
    assert!(trc::read(many.as_bytes(), &PointsOptions::default()).is_err());
    let csv = "time,a_x,a_y,a_z\n0,1,2,3\n0.001,1,2,3\n900000000,1,2,3\n";
    assert!(points_csv::read(csv.as_bytes()).is_err());

    // 65,535 points and frames in a header
    let mut header = vec![2, 0x50];
    for word in [u16::MAX, u16::MAX, 1, u16::MAX - 1, 0] {
        header.extend(word.to_le_bytes());
    }
    header.extend((-1_f32).to_le_bytes());
    header.extend([3, 0, 1, 0]);
    header.extend(100_f32.to_le_bytes());
    header.resize(512, 0);
    header.extend([1, 80, 1, 84]);
    // a parameter of no bytes that says it is 255^6 texts
    header.extend([1, 255, b'P', 3, 0, 0, 6, 1]);
    header.extend(b"LABELS");
    header.extend([12, 0, 255, 7, 0, 255, 255, 255, 255, 255, 255, 0]);
    header.resize(1024, 0);
    assert!(c3d::read(&header, &PointsOptions::default()).is_err());

    let asf =
        asf::read(b":units\nlength 1\nangle deg\n:root\norder RX\n:bonedata\n:hierarchy\n").unwrap().value;
    assert!(amc::read(b":DEGREES\n1000000000\n", &asf, 60.0).is_err());

    // a tar header that declares 8 GiB
    let mut tar = tar::Header::new_gnu();
    tar.set_path("a.amc").unwrap();
    tar.set_size(8 << 30);
    tar.set_cksum();
    assert!(archive::entries("a", tar.as_bytes(), &archive::Limits::default()).is_err());

    let ply = "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty double x\nproperty double y\n\
               property double z\nelement face 4000000000\nproperty list uint int vertex_indices\nend_header\n\0\0";
    assert!(ply::read(ply.as_bytes()).is_err());
    let npy = b"\x93NUMPY\x02\x00\x40\x00\x00\x00{'descr': '<f8', 'fortran_order': False, 'shape': (4000000000,), }";
    assert!(npy::read(npy).is_err());

    let grown = peak().saturating_sub(before);
    assert!(grown < 64 << 20, "{grown} bytes");
}
