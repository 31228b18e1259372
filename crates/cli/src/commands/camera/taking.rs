//! `sdg camera calibrate --from`: takes pictures of the board automatically; a page shows the view that is needed next.
//!
//! ```text
//! camera ─ frame ─ BoardSession: at rest, and a new view? ─ PNG in --taken ─ calibrate ─ missing views
//!            └──────── corners, views, empty parts and text drawn on it ─ the page on 127.0.0.1
//! ```

use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::Args;
use sdg_calibration::{Board, BoardSession, CalibrationConfig};
use sdg_camera::{Address, Frame, LatestFrame, MjpegServer, PixelFrame};
use sdg_cell::draw_board_session;
use sdg_inputs::BoardPicture;

use crate::interrupt::Interrupt;
use crate::live_pictures::{self, RequestArgs, next_frame};
use crate::output_paths::prepare_new_folder;
use crate::web_browser;

/// Default folder of the pictures.
const DEFAULT_FOLDER: &str = "calibration-pictures";
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

    /// Takes pictures until no view is missing, the maximum number is taken, the camera ends or Ctrl-C is pressed.
    ///
    /// # Errors
    /// The camera or the folder cannot be used.
    pub fn take(
        &self,
        address: &Address,
        board: &Board,
        config: impl Fn((u32, u32)) -> CalibrationConfig,
    ) -> Result<Vec<BoardPicture>> {
        let mut options = self.request.options(address)?;
        options.frame = PixelFrame::Sensor;
        let folder = self.taken.as_deref().unwrap_or(Path::new(DEFAULT_FOLDER));
        prepare_new_folder("--taken", folder)?;
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
        let mut session: Option<BoardSession<'_>> = None;
        let mut pictures = Vec::new();
        while !interrupt.is_requested() {
            let Some(Frame { mut picture, .. }) = next_frame(camera.as_mut(), &interrupt)? else { break };
            let size = picture.dimensions();
            let session = session.get_or_insert_with(|| BoardSession::new(board, config(size), is_live));
            if session.size() != size {
                eprintln!("a frame of {} x {} pixels is skipped", size.0, size.1);
                continue;
            }
            let sight = session.look(&picture);
            if sight.is_new {
                let path = folder.join(format!("{:03}.png", pictures.len()));
                sdg_files::write_png(&path, &picture)?;
                session.keep(sight.corners.clone());
                let next =
                    if session.next().is_empty() { String::new() } else { format!("; next: {}", session.next()) };
                eprintln!("taken: {}, {} corners{next}", path.display(), sight.corners.len());
                pictures.push(BoardPicture { path, size, corners: sight.corners.clone() });
            }
            let so_far = format!("{} taken", pictures.len());
            let (now, next) = match session.is_done() {
                true => (format!("{so_far}: done"), "the camera is being calibrated; the terminal shows its file"),
                false => (format!("{so_far}; {}", sight.words), session.next()),
            };
            draw_board_session(&mut picture, session, &sight.corners, [&now, next]);
            server.publish(picture, format!("{now}. {next}"));
            if session.is_done() {
                break;
            }
        }
        Ok(pictures)
    }
}
