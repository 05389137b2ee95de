//! Mapped bytes are the file's.

use std::io::Write;

fn file(bytes: &[u8]) -> tempfile::NamedTempFile {
    let mut file = tempfile::NamedTempFile::new().unwrap();
    file.write_all(bytes).unwrap();
    file
}

#[test]
fn a_mapped_file_reads_as_it_was_written_and_outlives_its_name() {
    let written: Vec<u8> = (0..200_000u32).flat_map(u32::to_le_bytes).collect();
    let file = file(&written);
    let mapped = mapped_file::map(file.path()).unwrap();
    assert_eq!(mapped, written);
    let part = mapped.slice(100_000..100_004);
    drop((mapped, file));
    assert_eq!(part[..], 25_000u32.to_le_bytes());
}

#[test]
fn mapped_bytes_lie_at_the_start_of_a_page() {
    let file = file(&[1; 10_000]);
    assert_eq!(mapped_file::map(file.path()).unwrap().as_ptr() as usize % 4_096, 0);
}

#[test]
fn an_empty_file_is_no_bytes_and_a_missing_one_an_error() {
    assert!(mapped_file::map(file(&[]).path()).unwrap().is_empty());
    let missing = mapped_file::map(std::path::Path::new("/nowhere/index")).unwrap_err();
    assert_eq!(missing.kind(), std::io::ErrorKind::NotFound);
}
