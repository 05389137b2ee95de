//! The store on a real folder. Another backend passes by running `conformance` on it.

use bytes::Bytes;
use futures::{StreamExt, TryStreamExt, stream};
use std::{collections::HashSet, path::Path};
use store::{Error, Key, Location, Store, UploadLimits};

fn open(folder: &Path) -> Store {
    Store::open(&Location::folder(folder)).unwrap()
}

fn key(text: &str) -> Key {
    text.parse().unwrap()
}

fn pieces(content: &[&'static [u8]]) -> impl futures::Stream<Item = Result<Bytes, String>> {
    stream::iter(content.iter().map(|c| Ok(Bytes::from_static(c))).collect::<Vec<_>>())
}

fn up_to(max_bytes: u64) -> UploadLimits {
    UploadLimits { max_bytes, expected_blake3: None }
}

fn files_in(folder: &Path) -> Vec<String> {
    let mut found = Vec::new();
    let mut open = vec![folder.to_owned()];
    while let Some(next) = open.pop() {
        for entry in std::fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else {
                found.push(path.strip_prefix(folder).unwrap().display().to_string());
            }
        }
    }
    found.sort();
    found
}

async fn conformance(store: &Store) {
    let a = key("runs/1/a");
    let stored = store.put(&a, Bytes::from_static(b"hello")).await.unwrap();
    assert_eq!((stored.bytes, stored.blake3.len()), (5, 64));
    assert_eq!(stored.blake3, blake3::hash(b"hello").to_hex().to_string());
    assert_eq!(store.get(&a, 5).await.unwrap(), "hello");
    assert_eq!(store.size(&a).await.unwrap(), 5);
    assert_eq!(store.get_range(&a, 1..3).await.unwrap(), "el");
    assert!(matches!(store.get(&a, 4).await, Err(Error::TooLarge { limit_bytes: 4, .. })));

    store.put(&a, Bytes::from_static(b"again")).await.unwrap();
    assert_eq!(store.get(&a, 5).await.unwrap(), "again");
    assert!(matches!(store.get_checked(&a, &stored.blake3, 5).await, Err(Error::Corrupt { .. })));

    assert!(matches!(store.create(&a, Bytes::new()).await, Err(Error::AlreadyExists { .. })));
    let b = key("runs/1/b");
    store.create(&b, Bytes::from_static(b"new")).await.unwrap();

    let streamed = store.put_stream(&key("runs/1/c"), pieces(&[b"one ", b"two"]), &up_to(7)).await.unwrap();
    assert_eq!(streamed.blake3, blake3::hash(b"one two").to_hex().to_string());
    let (size, content) = store.stream(&streamed.key).await.unwrap();
    let content: Vec<Bytes> = content.try_collect().await.unwrap();
    assert_eq!((size, content.concat().as_slice()), (7, b"one two".as_slice()));

    let mut listed: Vec<_> = store.list(&key("runs/1")).map(|e| e.unwrap().0.to_string()).collect().await;
    listed.sort();
    assert_eq!(listed, ["runs/1/a", "runs/1/b", "runs/1/c"]);

    let keep = HashSet::from([b.clone()]);
    assert_eq!(store.remove_orphans(&key("runs/1"), &keep).await.unwrap(), 2);
    assert!(matches!(store.get(&a, 5).await, Err(Error::NotFound { .. })));
    assert!(matches!(store.size(&a).await, Err(Error::NotFound { .. })));
    assert_eq!(store.get(&b, 5).await.unwrap(), "new");
    store.delete(&b).await.unwrap();
    store.delete(&b).await.unwrap();
}

#[tokio::test]
async fn a_folder_passes_the_conformance_suite() {
    let folder = tempfile::tempdir().unwrap();
    conformance(&open(folder.path())).await;
}

#[tokio::test]
async fn an_upload_over_the_limit_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let store = open(folder.path());
    let key = key("files/x");
    let result = store.put_stream(&key, pieces(&[b"12345", b"6"]), &up_to(5)).await;
    assert!(matches!(result, Err(Error::TooLarge { limit_bytes: 5, .. })));
    assert_eq!(files_in(folder.path()), Vec::<String>::new());
}

#[tokio::test]
async fn an_endless_upload_is_stopped_at_the_limit() {
    let folder = tempfile::tempdir().unwrap();
    let zeros = Bytes::from(vec![0u8; 1 << 20]);
    let endless = stream::repeat_with(move || Ok::<_, String>(zeros.clone()));
    let result = open(folder.path()).put_stream(&key("files/x"), endless, &up_to(20 << 20)).await;
    assert!(matches!(result, Err(Error::TooLarge { .. })));
    assert_eq!(files_in(folder.path()), Vec::<String>::new());
}

#[tokio::test]
async fn an_upload_that_breaks_off_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let broken = stream::iter([Ok(Bytes::from_static(b"123")), Err("connection reset")]);
    let result = open(folder.path()).put_stream(&key("files/x"), broken, &up_to(100)).await;
    assert!(matches!(result, Err(Error::Interrupted { bytes: 3, .. })));
    assert_eq!(files_in(folder.path()), Vec::<String>::new());
}

#[tokio::test]
async fn an_upload_with_the_wrong_checksum_leaves_the_old_object() {
    let folder = tempfile::tempdir().unwrap();
    let store = open(folder.path());
    let key = key("files/x");
    store.put(&key, Bytes::from_static(b"old")).await.unwrap();
    let limits = UploadLimits { max_bytes: 10, expected_blake3: Some("0".repeat(64)) };
    let result = store.put_stream(&key, pieces(&[b"new"]), &limits).await;
    assert!(matches!(result, Err(Error::ChecksumMismatch { .. })));
    assert_eq!(store.get(&key, 10).await.unwrap(), "old");

    let right =
        UploadLimits { expected_blake3: Some(blake3::hash(b"new").to_hex().to_uppercase()), ..limits };
    store.put_stream(&key, pieces(&[b"new"]), &right).await.unwrap();
    assert_eq!(store.get(&key, 10).await.unwrap(), "new");
}

#[tokio::test]
async fn exactly_one_creator_among_many_succeeds() {
    let folder = tempfile::tempdir().unwrap();
    let store = open(folder.path());
    let key = key("runs/lock");
    let attempts = (0..16u8).map(|i| store.create(&key, Bytes::from(vec![i; 1000])));
    let results = futures::future::join_all(attempts).await;
    assert_eq!(results.iter().filter(|r| r.is_ok()).count(), 1);
    let content = store.get(&key, 1000).await.unwrap();
    assert!(content.iter().all(|b| *b == content[0]), "two writers were mixed");
}

#[tokio::test]
async fn a_byte_that_changed_on_disk_is_noticed() {
    let folder = tempfile::tempdir().unwrap();
    let store = open(folder.path());
    let key = key("motion-databases/1/1.mdb");
    let stored = store.put(&key, Bytes::from(vec![7u8; 300_000])).await.unwrap();
    assert_eq!(store.get_checked(&key, &stored.blake3, 1 << 20).await.unwrap().len(), 300_000);
    let path = folder.path().join(key.as_str());
    let mut content = std::fs::read(&path).unwrap();
    content[200_000] ^= 1;
    std::fs::write(&path, content).unwrap();
    assert!(matches!(store.get_checked(&key, &stored.blake3, 1 << 20).await, Err(Error::Corrupt { .. })));
}

#[tokio::test]
async fn a_store_that_is_a_file_or_a_bucket_is_refused_with_its_name() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    std::fs::write(&file, "x").unwrap();
    let error = Store::open(&Location::folder(&file)).unwrap_err().to_string();
    assert!(error.contains(&file.display().to_string()), "{error}");
    let error = Store::open(&"s3://bucket/x".parse().unwrap()).unwrap_err().to_string();
    assert!(error.contains("s3://bucket/x") && error.contains("no S3 backend"), "{error}");
}

#[tokio::test]
async fn what_earlier_attempts_left_is_removed_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let store = open(folder.path());
    let run = uuid::Uuid::nil();
    for (job, lease) in [(7, 1), (7, 2), (7, 10), (70, 1), (8, 1)] {
        let key = store::key::artefact(run, job, lease, "chunk.bin").unwrap();
        store.put(&key, Bytes::from_static(b"x")).await.unwrap();
    }
    assert_eq!(store.remove_earlier_leases(&store::key::job_prefix(run, 7), 10).await.unwrap(), 2);
    let left = files_in(folder.path())
        .into_iter()
        .map(|f| f.split('/').skip(2).take(2).collect::<Vec<_>>().join("/"));
    assert_eq!(left.collect::<Vec<_>>(), ["7/10", "70/1", "8/1"]);
}

#[tokio::test]
async fn what_a_killed_process_left_of_a_write_is_removed_when_it_is_old() {
    let folder = tempfile::tempdir().unwrap();
    let store = open(folder.path());
    store.put(&key("runs/1/whole"), Bytes::from_static(b"x")).await.unwrap();
    let left = folder.path().join("runs/1/points.csv#1");
    std::fs::write(&left, b"half").unwrap();
    let other = folder.path().join("runs/1/notes#old");
    std::fs::write(&other, b"not ours").unwrap();

    let day = std::time::Duration::from_secs(24 * 3600);
    assert_eq!(store.remove_abandoned_uploads(day).await.unwrap(), 0, "it may still be written to");
    let written = std::time::SystemTime::now() - day;
    for file in [&left, &other, &folder.path().join("runs/1/whole")] {
        std::fs::File::options().append(true).open(file).unwrap().set_modified(written).unwrap();
    }
    assert_eq!(store.remove_abandoned_uploads(day).await.unwrap(), 1);
    assert_eq!(files_in(folder.path()), ["runs/1/notes#old", "runs/1/whole"]);
}

#[tokio::test]
async fn a_write_in_progress_is_named_as_the_removal_of_old_ones_expects() {
    let folder = tempfile::tempdir().unwrap();
    let store = open(folder.path());
    let endless = stream::iter([Ok::<_, String>(Bytes::from_static(b"first"))]).chain(stream::pending());
    let task = {
        let store = store.clone();
        tokio::spawn(async move { store.put_stream(&key("runs/1/a"), endless, &up_to(100)).await })
    };
    let mut found = Vec::new();
    for _ in 0..500 {
        found = files_in(folder.path());
        if !found.is_empty() {
            break;
        }
        tokio::time::sleep(std::time::Duration::from_millis(10)).await;
    }
    assert!(found.len() == 1 && found[0].starts_with("runs/1/a#"), "{found:?}");
    assert_eq!(store.remove_abandoned_uploads(std::time::Duration::ZERO).await.unwrap(), 1);
    task.abort();
}
