//! OBJ, PLY and NPY: the shared scans, dialects, and damaged files.

use formats::{archive, mesh_files, npy, obj, ply};
use model::Mesh;
use nalgebra::Vector3;
use proptest::{prelude::*, sample::Index};

/// Four triangles around the origin, one vertex without a face.
fn mesh() -> Mesh {
    let mut vertices = vec![Vector3::zeros(), Vector3::x(), Vector3::y(), Vector3::z()];
    vertices.push(Vector3::new(0.25, -1.5, 3e-3));
    Mesh::new(vertices, vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]).unwrap()
}

fn distance(a: &Mesh, b: &Mesh) -> f64 {
    assert_eq!(a.faces, b.faces);
    assert_eq!(a.vertices.len(), b.vertices.len());
    a.vertices.iter().zip(&b.vertices).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

#[test]
fn what_is_written_is_read_again() {
    let read = obj::read(obj::write(&mesh()).as_bytes()).unwrap();
    assert!(distance(&mesh(), &read.value) < 1e-6 && read.warnings.is_empty());
    let read = ply::read(&ply::write(&mesh())).unwrap();
    assert!(distance(&mesh(), &read.value) < 1e-6 && read.warnings.is_empty());
    let array = npy::read(&npy::write_f32(&[2, 3], &[1.0, 2.5, -3.0, 4.0, 5.0, 6.0]).unwrap()).unwrap();
    assert_eq!((array.shape.as_slice(), array.values[1]), ([2, 3].as_slice(), 2.5));
    assert_eq!(array.points().unwrap()[1], Vector3::new(4.0, 5.0, 6.0));
    assert!(npy::write_f32(&[2, 2], &[0.0]).is_err());
}

#[test]
fn scans_in_obj_and_npy_have_the_same_topology() {
    let test = "scans_in_obj_and_npy_have_the_same_topology";
    let Some(folder) = testkit::shared::find("data/bodies/scans", test) else { return };
    let template = obj::read(&testkit::shared::read(&folder, "topology.obj")).unwrap();
    assert!(template.warnings.is_empty());
    let template = template.value;
    assert_eq!((template.vertices.len(), template.faces.len()), (6500, 12_996));
    assert!((0.03..0.15).contains(&template.volume()), "outside is outside");
    let faces = npy::read(&testkit::shared::read(&folder, "faces.npy")).unwrap();
    assert_eq!(faces.shape, [12_996, 3]);
    assert!(faces.values.iter().zip(template.faces.as_flattened()).all(|(a, b)| *a == f64::from(*b)));
    let joints = npy::read(&testkit::shared::read(&folder, "joints.npy")).unwrap();
    assert_eq!(joints.shape, [564, 21, 3]);
    let vertices = npy::read(&testkit::shared::read(&folder, "vertices.npy")).unwrap();
    assert_eq!(vertices.shape, [564, 6500, 3]);
    // the template is the mean of the first 114, in steps of 0.1 mm
    let mean = |number: usize| {
        (0..114).map(|row| vertices.values[row * 19_500 + number]).sum::<f64>() / 114.0 * 1e-4
    };
    for number in (0..19_500).step_by(501) {
        assert!((mean(number) - template.vertices[number / 3][number % 3]).abs() < 1e-4);
    }
}

#[test]
fn the_mesh_of_the_synthetic_capture_stands_on_the_floor() {
    let test = "the_mesh_of_the_synthetic_capture_stands_on_the_floor";
    let Some(folder) = testkit::shared::find("data/multiview/synthetic-8cam/groundtruth", test) else {
        return;
    };
    let read = ply::read(&testkit::shared::read(&folder, "mesh_0000.ply")).unwrap();
    assert_eq!((read.value.vertices.len(), read.value.faces.len()), (6500, 12_996));
    let floor = read.value.vertices.iter().map(|vertex| vertex.y).fold(f64::INFINITY, f64::min);
    assert!(floor.abs() < 2e-3 && read.warnings.is_empty(), "{floor}");
}

#[test]
fn polygons_normals_and_negative_numbers_of_obj_are_understood() {
    let text = "# a cube's side\nmtllib a.mtl\no side\nv 0 0 0 1.0\nv 1 0 0\nv 1 1 0 0.5 0.5 0.5\nv 0 1 0\nvt 0 0\nvn 0 0 1\n\
                g a\nusemtl m\ns off\nf 1/1/1 2//1 3/1 -1\nf -4 -3 -2\n";
    let read = obj::read(text.as_bytes()).unwrap();
    assert_eq!(read.value.faces, [[0, 1, 2], [0, 2, 3], [0, 1, 2]]);
    assert_eq!(read.warnings[0].to_string(), "1 face of more than three corners became triangles");
    for (text, message) in [
        ("v 0 0\n", "line 1: found \"v 0 0\", expected three coordinates"),
        ("v 0 0 nan\n", "line 1: found \"nan\", expected a coordinate"),
        ("v 0 0 0\nf 1 1 2\n", "line 2: found \"2\", expected a vertex from 1 to 1, or from -1 to -1"),
        ("v 0 0 0\nf 1 1\n", "line 2: found \"f 1 1\", expected at least three corners"),
        ("o nothing\n", "file: found no vertex, expected lines that begin with v"),
    ] {
        assert_eq!(obj::read(text.as_bytes()).unwrap_err().to_string(), message);
    }
}

const TEXT_PLY: &str = "ply\r\nformat ascii 1.0\r\ncomment x\r\nelement camera 1\r\nproperty float f\r\nelement vertex 4\r\n\
    property float nx\r\nproperty float x\r\nproperty float y\r\nproperty float z\r\nproperty uchar red\r\nelement face 1\r\n\
    property list uchar int vertex_index\r\nproperty list uchar float texcoord\r\nend_header\r\n\
    35\r\n0 0 0 0 1\r\n0 1 0 0 1\r\n0 1 1 0 1\r\n0 0 1 0 1\r\n4 0 1 2 3 2 0.5 0.5\r\n";

#[test]
fn ply_of_text_and_of_either_byte_order_with_other_properties_is_read() {
    let read = ply::read(TEXT_PLY.as_bytes()).unwrap();
    assert_eq!(read.value.faces, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(read.value.vertices[2], Vector3::new(1.0, 1.0, 0.0));
    assert_eq!(read.warnings.len(), 1);
    let header = |order: &str| {
        format!(
            "ply\nformat binary_{order}_endian 1.0\nelement vertex 3\nproperty double x\nproperty ushort q\nproperty double y\n\
             property double z\nelement face 1\nproperty list ushort uint vertex_indices\nend_header\n"
        )
    };
    for is_big in [false, true] {
        let mut bytes = header(if is_big { "big" } else { "little" }).into_bytes();
        let mut push = |little: &[u8]| {
            let mut word = little.to_vec();
            if is_big {
                word.reverse();
            }
            bytes.extend(word);
        };
        for vertex in 0..3 {
            push(&f64::from(vertex).to_le_bytes());
            push(&7_u16.to_le_bytes());
            push(&0.5_f64.to_le_bytes());
            push(&f64::from(vertex * vertex).to_le_bytes());
        }
        push(&3_u16.to_le_bytes());
        (0..3_u32).for_each(|corner| push(&corner.to_le_bytes()));
        let read = ply::read(&bytes).unwrap();
        assert_eq!(read.value.vertices[2], Vector3::new(2.0, 0.5, 4.0));
        assert_eq!(read.value.faces, [[0, 1, 2]]);
        assert!(read.warnings.is_empty());
    }
}

#[test]
fn what_is_wrong_in_a_ply_is_told() {
    let message = |text: String| ply::read(text.as_bytes()).unwrap_err().to_string();
    let changed = |from: &str, to: &str| message(TEXT_PLY.replacen(from, to, 1));
    assert!(changed("ply", "PLY!").starts_with("line 1: found \"PLY!"));
    assert!(changed("ascii", "utf8").starts_with("line 2: found \"format utf8 1.0\", expected ascii"));
    let huge = changed("element vertex 4", "element vertex 4000000000");
    assert!(huge.contains("expected 4000000000 items of vertex, 10 bytes each or more"), "{huge}");
    assert!(
        changed("4 0 1 2 3", "4 0 1 2 9").contains("face 1 has corners [0, 2, 9], expected indices below 4")
    );
    assert!(changed("4 0 1 2 3", "2 0 1").contains("a face of 2 corners"));
    assert!(changed("property float z\r\n", "").contains("one number x, y and z each"));
    assert!(changed("0 1 1 0 1", "0 one 1 0 1").starts_with("line 19: found \"one\", expected a number"));
}

/// An NPY of version 1 with this header and data.
fn array(header: &str, data: &[u8]) -> Vec<u8> {
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(data);
    bytes
}

#[test]
fn arrays_of_every_kind_of_number_are_read() {
    let parsed = |descr: &str, data: &[u8]| {
        let header = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': (2,), }}\n");
        npy::read(&array(&header, data)).unwrap().values
    };
    assert_eq!(parsed("<i2", &[0xfe, 0xff, 1, 0]), [-2.0, 1.0]);
    assert_eq!(parsed(">u2", &[0xff, 0xfe, 1, 0]), [65_534.0, 256.0]);
    assert_eq!(parsed("|i1", &[0xff, 3]), [-1.0, 3.0]);
    assert_eq!(parsed("|b1", &[1, 0]), [1.0, 0.0]);
    assert_eq!(parsed("<f2", &[0x00, 0x3c, 0x00, 0xc1]), [1.0, -2.5]);
    assert_eq!(parsed("<f4", &[0, 0, 0x20, 0x41, 0, 0, 0, 0]), [10.0, 0.0]);
    assert_eq!(parsed(">f8", &[0x40, 0x24, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]), [10.0, 0.0]);
    assert_eq!(parsed("<i8", &[0xff; 16]), [-1.0, -1.0]);
    let fortran = "{'descr': '|u1', 'fortran_order': True, 'shape': (2, 3)}";
    let read = npy::read(&array(fortran, &[0, 3, 1, 4, 2, 5])).unwrap();
    assert_eq!(read.values, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
    let single =
        npy::read(&array("{'descr': '<f4', 'fortran_order': False, 'shape': ()}", &[0, 0, 0x20, 0x41]));
    assert_eq!(single.unwrap().values, [10.0]);
}

#[test]
fn arrays_that_claim_more_than_they_have_are_refused() {
    let message = |header: &str, data: &[u8]| npy::read(&array(header, data)).unwrap_err().to_string();
    let huge = "{'descr': '<f8', 'fortran_order': False, 'shape': (4294967296, 4294967296), }";
    assert!(
        message(huge, &[0; 8]).contains("found 8 bytes of data, expected those of an array of [4294967296")
    );
    assert!(message(huge, &[]).contains("found 0 bytes of data"));
    let complex = "{'descr': '<c8', 'fortran_order': False, 'shape': (1,), }";
    assert!(message(complex, &[0; 8]).contains("no such descr in the header"));
    let object = "{'descr': '|O', 'fortran_order': False, 'shape': (1,), }";
    assert!(message(object, &[0; 8]).contains("integers or floats"));
    assert!(
        npy::read(b"\x93NUMPY\x02\x00\xff\xff\xff\xff{}")
            .unwrap_err()
            .to_string()
            .contains("the end of the file")
    );
    assert!(npy::read(b"PK").unwrap_err().to_string().starts_with("byte 0: found \"PK\""));
}

/// Reads a file and gives the number of things in it, 0 if it is refused.
type Reader = fn(&[u8]) -> usize;

#[test]
fn the_name_of_a_file_tells_the_format_of_its_mesh() {
    for name in ["scan.obj", "folder/SCAN.OBJ"] {
        assert_eq!(
            mesh_files::read(name, obj::write(&mesh()).as_bytes()),
            obj::read(obj::write(&mesh()).as_bytes())
        );
    }
    assert_eq!(mesh_files::read("scan.ply", &ply::write(&mesh())), ply::read(&ply::write(&mesh())));
    let error = mesh_files::read("scan.stl", &ply::write(&mesh())).unwrap_err();
    assert_eq!(error.to_string(), r#"file: found the name "scan.stl", expected an ending .obj or .ply"#);
}

#[test]
fn damaged_meshes_and_arrays_are_read_or_refused() {
    let seeds: [(Vec<u8>, Reader); 4] = [
        (obj::write(&mesh()).into_bytes(), |b| obj::read(b).map_or(0, |read| read.value.vertices.len())),
        (ply::write(&mesh()), |b| ply::read(b).map_or(0, |read| read.value.vertices.len())),
        (TEXT_PLY.into(), |b| ply::read(b).map_or(0, |read| read.value.faces.len())),
        (npy::write_f32(&[4, 3], &[0.5; 12]).unwrap(), |b| {
            npy::read(b).map_or(0, |array| array.values.len())
        }),
    ];
    for (seed, read) in seeds {
        assert!(read(&seed) > 0);
        (0..seed.len()).for_each(|length| assert!(read(&seed[..length]) <= length));
        let changes = proptest::collection::vec((any::<Index>(), any::<u8>(), 0..4_usize), 1..8);
        let config = ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() };
        let mut runner = proptest::test_runner::TestRunner::new_with_rng(
            config,
            proptest::test_runner::TestRng::deterministic_rng(proptest::test_runner::RngAlgorithm::ChaCha),
        );
        let result = runner.run(&changes, |changes| {
            let mut bytes = seed.clone();
            for (at, byte, kind) in changes {
                let at = at.index(bytes.len());
                match kind {
                    0 => bytes.insert(at, byte),
                    1 if bytes.len() > 1 => drop(bytes.remove(at)),
                    2 => bytes[at] = b'0' + byte % 10,
                    _ => bytes[at] = byte,
                }
            }
            prop_assert!(read(&bytes) <= bytes.len());
            Ok(())
        });
        result.unwrap();
    }
}

#[test]
fn archives_of_meshes_and_pictures_are_unpacked() {
    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let png = formats::image_files::write_silhouette(&model::Silhouette::empty(1004, 1004));
    // many empty masks: they pack well, and must not be taken for a bomb
    let mut files = vec![("scans/s001.obj".to_owned(), obj::write(&mesh()).into_bytes())];
    files.push(("scans/s002.ply".to_owned(), ply::write(&mesh())));
    files.extend((0..300).map(|frame| (format!("cam0/{frame:04}.png"), png.clone())));
    for (name, bytes) in &files {
        zip.start_file(name.as_str(), zip::write::SimpleFileOptions::default()).unwrap();
        std::io::Write::write_all(&mut zip, bytes).unwrap();
    }
    let packed = zip.finish().unwrap().into_inner();
    let entries = archive::entries("masks.zip", &packed, &archive::Limits::default()).unwrap();
    assert_eq!(entries.len(), files.len());
    assert!(
        entries.iter().zip(&files).all(|(entry, (name, bytes))| entry.name == *name && entry.bytes == *bytes)
    );
}
