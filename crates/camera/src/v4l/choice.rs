//! Chooses among a node's formats and sizes.

use super::node::Format;
use crate::options::{Encoding, OpenOptions};

/// The settings requested from the driver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Choice {
    pub(super) encoding: Encoding,
    pub(super) size: (u32, u32),
}

/// Chooses the best of a node's formats by these criteria, in this order: the size nearest to the wanted one, a
/// sufficient frame rate, the smallest loss of the encoding. `None` if no format is supported.
pub(super) fn choose(formats: &[Format], options: &OpenOptions) -> Option<Choice> {
    let wanted = (options.width, options.height);
    let rated = formats.iter().filter_map(|format| {
        let encoding = format.encoding.filter(|encoding| options.encoding.is_none_or(|wanted| wanted == *encoding))?;
        let (size, place) = format.sizes.nearest(wanted)?;
        let differs = size.0.abs_diff(wanted.0) + size.1.abs_diff(wanted.1);
        let fps = format.max_fps.get(place).copied().filter(|fps| *fps > 0.0);
        // Drivers round rates: 29.97 frames per second count as 30.
        let is_slow = options.fps.zip(fps).is_some_and(|(wanted, fps)| fps < wanted * 0.99);
        let rank = Encoding::ALL.iter().position(|known| *known == encoding);
        Some(((differs, is_slow, rank), Choice { encoding, size }))
    });
    rated.min_by_key(|(rating, _)| *rating).map(|(_, choice)| choice)
}

#[cfg(test)]
mod tests {
    use super::super::node::Sizes;
    use super::*;

    fn format(encoding: Option<Encoding>, sizes: &[(u32, u32)], max_fps: &[f64]) -> Format {
        let fourcc = encoding.map_or("Z16 ".into(), |known| String::from_utf8_lossy(&known.fourcc()).into_owned());
        let sizes = Sizes::Listed(sizes.to_vec());
        Format { fourcc, description: String::new(), encoding, sizes, max_fps: max_fps.to_vec() }
    }

    fn options(width: u32, height: u32, fps: Option<f64>) -> OpenOptions {
        OpenOptions { width, height, fps, ..OpenOptions::default() }
    }

    /// A common USB webcam, whose large uncompressed frames have a low rate.
    fn webcam() -> Vec<Format> {
        vec![
            format(Some(Encoding::Mjpeg), &[(1280, 720), (640, 480)], &[30.0, 30.0]),
            format(Some(Encoding::Yuyv), &[(640, 480), (1280, 720)], &[29.97, 10.0]),
        ]
    }

    #[test]
    fn size_counts_before_speed_and_speed_before_loss() {
        let choice = |encoding, size| Some(Choice { encoding, size });
        assert_eq!(choose(&webcam(), &options(640, 480, Some(30.0))), choice(Encoding::Yuyv, (640, 480)));
        assert_eq!(choose(&webcam(), &options(1280, 720, None)), choice(Encoding::Yuyv, (1280, 720)));
        assert_eq!(choose(&webcam(), &options(1280, 720, Some(30.0))), choice(Encoding::Mjpeg, (1280, 720)));
        assert_eq!(choose(&webcam(), &options(700, 500, None)), choice(Encoding::Yuyv, (640, 480)));
        let jpeg = OpenOptions { encoding: Some(Encoding::Mjpeg), ..OpenOptions::default() };
        assert_eq!(choose(&webcam(), &jpeg), choice(Encoding::Mjpeg, (640, 480)));
        let rgb = OpenOptions { encoding: Some(Encoding::Rgb24), ..OpenOptions::default() };
        assert_eq!(choose(&webcam(), &rgb), None);
    }

    #[test]
    fn depth_alone_is_no_camera_and_ranges_are_kept_to() {
        assert_eq!(choose(&[format(None, &[(640, 480)], &[30.0])], &OpenOptions::default()), None);
        let mut any = format(Some(Encoding::Rgb24), &[], &[]);
        assert_eq!(choose(std::slice::from_ref(&any), &OpenOptions::default()), None);
        any.sizes = Sizes::Range { min: (320, 180), max: (1920, 1080) };
        assert_eq!(choose(&[any], &options(100, 2000, Some(60.0))).unwrap().size, (320, 1080));
    }
}
