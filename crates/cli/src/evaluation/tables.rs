//! The paper's two tables for this project, and those that say more; as Markdown here, on the page by the same rows.

use sdg_grasp::ModelKind;
use sdg_report::{Cell, Column, Step, Table, Tone};

use super::paper;
use super::records::{AttemptRecord, TeachingRecord};
use super::statistics::Share;
use super::summary::{Figures, ModelSummary, Summary};
use crate::trial::{RIGHT_DEGREES, RIGHT_MM};

/// A table under its heading.
pub struct Titled {
    /// The heading.
    pub title: String,
    /// What is to be seen, in a sentence or two.
    pub lead: String,
    /// The rows.
    pub table: Table,
}

/// All tables, the most important first.
pub fn tables(summary: &Summary) -> Vec<Titled> {
    let mut tables = vec![
        results(summary),
        by_part(summary),
        failures(summary),
        accuracy(summary),
        false_alarms(summary),
        models(summary),
        cells(summary),
    ];
    if summary.cells.iter().any(|cell| matches!(cell.teaching, Some(TeachingRecord::Failed { .. }))) {
        tables.push(not_taught(summary));
    }
    tables
}

/// The tables as a document of their own; `facts` are what is needed to see the same numbers again.
pub fn markdown(summary: &Summary, facts: &[(&str, String)], command: &str) -> String {
    let mut text = String::from("# Evaluation\n\n");
    if let Some(notice) = notice(summary) {
        text += &format!("**{notice}**\n\n");
    }
    for Titled { title, lead, table } in tables(summary) {
        text += &format!("## {title}\n\n{lead}\n\n{}\n", table.to_markdown());
    }
    text += "## This run\n\n";
    for (name, value) in facts {
        text += &format!("- {name}: {value}\n");
    }
    text + &format!("\n```\n{command}\n```\n")
}

/// What the reader must know before the first number.
pub fn notice(summary: &Summary) -> Option<String> {
    (summary.remaining > 0).then(|| {
        format!("Not complete: {} units of work are still to do. The same command goes on.", summary.remaining)
    })
}

/// The paper's Table II.
fn results(summary: &Summary) -> Titled {
    let mut table = Table::new(vec![
        Column::text("model"),
        Column::text("held"),
        Column::number("success").unit("%"),
        Column::text("95 % interval"),
        Column::number("success, network alone").unit("%"),
        Column::text("samples").group("ours"),
        Column::text("teaching, min:s").group("ours"),
        Column::number("model").unit("MB").group("ours"),
        Column::number("images a second").group("ours"),
        Column::number("success").unit("%").group("paper"),
        Column::text("samples").group("paper"),
        Column::text("training, min:s").group("paper"),
        Column::text("model, MB").group("paper"),
        Column::text("images a second").group("paper"),
    ]);
    for model in &summary.models {
        let figures = &model.verified;
        let paper = paper::row(model.model);
        let said = |pick: fn(&paper::PaperRow) -> &'static str| Cell::text(paper.as_ref().map_or("–", pick));
        table = table.row(vec![
            Cell::text(model.model.letter()),
            share(figures.held, Tone::Plain),
            number(figures.held.percent(), 1),
            Cell::text(interval(figures)),
            number(model.alone.as_ref().and_then(|alone| alone.held.percent()), 1),
            Cell::text(samples(model)),
            Cell::text(model.teaching_secs.map_or("–".to_owned(), minutes)),
            number(model.largest_bytes.map(|bytes| bytes as f64 / 1e6), 1),
            number(figures.frames_per_second, 1),
            number(paper.as_ref().map(|row| row.success_percent), 1),
            said(|row| row.samples),
            said(|row| row.teaching),
            said(|row| row.size),
            said(|row| row.frames_per_second),
        ]);
    }
    let jobs = summary.cells.iter().find_map(|cell| match cell.teaching {
        Some(TeachingRecord::Taught { jobs, .. }) => Some(jobs),
        _ => None,
    });
    let mut lead = format!(
        "Table II of the paper. {} grasp attempts on each part from random poses, robot starts, lights and things lying \
         about, the same for every model; held means hanging between both fingers one second after lifting. Samples and \
         teaching are medians over the parts",
        summary.settings.attempts
    );
    lead += &match jobs {
        Some(jobs) if jobs > 1 => format!(", each teaching with {jobs} units of work side by side on the same cores"),
        _ => String::new(),
    };
    lead += &format!(
        "; images a second with the machine to itself. The paper's times and speeds are a GTX 1080 Ti's; on a CPU its \
         model C reaches {} images a second.",
        paper::CPU_FRAMES_PER_SECOND
    );
    if let Some(shared) = shared_networks(summary) {
        lead += &format!(" {shared}");
    }
    Titled { title: "Results".to_owned(), lead, table }
}

/// Which models are readings of one network, in a sentence.
fn shared_networks(summary: &Summary) -> Option<String> {
    let sharing: Vec<String> = summary
        .models
        .iter()
        .filter(|model| model.network != model.model)
        .map(|model| format!("{} reads the network taught for {}, which is taught once", model.model, model.network))
        .collect();
    (!sharing.is_empty()).then(|| format!("{}.", sharing.join("; ")))
}

/// Success of each model on each part.
fn by_part(summary: &Summary) -> Titled {
    let mut columns = vec![Column::text("part")];
    columns.extend(summary.models.iter().map(|model| Column::text(model.model.letter())));
    let mut table = Table::new(columns);
    let mut objects: Vec<&str> = Vec::new();
    for cell in &summary.cells {
        if !objects.contains(&cell.object.as_str()) {
            objects.push(&cell.object);
        }
    }
    for object in objects {
        let mut row = vec![Cell::text(object.replace('_', " "))];
        row.extend(summary.models.iter().map(|model| {
            let cell = summary.cells.iter().find(|cell| cell.model == model.model && cell.object == object);
            let held = cell.map_or(Share::default(), |cell| cell.verified.held);
            let tone = match held.percent() {
                Some(percent) if percent >= 95.0 => Tone::Good,
                Some(percent) if percent < 80.0 => Tone::Bad,
                _ => Tone::Warning,
            };
            share(held, tone)
        }));
        table = table.row(row);
    }
    let mut all = vec![Cell::text("all")];
    all.extend(summary.models.iter().map(|model| share(model.verified.held, Tone::Plain)));
    Titled {
        title: "Held, by part".to_owned(),
        lead: "With the check against the demonstration.".to_owned(),
        table: table.summary(all),
    }
}

/// Where attempts ended that failed.
fn failures(summary: &Summary) -> Titled {
    let steps: Vec<&str> = std::iter::once(AttemptRecord::TEACH)
        .chain(Step::ALL.map(Step::name))
        .chain([AttemptRecord::SIMULATION])
        .collect();
    let mut columns = vec![Column::text("model"), Column::text("failed")];
    columns.extend(steps.iter().map(|step| Column::number(*step)));
    let mut table = Table::new(columns);
    for model in &summary.models {
        for (name, figures) in ways(model) {
            if figures.held.of == 0 {
                continue;
            }
            let failed = Share { count: figures.held.of - figures.held.count, of: figures.held.of };
            let mut row = vec![Cell::text(name), share(failed, Tone::Plain)];
            row.extend(steps.iter().map(|step| {
                let count = figures.failures_by_step.get(*step).copied().unwrap_or(0);
                Cell::number(count as f64, 0)
            }));
            table = table.row(row);
        }
    }
    Titled {
        title: "Failures, by step".to_owned(),
        lead: "The step at which each failed attempt ended. \"teach\": there was no model to try.".to_owned(),
        table,
    }
}

/// Detections beside the simulator's truth.
fn accuracy(summary: &Summary) -> Titled {
    let mut table = Table::new(vec![
        Column::text("model"),
        Column::text("right"),
        Column::number("right").unit("%"),
        Column::number("median").unit("mm").group("place"),
        Column::number("90 %").unit("mm").group("place"),
        Column::number("median").unit("°").group("turn"),
        Column::number("90 %").unit("°").group("turn"),
        Column::number("images a second"),
    ]);
    for model in &summary.models {
        for (name, figures) in ways(model) {
            table = table.row(vec![
                Cell::text(name),
                share(figures.right, Tone::Plain),
                number(figures.right.percent(), 1),
                number(figures.median_mm, 2),
                number(figures.p90_mm, 2),
                number(figures.median_deg, 2),
                number(figures.p90_deg, 2),
                number(figures.frames_per_second, 1),
            ]);
        }
    }
    Titled {
        title: "Detection against the truth".to_owned(),
        lead: format!(
            "{} unseen pictures of each part from the look-out pose. Right: found within {RIGHT_MM:.0} mm and \
             {RIGHT_DEGREES:.0}°. Errors are of all that was found, right or not; turns that a part's symmetry hides do \
             not count. \"alone\": without the check against the demonstration.",
            summary.settings.views
        ),
        table,
    }
}

/// Seen where it is not.
fn false_alarms(summary: &Summary) -> Titled {
    let mut table =
        Table::new(vec![Column::text("model"), Column::text("false alarms"), Column::text("false alarms, alone")]);
    for model in &summary.models {
        let tone = if model.verified.false_alarms.count == 0 { Tone::Good } else { Tone::Bad };
        table = table.row(vec![
            Cell::text(model.model.letter()),
            share(model.verified.false_alarms, tone),
            model.alone.as_ref().map_or(Cell::missing(), |alone| share(alone.false_alarms, Tone::Plain)),
        ]);
    }
    Titled {
        title: "Pictures without the part".to_owned(),
        lead: format!(
            "{} pictures for each part with unseen things and others made to resemble parts; in every second one lies \
             another shipped part, too.",
            summary.settings.scenes
        ),
        table,
    }
}

/// The paper's Table I.
fn models(summary: &Summary) -> Titled {
    let mut table = Table::new(vec![
        Column::text("model"),
        Column::text("network").group("place"),
        Column::text("output").group("place"),
        Column::text("network").group("turn"),
        Column::text("method").group("turn"),
        Column::text("human input"),
    ]);
    for model in &summary.models {
        let [network, output, turn_network, method, input] = description(model.model);
        table = table.row([model.model.letter(), network, output, turn_network, method, input].map(Cell::text).into());
    }
    Titled {
        title: "Models".to_owned(),
        lead: format!(
            "Table I of the paper. Preset {}; no network starts from pretrained weights. A drawn outline is also what the \
             check lays over the image.",
            summary.settings.preset
        ),
        table,
    }
}

/// Network and output for the place, network and method for the turn, human input.
fn description(model: ModelKind) -> [&'static str; 5] {
    match model.letter() {
        "A" => ["Faster R-CNN", "box", "CNN on the box's crop", "classes of the angle", "box, grasp line"],
        "B" => ["Keypoint R-CNN", "box", "the same", "line through twelve keypoints", "box, grasp line"],
        "C" => ["Keypoint R-CNN", "twelve keypoints", "the same", "line through twelve keypoints", "box, grasp line"],
        "D" => ["Mask R-CNN", "mask", "the same", "mask and SIFT", "outline, grasp line"],
        _ => ["none", "place and turn", "none", "demonstration searched for over all poses", "outline, grasp line"],
    }
}

/// Everything about every cell, in brief.
fn cells(summary: &Summary) -> Titled {
    let mut table = Table::new(vec![
        Column::text("part"),
        Column::text("model"),
        Column::number("teaching").unit("s"),
        Column::text("held").group("verified"),
        Column::text("right").group("verified"),
        Column::text("false alarms").group("verified"),
        Column::number("median").unit("mm").group("verified"),
        Column::text("held").group("alone"),
        Column::text("right").group("alone"),
        Column::text("false alarms").group("alone"),
        Column::number("median").unit("mm").group("alone"),
    ]);
    let mut cells: Vec<_> = summary.cells.iter().collect();
    // Stable: models keep their order within a part.
    cells.sort_by(|a, b| a.object.cmp(&b.object));
    for cell in cells {
        let teaching = match &cell.teaching {
            Some(TeachingRecord::Taught { facts, .. }) => Cell::number(facts.seconds, 0),
            Some(TeachingRecord::Failed { .. }) => Cell::text("failed"),
            None => Cell::missing(),
        };
        let mut row = vec![Cell::text(cell.object.replace('_', " ")), Cell::text(cell.model.letter()), teaching];
        for figures in [Some(&cell.verified), cell.alone.as_ref()] {
            let counted =
                |pick: fn(&Figures) -> Share| figures.map_or(Cell::missing(), |f| share(pick(f), Tone::Plain));
            row.extend([
                counted(|f| f.held),
                counted(|f| f.right),
                counted(|f| f.false_alarms),
                number(figures.and_then(|f| f.median_mm), 2),
            ]);
        }
        table = table.row(row);
    }
    Titled { title: "Every part and model".to_owned(), lead: "What the sums above are made of.".to_owned(), table }
}

/// Teachings that led to nothing.
fn not_taught(summary: &Summary) -> Titled {
    let mut table = Table::new(vec![Column::text("part"), Column::text("model"), Column::text("why")]);
    for cell in &summary.cells {
        if let Some(TeachingRecord::Failed { why }) = &cell.teaching {
            table =
                table.row([cell.object.replace('_', " "), cell.model.to_string(), why.clone()].map(Cell::text).into());
        }
    }
    Titled {
        title: "Not taught".to_owned(),
        lead: "Teachings that led to no model. All their attempts count as failed.".to_owned(),
        table,
    }
}

/// With the check and, where there is a network, without it.
fn ways(model: &ModelSummary) -> impl Iterator<Item = (String, &Figures)> {
    debug_assert_eq!(model.alone.is_some(), model.model.has_network());
    let alone = model.alone.as_ref().map(|figures| (format!("{}, alone", model.model), figures));
    std::iter::once((model.model.to_string(), &model.verified)).chain(alone)
}

fn share(share: Share, tone: Tone) -> Cell {
    match (share.of, tone) {
        (0, _) => Cell::text("–"),
        (_, Tone::Plain) => Cell::text(share.to_string()),
        (_, tone) => Cell::Verdict { tone, text: share.to_string(), note: None },
    }
}

fn number(value: Option<f64>, decimals: usize) -> Cell {
    value.map_or(Cell::missing(), |value| Cell::number(value, decimals))
}

/// Samples of the detector, and crops of the orientation CNN where there is one.
fn samples(model: &ModelSummary) -> String {
    match (model.samples, model.crops) {
        (Some(samples), Some(crops)) => format!("{samples:.0} + {crops:.0}"),
        (Some(samples), None) => format!("{samples:.0}"),
        (None, _) => "–".to_owned(),
    }
}

fn interval(figures: &Figures) -> String {
    if figures.held.of == 0 {
        return "–".to_owned();
    }
    let [low, high] = figures.held_interval.map(|share| 100.0 * share);
    format!("{low:.1} to {high:.1}")
}

/// Minutes and seconds, as the paper writes them.
fn minutes(secs: f64) -> String {
    let secs = secs.round() as u64;
    if secs == 0 { "under 0:01".to_owned() } else { format!("{}:{:02}", secs / 60, secs % 60) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::{CellSummary, Settings, wilson_interval};
    use std::collections::BTreeMap;

    fn figures(count: usize, of: usize) -> Figures {
        let held = Share { count, of };
        Figures {
            held,
            held_interval: wilson_interval(held),
            failures_by_step: BTreeMap::from([("lift".to_owned(), of - count)]),
            right: Share { count: 24, of: 25 },
            median_mm: Some(0.654),
            false_alarms: Share { count: 1, of: 25 },
            frames_per_second: Some(12.34),
            ..Figures::default()
        }
    }

    fn summary() -> Summary {
        let why = "the network | finds nothing".to_owned();
        let cell = CellSummary {
            model: ModelKind::B,
            object: "rod_end".into(),
            teaching: Some(TeachingRecord::Failed { why }),
            verified: figures(9, 10),
            alone: Some(Figures::default()),
            failures: Vec::new(),
            failures_alone: Vec::new(),
        };
        let model = ModelSummary {
            model: ModelKind::B,
            network: ModelKind::C,
            taught: Share { count: 0, of: 1 },
            samples: Some(3456.0),
            crops: None,
            teaching_secs: Some(151.6),
            longest_teaching_secs: Some(151.6),
            largest_bytes: Some(8_912_345),
            verified: figures(9, 10),
            alone: Some(Figures::default()),
        };
        let settings = Settings {
            protocol: Settings::PROTOCOL,
            preset: "edge".into(),
            steps: None,
            seed: 1,
            attempts: 10,
            views: 25,
            scenes: 25,
        };
        Summary { settings, remaining: 0, unverified: false, models: vec![model], cells: vec![cell] }
    }

    #[test]
    fn rows_stand_beside_the_paper_s() {
        let text = markdown(&summary(), &[("seed", "1".to_owned())], "sdg evaluate --seed 1");
        let row =
            "| B | 9 of 10 | 90.0 | 59.6 to 98.2 | – | 3456 | 2:32 | 8.9 | 12.3 | 82.5 | 1500 | 7:30 | 450 | 20 |";
        assert!(text.contains(row), "{text}");
        assert!(text.contains("B reads the network taught for C, which is taught once."));
        assert!(text.contains("| rod end | 9 of 10 |\n| all | 9 of 10 |"), "{text}");
        // Failures: one, at the lift, which stands sixth behind teach, detect, hover, approach and close.
        assert!(text.contains("| B | 1 of 10 | 0 | 0 | 0 | 0 | 0 | 1 | 0 | 0 |"), "{text}");
        assert!(text.contains("| B | 24 of 25 | 96.0 | 0.65 | – | – | – | 12.3 |"), "{text}");
        assert!(text.contains("the network \\| finds nothing"), "{text}");
        assert!(text.contains("- seed: 1\n\n```\nsdg evaluate --seed 1\n```\n") && !text.contains("Not complete"));
    }

    #[test]
    fn what_is_missing_is_told_first() {
        let text = markdown(&Summary { remaining: 3, ..summary() }, &[], "sdg evaluate");
        assert!(text.starts_with("# Evaluation\n\n**Not complete: 3 units"), "{text}");
    }

    #[test]
    fn every_model_is_described() {
        for model in ModelKind::ALL {
            assert_eq!(description(model)[0] == "none", !model.has_network());
        }
    }
}
