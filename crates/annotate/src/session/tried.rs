//! Pictures to try: adding, accepting as demonstrations, declaring them to be without the part, comparing.

use sdg_demonstration::ModelKind;
use sdg_files::absolute;
use serde::Deserialize;

use super::models::teaching_material;
use super::{MAX_LABEL_CHARS, Session};
use crate::error::{Error, Result};
use crate::marks::Marks;
use crate::names::{file_name, free_name};
use crate::picture::{Picture, extension_of, png};
use crate::project_file::MAX_TRIAL_PICTURES;
use crate::region::Searched;
use crate::session_state::{MarkedPicture, State, TrialPicture};
use crate::teacher::{TaughtModel, TeachRequest};
use crate::views::{ComparedPicture, ImageView, Saved, TrialPictureView, VersionFound};

/// A query whether learning from a picture would help in other pictures.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct HelpQuestion {
    /// Settings of the teaching.
    teaching: TeachRequest,
    /// The marks that the picture would get.
    marks: Marks,
    /// Numbers of the other pictures.
    others: Vec<usize>,
}

impl State {
    /// # Errors
    /// There are as many pictures to try as a session keeps.
    pub(super) fn check_room(&self) -> Result<()> {
        if self.trial_ids().count() < MAX_TRIAL_PICTURES {
            return Ok(());
        }
        Err(Error::TooManyPictures { most: MAX_TRIAL_PICTURES })
    }
}

impl Session {
    /// A picture to try.
    ///
    /// # Errors
    /// Unknown picture.
    pub(crate) fn trial_picture(&self, id: usize) -> Result<TrialPicture> {
        Ok(self.state().trial_picture(id)?.clone())
    }

    /// Adds a picture from the page. It is written to the project's folder for tried pictures or, without a project, to
    /// a temporary folder, unless the project's folder contains it.
    ///
    /// # Errors
    /// The bytes are not a picture, or there are more pictures than a session keeps.
    pub fn add_trial_picture(&self, name: &str, bytes: &[u8]) -> Result<TrialPictureView> {
        self.state().check_room()?;
        let name = name.rsplit(['/', '\\']).next().unwrap_or(name);
        if let Some(id) = self.same_other(name, bytes) {
            return self.add_other_trial(id);
        }
        // The given name is for display; the file gets a safe, unused name.
        let shown: String = name.chars().take(MAX_LABEL_CHARS).collect();
        // The lock is held until the picture is written, so that the next picture gets another name.
        let mut state = self.state();
        let folder = self.uploads(&state);
        std::fs::create_dir_all(&folder).map_err(Error::file(&folder, "cannot make this folder"))?;
        let path = free_name(&folder.join("picture"), &shown, extension_of(bytes));
        sdg_files::write_atomically(&path, bytes)?;
        let picture = Picture::open(&path, self.pixel_frame).map_err(|error| {
            // Invalid pictures are not kept.
            let _ = std::fs::remove_file(&path);
            match error {
                Error::Demonstration { source, .. } => Error::Demonstration { name: shown.clone(), source },
                other => other,
            }
        })?;
        state.trial_pictures.push(TrialPicture::new(Picture { name: shown, ..picture }, true));
        state.save_project()?;
        let id = state.trial_pictures.len() - 1;
        Ok(state.trial_picture_view(id))
    }

    /// Declares that the part is not in a tried picture, which becomes a negative of the next teaching; or revokes the
    /// declaration.
    ///
    /// # Errors
    /// Unknown picture, the picture is a demonstration, or the project cannot be written.
    pub fn set_absent(&self, trial_id: usize, is_absent: bool) -> Result<TrialPictureView> {
        let mut state = self.state();
        state.trial_picture(trial_id)?;
        if state.became(trial_id).is_some() {
            return Err(Error::Busy("this picture is a demonstration: remove that first"));
        }
        let trial = &mut state.trial_pictures[trial_id];
        trial.is_absent = is_absent;
        if is_absent {
            trial.missing_photo = None;
        }
        state.save_project()?;
        Ok(state.trial_picture_view(trial_id))
    }

    /// Removes a picture to try from the session. Its file is kept.
    ///
    /// # Errors
    /// Unknown picture, or the project cannot be written.
    pub fn remove_trial_picture(&self, id: usize) -> Result<()> {
        let mut state = self.state();
        state.trial_picture(id)?;
        state.trial_pictures[id].is_removed = true;
        state.save_project()
    }

    /// Restores a picture to try that was removed in this session.
    ///
    /// # Errors
    /// Unknown picture, more pictures than a session keeps, or the project cannot be written.
    pub fn put_back_trial_picture(&self, id: usize) -> Result<()> {
        let mut state = self.state();
        state.check_room()?;
        let count = state.trial_pictures.len();
        state.trial_pictures.get_mut(id).ok_or(Error::NoSuchPicture { id, count })?.is_removed = false;
        state.save_project()
    }

    /// The detections of two model versions in every picture to try, in the current search region.
    ///
    /// # Errors
    /// Unknown version, a version's file cannot be read, or a version cannot search the region.
    pub fn compare_versions(&self, one: usize, other: usize) -> Result<Vec<ComparedPicture>> {
        let (models, pictures, region) = {
            let state = self.state();
            let read = |id: usize| Ok::<_, Error>((state.models.read(id)?, state.models.get(id)?.summary.clone()));
            let tried = |id: usize| (id, state.trial_pictures[id].clone(), state.became(id).is_some());
            let pictures: Vec<_> = state.trial_ids().map(tried).collect();
            ([read(one)?, read(other)?], pictures, state.region)
        };
        let searched = Some(Searched::of(region));
        let [one, other] =
            models.map(|(bytes, summary)| self.teacher.open(&bytes, &summary, searched).map_err(Error::Teacher));
        let models = [one?, other?];
        let compare = |trial: &TrialPicture| {
            let pixels = trial.picture.pixels()?;
            let found = |model: &dyn TaughtModel| {
                let found = model.detect(&pixels).map_err(Error::Teacher)?;
                let best = found.iter().map(|one| one.score).fold(0.0, f64::max);
                let accepted = found.iter().filter(|one| one.is_accepted);
                let marks = |one| Marks { outline: None, ..Marks::of_found(one, trial.picture.size) };
                let accepted = accepted.map(marks).collect();
                Ok::<_, Error>(VersionFound { best, accepted })
            };
            Ok::<_, Error>([found(&*models[0])?, found(&*models[1])?])
        };
        let compared = pictures.into_iter().map(|(id, trial, is_demonstration)| {
            let is_there = if trial.is_absent { Some(false) } else { is_demonstration.then_some(true) };
            // A picture that cannot be searched, as one of another size, does not prevent the comparison in the others.
            let (found, failed) = match compare(&trial) {
                Ok(found) => (Some(found), None),
                Err(error) => (None, Some(error.to_string())),
            };
            ComparedPicture { id, name: trial.picture.name, is_there, found, failed }
        });
        Ok(compared.collect())
    }

    /// Teaches model S from the demonstrations and, in addition, a tried picture. Returns the model's best score in
    /// each of the given other tried pictures. Nothing is kept. `None` while a teaching is running, because the model
    /// of that teaching may answer the question.
    ///
    /// # Errors
    /// Another model than S; an unknown picture; insufficient marks.
    pub(crate) fn would_help(&self, trial_id: usize, question: HelpQuestion) -> Result<Option<Vec<(usize, f64)>>> {
        let HelpQuestion { teaching, marks, others } = question;
        teaching.check()?;
        if teaching.model != ModelKind::S {
            let found = teaching.model.letter().to_string();
            return Err(Error::Request { what: "model", expected: "S, which is taught in a second".into(), found });
        }
        if self.check_idle().is_err() {
            return Ok(None);
        }
        let mut demonstrations = self.demonstrations(teaching.model)?;
        let (further, negatives, pictures, region) = {
            let state = self.state();
            let picture = state.trial_picture(trial_id)?.picture.clone();
            let pictures = others.iter().map(|&id| Ok((id, state.trial_picture(id)?.picture.clone())));
            let pictures = pictures.collect::<Result<Vec<_>>>()?;
            let negatives: Vec<Picture> = state.negatives().cloned().collect();
            (MarkedPicture::unsaved(picture, marks).demonstration(&state.label)?, negatives, pictures, state.region)
        };
        demonstrations.push(further);
        let request = TeachRequest { region, ..teaching };
        let material = teaching_material(demonstrations, &negatives)?;
        let model = self.teacher.teach_on_trial(&material, &request).map_err(Error::Teacher)?;
        let best_in = |(id, picture): (usize, Picture)| {
            let found = model.detect(&picture.pixels()?).map_err(Error::Teacher)?;
            Ok((id, found.iter().map(|one| one.score).fold(0.0, f64::max)))
        };
        pictures.into_iter().map(best_in).collect::<Result<_>>().map(Some)
    }

    /// Makes a tried picture a demonstration with these marks, or with those that it has already, unless only the given
    /// ones have a grasp. A picture from the page, or from another folder, is copied beside the first picture under an
    /// unused name: no marks are written into other folders. If the photo that it became was removed, that is restored.
    ///
    /// # Errors
    /// Unknown picture, the picture is a demonstration already, its marks' file is that of another photo or locked by
    /// another process, an Exif orientation rotates a picture of a calibrated camera or it has another size, or a file
    /// cannot be written.
    pub fn accept(&self, trial_id: usize, marks: Marks) -> Result<ImageView> {
        let mut state = self.state();
        let trial = state.trial_picture(trial_id)?.clone();
        if state.became(trial_id).is_some() {
            return Err(Error::Busy("this picture is a demonstration already"));
        }
        let copy = trial.became.map(|id| state.images[id].picture.clone());
        let is_copied = copy.is_some();
        let mut picture = copy.unwrap_or(trial.picture);
        picture.check_is_markable()?;
        picture.check_size(state.photo_size)?;
        let is_elsewhere = || absolute(&picture.path).parent() != absolute(&self.home).parent();
        if !is_copied && (trial.uploaded || is_elsewhere()) {
            let extension = picture.path.extension().unwrap_or_default().to_string_lossy();
            let target = free_name(&self.home, &picture.name, &extension);
            let bytes = std::fs::read(&picture.path).map_err(Error::file(&picture.path, "cannot read"))?;
            sdg_files::write_atomically(&target, &bytes)?;
            picture.name = file_name(&target);
            picture.path = target;
        }
        self.lock_marks(&mut state, &picture.path)?;
        let id = state.add_image(picture, marks)?;
        let trial = &mut state.trial_pictures[trial_id];
        (trial.became, trial.missing_photo, trial.is_absent) = (Some(id), None, false);
        self.settle_place(&mut state, id)?;
        if !matches!(state.images[id].saved, Saved::Written { .. }) {
            state.save(id);
        }
        state.save_project()?;
        Ok(state.image_view(id))
    }

    /// Makes a shown frame a picture to try.
    ///
    /// # Errors
    /// No camera, the frame is no longer kept, or there are more pictures than a session keeps.
    pub fn keep_frame(&self, number: u64) -> Result<TrialPictureView> {
        let bytes = png(&*self.live_desk()?.frame(number)?)?;
        self.add_trial_picture(&format!("live-{number}.png"), &bytes)
    }
}
