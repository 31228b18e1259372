//! The frame of all plots: title, legend, the drawings of all widths, caption.

use crate::html::escape;

/// A figure with the page style's classes. The legend and the drawings are already HTML.
pub(super) fn framed(
    class: &str,
    title: &str,
    legend: &str,
    drawings: impl Iterator<Item = String>,
    caption: Option<&str>,
) -> String {
    let mut html = format!("<figure class=\"{class}\"><h3>{}</h3>{legend}", escape(title));
    html.extend(drawings);
    if let Some(caption) = caption {
        html += &format!("<figcaption>{}</figcaption>", escape(caption));
    }
    html + "</figure>"
}
