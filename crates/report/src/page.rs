//! The page: title, key figures and sections, written as one file.

use std::path::{Path, PathBuf};

use crate::error::ReportError;
use crate::figure::{Figure, MAX_PHOTO_WIDTH, PhotoQuality};
use crate::html::{escape, slug};
use crate::section::Section;
use crate::table::Tone;

/// Target size of the page in bytes; photos are compressed to reach it.
const PAGE_BYTES: usize = 4_000_000;

/// Qualities that are tried in order until the page is small enough; the last one is used even if it is not.
const QUALITIES: [PhotoQuality; 4] = [
    PhotoQuality { jpeg: 86, max_width: MAX_PHOTO_WIDTH },
    PhotoQuality { jpeg: 76, max_width: MAX_PHOTO_WIDTH },
    PhotoQuality { jpeg: 66, max_width: 960 },
    PhotoQuality { jpeg: 52, max_width: 640 },
];

/// A number in large type.
#[derive(Debug, Clone, PartialEq)]
pub struct KeyFigure {
    value: String,
    unit: String,
    label: String,
    tone: Tone,
}

impl KeyFigure {
    /// A number, its unit (or `of 10`), and its meaning, such as `142`, `s`, `to teach`.
    #[must_use]
    pub fn new(value: impl Into<String>, unit: impl Into<String>, label: impl Into<String>) -> Self {
        Self { value: value.into(), unit: unit.into(), label: label.into(), tone: Tone::Plain }
    }

    /// Sets the colour of the number.
    #[must_use]
    pub fn tone(mut self, tone: Tone) -> Self {
        self.tone = tone;
        self
    }

    fn to_html(&self) -> String {
        format!(
            "<div class=\"{}\"><dd><b>{}</b> <span>{}</span></dd><dt>{}</dt></div>",
            self.tone.class(),
            escape(&self.value),
            escape(&self.unit),
            escape(&self.label)
        )
    }
}

/// A report: title, key figures, sections.
#[derive(Debug, Clone)]
pub struct Report {
    title: String,
    kicker: Option<String>,
    lead: Option<String>,
    key_figures: Vec<KeyFigure>,
    cover: Option<Figure>,
    sections: Vec<Section>,
    footer: Option<String>,
}

impl Report {
    /// An empty report.
    #[must_use]
    pub fn new(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            kicker: None,
            lead: None,
            key_figures: Vec::new(),
            cover: None,
            sections: Vec::new(),
            footer: None,
        }
    }

    /// Sets a few words above the title: the kind of run.
    #[must_use]
    pub fn kicker(mut self, kicker: impl Into<String>) -> Self {
        self.kicker = Some(kicker.into());
        self
    }

    /// Sets one or two sentences below the title: a summary.
    #[must_use]
    pub fn lead(mut self, lead: impl Into<String>) -> Self {
        self.lead = Some(lead.into());
        self
    }

    /// Adds a key figure.
    #[must_use]
    pub fn key_figure(mut self, key_figure: KeyFigure) -> Self {
        self.key_figures.push(key_figure);
        self
    }

    /// Sets a picture beside the title.
    #[must_use]
    pub fn cover(mut self, cover: Figure) -> Self {
        self.cover = Some(cover);
        self
    }

    /// Adds a section.
    #[must_use]
    pub fn section(mut self, section: Section) -> Self {
        self.sections.push(section);
        self
    }

    /// Adds a footer in small print.
    #[must_use]
    pub fn footer(mut self, footer: impl Into<String>) -> Self {
        self.footer = Some(footer.into());
        self
    }

    /// The page as HTML. The same report gives the same bytes.
    ///
    /// Photos are compressed so that the page is smaller than about 4 MB, if possible.
    ///
    /// # Errors
    /// [`ReportError::PictureSize`] and [`ReportError::Jpeg`] if a picture cannot be encoded.
    pub fn to_html(&self) -> Result<String, ReportError> {
        let has_photo =
            self.cover.as_ref().is_some_and(Figure::is_photo) || self.sections.iter().any(Section::has_photo);
        let mut html = self.render(QUALITIES[0])?;
        for quality in QUALITIES.into_iter().skip(1) {
            if html.len() <= PAGE_BYTES || !has_photo {
                break;
            }
            html = self.render(quality)?;
        }
        Ok(html)
    }

    /// Writes the page to `folder/index.html` and returns that path; a missing folder is created.
    ///
    /// An existing page is kept until the new one is complete.
    ///
    /// # Errors
    /// The errors of [`Report::to_html`]; [`ReportError::Folder`] and [`ReportError::File`] if the folder or the file
    /// cannot be created.
    pub fn write(&self, folder: &Path) -> Result<PathBuf, ReportError> {
        let html = self.to_html()?;
        std::fs::create_dir_all(folder).map_err(|source| ReportError::Folder { path: folder.to_owned(), source })?;
        let path = folder.join("index.html");
        sdg_files::write_atomically(&path, html.as_bytes())?;
        Ok(path)
    }

    fn render(&self, quality: PhotoQuality) -> Result<String, ReportError> {
        let ids = self.section_ids();
        let mut html = format!("{HEAD_START}<title>{}</title><style>{STYLE}</style></head><body>", escape(&self.title));
        html += "<header class=\"top\"><div class=\"intro\">";
        if let Some(kicker) = &self.kicker {
            html += &format!("<p class=\"kicker\">{GRIPPER}{}</p>", escape(kicker));
        }
        html += &format!("<h1>{}</h1>", escape(&self.title));
        if let Some(lead) = &self.lead {
            html += &format!("<p class=\"lead\">{}</p>", escape(lead));
        }
        html += "</div>";
        if let Some(cover) = &self.cover {
            html += &format!("<div class=\"cover\">{}</div>", cover.to_html(quality)?);
        }
        if !self.key_figures.is_empty() {
            let figures: String = self.key_figures.iter().map(KeyFigure::to_html).collect();
            html += &format!("<dl class=\"glance\" aria-label=\"At a glance\">{figures}</dl>");
        }
        html += "</header>";
        if self.sections.len() > 2 {
            let links: String = self
                .sections
                .iter()
                .zip(&ids)
                .map(|(section, id)| format!("<a href=\"#{id}\">{}</a>", escape(&section.title)))
                .collect();
            html += &format!("<nav aria-label=\"Sections\">{links}</nav>");
        }
        html += "<main>";
        for (section, id) in self.sections.iter().zip(&ids) {
            html += &section.to_html(id, quality)?;
        }
        html += "</main>";
        if let Some(footer) = &self.footer {
            html += &format!("<footer><p>{}</p></footer>", escape(footer));
        }
        Ok(html + "</body></html>\n")
    }

    /// An anchor for each section, from its title; a leading number distinguishes equal titles.
    fn section_ids(&self) -> Vec<String> {
        self.sections.iter().zip(1..).map(|(section, number)| format!("s{number}-{}", slug(&section.title))).collect()
    }
}

/// The security policy forbids the browser to load any external resource, whatever the page contains.
const HEAD_START: &str = "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\">\
<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\
<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; style-src 'unsafe-inline'\">\
<meta name=\"color-scheme\" content=\"light dark\"><link rel=\"icon\" href=\"data:,\">";

/// The icon: two jaws and a part.
const GRIPPER: &str = "<svg class=\"gripper\" viewBox=\"0 0 24 24\" aria-hidden=\"true\">\
<path d=\"M3 5h3v14H3zM18 5h3v14h-3z\"/><path class=\"part\" d=\"M9 12h6\"/></svg>";

const STYLE: &str = include_str!("page.css");

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::chart::{Axis, Chart, Matrix, Series, ShareChart};
    use crate::html_checker::assert_well_formed;
    use crate::section::GallerySize;
    use crate::table::{Cell, Column, Table};
    use image::RgbImage;

    const HOSTILE: &str = "<script src=\"x\">alert('&')</script>";

    fn full_report(text: &str) -> Report {
        let photo = || Figure::photo(RgbImage::new(32, 24)).caption(text).alt(text);
        let chart = Chart::new(text, Axis::new(text), Axis::new(text)).series(Series::new(text, vec![(0.0, 1.0)]));
        let section = Section::new(text)
            .lead(text)
            .paragraph(text)
            .notice(Tone::Warning, text)
            .figure(photo())
            .gallery(GallerySize::Medium, vec![photo()])
            .captioned_gallery(GallerySize::Small, vec![photo(), photo()], text)
            .charts(vec![chart])
            .matrix(Matrix::new(text, [text]).row(text, [1]).caption(text))
            .shares(ShareChart::new(text).reference_name(text).row(text, 50.0, [40.0, 60.0], Some(45.0)).caption(text))
            .table(Table::new(vec![Column::text(text)]).row(vec![Cell::text(text)]).caption(text))
            .facts([(text, text)])
            .command(text);
        Report::new(text)
            .kicker(text)
            .lead(text)
            .key_figure(KeyFigure::new(text, text, text).tone(Tone::Good))
            .cover(photo())
            .section(section.clone())
            .section(section.clone())
            .section(section)
            .footer(text)
    }

    #[test]
    fn every_text_is_escaped_and_the_page_well_formed() {
        let html = full_report(HOSTILE).to_html().unwrap();
        assert_well_formed(&html);
        assert!(!html.contains("<script"));
        assert!(html.matches("&lt;script").count() > 40);
        assert_well_formed(&Report::new("").to_html().unwrap());
    }

    #[test]
    fn nothing_is_fetched_from_anywhere() {
        let html = full_report("text").to_html().unwrap();
        // Base64 may contain text that looks like an address; the rest of the page must not.
        let mut parts = html.split("base64,");
        let mut text = parts.next().unwrap().to_owned();
        text.extend(parts.map(|part| part.split_once('"').unwrap().1));
        for forbidden in ["http:", "https:", "//", "@import", "url(", "<script", "<iframe", "<object"] {
            assert!(!text.contains(forbidden), "{forbidden}");
        }
        for (at, _) in html.match_indices("src=\"").chain(html.match_indices("srcset=\"")) {
            assert!(html[at..].contains("=\"data:image/"), "{}", &html[at..at + 40]);
        }
    }

    #[test]
    fn the_same_report_gives_the_same_bytes() {
        assert_eq!(full_report("a").to_html().unwrap(), full_report("a").to_html().unwrap());
    }

    #[test]
    fn photos_give_way_to_keep_the_page_small() {
        let noise = |seed: u32| {
            RgbImage::from_fn(1280, 960, |x, y| {
                let hash = (x ^ (y << 11) ^ (seed << 22)).wrapping_mul(2_654_435_761).rotate_left(13);
                image::Rgb([(hash >> 3) as u8, (hash >> 11) as u8, (hash >> 19) as u8])
            })
        };
        let report = Report::new("noise")
            .section(Section::new("all").figure(Figure::photo(noise(1))).figure(Figure::photo(noise(2))));
        let unlimited = report.render(QUALITIES[0]).unwrap().len();
        let html = report.to_html().unwrap();
        assert!(unlimited > PAGE_BYTES && html.len() <= PAGE_BYTES, "{unlimited} to {} bytes", html.len());
    }

    #[test]
    fn writing_creates_the_folder_and_replaces_the_page() {
        let folder = tempfile::tempdir().unwrap();
        let nested = folder.path().join("a/b");
        let path = Report::new("first").write(&nested).unwrap();
        assert_eq!(path, nested.join("index.html"));
        Report::new("second").write(&nested).unwrap();
        let html = std::fs::read_to_string(&path).unwrap();
        assert!(html.contains("<title>second</title>"));
        assert_eq!(std::fs::read_dir(&nested).unwrap().count(), 1);
    }

    #[test]
    fn a_folder_that_cannot_be_made_is_an_error_and_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        std::fs::write(&file, b"here first").unwrap();
        let error = Report::new("x").write(&file.join("report")).unwrap_err();
        assert!(matches!(error, ReportError::Folder { .. }), "{error}");
        assert_eq!(std::fs::read(&file).unwrap(), b"here first");
    }
}
