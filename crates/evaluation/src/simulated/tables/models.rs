//! Tables of the models: their structure, the cost of teaching them, and failed teaching runs.

use sdg_grasp::ModelKind;
use sdg_report::{Cell, Column, Table};

use super::titled::{Titled, number};
use crate::simulated::paper;
use crate::simulated::records::TeachingRecord;
use crate::simulated::summary::{ModelSummary, Summary};

/// The costs of a model, as in the paper's Table II.
pub(super) fn costs(summary: &Summary) -> Titled {
    let mut table = Table::new(vec![
        Column::text("model"),
        Column::text("samples").group("ours"),
        Column::text("teaching, min:s").group("ours"),
        Column::number("size").unit("MB").group("ours"),
        Column::number("images per second").group("ours"),
        Column::text("samples").group("paper"),
        Column::text("training, min:s").group("paper"),
        Column::text("size, MB").group("paper"),
        Column::text("images per second").group("paper"),
    ]);
    for model in &summary.models {
        let paper = paper::row(model.model);
        let paper_cell = |pick: fn(&paper::PaperRow) -> &'static str| Cell::text(paper.as_ref().map_or("–", pick));
        table = table.row(vec![
            Cell::text(model.model.letter()),
            Cell::text(samples(model)),
            Cell::text(model.teaching_secs.map_or("–".to_owned(), minutes)),
            number(model.largest_bytes.map(|bytes| bytes as f64 / 1e6), 2),
            number(model.verified.frames_per_second, 1),
            paper_cell(|row| row.samples),
            paper_cell(|row| row.teaching),
            paper_cell(|row| row.size),
            paper_cell(|row| row.frames_per_second),
        ]);
    }
    let jobs = summary.cells.iter().find_map(|cell| match cell.teaching {
        Some(TeachingRecord::Taught { jobs, .. }) => Some(jobs),
        _ => None,
    });
    let mut lead = "Table II of the paper. Samples and teaching are medians over the parts".to_owned();
    if let Some(jobs) = jobs.filter(|jobs| *jobs > 1) {
        lead += &format!(", each teaching with {jobs} units of work in parallel on the same cores");
    }
    lead += &format!(
        "; images per second are with the check, without other load on the machine. The paper's times and speeds are \
         for a GTX 1080 Ti; on a CPU its model C reaches {} images per second.",
        paper::CPU_FRAMES_PER_SECOND
    );
    if let Some(shared) = shared_networks(summary) {
        lead += &format!(" {shared}");
    }
    Titled { title: "Teaching, size and speed".to_owned(), lead, table }
}

/// A sentence on models that use the same network.
fn shared_networks(summary: &Summary) -> Option<String> {
    let sharing: Vec<String> = summary
        .models
        .iter()
        .filter(|model| model.network != model.model)
        .map(|model| format!("{} reads the network taught for {}, which is taught once", model.model, model.network))
        .collect();
    (!sharing.is_empty()).then(|| format!("{}.", sharing.join("; ")))
}

/// The models, as in the paper's Table I.
pub(super) fn models(summary: &Summary) -> Titled {
    let mut table = Table::new(vec![
        Column::text("model"),
        Column::text("network").group("position"),
        Column::text("output").group("position"),
        Column::text("network").group("angle"),
        Column::text("method").group("angle"),
        Column::text("human input"),
    ]);
    for model in &summary.models {
        let [network, output, turn_network, method, input] = description(model.model);
        table = table.row([model.model.letter(), network, output, turn_network, method, input].map(Cell::text).into());
    }
    Titled {
        title: "Models".to_owned(),
        lead: format!(
            "Table I of the paper. Preset {}; networks of preset edge start from weights pretrained on generated parts. The \
             check uses a drawn outline, too.",
            summary.settings.preset
        ),
        table,
    }
}

/// Network and output for the position, network and method for the angle, and the human input.
fn description(model: ModelKind) -> [&'static str; 5] {
    match model {
        ModelKind::A => ["Faster R-CNN", "box", "CNN on the box's crop", "classes of the angle", "box, grasp line"],
        ModelKind::B => ["Keypoint R-CNN", "box", "the same", "line through twelve keypoints", "box, grasp line"],
        ModelKind::C => {
            ["Keypoint R-CNN", "twelve keypoints", "the same", "line through twelve keypoints", "box, grasp line"]
        }
        ModelKind::D => ["Mask R-CNN", "mask", "the same", "mask and SIFT", "outline, grasp line"],
        ModelKind::S => {
            ["none", "position and angle", "none", "demonstration searched for over all poses", "outline, grasp line"]
        }
    }
}

/// Teaching runs that gave no model.
pub(super) fn not_taught(summary: &Summary) -> Titled {
    let mut table = Table::new(vec![Column::text("part"), Column::text("model"), Column::text("why")]);
    for cell in &summary.cells {
        if let Some(TeachingRecord::Failed { why }) = &cell.teaching {
            table =
                table.row([cell.object.replace('_', " "), cell.model.to_string(), why.clone()].map(Cell::text).into());
        }
    }
    Titled {
        title: "Not taught".to_owned(),
        lead: "Teachings that gave no model. All their attempts count as failed.".to_owned(),
        table,
    }
}

/// Number of samples for the detector, and of crops for the orientation CNN if there is one.
fn samples(model: &ModelSummary) -> String {
    match (model.samples, model.crops) {
        (Some(samples), Some(crops)) => format!("{samples:.0} + {crops:.0}"),
        (Some(samples), None) => format!("{samples:.0}"),
        (None, _) => "–".to_owned(),
    }
}

/// Minutes and seconds in the paper's notation.
fn minutes(secs: f64) -> String {
    let secs = secs.round() as u64;
    if secs == 0 { "under 0:01".to_owned() } else { format!("{}:{:02}", secs / 60, secs % 60) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_model_is_described() {
        for model in ModelKind::ALL {
            assert_eq!(description(model)[0] == "none", !model.has_network());
        }
    }
}
