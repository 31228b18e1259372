//! The address of a camera, as text.

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Duration;

use crate::command_line::CommandLine;
use crate::error::CameraError;
use crate::http::{Url, without_password};

/// The address of a camera.
///
/// | text | camera |
/// |---|---|
/// | `v4l:` | the first V4L2 node with a supported format |
/// | `v4l:/dev/video2`, `v4l:RealSense` | the node with this path; the first node whose card name contains this text |
/// | `http://[USER:PASSWORD@]HOST[:PORT]/PATH` | motion JPEG, or one JPEG or PNG that is requested repeatedly |
/// | `cmd:PROGRAM ARGUMENTS` | a program that writes JPEG, PNG or PPM pictures to its standard output |
/// | `dir:FOLDER` | the folder's pictures (PNG, JPEG, PPM, WebP, BMP, TIFF) in the order of their names; options below |
/// | `file:PATH` | one picture, once; with `?loop` repeatedly |
/// | `sim:REST` | the simulated camera, which another crate opens |
/// | `ros2:TOPIC`, `ros2:TOPIC?OPTIONS` | a topic of ROS 2 with sensor_msgs/Image or CompressedImage, which another crate opens |
///
/// Options of `dir:` and `file:` follow the last `?`, joined by `&`: `fps=10` (pictures per second; default: no delay),
/// `loop` (starts again after the last picture), `follow` (`dir:` only: waits for new files). If the path itself
/// contains `?`, another `?` must follow it.
#[derive(Debug, Clone, PartialEq)]
pub enum Address {
    /// `v4l:`, a camera of Video4Linux 2.
    V4l(NodeName),
    /// `http://`, a server of motion JPEG or of single pictures.
    Http(Url),
    /// `cmd:`, a program that writes pictures to its standard output.
    Command(CommandLine),
    /// The pictures in a folder.
    Folder {
        /// The folder; its pictures are read in the order of their names.
        path: PathBuf,
        /// Playback settings.
        playback: Playback,
    },
    /// `file:`, a single picture.
    File {
        /// A picture in any supported format.
        path: PathBuf,
        /// Playback settings.
        playback: Playback,
    },
    /// The simulated camera: the text after `sim:`.
    Sim(String),
    /// A topic of ROS 2: the text after `ros2:`.
    Ros2(String),
}

/// Selects a V4L2 node.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum NodeName {
    /// The first node with a supported format.
    Any,
    /// The node with this path.
    Path(PathBuf),
    /// The first node with a supported format whose card name contains this text, ignoring case.
    Card(String),
}

/// Playback settings of picture files.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Playback {
    /// Time between pictures; `None` for no delay.
    pub interval: Option<Duration>,
    /// Starts again after the last picture.
    pub is_looped: bool,
    /// Waits for new files after the last picture.
    pub is_followed: bool,
}

impl Address {
    /// Whether the source is live. Pictures in files and folders are not.
    pub fn is_live(&self) -> bool {
        !matches!(self, Self::Folder { .. } | Self::File { .. })
    }
}

/// The input that [`Address::from_str`] expects.
const EXPECTED: &str = "an address of a camera: v4l:, v4l:/dev/video0, http://HOST/PATH, cmd:PROGRAM ARGUMENTS, dir:FOLDER, \
                        file:PATH, sim: or ros2:TOPIC";
/// Range of `fps=`, in frames per second.
const FPS: std::ops::RangeInclusive<f64> = 0.1..=1000.0;

impl FromStr for Address {
    type Err = CameraError;

    fn from_str(text: &str) -> Result<Self, CameraError> {
        let refused =
            |expected: &str| CameraError::Address { expected: expected.into(), found: without_password(text) };
        let (kind, rest) = text.split_once(':').ok_or_else(|| refused(EXPECTED))?;
        match kind {
            "v4l" => Ok(Self::V4l(match rest {
                "" => NodeName::Any,
                path if path.starts_with('/') => NodeName::Path(path.into()),
                card => NodeName::Card(card.to_owned()),
            })),
            "http" => text.parse().map(Self::Http),
            "https" => {
                Err(refused("http://, because https is not supported (cmd:curl -sN URL or cmd:ffmpeg fetches https)"))
            }
            "cmd" => rest.parse().map(Self::Command).map_err(|error| match error {
                CameraError::Address { expected, .. } => refused(&expected),
                other => other,
            }),
            "dir" => {
                let (path, playback) = parse_playback(rest, text)?;
                if playback.is_looped && playback.is_followed {
                    return Err(refused("loop or follow, not both"));
                }
                Ok(Self::Folder { path, playback })
            }
            "file" => {
                let (path, playback) = parse_playback(rest, text)?;
                if playback.is_followed {
                    return Err(refused("fps or loop for file:; follow is for dir:"));
                }
                Ok(Self::File { path, playback })
            }
            "sim" => Ok(Self::Sim(rest.to_owned())),
            "ros2" if rest.is_empty() => Err(refused("a topic after ros2:, as in ros2:/camera/image_raw")),
            "ros2" => Ok(Self::Ros2(rest.to_owned())),
            _ => Err(refused(EXPECTED)),
        }
    }
}

/// `PATH` or `PATH?fps=10&loop&follow`.
fn parse_playback(rest: &str, text: &str) -> Result<(PathBuf, Playback), CameraError> {
    let refused = |expected: &str| CameraError::Address { expected: expected.into(), found: text.into() };
    let (path, options) = rest.rsplit_once('?').unwrap_or((rest, ""));
    if path.is_empty() {
        return Err(refused("a path"));
    }
    let mut playback = Playback::default();
    for option in options.split('&').filter(|option| !option.is_empty()) {
        match option.split_once('=') {
            None if option == "loop" => playback.is_looped = true,
            None if option == "follow" => playback.is_followed = true,
            Some(("fps", number)) => {
                let fps =
                    number.parse().ok().filter(|fps| FPS.contains(fps)).ok_or_else(|| refused("fps=0.1 to 1000"))?;
                playback.interval = Some(Duration::from_secs_f64(1.0 / fps));
            }
            _ => return Err(refused("the options fps=NUMBER, loop or follow after ?")),
        }
    }
    Ok((path.into(), playback))
}

impl fmt::Display for Address {
    /// The address in parsable form, without the password.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::V4l(NodeName::Any) => f.write_str("v4l:"),
            Self::V4l(NodeName::Path(path)) => write!(f, "v4l:{}", path.display()),
            Self::V4l(NodeName::Card(card)) => write!(f, "v4l:{card}"),
            Self::Http(url) => write!(f, "{url}"),
            Self::Command(line) => write!(f, "cmd:{line}"),
            Self::Folder { path, playback } => write!(f, "dir:{}", with_options(path, playback)),
            Self::File { path, playback } => write!(f, "file:{}", with_options(path, playback)),
            Self::Sim(rest) => write!(f, "sim:{rest}"),
            Self::Ros2(rest) => write!(f, "ros2:{rest}"),
        }
    }
}

/// The text from which [`parse_playback`] reads them: a path with a question mark needs another one after it.
fn with_options(path: &Path, playback: &Playback) -> String {
    let options = playback.to_string();
    let mark = if options.is_empty() && path.as_os_str().as_encoded_bytes().contains(&b'?') { "?" } else { "" };
    format!("{}{options}{mark}", path.display())
}

impl fmt::Display for Playback {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut separator = '?';
        let mut option = |text: String| {
            let result = write!(f, "{separator}{text}");
            separator = '&';
            result
        };
        if let Some(interval) = self.interval {
            option(
                format!("fps={:.4}", 1.0 / interval.as_secs_f64())
                    .trim_end_matches('0')
                    .trim_end_matches('.')
                    .to_owned(),
            )?;
        }
        if self.is_looped {
            option("loop".to_owned())?;
        }
        if self.is_followed {
            option("follow".to_owned())?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_what_they_print() {
        for text in [
            "v4l:",
            "v4l:/dev/video2",
            "v4l:RealSense",
            "http://10.0.0.7:8080/video?size=640",
            "cmd:ffmpeg -i 'my film.mp4' -f mjpeg -",
            "dir:/tmp/pictures",
            "dir:pictures?fps=10&loop",
            "dir:pictures?follow",
            "file:a.png?fps=0.5&loop",
            "sim:rod-end",
            "ros2:/camera/image_raw?compressed&domain=7",
        ] {
            assert_eq!(text.parse::<Address>().unwrap().to_string(), text);
        }
    }

    #[test]
    fn paths_and_options_are_told_apart_at_the_last_question_mark() {
        let Address::Folder { path, playback } = "dir:what?now?fps=4".parse().unwrap() else { panic!() };
        assert_eq!((path.to_str().unwrap(), playback.interval), ("what?now", Some(Duration::from_millis(250))));
        let Address::File { path, .. } = "file:what?now?".parse().unwrap() else { panic!() };
        assert_eq!(path.to_str().unwrap(), "what?now");
        for text in ["dir:what?now?fps=4", "file:what?now?", "file:now.png"] {
            assert_eq!(text.parse::<Address>().unwrap().to_string(), text);
        }
    }

    #[test]
    fn what_is_no_address_is_refused_with_what_was_expected() {
        for (text, expected) in [
            ("", "address of a camera"),
            ("/dev/video0", "v4l:/dev/video0"),
            ("rtsp://camera/", "address of a camera"),
            ("https://camera/", "https is not supported"),
            ("http://", "HOST"),
            ("cmd:", "a program"),
            ("ros2:", "a topic after ros2:"),
            ("dir:", "a path"),
            ("dir:?loop", "a path"),
            ("dir:a?fps=0", "0.1 to 1000"),
            ("dir:a?fps=x", "0.1 to 1000"),
            ("dir:a?b", "fps=NUMBER, loop or follow"),
            ("dir:a?loop&follow", "not both"),
            ("file:a?follow", "for dir:"),
        ] {
            let error = text.parse::<Address>().unwrap_err().to_string();
            assert!(error.contains(expected) && error.contains(&format!("\"{text}\"")), "{text}: {error}");
        }
    }

    #[test]
    fn the_password_of_a_wrong_address_is_not_printed() {
        for (text, shown) in [
            ("http://me:50%off@cam/", "http://me:***@cam/"),
            ("http://me:a/b@cam/", "http://me:***@cam/"),
            ("http://me:50@home@cam:80000/", "http://me:***@cam:80000/"),
            ("https://me:secret@cam/", "https://me:***@cam/"),
            ("rtsp://me:secret@cam/", "rtsp://me:***@cam/"),
            ("cmd:'curl http://me:secret@cam/", "cmd:'curl http://me:***@cam/"),
            ("http://me@cam:80000/", "http://me@cam:80000/"),
        ] {
            let error = text.parse::<Address>().unwrap_err().to_string();
            assert!(error.ends_with(&format!("found \"{shown}\"")), "{text}: {error}");
        }
    }
}
