//! A real server on a real port, and a client that sends given bytes.

use std::io::{Read, Write};
use std::net::{Ipv4Addr, Shutdown, TcpStream};
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

use image::{Rgb, RgbImage};
use sdg_annotate::{
    FoundGrasp, GraspTeacher, LiveOptions, LivePictures, RecentProjects, Region, Searched, Server, Session,
    SessionOptions, Start, TaughtModel, TaughtSummary, TeachRequest, TeacherError, TeachingMaterial, TeachingStep,
};
use sdg_demonstration::{Demonstration, PixelFrame};
use sdg_geometry::{GraspLine, PlanarGrasp};
use serde_json::Value;

/// A teacher whose model finds the part only where it is in its demonstration; quick, for tests of the page.
pub struct InPlace;

struct InPlaceModel(Demonstration, Vec<RgbImage>, Mutex<Option<Region>>);

/// The model read from a model file of these tests. The file contains no demonstration, so the model detects nothing.
struct ReadModel(TaughtSummary, Mutex<Option<Region>>);

impl TaughtModel for ReadModel {
    fn summary(&self) -> TaughtSummary {
        self.0.clone()
    }

    fn to_bytes(&self) -> Result<Vec<u8>, TeacherError> {
        Ok(b"a model".to_vec())
    }

    fn region(&self) -> Option<Region> {
        *self.1.lock().unwrap()
    }

    fn look_in(&self, region: Option<Region>) -> Result<(), TeacherError> {
        *self.1.lock().unwrap() = region;
        Ok(())
    }

    fn detect(&self, _: &RgbImage) -> Result<Vec<FoundGrasp>, TeacherError> {
        Ok(Vec::new())
    }
}

fn fits(region: &Region, demonstration: &Demonstration) -> Result<(), TeacherError> {
    if f64::from(region.width) < demonstration.annotation.bbox.width() {
        return Err("the part does not fit in".into());
    }
    Ok(())
}

impl GraspTeacher for InPlace {
    fn teach(
        &self,
        material: &TeachingMaterial,
        request: &TeachRequest,
        observe: &mut dyn FnMut(TeachingStep) -> ControlFlow<()>,
    ) -> Result<Box<dyn TaughtModel>, TeacherError> {
        let planned = request.steps.unwrap_or(3);
        for done in 1..=planned {
            // Slow enough that a test can stop it.
            std::thread::sleep(Duration::from_millis(2));
            let step = TeachingStep::Step { of: "the place", is_last: true, done, planned, loss: 1.0 / done as f64 };
            if observe(step).is_break() {
                return Err("stopped before anything was learnt".into());
            }
        }
        let _ = observe(TeachingStep::Validated { done: planned, hit_rate: 1.0 });
        let (demonstration, negatives) = (material.demonstrations[0].clone(), material.negatives.clone());
        Ok(Box::new(InPlaceModel(demonstration, negatives, Mutex::new(request.region))))
    }

    fn teach_on_trial(
        &self,
        material: &TeachingMaterial,
        request: &TeachRequest,
    ) -> Result<Box<dyn TaughtModel>, TeacherError> {
        let last = material.demonstrations.last().unwrap().clone();
        Ok(Box::new(InPlaceModel(last, material.negatives.clone(), Mutex::new(request.region))))
    }

    fn check_region(&self, region: &Region, demonstrations: &[Demonstration]) -> Result<(), TeacherError> {
        fits(region, &demonstrations[0])
    }

    fn open(
        &self,
        bytes: &[u8],
        summary: &TaughtSummary,
        searched: Option<Searched>,
    ) -> Result<Box<dyn TaughtModel>, TeacherError> {
        if bytes == b"a model" {
            Ok(Box::new(ReadModel(summary.clone(), Mutex::new(searched.and_then(Searched::region)))))
        } else {
            Err("no model".into())
        }
    }
}

impl TaughtModel for InPlaceModel {
    fn summary(&self) -> TaughtSummary {
        TaughtSummary {
            model: sdg_annotate::ModelKind::S,
            object: self.0.annotation.label.clone(),
            seconds: 0.1,
            figures: None,
            negatives: None,
        }
    }

    fn to_bytes(&self) -> Result<Vec<u8>, TeacherError> {
        Ok(b"a model".to_vec())
    }

    fn region(&self) -> Option<Region> {
        *self.2.lock().unwrap()
    }

    fn look_in(&self, region: Option<Region>) -> Result<(), TeacherError> {
        region.map_or(Ok(()), |region| fits(&region, &self.0))?;
        *self.2.lock().unwrap() = region;
        Ok(())
    }

    fn detect(&self, image: &RgbImage) -> Result<Vec<FoundGrasp>, TeacherError> {
        let bbox = self.0.annotation.bbox;
        let middle = bbox.center();
        let has_middle = |region: Region| {
            (region.x..region.x + region.width).contains(&(middle.x as u32))
                && (region.y..region.y + region.height).contains(&(middle.y as u32))
        };
        if !self.region().is_none_or(has_middle) {
            return Ok(Vec::new());
        }
        let place = bbox.center().map(|v| v as u32);
        let same =
            !self.1.contains(image) && image.get_pixel(place.x, place.y) == self.0.image.get_pixel(place.x, place.y);
        let line: GraspLine = *self.0.annotation.require_grasp()?;
        Ok(vec![FoundGrasp {
            score: if same { 0.9 } else { 0.1 },
            is_accepted: same,
            bbox,
            outline: self.0.annotation.outline.clone(),
            grasp: PlanarGrasp::from_line(&line, self.0.annotation.jaw_width.unwrap_or(30.0)),
            line_length: line.length(),
            pose: None,
            refusal: None,
            touches: Vec::new(),
        }])
    }
}

/// A server for a folder; stopped when dropped.
pub struct Served {
    pub folder: tempfile::TempDir,
    pub port: u16,
    pub token: String,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

/// The client's action after sending.
#[derive(PartialEq)]
pub enum Then {
    Close,
    StaySilent,
}

/// A parsed response.
pub struct Answer {
    pub status: u16,
    pub head: String,
    pub body: Vec<u8>,
}

impl Answer {
    pub fn text(&self) -> String {
        String::from_utf8_lossy(&self.body).into_owned()
    }

    pub fn json(&self) -> Value {
        assert_eq!(self.status, 200, "{}", self.text());
        serde_json::from_slice(&self.body).unwrap()
    }
}

/// A light bar on a dark table with some grain.
pub fn photo() -> RgbImage {
    RgbImage::from_fn(200, 100, |x, y| {
        let grain = ((x * 7 + y * 13) % 11) as u8;
        let on_part = (40..140).contains(&x) && (40..60).contains(&y);
        Rgb(if on_part { [200 + grain, 190, 170 + (x % 40) as u8] } else { [40 + grain, 45, 50] })
    })
}

pub fn photo_png() -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    photo().write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

/// Maximum silence of connections, unless a test is about it.
const PATIENCE: Duration = Duration::from_secs(30);

impl Served {
    pub fn start() -> Self {
        Self::with_patience(PATIENCE)
    }

    /// A server with this maximum silence of connections.
    pub fn with_patience(patience: Duration) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let image: PathBuf = folder.path().join("photo.png");
        std::fs::write(&image, photo_png()).unwrap();
        std::fs::write(folder.path().join("secret.txt"), "not for the page").unwrap();
        Self::open(folder, SessionOptions { images: vec![(image, None)], ..SessionOptions::default() }, patience)
    }

    /// A server for a project's folder.
    pub fn of_project(folder: tempfile::TempDir) -> Self {
        let options = SessionOptions { project: Some(folder.path().to_owned()), ..SessionOptions::default() };
        Self::open(folder, options, PATIENCE)
    }

    /// Like [`Self::of_project`], with a file for the model.
    pub fn of_project_with_model(folder: tempfile::TempDir, model_path: PathBuf) -> Self {
        let (project, model_path) = (Some(folder.path().to_owned()), Some(model_path));
        let options = SessionOptions { project, model_path, ..SessionOptions::default() };
        Self::open(folder, options, PATIENCE)
    }

    /// Like [`Self::of_project`], with a calibrated camera.
    pub fn of_calibrated_project(folder: tempfile::TempDir) -> Self {
        let project = Some(folder.path().to_owned());
        let options = SessionOptions { project, pixel_frame: PixelFrame::Sensor, ..SessionOptions::default() };
        Self::open(folder, options, PATIENCE)
    }

    /// A server for a photo in a folder.
    pub fn of_photo(folder: tempfile::TempDir, name: &str) -> Self {
        let images = vec![(folder.path().join(name), None)];
        Self::open(folder, SessionOptions { images, ..SessionOptions::default() }, PATIENCE)
    }

    /// Like [`Self::of_photo`], with pictures to try from another folder.
    pub fn of_photo_and_tried(folder: tempfile::TempDir, name: &str, tried: &std::path::Path) -> Self {
        let images = vec![(folder.path().join(name), None)];
        let trial_pictures = vec![tried.to_owned()];
        Self::open(folder, SessionOptions { images, trial_pictures, ..SessionOptions::default() }, PATIENCE)
    }

    /// A server without a project; new ones are created in the folder.
    pub fn of_start(folder: tempfile::TempDir) -> Self {
        let recent = RecentProjects::at(folder.path().join("state/recent.json"));
        let noted = recent.clone();
        let open = move |path: &std::path::Path| {
            let options = SessionOptions { project: Some(path.to_owned()), ..SessionOptions::default() };
            noted.note(path)?;
            Ok(Session::open(&options, Arc::new(InPlace))?)
        };
        let start = Start {
            recent: Some(recent),
            folder: folder.path().to_owned(),
            pixel_frame: PixelFrame::Upright,
            photo_size: None,
            open: Box::new(open),
        };
        Self::serve(folder, Server::bind_start(start, 0, None).unwrap())
    }

    /// Stops the server and returns its folder.
    pub fn end(mut self) -> tempfile::TempDir {
        let folder = std::mem::replace(&mut self.folder, tempfile::tempdir().unwrap());
        drop(self);
        folder
    }

    /// A server with a camera and no photo, in an empty folder.
    pub fn with_camera(pictures: Arc<dyn LivePictures>) -> Self {
        Self::with_camera_in(tempfile::tempdir().unwrap(), pictures)
    }

    /// A server with a camera that writes its photos into a folder.
    pub fn with_camera_in(folder: tempfile::TempDir, pictures: Arc<dyn LivePictures>) -> Self {
        let live = LiveOptions { pictures, address: "test:".into(), photo_path: folder.path().join("photo.png") };
        let options = SessionOptions { live: Some(live), ..SessionOptions::default() };
        Self::open(folder, options, PATIENCE)
    }

    fn open(folder: tempfile::TempDir, options: SessionOptions, patience: Duration) -> Self {
        let session = Session::open(&options, Arc::new(InPlace)).unwrap();
        Self::serve(folder, Server::bind(session, 0).unwrap().with_patience(patience))
    }

    fn serve(folder: tempfile::TempDir, server: Server) -> Self {
        let url = server.url();
        let (address, token) = url.split_once("/?token=").unwrap();
        let (port, token) = (address.rsplit(':').next().unwrap().parse().unwrap(), token.to_owned());
        let stop = Arc::new(AtomicBool::new(false));
        let asked = Arc::clone(&stop);
        let thread = std::thread::spawn(move || server.run(move || asked.load(Ordering::SeqCst)).unwrap());
        Self { folder, port, token, stop, thread: Some(thread) }
    }

    /// Sends exactly these bytes, closes the sending direction unless told to stay silent, and reads to the end.
    pub fn exchange(&self, bytes: &[u8], then: Then) -> String {
        let mut stream = TcpStream::connect((Ipv4Addr::LOCALHOST, self.port)).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        stream.write_all(bytes).unwrap();
        if then == Then::Close {
            stream.shutdown(Shutdown::Write).unwrap();
        }
        let mut answer = Vec::new();
        match stream.read_to_end(&mut answer) {
            // If the server closes with unread bytes, the connection is reset.
            Err(error) if error.kind() != std::io::ErrorKind::ConnectionReset => panic!("{error}"),
            _ => String::from_utf8_lossy(&answer).into_owned(),
        }
    }

    /// Sends exactly these headers.
    pub fn send(&self, method: &str, path: &str, headers: &[(&str, &str)], body: &[u8]) -> Answer {
        let mut stream = TcpStream::connect((Ipv4Addr::LOCALHOST, self.port)).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
        let mut head = format!("{method} {path} HTTP/1.1\r\nConnection: close\r\nContent-Length: {}\r\n", body.len());
        for (name, value) in headers {
            head += &format!("{name}: {value}\r\n");
        }
        stream.write_all(format!("{head}\r\n").as_bytes()).unwrap();
        // A server that rejects the head may close before it has read the body.
        let _ = stream.write_all(body);
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        let end = answer.windows(4).position(|four| four == b"\r\n\r\n").expect("a whole head");
        let head = String::from_utf8_lossy(&answer[..end]).into_owned();
        let status = head.split(' ').nth(1).unwrap().parse().unwrap();
        Answer { status, head, body: answer[end + 4..].to_vec() }
    }

    pub fn host(&self) -> String {
        format!("127.0.0.1:{}", self.port)
    }

    pub fn cookie(&self) -> String {
        format!("sdg-annotate-{}={}", self.port, self.token)
    }

    /// A request in the form of the page.
    pub fn ask(&self, method: &str, path: &str, body: &[u8]) -> Answer {
        let (host, cookie) = (self.host(), self.cookie());
        let origin = format!("http://{host}");
        self.send(
            method,
            path,
            &[("Host", host.as_str()), ("Cookie", cookie.as_str()), ("Origin", origin.as_str())],
            body,
        )
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::SeqCst);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
