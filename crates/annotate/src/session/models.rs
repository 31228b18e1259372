//! The models of a session: teaching, versions, and the searched region.

use std::sync::Arc;

use sdg_demonstration::{Demonstration, ModelKind};

use super::{Session, locked, model_path};
use crate::error::{Error, Result};
use crate::model_versions::{Version, now_secs};
use crate::picture::Picture;
use crate::region::{Region, Searched};
use crate::teacher::{TaughtModel, TeachRequest, TeachingMaterial};
use crate::teaching::News;

/// The inputs of a teaching, with the negatives' pixels.
///
/// # Errors
/// A picture cannot be read.
pub(super) fn teaching_material(demonstrations: Vec<Demonstration>, negatives: &[Picture]) -> Result<TeachingMaterial> {
    let negative_names = negatives.iter().map(|picture| picture.name.clone()).collect();
    let negatives = negatives.iter().map(Picture::pixels).collect::<Result<_>>()?;
    Ok(TeachingMaterial { demonstrations, negatives, negative_names })
}

impl Session {
    /// Makes a version the model in use, and copies it to the model's file. It searches the page's region, if it can.
    ///
    /// # Errors
    /// Unknown version, its file cannot be read, a file cannot be written, or a teaching is running.
    pub fn use_version(&self, id: usize) -> Result<()> {
        // With the lock, so that a teaching that begins now gets the region that is in use then.
        let mut state = self.state();
        self.teaching.check_idle()?;
        let path = model_path(self.model_path.as_deref(), &self.home, &state)?;
        let summary = state.models.get(id)?.summary.clone();
        let bytes = state.models.read(id)?;
        let open = |searched| self.teacher.open(&bytes, &summary, searched);
        // The part of this version may not fit into the page's region; then the version's own applies.
        let opened = open(Some(Searched::of(state.region))).or_else(|_| open(None));
        let model = opened.map_err(Error::Teacher)?;
        state.models.use_version(&path, id)?;
        state.region = model.region();
        state.is_model_lost = false;
        self.teaching.set_model(Arc::from(model));
        state.save_project()
    }

    /// Restricts the search to a region, for the model in use and for models taught later; `None` for the whole
    /// picture.
    ///
    /// # Errors
    /// The region is invalid, the model cannot search it, or (without a model) the marked part does not fit into it; a
    /// teaching is running; the project cannot be written.
    pub fn set_region(&self, region: Option<Region>) -> Result<()> {
        self.teaching.check_idle()?;
        if let Some(region) = &region {
            region.check()?;
        }
        if let Ok(model) = self.teaching.model() {
            model.look_in(region).map_err(Error::Teacher)?;
        } else if let Some(region) = &region {
            self.check_fits(region)?;
        }
        let mut state = self.state();
        // A teaching that began in the meantime has the previous region.
        if let Err(busy) = self.teaching.check_idle() {
            let previous = state.region;
            drop(state);
            if let Ok(model) = self.teaching.model() {
                model.look_in(previous).map_err(Error::Teacher)?;
            }
            return Err(busy);
        }
        state.region = region;
        state.save_project()
    }

    /// Whether the part on all marked photos fits into a region.
    fn check_fits(&self, region: &Region) -> Result<()> {
        let (label, marked) = {
            let state = self.state();
            let marked: Vec<_> = state.image_ids().map(|id| state.images[id].clone()).collect();
            (state.label.clone(), marked)
        };
        // Incomplete marks are skipped.
        let demonstrations: Vec<_> = marked.iter().filter_map(|image| image.demonstration(&label).ok()).collect();
        if demonstrations.is_empty() {
            return Ok(());
        }
        self.teacher.check_region(region, &demonstrations).map_err(Error::Teacher)
    }

    /// Starts teaching from all marked pictures; [`teaching_news`](Self::teaching_news) gives the progress.
    ///
    /// # Errors
    /// An invalid request, a running teaching, insufficient marks, or a picture without the part that has another size
    /// than those of the calibrated camera.
    pub fn start_teaching(&self, request: TeachRequest) -> Result<News> {
        request.check()?;
        let preparation = self.teaching.prepare(request.model)?;
        // The pictures are decoded without the lock: marks that change meanwhile make the model stale.
        let (marked, label, negatives, fingerprint, region, heights_m) = {
            let state = self.state();
            let negatives: Vec<_> = state.negatives().cloned().collect();
            negatives.iter().try_for_each(|picture| picture.check_size(state.photo_size))?;
            let marked = state.demonstrated(request.model)?;
            (marked, state.label.clone(), negatives, state.material(), state.region, state.heights_m)
        };
        let request = TeachRequest { region, ..request };
        let demonstrations = marked.iter().map(|image| image.demonstration(&label)).collect::<Result<Vec<_>>>()?;
        let [photos, num_negatives] = [demonstrations.len(), negatives.len()];
        let material = teaching_material(demonstrations, &negatives)?;
        let (symmetry, fixed_height) = (Some(request.symmetry), Some(request.fixed_height));
        let state = Arc::clone(&self.state);
        let (given_path, home) = (self.model_path.clone(), self.home.clone());
        let keep = move |model: &dyn TaughtModel| {
            let bytes = model.to_bytes().map_err(Error::Teacher)?;
            let version = Version {
                file: String::new(),
                taught_secs: now_secs(),
                summary: model.summary(),
                photos,
                negatives: num_negatives,
                material: fingerprint,
                symmetry,
                fixed_height,
                heights_m,
            };
            let mut state = locked(&state);
            // The part may have been renamed during the teaching.
            let path = model_path(given_path.as_deref(), &home, &state)?;
            state.models.keep(&path, &bytes, version)?;
            state.is_model_lost = false;
            state.save_project()?;
            Ok(path)
        };
        Ok(preparation.start(Arc::clone(&self.teacher), request, material, keep))
    }

    /// # Errors
    /// A teaching is running.
    pub(crate) fn check_idle(&self) -> Result<()> {
        self.teaching.check_idle()
    }

    /// State of the teaching, for the page.
    pub fn teaching_news(&self) -> News {
        self.teaching.news()
    }

    /// Asks a running teaching to end with its current result.
    pub fn stop_teaching(&self) {
        self.teaching.stop();
    }

    /// The model in use: the one taught last, or a version read from its file.
    ///
    /// # Errors
    /// [`Error::NotTaught`].
    pub fn taught_model(&self) -> Result<Arc<dyn TaughtModel>> {
        self.teaching.model()
    }

    /// The demonstrations for teaching `model`. Pictures without any mark are left out.
    ///
    /// # Errors
    /// No picture is marked, or a picture has marks but lacks some that `model` needs.
    pub fn demonstrations(&self, model: ModelKind) -> Result<Vec<Demonstration>> {
        let (label, marked) = {
            let state = self.state();
            (state.label.clone(), state.demonstrated(model)?)
        };
        marked.iter().map(|image| image.demonstration(&label)).collect()
    }
}
