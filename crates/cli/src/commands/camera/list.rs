//! `sdg camera list`.

use std::io::Write;

use anyhow::Result;
use clap::Args;
use sdg_camera::v4l::{self, Format, Sizes};
use serde_json::{Value, json};

use crate::exit::Outcome;

/// `sdg camera list`
#[derive(Debug, Args)]
pub struct ListArgs {
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

/// Prints one line for each camera and one for each of its formats.
pub fn run(args: &ListArgs) -> Result<Outcome> {
    let nodes = v4l::nodes();
    let mut stdout = std::io::stdout().lock();
    if args.json {
        let cameras: Vec<Value> = nodes
            .iter()
            .map(|node| {
                let formats: Vec<Value> = node.formats.iter().map(json_format).collect();
                let address = format!("v4l:{}", node.path.display());
                json!({"address": address, "name": node.name, "driver": node.driver, "bus": node.bus, "formats": formats})
            })
            .collect();
        writeln!(stdout, "{}", json!({"cameras": cameras}))?;
    } else {
        for node in &nodes {
            writeln!(stdout, "v4l:{}  {} (driver {}, {})", node.path.display(), node.name, node.driver, node.bus)?;
            for format in &node.formats {
                let unread = if format.encoding.is_some() { "" } else { ", not read by sdg" };
                let sizes = in_words(&format.sizes);
                writeln!(stdout, "    {}  {}{unread}: {sizes}", format.fourcc.trim(), format.description)?;
            }
        }
        if nodes.is_empty() {
            writeln!(
                stdout,
                "no V4L2 camera on this machine (no /dev/video* that opens and captures pictures); --from also takes http://, cmd:, \
                 dir: and file:"
            )?;
        }
    }
    Ok(if nodes.is_empty() { Outcome::NothingToGrasp } else { Outcome::Done })
}

fn json_format(format: &Format) -> Value {
    let sizes = match &format.sizes {
        Sizes::Listed(sizes) => {
            // 0 is a rate that the driver does not give.
            let rates = format.max_fps.iter().map(|&fps| (fps > 0.0).then_some(fps)).chain(std::iter::repeat(None));
            json!(
                sizes
                    .iter()
                    .zip(rates)
                    .map(|((w, h), fps)| json!({"width": w, "height": h, "max_fps": fps}))
                    .collect::<Vec<_>>()
            )
        }
        Sizes::Range { min, max } => json!({"min": [min.0, min.1], "max": [max.0, max.1]}),
    };
    json!({"fourcc": format.fourcc, "description": format.description, "read": format.encoding.is_some(), "sizes": sizes})
}

fn in_words(sizes: &Sizes) -> String {
    match sizes {
        Sizes::Listed(sizes) => sizes.iter().map(|(w, h)| format!("{w}x{h}")).collect::<Vec<_>>().join(" "),
        Sizes::Range { min, max } => format!("{}x{} to {}x{}", min.0, min.1, max.0, max.1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sdg_camera::Encoding;

    #[test]
    fn a_rate_that_the_driver_does_not_give_is_null() {
        let format = Format {
            fourcc: "YUYV".to_owned(),
            description: "YUYV 4:2:2".to_owned(),
            encoding: Some(Encoding::Yuyv),
            sizes: Sizes::Listed(vec![(640, 480), (320, 240), (160, 120)]),
            max_fps: vec![30.0, 0.0],
        };
        let printed = json_format(&format);
        let rates = [0_usize, 1, 2].map(|idx| printed["sizes"][idx]["max_fps"].clone());
        assert_eq!(rates, [json!(30.0), Value::Null, Value::Null]);
    }
}
