//! One stream: a task that takes frames, a thread that computes, a stream of answers.

use super::{
    end::StreamEnd,
    queue::{Gone, Queue},
    start::Start,
};
use crate::{config::LiveConfig, error::CallError};
use model::Samples;
use nalgebra::Vector3;
use proto::v1::{self, live_request, live_response};
use sparse::{Live, LivePose, Reconstructor};
use std::{
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
    time::Duration,
};
use tokio::sync::{OwnedSemaphorePermit, oneshot};
use tokio_stream::Stream;
use tokio_util::sync::{CancellationToken, DropGuard};
use tonic::{Status, Streaming};

/// Frames that wait to be computed, where none may be dropped.
const WAITING_EVERY: usize = 64;
/// Frames that wait where the latest counts: 4 are 67 ms.
const WAITING_LATEST: usize = 4;
/// Poses that wait to be read.
const UNREAD: usize = 16;

type Answer = Result<v1::LiveResponse, Status>;

/// A frame that makes sense.
struct Frame {
    number: u64,
    time: f64,
    positions: Vec<Vector3<f64>>,
    sigmas: Vec<f64>,
}

/// What both sides of a stream share.
struct Channel {
    frames: Queue<Frame>,
    answers: Queue<Answer>,
    /// frames that have no pose
    dropped: AtomicU64,
    is_every: bool,
    /// how long nobody may do anything
    patience: Duration,
}

impl Channel {
    async fn put_frame(&self, frame: Frame) -> Result<(), Gone> {
        if self.is_every {
            return self.frames.put_waiting(frame).await;
        }
        if self.frames.put_dropping(frame)?.is_some() {
            self.dropped.fetch_add(1, Ordering::Relaxed);
        }
        Ok(())
    }

    fn put_answer(&self, message: live_response::Message) -> Result<(), Gone> {
        let answer = Ok(v1::LiveResponse { message: Some(message) });
        if self.is_every {
            return self.answers.put_blocking(answer, self.patience);
        }
        let dropped = self.answers.put_dropping(answer)?;
        if let Some(Ok(v1::LiveResponse { message: Some(live_response::Message::Pose(_)) })) = dropped {
            self.dropped.fetch_add(1, Ordering::Relaxed);
        }
        Ok(())
    }
}

/// Starts the thread and the task; gives back the answers once the thread has begun.
///
/// # Errors
/// If the state to go on from does not fit.
pub(super) async fn open(
    start: Start,
    requests: Streaming<v1::LiveRequest>,
    slot: OwnedSemaphorePermit,
    config: &LiveConfig,
    shutdown: CancellationToken,
) -> Result<impl Stream<Item = Answer> + Send + 'static, CallError> {
    let channel = Arc::new(Channel {
        frames: Queue::new(if start.is_every { WAITING_EVERY } else { WAITING_LATEST }),
        answers: Queue::new(UNREAD),
        dropped: AtomicU64::new(0),
        is_every: start.is_every,
        patience: config.idle_timeout,
    });
    let points = start.session.points.len();
    let (ended, why) = oneshot::channel();
    let (begun, has_begun) = oneshot::channel();
    let work = channel.clone();
    let thread = std::thread::Builder::new().name("live".to_owned());
    thread
        .spawn(move || {
            let closed = Closed(&work);
            let last = compute(&start, &work, begun, why);
            // Who has heard the last word finds the slot free.
            drop(slot);
            work.answers.finish(last);
            drop(closed);
        })
        .map_err(CallError::NoThread)?;
    // A thread that is gone without a word has panicked.
    has_begun.await.map_err(|_| CallError::Panicked)??;
    let gone = CancellationToken::new();
    let reader = Reader { channel: channel.clone(), points, last: None };
    tokio::spawn(reader.run(requests, ended, shutdown, gone.clone()));
    let guard = Unread { channel, _gone: gone.drop_guard() };
    Ok(answers_of(guard))
}

/// Answers, one after the other; `dropped` is that of the moment in which a pose is read.
fn answers_of(unread: Unread) -> impl Stream<Item = Answer> + Send + 'static {
    async_stream::stream! {
        let channel = unread.channel.clone();
        while let Some(mut answer) = channel.answers.take().await {
            if let Ok(v1::LiveResponse { message: Some(live_response::Message::Pose(pose)) }) = &mut answer {
                pose.dropped = channel.dropped.load(Ordering::Relaxed);
            }
            yield answer;
        }
    }
}

/// Held by the stream of answers: when it is dropped the client is gone, and everything ends.
struct Unread {
    channel: Arc<Channel>,
    _gone: DropGuard,
}

impl Drop for Unread {
    fn drop(&mut self) {
        self.channel.answers.close();
        self.channel.frames.close();
    }
}

/// Held by the thread: however it ends, nobody waits for it.
struct Closed<'a>(&'a Channel);

impl Drop for Closed<'_> {
    fn drop(&mut self) {
        self.0.frames.close();
        let panicked = std::thread::panicking().then(|| Err(CallError::Panicked.into()));
        self.0.answers.finish(panicked);
    }
}

/// The task that takes frames.
struct Reader {
    channel: Arc<Channel>,
    points: usize,
    /// number of the last frame
    last: Option<u64>,
}

impl Reader {
    async fn run(
        mut self,
        mut requests: Streaming<v1::LiveRequest>,
        ended: oneshot::Sender<Status>,
        shutdown: CancellationToken,
        gone: CancellationToken,
    ) {
        let end = tokio::select! {
            end = self.read(&mut requests) => end,
            () = shutdown.cancelled() => StreamEnd::ShuttingDown.into(),
            () = gone.cancelled() => StreamEnd::ClientGone.into(),
        };
        // The thread may have ended by itself.
        let _ = ended.send(end);
        self.channel.frames.close();
    }

    /// Takes frames until there are no more; says why.
    async fn read(&mut self, requests: &mut Streaming<v1::LiveRequest>) -> Status {
        loop {
            let Ok(request) = tokio::time::timeout(self.channel.patience, requests.message()).await else {
                return StreamEnd::NoFrame(self.channel.patience).into();
            };
            let message = match request {
                Ok(Some(request)) => request.message,
                Ok(None) => return Status::ok(""),
                Err(status) => return status,
            };
            let frame = match message {
                Some(live_request::Message::Frame(frame)) => self.frame(frame),
                Some(live_request::Message::Start(_)) => Err("a second start, expected frames".to_owned()),
                None => Err("not a frame message, expected frames".to_owned()),
            };
            let frame = match frame {
                Ok(frame) => frame,
                Err(what) => return StreamEnd::BadFrame(what).into(),
            };
            if self.channel.put_frame(frame).await.is_err() {
                return StreamEnd::ClientGone.into();
            }
        }
    }

    fn frame(&mut self, frame: v1::LiveFrame) -> Result<Frame, String> {
        let v1::LiveFrame { frame: number, time, positions_m, sigmas_m } = frame;
        if let Some(last) = self.last.filter(|last| number <= *last) {
            return Err(format!("frame {number} came after frame {last}, expected rising numbers"));
        }
        if positions_m.len() != 3 * self.points {
            let (found, expected) = (positions_m.len(), 3 * self.points);
            return Err(format!(
                "frame {number} has {found} coordinates, expected {expected}, three a point"
            ));
        }
        if !sigmas_m.is_empty() && sigmas_m.len() != self.points {
            let (found, expected) = (sigmas_m.len(), self.points);
            return Err(format!(
                "frame {number} has {found} standard deviations, expected {expected} or none"
            ));
        }
        if let Some(bad) = positions_m.iter().position(|v| v.is_infinite()) {
            let (point, found) = (bad / 3, positions_m[bad]);
            return Err(format!(
                "frame {number}: a coordinate of point {point} is {found}, expected a finite one or NaN"
            ));
        }
        if let Some(bad) = sigmas_m.iter().position(|s| *s <= 0.0 || s.is_infinite()) {
            let found = sigmas_m[bad];
            return Err(format!(
                "frame {number}: the standard deviation of point {bad} is {found}, expected a positive one or NaN"
            ));
        }
        self.last = Some(number);
        let positions = positions_m.as_chunks::<3>().0.iter().map(|p| Vector3::from(*p)).collect();
        Ok(Frame { number, time, positions, sigmas: sigmas_m })
    }
}

/// The thread: all that is computed. What is to be said last.
fn compute(
    start: &Start,
    channel: &Channel,
    begun: oneshot::Sender<Result<(), sparse::Error>>,
    why: oneshot::Receiver<Status>,
) -> Vec<Answer> {
    let Start { prior, session, parameters, table, .. } = start;
    let made = Reconstructor::with_table(&prior.database, &prior.index, session, parameters, table.clone());
    let reconstructor = match made {
        Ok(reconstructor) => reconstructor,
        Err(error) => return refused(begun, error),
    };
    let mut live = match Live::new(&reconstructor) {
        Ok(live) => live,
        Err(error) => return refused(begun, error),
    };
    let is_resumed = !start.state.is_empty();
    if is_resumed && let Err(error) = live.resume(&start.state) {
        return refused(begun, error);
    }
    // Whoever waits for this may be gone; the queues are closed then.
    let _ = begun.send(Ok(()));
    if channel.put_answer(live_response::Message::Started(started(start, is_resumed))).is_err() {
        return Vec::new();
    }
    let mut last = 0;
    let mut since_state = 0;
    while let Some(frame) = channel.frames.take_blocking() {
        last = frame.number;
        let found = live.push(Samples { positions: &frame.positions, sigmas: &frame.sigmas });
        let answer = live_response::Message::Pose(pose(&frame, found, start.joint_positions));
        since_state += 1;
        let mut put = channel.put_answer(answer);
        if since_state == start.state_every {
            since_state = 0;
            put = put.and_then(|()| channel.put_answer(state(&live, last)));
        }
        if put.is_err() {
            return Vec::new();
        }
    }
    let end = why.blocking_recv().unwrap_or_else(|_| StreamEnd::ClientGone.into());
    let mut answers = vec![Ok(v1::LiveResponse { message: Some(state(&live, last)) })];
    if end.code() != tonic::Code::Ok {
        answers.push(Err(end));
    }
    answers
}

fn refused(begun: oneshot::Sender<Result<(), sparse::Error>>, error: sparse::Error) -> Vec<Answer> {
    // Whoever waits for this may be gone.
    let _ = begun.send(Err(error));
    Vec::new()
}

fn started(start: &Start, is_resumed: bool) -> v1::LiveStarted {
    let skeleton = &start.session.skeleton;
    let parent = |parent: Option<usize>| parent.and_then(|p| i32::try_from(p).ok()).unwrap_or(-1);
    v1::LiveStarted {
        dof_names: skeleton.dof_names(),
        joint_names: skeleton.joints().iter().map(|j| j.name.clone()).collect(),
        joint_parents: skeleton.joints().iter().map(|j| parent(j.parent)).collect(),
        is_resumed,
        // Numbers and words always are JSON.
        parameters_json: serde_json::to_string(&start.parameters).unwrap_or_default(),
    }
}

fn state(live: &Live<'_>, frame: u64) -> live_response::Message {
    live_response::Message::State(v1::LiveState { frame, state: live.state() })
}

fn pose(frame: &Frame, found: Option<LivePose<'_>>, joint_positions: bool) -> v1::LivePose {
    let nothing =
        v1::LivePose { frame: frame.number, time: frame.time, is_starting: true, ..Default::default() };
    let Some(found) = found else { return nothing };
    let joints = if joint_positions { found.joint_positions } else { &[] };
    v1::LivePose {
        pose: found.pose.to_vec(),
        joint_positions_m: joints.iter().flat_map(|p| [p.x, p.y, p.z]).collect(),
        residual_m: found.quality.residual_m,
        sigma_rad: found.quality.sigma_rad,
        energy: found.quality.energy,
        measured_points: found.quality.measured_points as u32,
        is_starting: found.is_starting,
        ..nothing
    }
}
