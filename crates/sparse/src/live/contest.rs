use model::Samples;
use motion_db::{StartPose, StartScan};

use super::recent::Recent;
use crate::Parameters;
use crate::frame_solver::FrameSolver;
use crate::problem::Problem;
use crate::track::{Observed, Step, Track};

/// Tracks that run beside the leader at once: with it, four steps a frame.
pub(super) const CHALLENGERS: usize = 3;
/// Samples (poses × frames × points) that the search looks at in one frame: about a millisecond.
const SEARCH_WORK: usize = 400_000;
/// Frames of a heat that do not count: challengers find into their motion.
const WARM_FRAMES: usize = 2;
/// Heats of a contest over `start_frames` frames of evidence.
const HEATS_PER_START: usize = 3;

/// Somebody who may be where the performer is.
#[derive(Debug, Clone)]
pub(super) struct Challenger {
    pub track: Track,
    /// minus the log of the probability it gave to what was measured in this heat
    pub surprise: f64,
}

/// What is being done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Phase {
    /// nothing: the leader goes alone
    Over,
    /// the database is searched for challengers
    Search,
    /// challengers run beside the leader for this many more frames
    Heat { left: usize },
}

/// Finds out where the performer is while frames keep coming.
///
/// The database is searched in slices for poses that fit the last frames; the best three then run beside the leader
/// for a heat, and who made the measurements most probable leads on (evidence as in
/// [`crate::Reconstructor::reconstruct`], docs/papers.md#start-poses). Heats go on until as many frames as a start
/// looks at were seen and the `start_candidates` best poses for these have run. The first search has one frame to go
/// by; its best pose leads until there is a better one.
#[derive(Debug, Clone)]
pub(super) struct Contest {
    scan: StartScan,
    found: Vec<StartPose>,
    pub challengers: Vec<Challenger>,
    pub active: usize,
    pub leader_surprise: f64,
    pub phase: Phase,
    /// how many poses of a search over all frames have run
    pub tried: usize,
    /// number of the frame after which the search began
    begun_at: usize,
    pub heat_frames: usize,
    candidates: usize,
}

impl Contest {
    pub fn new(points: usize, dofs: usize, parameters: &Parameters) -> Self {
        let challenger = Challenger { track: Track::blank(dofs, parameters), surprise: 0.0 };
        let Parameters { window, start_frames, start_skeleton_weight, start_candidates, .. } = *parameters;
        Self {
            // one more, for tracks that are placed a frame before
            scan: StartScan::new(points, start_frames, window + 1, start_skeleton_weight),
            found: Vec::with_capacity(2 * CHALLENGERS + start_candidates + 64),
            challengers: vec![challenger; CHALLENGERS],
            active: 0,
            leader_surprise: 0.0,
            phase: Phase::Over,
            tried: 0,
            begun_at: 0,
            heat_frames: (start_frames / HEATS_PER_START).max(1) + WARM_FRAMES,
            candidates: start_candidates,
        }
    }

    pub fn is_over(&self) -> bool {
        self.phase == Phase::Over
    }

    pub fn end(&mut self) {
        self.phase = Phase::Over;
        self.active = 0;
    }

    /// Begins with all candidates still to be tried.
    pub fn begin(&mut self, recent: &Recent) {
        self.tried = 0;
        self.begin_search(recent);
    }

    pub fn begin_search(&mut self, recent: &Recent) {
        self.active = 0;
        self.phase = Phase::Search;
        self.begun_at = recent.count();
        self.scan.begin();
        recent.observe(&mut self.scan);
    }

    /// Searches on; at its end, the number of poses found, which then are in `found`.
    pub fn search(&mut self, problem: &Problem<'_>, recent: &Recent) -> Option<usize> {
        if self.phase != Phase::Search {
            return None;
        }
        let Problem { database, table, exclude_poses, .. } = problem;
        if !self.scan.advance(database, table, exclude_poses, SEARCH_WORK) {
            return None;
        }
        let span = self.scan.span();
        self.scan.forget();
        recent.observe(&mut self.scan);
        // The oldest frame observed is later now by the frames that came and are not observed in addition.
        let later = (recent.count() - self.begun_at + span).saturating_sub(self.scan.span());
        self.scan.finish(database, table, exclude_poses, later, &mut self.found);
        Some(self.found.len())
    }

    /// Puts the first of the poses found into `leader`, and the next ones into a heat with it. `false` if none was found.
    pub fn take_first(&mut self, solver: &FrameSolver<'_>, leader: &mut Track, found: usize) -> bool {
        if found == 0 {
            self.end();
            return false;
        }
        // Found for this frame; it is the next step that comes to it.
        solver.place(&before(&self.found[0]), leader);
        self.begin_heat(solver, 1, true);
        true
    }

    /// `is_now`: the poses found are those of a frame that the tracks have not come to yet.
    fn begin_heat(&mut self, solver: &FrameSolver<'_>, first: usize, is_now: bool) {
        let challengers = self.challengers.iter_mut().zip(self.found.iter().skip(first));
        self.active = 0;
        for (challenger, start) in challengers {
            let start = if is_now { before(start) } else { *start };
            solver.place(&start, &mut challenger.track);
            challenger.surprise = 0.0;
            self.active += 1;
        }
        self.leader_surprise = 0.0;
        self.phase = Phase::Heat { left: self.heat_frames };
    }

    /// All challengers one frame further.
    pub fn step(&mut self, solver: &mut FrameSolver<'_>, samples: Samples<'_>) {
        let Phase::Heat { left } = self.phase else { return };
        let counts = left + WARM_FRAMES <= self.heat_frames;
        for challenger in &mut self.challengers[..self.active] {
            let surprise = solver
                .step(&mut challenger.track, Observed { now: samples, session: None })
                .solution
                .surprise();
            if counts {
                challenger.surprise += surprise;
            }
        }
    }

    /// After a frame in which the leader made `step`: continues the search or the heat. Whether another track leads
    /// now.
    pub fn advance(
        &mut self,
        problem: &Problem<'_>,
        recent: &Recent,
        solver: &FrameSolver<'_>,
        leader: &mut Track,
        step: &Step,
    ) -> bool {
        match self.phase {
            Phase::Over => {}
            Phase::Search => {
                if self.search(problem, recent).is_some() {
                    let first = self.tried;
                    if recent.is_full() {
                        self.tried += CHALLENGERS;
                    }
                    self.begin_heat(solver, first, false);
                }
            }
            Phase::Heat { left } => {
                if left + WARM_FRAMES <= self.heat_frames {
                    self.leader_surprise += step.solution.surprise();
                }
                self.phase = Phase::Heat { left: left - 1 };
                if left <= 1 {
                    let is_other = self.end_heat(leader);
                    if self.tried < self.candidates {
                        self.begin_search(recent);
                    } else {
                        self.end();
                    }
                    return is_other;
                }
            }
        }
        false
    }

    /// The best track leads from now on; whether it is another one.
    fn end_heat(&mut self, leader: &mut Track) -> bool {
        let challengers = self.challengers[..self.active].iter();
        let best = challengers.min_by(|a, b| a.surprise.total_cmp(&b.surprise));
        let Some(best) = best.filter(|best| best.surprise < self.leader_surprise) else { return false };
        leader.copy_from(&best.track);
        true
    }
}

/// The start from which one step leads to where `start` already is.
fn before(start: &StartPose) -> StartPose {
    StartPose { pose: start.pose - 1, ..*start }
}
