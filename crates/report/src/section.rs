//! A section of the page: its blocks, and their HTML.

use crate::chart::{Chart, Matrix, ShareChart};
use crate::error::ReportError;
use crate::figure::{Figure, PhotoQuality};
use crate::html::escape;
use crate::table::{Table, Tone};

/// Width of the pictures in a gallery.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GallerySize {
    /// Many per row, for samples.
    Small,
    /// About three per row, for detections.
    Medium,
    /// Two per row.
    Large,
}

#[derive(Debug, Clone)]
enum Block {
    Paragraph(String),
    Notice(Tone, String),
    Figure(Figure),
    Gallery(GallerySize, Vec<Figure>, Option<String>),
    Charts(Vec<Chart>),
    Matrix(Matrix),
    Shares(ShareChart),
    Table(Table),
    Facts(Vec<(String, String)>),
    Command(String),
}

/// A part of the page with its own heading.
#[derive(Debug, Clone)]
pub struct Section {
    pub(crate) title: String,
    lead: Option<String>,
    blocks: Vec<Block>,
}

impl Section {
    /// An empty section.
    #[must_use]
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), lead: None, blocks: Vec::new() }
    }

    /// Sets one or two sentences below the heading: a description of the section.
    #[must_use]
    pub fn lead(mut self, lead: impl Into<String>) -> Self {
        self.lead = Some(lead.into());
        self
    }

    /// Adds a paragraph.
    #[must_use]
    pub fn paragraph(self, text: impl Into<String>) -> Self {
        self.with(Block::Paragraph(text.into()))
    }

    /// Adds a highlighted paragraph.
    #[must_use]
    pub fn notice(self, tone: Tone, text: impl Into<String>) -> Self {
        self.with(Block::Notice(tone, text.into()))
    }

    /// Adds a picture in its own row.
    #[must_use]
    pub fn figure(self, figure: Figure) -> Self {
        self.with(Block::Figure(figure))
    }

    /// Adds pictures side by side, which wrap at the screen's width.
    #[must_use]
    pub fn gallery(self, size: GallerySize, figures: Vec<Figure>) -> Self {
        self.with(Block::Gallery(size, figures, None))
    }

    /// Adds pictures side by side with a common caption.
    #[must_use]
    pub fn captioned_gallery(self, size: GallerySize, figures: Vec<Figure>, caption: impl Into<String>) -> Self {
        self.with(Block::Gallery(size, figures, Some(caption.into())))
    }

    /// Adds charts, two per row if there is room.
    #[must_use]
    pub fn charts(self, charts: Vec<Chart>) -> Self {
        self.with(Block::Charts(charts))
    }

    /// Adds a matrix of counts.
    #[must_use]
    pub fn matrix(self, matrix: Matrix) -> Self {
        self.with(Block::Matrix(matrix))
    }

    /// Adds fractions with their intervals.
    #[must_use]
    pub fn shares(self, shares: ShareChart) -> Self {
        self.with(Block::Shares(shares))
    }

    /// Adds a table.
    #[must_use]
    pub fn table(self, table: Table) -> Self {
        self.with(Block::Table(table))
    }

    /// Adds facts, which are pairs of a name and a value: seed, preset, machine, versions.
    #[must_use]
    pub fn facts<K: Into<String>, V: Into<String>>(self, facts: impl IntoIterator<Item = (K, V)>) -> Self {
        self.with(Block::Facts(facts.into_iter().map(|(name, value)| (name.into(), value.into())).collect()))
    }

    /// Adds a command line for copying.
    #[must_use]
    pub fn command(self, command: impl Into<String>) -> Self {
        self.with(Block::Command(command.into()))
    }

    fn with(mut self, block: Block) -> Self {
        self.blocks.push(block);
        self
    }

    pub(crate) fn has_photo(&self) -> bool {
        self.blocks.iter().any(Block::has_photo)
    }

    pub(crate) fn to_html(&self, id: &str, quality: PhotoQuality) -> Result<String, ReportError> {
        let mut html = format!("<section id=\"{id}\"><header><h2>{}</h2>", escape(&self.title));
        if let Some(lead) = &self.lead {
            html += &format!("<p>{}</p>", escape(lead));
        }
        html += "</header><div class=\"content\">";
        for block in &self.blocks {
            html += &block.to_html(quality)?;
        }
        Ok(html + "</div></section>")
    }
}

impl Block {
    fn to_html(&self, quality: PhotoQuality) -> Result<String, ReportError> {
        Ok(match self {
            Self::Paragraph(text) => format!("<p>{}</p>", escape(text)),
            Self::Notice(tone, text) => format!("<p class=\"notice {}\">{}</p>", tone.class(), escape(text)),
            Self::Figure(figure) => figure.to_html(quality)?,
            Self::Gallery(size, figures, caption) => {
                let (class, max_width) = match size {
                    GallerySize::Small => ("small", 360),
                    GallerySize::Medium => ("medium", 640),
                    GallerySize::Large => ("large", 900),
                };
                let quality = PhotoQuality { max_width: quality.max_width.min(max_width), ..quality };
                let mut html = format!("<div class=\"gallery {class}\">");
                for figure in figures {
                    html += &figure.to_html(quality)?;
                }
                html += "</div>";
                if let Some(caption) = caption {
                    html += &format!("<p class=\"caption\">{}</p>", escape(caption));
                }
                html
            }
            Self::Charts(charts) => {
                let class = if charts.len() == 1 { "charts one" } else { "charts" };
                let charts: String = charts.iter().map(Chart::to_html).collect();
                format!("<div class=\"{class}\">{charts}</div>")
            }
            Self::Matrix(matrix) => format!("<div class=\"charts one\">{}</div>", matrix.to_html()),
            Self::Shares(shares) => format!("<div class=\"charts one\">{}</div>", shares.to_html()),
            Self::Table(table) => table.to_html(),
            Self::Facts(facts) => {
                let facts: String = facts
                    .iter()
                    .map(|(name, value)| format!("<div><dt>{}</dt><dd>{}</dd></div>", escape(name), escape(value)))
                    .collect();
                format!("<dl class=\"facts\">{facts}</dl>")
            }
            Self::Command(command) => {
                format!("<pre tabindex=\"0\"><code>{}</code></pre>", escape(command))
            }
        })
    }

    fn has_photo(&self) -> bool {
        match self {
            Self::Figure(figure) => figure.is_photo(),
            Self::Gallery(_, figures, _) => figures.iter().any(Figure::is_photo),
            _ => false,
        }
    }
}
