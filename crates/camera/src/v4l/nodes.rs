//! Lists the nodes of this machine.

use std::fs;
use std::path::{Path, PathBuf};

use linuxvideo::format::{FrameIntervals, FrameSizes, PixelFormat};
use linuxvideo::{BufType, Device};

use super::node::{Format, Node, Sizes};
use crate::options::Encoding;

/// All nodes that capture pictures.
pub(super) fn nodes() -> Vec<Node> {
    paths().iter().filter_map(|path| read(path).ok()).filter(|node| !node.formats.is_empty()).collect()
}

/// `/dev/video*` in numerical order.
pub(super) fn paths() -> Vec<PathBuf> {
    let number = |path: &Path| path.file_name()?.to_str()?.strip_prefix("video")?.parse::<u32>().ok();
    let entries = fs::read_dir("/dev").into_iter().flatten().filter_map(|entry| Some(entry.ok()?.path()));
    let mut paths: Vec<_> = entries.filter_map(|path| Some((number(&path)?, path))).collect();
    paths.sort();
    paths.into_iter().map(|(_, path)| path).collect()
}

/// The card, driver and formats of one node; the formats are empty if the node does not capture pictures.
pub(super) fn read(path: &Path) -> std::io::Result<Node> {
    let device = Device::open(path)?;
    let card = device.capabilities()?;
    // A node of another kind (output, metadata) has no formats of this type.
    let formats = device.formats(BufType::VIDEO_CAPTURE).map_while(Result::ok);
    let formats = formats.map(|format| read_format(&device, format.pixel_format(), format.description())).collect();
    Ok(Node {
        path: path.to_owned(),
        name: card.card().to_owned(),
        driver: card.driver().to_owned(),
        bus: card.bus_info().to_owned(),
        formats,
    })
}

fn read_format(device: &Device, format: PixelFormat, description: &str) -> Format {
    let encoding = Encoding::ALL.into_iter().find(|known| known.fourcc() == format.as_fourcc());
    let sizes = match device.frame_sizes(format) {
        Ok(FrameSizes::Discrete(sizes)) => {
            Sizes::Listed(sizes.iter().map(|size| (size.width(), size.height())).collect())
        }
        Ok(FrameSizes::Stepwise(sizes) | FrameSizes::Continuous(sizes)) => {
            Sizes::Range { min: (sizes.min_width(), sizes.min_height()), max: (sizes.max_width(), sizes.max_height()) }
        }
        // A driver without a list of sizes accepts the requested size, or returns the size that it uses instead.
        Err(_) => Sizes::Range { min: (1, 1), max: (u32::MAX, u32::MAX) },
    };
    let max_fps = match &sizes {
        // The query takes dozens of calls per size, so it is limited to supported formats.
        Sizes::Listed(sizes) if encoding.is_some() => sizes.iter().map(|size| max_fps(device, format, *size)).collect(),
        _ => Vec::new(),
    };
    Format { fourcc: format.to_string(), description: description.to_owned(), encoding, sizes, max_fps }
}

fn max_fps(device: &Device, format: PixelFormat, (width, height): (u32, u32)) -> f64 {
    let fps = |interval: linuxvideo::Fract| match interval.numerator() {
        0 => 0.0,
        numerator => f64::from(interval.denominator()) / f64::from(numerator),
    };
    match device.frame_intervals(format, width, height) {
        Ok(FrameIntervals::Discrete(intervals)) => intervals.iter().map(|i| fps(*i.fract())).fold(0.0, f64::max),
        Ok(FrameIntervals::Stepwise(range) | FrameIntervals::Continuous(range)) => fps(*range.min()),
        Err(_) => 0.0,
    }
}
