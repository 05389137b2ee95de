//! The model's file: round trip, and files that are damaged or hostile.

use body::{BodyModel, Error, MAX_BYTES, ModelParts, RigFile};
use proptest::prelude::*;

/// A file with some bytes changed and the checksum put right again: what damage by intent looks like.
fn with_checksum(mut content: Vec<u8>) -> Vec<u8> {
    content.extend(blake3::hash(&content).as_bytes());
    content
}

fn content() -> Vec<u8> {
    let mut bytes = BodyModel::shipped().to_bytes();
    bytes.truncate(bytes.len() - 32);
    bytes
}

fn header_length(content: &[u8]) -> usize {
    u32::from_le_bytes(content[12..16].try_into().unwrap()) as usize
}

/// A file whose header is changed as text.
fn with_header(change: impl Fn(&str) -> String) -> Vec<u8> {
    let content = content();
    let (head, packed) = content.split_at(16 + header_length(&content));
    let text = change(std::str::from_utf8(&head[16..]).unwrap());
    let mut bytes = head[..12].to_vec();
    bytes.extend((text.len() as u32).to_le_bytes());
    bytes.extend(text.as_bytes());
    bytes.extend(packed);
    with_checksum(bytes)
}

#[test]
fn a_model_is_read_as_it_was_written() {
    let model = BodyModel::shipped();
    let bytes = model.to_bytes();
    // Not the bytes of the shipped file itself: another version of the compressor packs them otherwise.
    assert!(BodyModel::from_bytes(&bytes).unwrap() == model);
    assert!(bytes.len() <= 1_500_000, "{} bytes", bytes.len());
}

#[test]
fn damage_is_noticed() {
    let bytes = BodyModel::shipped().to_bytes();
    for length in [0, 3, 8, 11, 12, 15, 16, 47, 1000, bytes.len() - 1] {
        assert!(BodyModel::from_bytes(&bytes[..length]).is_err(), "{length} bytes");
    }
    let mut flipped = bytes.clone();
    flipped[bytes.len() / 2] ^= 1;
    let error = BodyModel::from_bytes(&flipped).unwrap_err().to_string();
    assert!(error.contains("checksum"), "{error}");
    let mut later = bytes.clone();
    later[8] = 9;
    assert_eq!(BodyModel::from_bytes(&later).unwrap_err(), Error::Version { found: 9, expected: 1 });
    assert!(BodyModel::from_bytes(&vec![0; MAX_BYTES + 1]).is_err());
}

#[test]
fn headers_that_lie_are_refused() {
    for (from, to, expected) in [
        ("\"vertices\":6500", "\"vertices\":4000000000", "4000000000 vertices"),
        ("\"vertices\":6500", "\"vertices\":6501", "numbers are not"),
        ("\"vertices\":6500", "\"vertices\":0", "numbers are not"),
        ("\"faces\":12996", "\"faces\":1", "numbers are not"),
        ("\"parent\":0", "\"parent\":20", "expected an earlier joint"),
        ("\"parent\":-1", "\"parent\":-2", "has parent -2"),
        ("\"joint\":\"l_knee\"", "\"joint\":\"tail\"", "not a joint"),
        ("\"slope\":[", "\"slope\":[1.0,", "measurements"),
        ("\"scales\":[", "\"scales\":[7.0,", "21 components"),
        ("\"description\"", "\"rubbish\"", "header"),
    ] {
        let bytes = with_header(|text| text.replacen(from, to, 1));
        let error = BodyModel::from_bytes(&bytes).unwrap_err().to_string();
        assert!(error.contains(expected), "{to}: {error}");
    }
}

#[test]
fn a_mean_that_is_not_finite_is_refused() {
    let model = BodyModel::shipped();
    let mut parts = ModelParts {
        description: String::new(),
        faces: model.faces().to_vec(),
        mean: model.mean().to_vec(),
        components: Vec::new(),
        variance_kept: Vec::new(),
        rig: model.rig().clone(),
        regressor: model.regressor().clone(),
        skin: model.skin().clone(),
    };
    assert_eq!(BodyModel::new(parts.clone()).unwrap().num_components(), 0);
    parts.mean[77].x = f64::NAN;
    let error = BodyModel::new(parts).unwrap_err().to_string();
    assert!(error.contains("vertex 77"), "{error}");
}

#[test]
fn a_rig_of_rubbish_is_refused() {
    for text in [
        "",
        "{}",
        "[]",
        "{\"joints\":[],\"dofs\":[]}",
        "{\"joints\":[{\"name\":\"a\",\"parent\":-1}],\"dofs\":[]}",
    ] {
        assert!(RigFile::parse(text.as_bytes()).and_then(|file| file.rig()).is_err(), "{text}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn bytes_changed_anywhere_never_panic(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        in_header in any::<bool>(),
    ) {
        let mut content = content();
        let end = if in_header { 16 + header_length(&content) } else { content.len() };
        for (place, byte) in changes {
            content[place.index(end)] = byte;
        }
        if let Ok(model) = BodyModel::from_bytes(&with_checksum(content)) {
            let shape = model.shape(&vec![1.0; model.num_components()]);
            let mut posed = body::Posed::default();
            shape.pose(&model, &vec![0.1; model.rig().num_dofs()], &mut posed);
        }
    }
}
