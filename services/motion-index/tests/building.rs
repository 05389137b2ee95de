//! Motion databases as their builds leave them: parts, versions, augmentation, shards, models, bad input.

mod fixture;

use fixture::{Fixture, plan};
use jobs::motion_database::{Augment, MotionDatabaseFile, PlanMotionDatabase, TrainGplvm};
use motion_db::{MotionDatabase, trial_name};
use queue::{ClaimedJob, Job, Lease, RunState};
use regression::gplvm::TrainingOptions;
use serde_json::{Value, json};
use store::key;
use testkit::walker;
use uuid::Uuid;

fn names(database: &MotionDatabase) -> Vec<&str> {
    database.clips().iter().map(|clip| clip.name.as_str()).collect()
}

async fn contents(fixture: &Fixture, id: Uuid) -> Value {
    sqlx::query_scalar("SELECT contents FROM motion_databases WHERE id = $1")
        .bind(id)
        .fetch_one(&fixture.pool)
        .await
        .unwrap()
}

/// A database with the clips of another first.
async fn added(fixture: &Fixture, base: &MotionDatabaseFile, trials: &[usize]) -> PlanMotionDatabase {
    let id = fixture.new_database("walks").await;
    let files = if trials.is_empty() { Vec::new() } else { fixture.walks(id, trials, 240).await };
    PlanMotionDatabase { base: Some(base.clone()), ..plan(id, files) }
}

#[tokio::test]
async fn many_files_are_imported_in_parts_by_several_workers_and_the_result_is_the_same() {
    let mut fixture = Fixture::without_service().await;
    let id = fixture.new_database("walks").await;
    let trials: Vec<usize> = (1..=70).collect();
    let files = fixture.walks(id, &trials, 40).await;
    fixture.serve(|_| {}).await;
    let one = fixture.build(&plan(id, files.clone())).await;
    let kinds: Vec<(String, i64)> =
        sqlx::query_as("SELECT kind, count(*) FROM jobs GROUP BY kind ORDER BY min(id)")
            .fetch_all(&fixture.pool)
            .await
            .unwrap();
    let jobs = [("plan-motion-database", 1), ("import-motion", 3), ("build-motion-database", 1)];
    assert_eq!(kinds, jobs.map(|(kind, count)| (kind.to_owned(), count)));

    fixture.serve(|config| config.service.worker.concurrency = 3).await;
    let again = fixture.new_database("walks").await;
    let several = fixture.build(&plan(again, files)).await;
    assert_eq!(several.blake3, one.blake3);
    let database = fixture.open(&one).await;
    assert_eq!(database.clips().len(), 70);
    assert_eq!(database.num_poses(), 70 * 20);
    assert_eq!(names(&database)[..2], ["7_01", "7_02"]);
    fixture.stop().await;
}

#[tokio::test]
async fn a_version_holds_the_clips_of_its_base_bit_for_bit_and_the_new_ones() {
    let fixture = Fixture::new().await;
    let id = fixture.build_walks(&[1, 2, 3]).await;
    let first = fixture.file(id).await;
    let mut plan = added(&fixture, &first, &[1, 4]).await;
    plan.without = vec!["7_02".to_owned()];
    let second = fixture.build(&plan).await;
    assert_eq!(second.version, 2);
    let (old, new) = (fixture.open(&first).await, fixture.open(&second).await);
    // The file named 7_01 is another motion than the clip 7_01 that is kept.
    assert_eq!(names(&new), ["7_01", "7_03", "7_01_2", "7_04"]);
    assert!(new.has_same_coordinates_as(&old));
    let poses = |database: &MotionDatabase, clip: usize| {
        let clip = &database.clips()[clip];
        (0..clip.num_poses).flat_map(|i| database.pose(clip.first_pose + i).to_vec()).collect::<Vec<f32>>()
    };
    assert_eq!(poses(&new, 0), poses(&old, 0));
    assert_eq!(poses(&new, 1), poses(&old, 2));
    // The same motion in the same coordinates is the same numbers.
    assert_eq!(poses(&new, 2), poses(&old, 0));

    // Without any file: clips are only left out.
    let mut fewer = added(&fixture, &second, &[]).await;
    fewer.without = vec!["7_03".to_owned(), "7_01_2".to_owned()];
    let third = fixture.build(&fewer).await;
    assert_eq!(names(fixture.open(&third).await.as_ref()), ["7_01", "7_04"]);
    assert_eq!(names(fixture.open(&first).await.as_ref()), ["7_01", "7_02", "7_03"], "versions never change");
    let mut none = added(&fixture, &third, &[]).await;
    none.without = vec!["7_01".to_owned(), "7_04".to_owned()];
    let message = fixture.fail_to_build(&none).await;
    assert!(message.contains("no clip"), "{message}");
    fixture.stop().await;
}

#[tokio::test]
async fn recordings_are_mirrored_and_warped_and_what_is_made_of_a_trial_goes_with_it() {
    let fixture = Fixture::new().await;
    let id = fixture.new_database("walks").await;
    let files = fixture.walks(id, &[1, 2], 240).await;
    let augment = Augment { mirror: true, speeds: vec![0.8, 1.25] };
    let first = fixture.build(&PlanMotionDatabase { augment: augment.clone(), ..plan(id, files) }).await;
    let database = fixture.open(&first).await;
    assert_eq!(database.clips().len(), 2 * augment.copies());
    assert!(names(&database).contains(&"7_01~mirror~x0.8"), "{:?}", names(&database));
    assert!(database.num_poses() > 5 * 240 && database.num_poses() < 7 * 240, "{}", database.num_poses());
    let found = contents(&fixture, id).await;
    assert_eq!(found["augment"], json!({"mirror": true, "warps": [0.8, 1.25]}));
    assert_eq!(found["subjects"][0]["name"], "7");
    assert_eq!(found["subjects"][0]["num_clips"], 12);
    assert_eq!(found["actions"][0]["num_poses"], database.num_poses());

    let mut plan = added(&fixture, &first, &[]).await;
    plan.without = vec!["7_01".to_owned()];
    let second = fixture.open(&fixture.build(&plan).await).await;
    assert!(second.clips().iter().all(|clip| trial_name(&clip.name) == "7_02"), "{:?}", names(&second));
    fixture.stop().await;
}

#[tokio::test]
async fn a_divided_database_put_together_is_the_undivided_one() {
    let fixture = Fixture::new().await;
    let id = fixture.build_walks(&[1, 2, 3, 4, 5]).await;
    let whole = fixture.open(&fixture.file(id).await).await;
    let divided = fixture.new_database("walks").await;
    let files = fixture.walks(divided, &[1, 2, 3, 4, 5], 240).await;
    let divided = fixture.build(&PlanMotionDatabase { shards: 3, ..plan(divided, files) }).await;
    let shards: i32 = sqlx::query_scalar("SELECT num_shards FROM motion_databases WHERE id = $1")
        .bind(divided.id)
        .fetch_one(&fixture.pool)
        .await
        .unwrap();
    assert_eq!(shards, 3);
    assert_eq!(fixture.open(&divided).await.to_bytes(), whole.to_bytes());
    // And it can be added to.
    let mut more = added(&fixture, &divided, &[6]).await;
    more.shards = 2;
    let more = fixture.open(&fixture.build(&more).await).await;
    assert_eq!(more.clips().len(), 6);
    fixture.stop().await;
}

#[tokio::test]
async fn a_build_that_needs_more_memory_than_there_is_says_so() {
    let mut fixture = Fixture::without_service().await;
    fixture.serve(|config| config.service.memory.max_build_bytes = 60_000).await;
    let id = fixture.new_database("walks").await;
    let trials: Vec<usize> = (1..=10).collect();
    let message = fixture.fail_to_build(&plan(id, fixture.walks(id, &trials, 60).await)).await;
    assert!(message.contains("shards") && message.contains("60000"), "{message}");
    fixture.stop().await;
}

#[tokio::test]
async fn a_model_is_trained_and_recorded_with_its_database() {
    let fixture = Fixture::new().await;
    let id = fixture.build_walks(&[1, 2]).await;
    let file = fixture.file(id).await;
    let parameters = TrainingOptions { latent_dims: 2, active: 32, max_iterations: 5 };
    let train = TrainGplvm { motion_database: file.clone(), parameters };
    for _ in 0..2 {
        let run = fixture.run(&train).await;
        assert_eq!(run.state, RunState::Succeeded, "{:?}", run.error_message);
    }
    let models: Vec<(String, String, String)> = sqlx::query_as(
        "SELECT method, store_key, blake3 FROM motion_database_models WHERE motion_database_id = $1",
    )
    .bind(id)
    .fetch_all(&fixture.pool)
    .await
    .unwrap();
    assert_eq!(models.len(), 1, "trained again, it replaces the first");
    let (method, store_key, blake3) = &models[0];
    assert_eq!(method, "gplvm");
    let bytes = fixture.store.get_checked(&store_key.parse().unwrap(), blake3, 1 << 24).await.unwrap();
    regression::gplvm::Gplvm::from_bytes(&bytes).unwrap();

    let bad = TrainGplvm { parameters: TrainingOptions { latent_dims: 99, ..parameters }, ..train };
    let run = fixture.run(&bad).await;
    assert_eq!(run.state, RunState::Failed);
    assert!(run.error_message.unwrap().contains("latent_dims"));
    fixture.stop().await;
}

#[tokio::test]
async fn what_a_lost_attempt_wrote_for_a_version_is_removed_by_the_next() {
    let mut fixture = Fixture::new().await;
    let id = fixture.build_walks(&[1, 2]).await;
    let motion_database = fixture.file(id).await;
    fixture.stop_service(0).await;
    let parameters = TrainingOptions { latent_dims: 2, active: 32, max_iterations: 5 };
    let run = fixture.enqueue("training", None, &TrainGplvm { motion_database, parameters }).await;
    let mut connection = fixture.pool.acquire().await.unwrap();
    let claimed = queue::claim(&mut connection, "lost", &[TrainGplvm::KIND], 1).await.unwrap();
    let ClaimedJob { id: job_id, lease_number, .. } = claimed[0];
    let left = key::motion_database(id, job_id.0, lease_number.0, "gplvm.model").unwrap();
    fixture.put(&left, "half a model").await;
    let lease = Lease { job_id, run_id: run, lease_number };
    queue::hand_back(&mut connection, &lease).await.unwrap();
    drop(connection);
    fixture.serve(|_| {}).await;
    let end = fixture.finished(run).await;
    assert_eq!(end.state, RunState::Succeeded, "{:?}", end.error_message);
    let gone = fixture.store.size(&left).await;
    assert!(matches!(gone, Err(store::Error::NotFound { .. })), "{gone:?}");
    fixture.stop().await;
}

#[tokio::test]
async fn uploads_that_are_no_motion_fail_the_build_and_say_why() {
    let fixture = Fixture::new().await;
    let tar = |files: &[(&str, &[u8])]| {
        let mut builder = tar::Builder::new(Vec::new());
        for (name, content) in files {
            let mut header = tar::Header::new_gnu();
            header.set_size(content.len() as u64);
            builder.append_data(&mut header, name, *content).unwrap();
        }
        builder.into_inner().unwrap()
    };
    let amc = walker::amc(1, 20);
    let other = amc.replace("lfemur", "tail");
    let cases = [
        ("notes.zip", tar(&[("readme.txt", b"nothing")]), "found one file, which is no motion"),
        ("orphan.tar", tar(&[("7_01.amc", amc.as_bytes())]), "no ASF file"),
        ("odd.tar", tar(&[("7.asf", walker::ASF.as_bytes()), ("7_01.amc", other.as_bytes())]), "7_01.amc"),
        (
            "short.tar",
            tar(&[("7.asf", walker::ASF.as_bytes()), ("7_01.amc", walker::amc(1, 9).as_bytes())]),
            "8 frames",
        ),
        ("index.tar", tar(&[("index.csv", b"a,b\n1,2\n"), ("7_01.amc", amc.as_bytes())]), "index.csv"),
        ("empty.zip", Vec::new(), "found a file that is no archive with files in it"),
        ("damaged.tar.zst", b"\x28\xb5\x2f\xfd\x00rest".to_vec(), "damaged.tar.zst"),
    ];
    for (name, content, expected) in cases {
        let id = fixture.new_database("bad").await;
        let files = vec![fixture.upload(id, name, content).await];
        let message = fixture.fail_to_build(&plan(id, files)).await;
        assert!(message.contains(expected), "{name}: {message}");
    }
    fixture.stop().await;
}
