//! What a session holds: the object's name, its pictures with their marks, and the pictures to try.

use std::path::PathBuf;

use sdg_demonstration::{Annotation, Demonstration, ImageFacts};

use crate::advice::advise;
use crate::annotation_file;
use crate::error::{Error, Result};
use crate::marks::Marks;
use crate::names::file_name;
use crate::picture::Picture;
use crate::views::{ImageView, Saved, TrialPictureView};

/// The present label, the pictures of the object and the pictures to try, each numbered by its place.
pub struct State {
    pub label: String,
    pub images: Vec<MarkedPicture>,
    pub trial_pictures: Vec<TrialPicture>,
}

/// A picture of the object and what is marked on it.
#[derive(Clone)]
pub struct MarkedPicture {
    pub picture: Picture,
    pub marks: Marks,
    pub file: PathBuf,
    pub note: Option<String>,
    pub saved: Saved,
}

/// A picture that a taught model is tried on.
#[derive(Clone)]
pub struct TrialPicture {
    pub picture: Picture,
    pub uploaded: bool,
    /// The number of the marked picture that it became.
    pub became: Option<usize>,
}

impl State {
    pub fn image(&self, id: usize) -> Result<&MarkedPicture> {
        self.images.get(id).ok_or(Error::NoSuchPicture { id, count: self.images.len() })
    }

    pub fn trial_picture(&self, id: usize) -> Result<&TrialPicture> {
        self.trial_pictures.get(id).ok_or(Error::NoSuchPicture { id, count: self.trial_pictures.len() })
    }

    /// Adds a picture with marks that are not saved yet, and says its number.
    pub fn add_image(&mut self, picture: Picture, marks: Marks) -> Result<usize> {
        let opened = annotation_file::open(&picture.path, None, picture.size)?;
        let (file, note) = (opened.path, opened.note);
        self.images.push(MarkedPicture { picture, marks, file, note, saved: Saved::Nothing });
        Ok(self.images.len() - 1)
    }

    pub fn save(&mut self, id: usize) {
        let MarkedPicture { picture, marks, file, .. } = &self.images[id];
        let written = annotation_file::save(file, marks, &self.label, &picture.name, picture.size);
        self.images[id].saved = match written {
            Ok(true) => Saved::Written { file: file_name(&self.images[id].file) },
            Ok(false) => Saved::Nothing,
            Err(error) => Saved::Refused { why: error.to_string() },
        };
    }

    pub fn image_view(&self, id: usize) -> ImageView {
        let MarkedPicture { picture, marks, note, saved, .. } = &self.images[id];
        let Picture { name, size: [width, height], .. } = picture.clone();
        let advice = advise(marks, picture.size);
        ImageView { id, name, width, height, marks: marks.clone(), saved: saved.clone(), advice, note: note.clone() }
    }

    pub fn trial_picture_view(&self, id: usize) -> TrialPictureView {
        let TrialPicture { picture, became, .. } = &self.trial_pictures[id];
        let Picture { name, size: [width, height], .. } = picture.clone();
        TrialPictureView { id, name, width, height, became: *became }
    }
}

impl MarkedPicture {
    /// The picture with its marks, as teaching takes it.
    ///
    /// # Errors
    /// Nothing marked on it, or marks that cannot be taught.
    pub fn demonstration(&self, label: &str) -> Result<Demonstration> {
        let Self { picture, marks, .. } = self;
        let [width, height] = picture.size;
        let facts = ImageFacts { width, height, file_name: Some(&picture.name) };
        let complain = |source| Error::Demonstration { name: picture.name.clone(), source };
        let coco = marks.to_coco(label, &facts).map_err(complain)?;
        let mut objects = Annotation::read(coco.as_bytes(), &facts).map_err(complain)?;
        // A file without an object is refused on reading, so there is one.
        Ok(Demonstration { image: picture.pixels()?, annotation: objects.remove(0) })
    }
}
