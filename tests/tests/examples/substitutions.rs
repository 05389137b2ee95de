//! What the tests put in for what a reader has to fill in, what pages take for granted, and examples that can't run here.

/// Text of examples that is replaced before they are run.
#[derive(Debug)]
pub struct Substitution {
    /// the pages it is for: the beginning of their names
    pub page: &'static str,
    pub from: &'static str,
    pub to: &'static str,
}

const fn on(page: &'static str, from: &'static str, to: &'static str) -> Substitution {
    Substitution { page, from, to }
}

/// Made in this order.
pub const SUBSTITUTIONS: &[Substitution] = &[
    // the server under test is at another address
    on("docs/api.md", "MAREY_URL=http://127.0.0.1:8080 MAREY_API_KEY=mk_…", "MAREY_URL MAREY_API_KEY"),
    on("docs/live.md", "\"mk_…\"", "__import__('os').environ['MAREY_API_KEY']"),
    on(
        "docs/live.md",
        "\"ws://127.0.0.1:8080/v1/live?motion_database=walks\"",
        "__import__('os').environ['MAREY_URL'].replace('http', 'ws') + '/v1/live?motion_database=walks'",
    ),
    on("marey health", "http://127.0.0.1:8080", "$MAREY_URL"),
    // what only the reader has
    on("docs/api.md", "$filmed", "$(cat filmed)"),
    on("docs/foot-contacts.md", " DIR", " recordings"),
    on("docs/skeleton.md", " DIR", " recordings"),
    on(
        "docs/motion-database.md",
        "--train cmu/ --query cmu/07 cmu/35 cmu/49 cmu/91",
        "--train recordings --query more",
    ),
    on("docs/speed.md", "--train five-actions/ --query five-actions/", "--train recordings/ --query more/"),
    on("docs/speed.md", "--train cmu/ --query held-out/", "--train recordings/ --query more/"),
    on("docs/live.md", "capture-program |", "head -30 points.csv |"),
    // less of it
    on("README.md", "--count 40", "--count 12 --frames 120"),
    on("docs/skeleton.md", "--points 2,4,6", "--points 4"),
    on(
        "docs/live.md",
        "--streams 8 --fps 60 --seconds 60",
        "--database walks --test more/ --streams 2 --fps 60 --seconds 2",
    ),
    on(
        "marey bench live",
        "--streams 8 --seconds 20",
        "--database walks --test more/ --streams 2 --seconds 1",
    ),
    on("marey evaluate ik", "--frames 20", "--frames 5"),
    on("marey evaluate recovery", "--starts 5", "--starts 2"),
    on("marey evaluate sparse", "--test recordings/", "--test more/"),
    on("marey run", "--cameras cam01,cam02,cam03", "--cameras cam01,cam02,cam03 --set num_frames=3"),
    on("marey run", "--set particles=50", "--set particles=50 --set num_frames=3"),
    on("marey bench live", "--seconds 10", "--seconds 1"),
    on("marey sample --", "--count 40", "--count 4"),
    on("marey sample --", "--count 20", "--count 4"),
    on("marey sample-capture", "--frames 24", "--frames 6"),
];

const WALKS: &str = "marey db build walks recordings/ --watch\n";
const TAKE_3: &str = "marey upload 'take 3' points.csv skeleton.asf\n";
const TAKE_4: &str = "marey upload 'take 4' calib.toml cam*.mp4 plates/\n";
const MARKERS: &str =
    "marey upload markers take3.c3d skeleton.asf; marey markers take3.c3d --write take3.toml\n";
const RUN: &str = "marey run 'take 3' --database walks --watch\n";
const SHIPPED: &str = "curl -sSf -H \"Authorization: Bearer $MAREY_API_KEY\" -o athletes.marey-body \
                       $MAREY_URL/v1/body-models/shipped/model\n";

/// What is there before a page begins, by the beginnings of the pages' names.
pub const SETUPS: &[(&str, &str)] = &[
    ("docs/api.md", "cd recordings; python3 -m zipfile -c ../walks.zip *.asf *.amc"),
    (
        "docs/api.md",
        "marey upload filmed calib.toml cam*.mp4 plates/ | sed -n 's/^to a new session .* id //p' >filmed",
    ),
    ("docs/databases.md", TAKE_3),
    ("docs/evaluation.md", WALKS),
    ("docs/evaluation.md", TAKE_3),
    ("docs/evaluation.md", RUN),
    ("docs/live.md", WALKS),
    ("docs/markers.md", WALKS),
    ("docs/markers.md", "marey upload 'take 3' take3.c3d skeleton.asf"),
    ("marey body", SHIPPED),
    ("marey bench live", WALKS),
    ("marey cancel", "marey upload 'take 3' calib.toml cam*.mp4 plates/; marey run 'take 3'"),
    ("marey db add", WALKS),
    ("marey db delete", WALKS),
    ("marey db show", WALKS),
    ("marey db train", WALKS),
    ("marey db train", TAKE_3),
    ("marey evaluate recovery", "rm -r recordings; marey sample --out recordings --count 40"),
    ("marey evaluate run", WALKS),
    ("marey evaluate run", TAKE_3),
    ("marey evaluate run", RUN),
    ("marey evaluate run", "marey upload 'synthetic walk' capture/calibration.json capture/silhouettes/"),
    ("marey evaluate run", "marey run 'synthetic walk' --set frame_rate=30 --watch"),
    ("marey live", WALKS),
    ("marey results", WALKS),
    ("marey results", TAKE_3),
    ("marey results", RUN),
    ("marey run", WALKS),
    ("marey run", TAKE_3),
    ("marey run", TAKE_4),
    ("marey run", MARKERS),
    ("marey sample --", "rm -r recordings take"),
    ("marey sample-capture", "rm -r capture"),
    ("marey status", WALKS),
    ("marey status", TAKE_3),
    ("marey status", RUN),
];

/// Examples of `--help` that are not run, and why.
pub const NOT_RUN: &[(&str, &str)] = &[
    ("marey demo", "takes minutes; `make demo` runs it"),
    ("marey demo --data recordings/ --out my-demo/", "takes minutes"),
    ("marey data cmu --subjects 16,35 recordings/", "needs the internet"),
    ("marey data cmu --subjects 16 --trials 15,16,21 recordings/", "needs the internet"),
    ("marey evaluate shape --scans scans/ --leave-one-out 20 --json errors.json", "needs scans"),
    ("marey body learn athletes scans/ --watch", "needs scans"),
    ("marey body learn athletes scans/ --out athletes.marey-body", "needs scans"),
    ("marey body delete athletes@1", "needs a model that was learned from scans"),
    ("marey health grpc://127.0.0.1:50051", "`marey up` opens no port for gRPC"),
];
