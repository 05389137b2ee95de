//! Results are streamed, in whole or in part, with their checksum.

use anyhow::{Context, Result};
use serde_json::json;

#[test]
fn a_result_is_given_whole_in_part_or_not_again() -> Result<()> {
    let api = crate::with_database();
    let session = crate::session(api, 11, 240)?;
    let run = api.start_run(&session, &json!({"motion_database": "walks"}))?;
    assert_eq!(api.wait(&run)?["state"], "succeeded");
    let path = format!("{run}/results/motion.bvh");
    let whole = api.get(&path)?;
    assert_eq!(whole.status, 200);
    assert!(whole.body.starts_with(b"HIERARCHY"));
    assert!(whole.header("content-disposition").contains("motion.bvh"));
    let listed = api.get(&format!("{run}/results"))?.json();
    let listed = listed.as_array().context("no list")?;
    let listed = listed.iter().find(|r| r["name"] == "motion.bvh").context("not listed")?;
    assert_eq!(listed["bytes"], whole.body.len());
    let etag = format!("\"{}\"", listed["blake3"].as_str().unwrap_or_default());
    assert_eq!(whole.header("etag"), etag);

    let part = api.get_with(&path, &[("range", "bytes=10-19")])?;
    assert_eq!((part.status, part.body.as_slice()), (206, &whole.body[10..20]));
    assert_eq!(part.header("content-range"), format!("bytes 10-19/{}", whole.body.len()));
    let behind = api.get_with(&path, &[("range", "bytes=999999999-")])?;
    assert_eq!((behind.status, behind.problem().as_str()), (416, "range-not-satisfiable"));
    let again = api.get_with(&path, &[("if-none-match", &etag)])?;
    assert_eq!((again.status, again.body.len()), (304, 0));
    assert_eq!(api.get(&format!("{run}/results/none.bvh"))?.status, 404);
    Ok(())
}
