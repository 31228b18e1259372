//! Runs a model on all pictures of a folder.

use anyhow::{Result, anyhow};
use sdg_cell::{CellError, Perception};
use sdg_grasp::{GraspError, Verification};

use super::folder::LabelledFolder;
use super::page::in_words;
use super::picture::LeftOut;
use super::score::{Tested, judge};
use crate::progress::Progress;

/// The pictures of a folder with their detections.
#[derive(Debug)]
pub struct TestedFolder {
    pub tested: Vec<Tested>,
    /// Files of the folder that are left out.
    pub left_out: Vec<LeftOut>,
    /// Number of instances with labels of other objects.
    pub others: usize,
    /// See [`LabelledFolder::foreign_label`].
    pub foreign_label: Option<String>,
    /// Whether the test was interrupted; the remaining pictures are then left out.
    pub is_interrupted: bool,
}

impl LabelledFolder {
    /// Searches the pictures in order, until `is_interrupted` returns true. If the model has a region, pictures of
    /// another size than the one for which the region is given are left out. `min_score` is used only in the reports of
    /// progress.
    ///
    /// # Errors
    /// A picture cannot be read, or detection fails; or no picture was searched.
    pub fn test(
        self,
        detector: &Perception,
        verification: Verification,
        min_score: f64,
        is_interrupted: &dyn Fn() -> bool,
        progress: &dyn Progress,
    ) -> Result<TestedFolder> {
        let Self { pictures, mut left_out, others, foreign_label } = self;
        progress.expect(pictures.len());
        let mut tested = Vec::with_capacity(pictures.len());
        let (mut was_interrupted, mut refusal) = (false, None);
        for picture in pictures {
            let name = picture.name();
            was_interrupted |= is_interrupted();
            if was_interrupted {
                left_out.push(LeftOut { file: name, why: "the test was interrupted".to_owned() });
                continue;
            }
            let of_picture = match Tested::detect(picture, detector, verification) {
                Ok(of_picture) => of_picture,
                // The model's region is for pictures of a different size.
                Err(error) if matches!(error.downcast_ref(), Some(CellError::Grasp(GraspError::Region(_)))) => {
                    left_out.push(LeftOut { file: name, why: error.root_cause().to_string() });
                    refusal = Some(error);
                    continue;
                }
                Err(error) => return Err(error),
            };
            let judged = judge(&of_picture, min_score);
            progress.unit_done(&format!("{}: {}", of_picture.picture.name(), in_words(&of_picture, &judged)));
            tested.push(of_picture);
        }
        if tested.is_empty() {
            return Err(match refusal {
                Some(refusal) => refusal.context("no picture can be searched"),
                None => anyhow!("interrupted before a picture was searched"),
            });
        }
        Ok(TestedFolder { tested, left_out, others, foreign_label, is_interrupted: was_interrupted })
    }
}
