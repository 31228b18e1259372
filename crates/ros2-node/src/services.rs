//! The services, each with its full type, and also as std_srvs/Trigger for clients without `sdg_interfaces`.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Result, bail};
use sdg_ros2::RosError;
use sdg_ros2::cdr::Cdr;
use sdg_ros2::dds::{Node, RequestId, Server, ServiceType};
use sdg_ros2::found::{to_detections, to_pose};
use sdg_ros2::messages::{
    DetectRequest, DetectResponse, GraspRequest, GraspResponse, TeachRequest, TeachResponse, TriggerRequest,
    TriggerResponse,
};

use crate::camera_pose::CameraPoseReader;
use crate::grasping::Grasping;
use crate::lines::Lines;
use crate::pictures::PictureReader;
use crate::requests::given;
use crate::searching::Searched;
use crate::teaching::{Teach, TeachJob, Teaching};

/// Default timeout for a picture.
const DETECT_TIMEOUT: Duration = Duration::from_secs(5);
/// Maximum timeout for a picture.
const MAX_DETECT_TIMEOUT_SECS: f64 = 60.0;

/// Maximum number of requests taken at once, so that neither a flood of them nor a repeated error stops the node.
const MAX_REQUESTS: usize = 64;
/// Interval of checks for the end of a grasp.
const FINISH_POLL: Duration = Duration::from_millis(5);

const TRIGGER: ServiceType = ServiceType { package: "std_srvs", name: "Trigger" };

/// A service and its Trigger variant.
struct Pair<Q: Cdr + 'static, A: Cdr + 'static> {
    full: Server<Q, A>,
    trigger: Server<TriggerRequest, TriggerResponse>,
}

/// The client of a request.
#[derive(Clone, Copy)]
enum Client {
    Full(RequestId),
    Trigger(RequestId),
}

impl<Q: Cdr + Clone + Default + 'static, A: Cdr + 'static> Pair<Q, A> {
    fn open(node: &mut Node, name: &'static str, type_name: &'static str) -> Result<Self, RosError> {
        let of = ServiceType { package: "sdg_interfaces", name: type_name };
        Ok(Self {
            full: node.serve(&format!("~/{name}"), of)?,
            trigger: node.serve(&format!("~/{name}_trigger"), TRIGGER)?,
        })
    }

    /// The waiting requests, at most [`MAX_REQUESTS`] of each kind; a Trigger is a request with default values.
    fn requests(&self, lines: &Lines) -> Vec<(Client, Result<Q, RosError>)> {
        let mut requests = Vec::new();
        for _ in 0..MAX_REQUESTS {
            match self.full.receive(Duration::ZERO) {
                Ok(Some((id, request))) => requests.push((Client::Full(id), request)),
                Ok(None) => break,
                Err(error) => lines.complain(&error.to_string()),
            }
        }
        for _ in 0..MAX_REQUESTS {
            match self.trigger.receive(Duration::ZERO) {
                Ok(Some((id, request))) => requests.push((Client::Trigger(id), request.map(|_| Q::default()))),
                Ok(None) => break,
                Err(error) => lines.complain(&error.to_string()),
            }
        }
        requests
    }

    fn answer(&self, asker: Client, full: A, success: bool, message: String, lines: &Lines) {
        let sent = match asker {
            Client::Full(id) => self.full.answer(id, full),
            Client::Trigger(id) => self.trigger.answer(id, TriggerResponse { success, message }),
        };
        if let Err(error) = sent {
            lines.complain(&error.to_string());
        }
    }
}

/// A detection request that waits for a picture.
struct Detecting {
    asker: Client,
    request: DetectRequest,
    wait: Wait,
}

/// The time in which a picture must arrive; its search may end later.
struct Wait {
    asked: Instant,
    deadline: Instant,
}

impl Wait {
    /// Whether the time is over and no picture has arrived since the request. A picture in the queue may be skipped, but
    /// only for a newer one.
    fn is_over(&self, now: Instant, newest_arrival: Option<Instant>) -> bool {
        self.deadline < now && newest_arrival.is_none_or(|arrived| arrived < self.asked)
    }
}

/// A taught model that the node is to use. Its client has no answer yet.
pub(super) struct Taught {
    pub(super) path: PathBuf,
    asker: Client,
    secs: f64,
}

/// All services.
pub(super) struct Services {
    detect: Pair<DetectRequest, DetectResponse>,
    detecting: Vec<Detecting>,
    teach: Pair<TeachRequest, TeachResponse>,
    teaching: Option<(Client, Teaching)>,
    teach_with: Arc<Teach>,
    trigger_teaching: Option<TeachJob>,
    /// Whether the node uses only models with lengths.
    needs_lengths: bool,
    grasp: Option<(Pair<GraspRequest, GraspResponse>, Grasping)>,
    grasping: Option<Client>,
    lines: Arc<Lines>,
}

impl Services {
    pub(super) fn open(
        node: &mut Node,
        teach_with: Arc<Teach>,
        trigger_teaching: Option<TeachJob>,
        needs_lengths: bool,
        grasping: Option<Grasping>,
        lines: &Arc<Lines>,
    ) -> Result<Self, RosError> {
        let grasp = match grasping {
            Some(grasping) => Some((Pair::open(node, "grasp", "Grasp")?, grasping)),
            None => None,
        };
        Ok(Self {
            detect: Pair::open(node, "detect", "Detect")?,
            detecting: Vec::new(),
            teach: Pair::open(node, "teach", "Teach")?,
            teaching: None,
            teach_with,
            trigger_teaching,
            needs_lengths,
            grasp,
            grasping: None,
            lines: Arc::clone(lines),
        })
    }

    /// Receives requests and sends finished responses. Returns a taught model that is to be used, whose client
    /// [`Self::answer_use`] answers.
    pub(super) fn work(
        &mut self,
        reader: &PictureReader,
        model: Option<&sdg_grasp::GraspModel>,
        camera_pose: &CameraPoseReader,
    ) -> Option<Taught> {
        self.take_detections();
        self.give_up_detections(&reader.topic, reader.shared.newest_arrival());
        self.take_grasps(model, camera_pose);
        self.take_teachings();
        self.finish_teaching()
    }

    fn take_detections(&mut self) {
        for (asker, request) in self.detect.requests(&self.lines) {
            let checked = request.map_err(anyhow::Error::from).and_then(|request| Ok((timeout_of(&request)?, request)));
            let (timeout, request) = match checked {
                Ok(checked) => checked,
                Err(error) => {
                    self.answer_detection(asker, Err(error.to_string()));
                    continue;
                }
            };
            let asked = Instant::now();
            self.detecting.push(Detecting { asker, request, wait: Wait { asked, deadline: asked + timeout } });
        }
    }

    fn give_up_detections(&mut self, topic: &str, newest_arrival: Option<Instant>) {
        let now = Instant::now();
        let is_late = |one: &Detecting| one.wait.is_over(now, newest_arrival);
        let (late, waiting) = std::mem::take(&mut self.detecting).into_iter().partition(is_late);
        self.detecting = waiting;
        for Detecting { asker, wait, .. } in late {
            let secs = wait.asked.elapsed().as_secs_f64();
            self.answer_detection(asker, Err(format!("no picture on {topic} within {secs:.1} s")));
        }
    }

    /// Answers the detection requests that were received before this picture arrived.
    pub(super) fn searched(&mut self, searched: Result<&Searched, String>, arrived: Instant) {
        let (waiting, ready) =
            std::mem::take(&mut self.detecting).into_iter().partition(|one| one.wait.asked > arrived);
        self.detecting = waiting;
        for Detecting { asker, request, .. } in ready {
            let answer = searched.clone().map(|searched| detect_response(&request, searched));
            self.answer_detection(asker, answer);
        }
    }

    fn answer_detection(&self, asker: Client, answer: Result<DetectResponse, String>) {
        let answer =
            answer.unwrap_or_else(|message| DetectResponse { success: false, message, ..DetectResponse::default() });
        // For a Trigger, success means that the part was found.
        let found = answer.success && !answer.detections.detections.is_empty();
        let message = answer.message.clone();
        self.detect.answer(asker, answer, found, message, &self.lines);
    }

    fn take_grasps(&mut self, model: Option<&sdg_grasp::GraspModel>, camera_pose: &CameraPoseReader) {
        let Some((pair, grasping)) = &mut self.grasp else { return };
        for (asker, request) in pair.requests(&self.lines) {
            let begun = match (request, model, self.grasping.is_some()) {
                (Err(error), ..) => Err(error.to_string()),
                (_, None, _) => {
                    Err("no grasp model yet: start the node with one, or call the service teach".to_owned())
                }
                (_, _, true) => Err("a grasp is already running".to_owned()),
                (Ok(request), Some(model), false) => {
                    grasping.begin(&request, model, camera_pose).map_err(|error| format!("{error:#}"))
                }
            };
            match begun {
                Ok(()) => self.grasping = Some(asker),
                Err(message) => {
                    let answer = GraspResponse { message: message.clone(), ..GraspResponse::default() };
                    pair.answer(asker, answer, false, message, &self.lines);
                }
            }
        }
        self.answer_grasp();
    }

    /// Answers the client of a finished grasp; returns the reason if the grasp failed.
    fn answer_grasp(&mut self) -> Option<String> {
        let (pair, grasping) = self.grasp.as_mut()?;
        let answer = grasping.finished()?;
        let (success, message) = (answer.success, answer.message.clone());
        if let Some(asker) = self.grasping.take() {
            pair.answer(asker, answer, success, message.clone(), &self.lines);
        }
        (!success).then_some(message)
    }

    /// Waits for a running grasp, which stops when the node is interrupted, because the arm may still move until then.
    pub(super) fn finish(&mut self) {
        while self.grasp.as_ref().is_some_and(|(_, grasping)| grasping.is_running()) {
            std::thread::sleep(FINISH_POLL);
        }
        if let Some(why) = self.answer_grasp() {
            self.lines.complain(&why);
        }
    }

    fn take_teachings(&mut self) {
        for (asker, request) in self.teach.requests(&self.lines) {
            let begun = match (asker, request, &self.trigger_teaching) {
                _ if self.teaching.is_some() => Err("a teaching is already running".to_owned()),
                (Client::Trigger(_), Ok(_), Some(job)) => {
                    Teaching::begin(job.clone(), &self.teach_with, self.needs_lengths)
                        .map_err(|error| format!("{error:#}"))
                }
                (Client::Trigger(_), Ok(_), None) => {
                    Err("expected a node that was started with a demonstration and a file to teach".to_owned())
                }
                (_, Ok(request), _) => Teaching::of_request(&request, &self.teach_with, self.needs_lengths)
                    .map_err(|error| format!("{error:#}")),
                (_, Err(error), _) => Err(error.to_string()),
            };
            match begun {
                Ok(teaching) => self.teaching = Some((asker, teaching)),
                Err(message) => self.answer_teaching(asker, Err(message)),
            }
        }
    }

    fn finish_teaching(&mut self) -> Option<Taught> {
        let (asker, mut teaching) = self.teaching.take()?;
        let Some(taught) = teaching.finished() else {
            self.teaching = Some((asker, teaching));
            return None;
        };
        match taught {
            Ok((path, secs)) if teaching.is_used => return Some(Taught { path, asker, secs }),
            Ok((path, secs)) => self.answer_teaching(asker, Ok((path.as_path(), secs))),
            Err(message) => self.answer_teaching(asker, Err(message)),
        }
        None
    }

    /// Answers the client of a taught model; `changed` is an error if the node cannot use it.
    pub(super) fn answer_use(&self, taught: &Taught, changed: Result<(), String>) {
        let Taught { path, asker, secs } = taught;
        let answer = changed.map(|()| (path.as_path(), *secs));
        let not_used = |why: String| format!("{} was taught, but the node does not use it: {why}", path.display());
        self.answer_teaching(*asker, answer.map_err(not_used));
    }

    fn answer_teaching(&self, asker: Client, taught: Result<(&Path, f64), String>) {
        let answer = match taught {
            Ok((path, seconds)) => TeachResponse {
                success: true,
                message: format!("taught in {seconds:.0} s"),
                model_path: path.display().to_string(),
                seconds,
            },
            Err(message) => TeachResponse { message, ..TeachResponse::default() },
        };
        let (success, message) = (answer.success, answer.message.clone());
        self.teach.answer(asker, answer, success, message, &self.lines);
    }
}

/// The time in which a picture must arrive.
///
/// # Errors
/// The request is invalid.
fn timeout_of(request: &DetectRequest) -> Result<Duration> {
    if let Some(min_score) = given("min_score", request.min_score)?
        && min_score > 1.0
    {
        bail!("min_score: expected at most 1, found {min_score}");
    }
    let secs = given("timeout_secs", request.timeout_secs)?;
    Ok(secs.map_or(DETECT_TIMEOUT, |secs| Duration::from_secs_f64(secs.min(MAX_DETECT_TIMEOUT_SECS))))
}

fn detect_response(request: &DetectRequest, searched: &Searched) -> DetectResponse {
    let min_score = if request.min_score > 0.0 { request.min_score } else { searched.min_score };
    let found: Vec<_> = searched.found.iter().filter(|part| part.score >= min_score).cloned().collect();
    let grasps: Vec<_> = found.iter().filter_map(|part| part.grasp).collect();
    DetectResponse {
        success: true,
        message: match found.first() {
            Some(best) => format!("{} found, the best with score {:.2}", found.len(), best.score),
            None => "nothing found".to_owned(),
        },
        detections: to_detections(&searched.header, &found),
        poses: grasps.iter().map(|(pose, _)| to_pose(&searched.header, pose)).collect(),
        openings_m: grasps.iter().map(|(_, opening_m)| *opening_m).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point2;
    use sdg_ros2::found::FoundPart;
    use sdg_ros2::messages::Header;
    use std::time::Instant;

    #[test]
    fn a_request_waits_for_the_search_of_a_picture_that_arrived_in_time() {
        let [early, asked, in_time, deadline, now] =
            [0, 1, 2, 3, 4].map(|secs| Instant::now() + Duration::from_secs(secs));
        let wait = Wait { asked, deadline };
        for (newest_arrival, is_over) in
            [(None, true), (Some(early), true), (Some(asked), false), (Some(in_time), false)]
        {
            assert_eq!(wait.is_over(now, newest_arrival), is_over);
            assert!(!wait.is_over(in_time, newest_arrival));
        }
    }

    #[test]
    fn a_detection_with_invalid_numbers_is_refused() {
        let checked = |min_score: f64, timeout_secs: f64| timeout_of(&DetectRequest { min_score, timeout_secs });
        for (timeout_secs, expected_secs) in [(0.0, 5), (3.0, 3), (100.0, 60)] {
            assert_eq!(checked(0.3, timeout_secs).unwrap(), Duration::from_secs(expected_secs));
        }
        for (min_score, timeout_secs, name) in
            [(f64::NAN, 0.0, "min_score"), (1.1, 0.0, "min_score"), (0.0, -1.0, "timeout_secs")]
        {
            let error = checked(min_score, timeout_secs).unwrap_err().to_string();
            assert!(error.starts_with(&format!("{name}: expected")), "{error}");
        }
    }

    #[test]
    fn a_request_may_ask_for_lower_or_higher_scores_than_the_setting() {
        let part = |score: f64| FoundPart {
            name: "part".to_owned(),
            score,
            corners: [Point2::new(0.0, 0.0), Point2::new(9.0, 9.0)],
            grasp: None,
        };
        let mut searched = Searched {
            header: Header::default(),
            arrived: Instant::now(),
            min_score: 0.5,
            found: [0.9, 0.6, 0.3].map(part).to_vec(),
            detections: Vec::new(),
            picture: Arc::default(),
            search_secs: 0.1,
        };
        let counts = [0.0, 0.2, 0.4, 0.7].map(|min_score| {
            let request = DetectRequest { min_score, ..DetectRequest::default() };
            detect_response(&request, &searched).detections.detections.len()
        });
        assert_eq!(counts, [2, 3, 2, 1]);
        searched.keep_by_setting();
        assert_eq!(searched.found.len(), 2);
    }
}
