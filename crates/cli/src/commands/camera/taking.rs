//! `sdg camera calibrate --from`: takes pictures of the board automatically; a page shows the view that is needed next.
//!
//! ```text
//! camera ─ frame ─ find_board ─ PictureTaker: at rest, and a new view? ─ PNG in --taken ─ calibrate ─ missing views
//!            └──────── corners, views, empty parts and text drawn on it ─ the page on 127.0.0.1
//! ```

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;
use image::RgbImage;
use nalgebra::Point2;
use sdg_calibration::{
    Board, CalibrationConfig, CalibrationError, MIN_PICTURES, PictureTaker, SeenCorner, Sight, calibrate, find_board,
};
use sdg_camera::{Address, LatestFrame, MjpegServer};
use sdg_demonstration::PixelFrame;
use sdg_geometry::{BoundingBox, Keypoint, Polygon, convex_hull};
use sdg_report::{Color, Pen, draw_box, draw_keypoints, draw_label, draw_polygon, line_width};

use super::board_in_use::{grey, named};
use crate::exit::{Usage, one_line};
use crate::interrupt::Interrupt;
use crate::live_pictures::{self, RequestArgs, next_frame};
use crate::web_browser;

/// Default folder of the pictures.
const DEFAULT_FOLDER: &str = "calibration-pictures";
/// Number of pictures after which taking ends if nothing is missing; docs/calibration.md states this number and
/// [`MAX_TAKEN`].
const MIN_TAKEN: usize = 12;
/// Number of pictures after which taking always ends: more do not improve the result.
const MAX_TAKEN: usize = 40;
const BOARD: Color = Color([255, 196, 61]);

/// Arguments of taking pictures.
#[derive(Debug, Args)]
pub struct TakingArgs {
    /// Take the pictures with this camera: v4l:, v4l:/dev/video0, http://HOST/PATH, 'cmd:PROGRAM', dir:FOLDER.
    ///
    /// A page opens that shows the board's corners, the views taken so far, and the view that is needed next. A picture
    /// is taken whenever the board is held still in a new view. Taking ends after 12 pictures if nothing is missing,
    /// after 40 at the latest; Ctrl-C ends it early and uses the pictures taken so far
    #[arg(long, value_name = "ADDRESS", conflicts_with = "pictures")]
    from: Option<Address>,
    /// With --from: the folder for the pictures, new or empty; default: calibration-pictures
    #[arg(long, value_name = "FOLDER")]
    taken: Option<PathBuf>,
    /// With --from: the page's port on 127.0.0.1; default: any free port
    #[arg(long, value_name = "PORT")]
    port: Option<u16>,
    /// With --from: print the page's address and do not open a browser
    #[arg(long)]
    no_browser: bool,
    #[command(flatten)]
    request: RequestArgs,
}

/// A picture in which the board was found.
pub struct Seen {
    /// The file of the picture.
    pub path: PathBuf,
    /// Width and height.
    pub size: (u32, u32),
    /// The board's corners.
    pub corners: Vec<SeenCorner>,
}

/// The texts in the lower left corner of the picture on the page.
struct Words {
    now: String,
    next: String,
}

impl TakingArgs {
    /// The camera's address, if there is one.
    ///
    /// # Errors
    /// Camera options are given without a camera.
    pub fn address(&self, pictures: &[PathBuf]) -> Result<Option<&Address>> {
        if self.from.is_none() {
            let own =
                [("--taken", self.taken.is_some()), ("--port", self.port.is_some()), ("--no-browser", self.no_browser)];
            self.request.refuse_without_camera(&own, &format!("{} pictures", pictures.len()))?;
        }
        Ok(self.from.as_ref())
    }

    /// Takes pictures until [`MIN_TAKEN`] are taken and nothing is missing, [`MAX_TAKEN`] are taken, the camera ends or
    /// Ctrl-C is pressed.
    ///
    /// # Errors
    /// The camera or the folder cannot be used.
    pub fn take(
        &self,
        address: &Address,
        board: &Board,
        config: impl Fn((u32, u32)) -> CalibrationConfig,
    ) -> Result<Vec<Seen>> {
        let folder = self.taken.as_deref().unwrap_or(Path::new(DEFAULT_FOLDER));
        sdg_files::prepare_folder(folder)?;
        if std::fs::read_dir(folder).with_context(|| named(folder))?.next().is_some() {
            let found = folder.display();
            return Err(Usage(format!("--taken: expected a new or an empty folder, found files in {found}")).into());
        }
        let mut options = self.request.options();
        options.frame = PixelFrame::Sensor;
        let mut camera = live_pictures::open(address, &options)?;
        let is_live = address.is_live();
        if is_live {
            camera = Box::new(LatestFrame::spawn(camera));
        }
        let server = MjpegServer::start(self.port.unwrap_or_default())?;
        eprintln!("pictures at {}", server.url());
        if !self.no_browser {
            web_browser::open(&server.url());
        }
        let interrupt = Interrupt::watch();
        let mut session: Option<Taking<'_>> = None;
        while !interrupt.is_requested() {
            let Some(frame) = next_frame(camera.as_mut())? else { break };
            let size = frame.picture.dimensions();
            let taking = session.get_or_insert_with(|| Taking::new(board, config(size), folder, is_live));
            if taking.size() != size {
                eprintln!("a frame of {} x {} pixels is skipped", size.0, size.1);
                continue;
            }
            let (drawn, words) = taking.look(frame.picture)?;
            server.publish(drawn, words);
            if taking.is_done() {
                break;
            }
        }
        Ok(session.map(|taking| taking.seen).unwrap_or_default())
    }
}

/// The pictures taken so far.
struct Taking<'a> {
    board: &'a Board,
    config: CalibrationConfig,
    folder: &'a Path,
    taker: PictureTaker,
    seen: Vec<Seen>,
    /// The view that is needed most; empty if nothing is known to be missing.
    next: String,
}

impl<'a> Taking<'a> {
    fn new(board: &'a Board, config: CalibrationConfig, folder: &'a Path, is_live: bool) -> Self {
        let taker = PictureTaker::new(config.width, config.height);
        let taker = if is_live { taker } else { taker.of_single_pictures() };
        let next = "show the board, tilted by 20 to 40 degrees, and hold it still".to_owned();
        Self { board, config, folder, taker, seen: Vec::new(), next }
    }

    fn size(&self) -> (u32, u32) {
        (self.config.width, self.config.height)
    }

    fn is_done(&self) -> bool {
        self.seen.len() >= MAX_TAKEN || (self.seen.len() >= MIN_TAKEN && self.next.is_empty())
    }

    /// Searches a frame for the board and saves the frame if it is useful. Returns the picture for the page, and its
    /// text.
    fn look(&mut self, picture: RgbImage) -> Result<(RgbImage, String)> {
        let corners = find_board(&grey(&picture), self.board);
        let now = match &corners {
            Err(error) => {
                self.taker.lose();
                match error {
                    CalibrationError::OtherBoard { .. } | CalibrationError::OtherCheckerboard { .. } => {
                        error.to_string()
                    }
                    _ => "no board is visible".to_owned(),
                }
            }
            Ok(corners) => match self.taker.look(corners) {
                Sight::Moving => "hold it still".to_owned(),
                Sight::Known => "this view is taken, move the board".to_owned(),
                Sight::New => {
                    self.keep(&picture, corners)?;
                    "picture taken".to_owned()
                }
            },
        };
        let so_far = format!("{} taken", self.seen.len());
        let words = match self.is_done() {
            true => Words {
                now: format!("{so_far}: done"),
                next: "the camera is being calibrated; the terminal shows its file".to_owned(),
            },
            false => Words { now: format!("{so_far}; {now}"), next: self.next.clone() },
        };
        let drawn = self.drawn(picture, corners.as_deref().unwrap_or_default(), &words);
        Ok((drawn, format!("{}. {}", words.now, words.next)))
    }

    fn keep(&mut self, picture: &RgbImage, corners: &[SeenCorner]) -> Result<()> {
        let path = self.folder.join(format!("{:03}.png", self.seen.len()));
        sdg_files::write_png(&path, picture)?;
        self.taker.keep(corners.to_vec());
        self.next = self.lacking();
        let next = if self.next.is_empty() { String::new() } else { format!("; next: {}", self.next) };
        eprintln!("taken: {}, {} corners{next}", path.display(), corners.len());
        self.seen.push(Seen { path, size: picture.dimensions(), corners: corners.to_vec() });
        Ok(())
    }

    /// The view that is needed most.
    fn lacking(&self) -> String {
        let taken = self.taker.taken();
        if taken.len() < MIN_PICTURES {
            return "tilt the board another way, by 20 to 40 degrees".to_owned();
        }
        match calibrate(self.board, taken, &self.config) {
            Ok(found) => found.advice.first().map(ToString::to_string).unwrap_or_default(),
            Err(CalibrationError::PosesAlike { .. }) => {
                "tilt the board more, to the left and right, upwards and downwards".to_owned()
            }
            Err(error) => one_line(&error.into()),
        }
    }

    /// The picture with the board's corners, the views taken so far, the regions without views, and the instructions.
    fn drawn(&self, mut picture: RgbImage, corners: &[SeenCorner], words: &Words) -> RgbImage {
        let width = line_width(&picture);
        for view in self.taker.taken() {
            let hull = Polygon { vertices: convex_hull(view.iter().map(|seen| seen.pixel)) };
            draw_polygon(&mut picture, &hull, &Pen::new(Color::VERIFIED).width(0.5 * width).without_halo());
        }
        for part in self.empty_parts() {
            let pen = Pen::new(Color::NEUTRAL).width(0.5 * width).dashed(6.0 * width, 4.0 * width);
            draw_box(&mut picture, &part, &pen);
        }
        let places: Vec<Keypoint> = corners.iter().map(|seen| Keypoint::visible(seen.pixel)).collect();
        draw_keypoints(&mut picture, &places, &Pen::new(BOARD).width(0.6 * width));
        let text_px = (f64::from(picture.width().max(picture.height())) / 55.0).max(8.0);
        let mut bottom = f64::from(picture.height());
        // A new line after each colon, so that the text fits into the picture.
        for line in words.next.split(": ").collect::<Vec<_>>().into_iter().rev().filter(|line| !line.is_empty()) {
            draw_label(&mut picture, Point2::new(0.0, bottom), line, Color::NEUTRAL, text_px);
            bottom -= 2.5 * text_px;
        }
        draw_label(&mut picture, Point2::new(0.0, bottom), &words.now, BOARD, 1.2 * text_px);
        picture
    }

    /// The cells of a 3x3 grid over the picture that contain no corner so far.
    fn empty_parts(&self) -> Vec<BoundingBox> {
        let [width, height] = [self.config.width, self.config.height].map(|side| f64::from(side) / 3.0);
        let parts = (0..9).map(|k| {
            let [x1, y1] = [f64::from(k % 3) * width, f64::from(k / 3) * height];
            BoundingBox { x1, y1, x2: x1 + width, y2: y1 + height }
        });
        let is_seen =
            |part: &BoundingBox| {
                self.taker.taken().iter().flatten().any(|seen| {
                    (part.x1..part.x2).contains(&seen.pixel.x) && (part.y1..part.y2).contains(&seen.pixel.y)
                })
            };
        parts.filter(|part| !is_seen(part)).collect()
    }
}
