//! Tables of the results of each axis and each error, for the paper's parts and separately for the held-out ones.

use sdg_grasp::ModelKind;
use sdg_report::{Cell, Column, DetectionError, Table, Tone};

use super::known_from_simulator::known_from_simulator;
use super::matching::{SLANT_TOLERANCE, TOLERANCE};
use super::summary::{AxesSummary, AxisFigures, GraspFigures, GroupSummary, LookAlikeFigures, PartShare, lowest};
use super::way::Way;
use crate::simulated::records::AttemptRecord;
use crate::simulated::tables::{Titled, document, incomplete, number, share};
use crate::statistics::Share;

/// All tables, group by group, followed by the quantities that the robot gets from the simulator.
pub fn tables(summary: &AxesSummary) -> Vec<Titled> {
    let mut tables = Vec::new();
    for group in &summary.groups {
        let titled = |(title, lead, table): (String, String, Table)| Titled {
            title: format!("{}: {title}", group.group.title()),
            lead,
            table,
        };
        if !group.axes.is_empty() {
            let ways = Way::ALL.into_iter().filter(|way| !models_of(group, *way).is_empty());
            tables.extend(ways.map(|way| titled(found(group, way))));
            tables.push(titled(thirds(group)));
            tables.push(titled(lowest_parts(group)));
            tables.push(titled(wrong(group)));
            tables.push(titled(errors(group)));
        }
        if !group.look_alikes.is_empty() {
            tables.push(titled(look_alikes(group)));
        }
        if !group.grasps.is_empty() {
            tables.push(titled(grasps(group)));
            tables.push(titled(failures(group)));
        }
        if !group.axes.is_empty() {
            tables.push(titled(by_part(group)));
        }
        if !group.grasps.is_empty() {
            tables.push(titled(grasps_by_part(group)));
        }
    }
    tables.push(quantities_from_simulator());
    tables
}

/// A notice that precedes the tables, if results are missing.
pub fn notice(summary: &AxesSummary) -> Option<String> {
    incomplete(summary.remaining)
}

/// The tables as a document; `more` are additional tables, `facts` the settings for reproducing the results.
pub fn markdown(summary: &AxesSummary, more: Vec<Titled>, facts: &[(&str, String)], command: &str) -> String {
    let tables = tables(summary).into_iter().chain(more);
    document("Axes and grasps under errors", notice(summary), tables, facts, command)
}

/// Each value once, in order of first appearance.
fn distinct<T: PartialEq + Copy>(values: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut distinct = Vec::new();
    for value in values {
        if !distinct.contains(&value) {
            distinct.push(value);
        }
    }
    distinct
}

fn models_of(group: &GroupSummary, way: Way) -> Vec<ModelKind> {
    let shown = group.axes.iter().map(|f| (f.model, f.way)).chain(group.look_alikes.iter().map(|f| (f.model, f.way)));
    distinct(shown.filter(|(_, of)| *of == way).map(|(model, _)| model))
}

fn axes_of(group: &GroupSummary) -> Vec<&'static str> {
    distinct(group.axes.iter().map(|figures| figures.axis))
}

fn figures_of<'g>(group: &'g GroupSummary, axis: &str, model: ModelKind, way: Way) -> Option<&'g AxisFigures> {
    group.axes.iter().find(|f| f.axis == axis && f.model == model && f.way == way)
}

/// The fraction in percent with its interval, such as `97.5 (93.8 to 99.0)`.
pub(super) fn with_interval(share: Share, [low, high]: [f64; 2]) -> String {
    let Some(percent) = share.percent() else { return "–".to_owned() };
    format!("{percent:.1} ({:.1} to {:.1})", 100.0 * low, 100.0 * high)
}

fn part_name(object: &str) -> String {
    object.replace('_', " ")
}

/// The smallest fraction, and its part.
fn lowest_shares(parts: &[PartShare]) -> String {
    lowest(parts).map_or("–".to_owned(), |part| format!("{}, {}", part.share, part_name(&part.object)))
}

fn limits(DetectionError { distance_mm, angle_deg }: DetectionError) -> String {
    format!("{distance_mm:.0} mm and {angle_deg:.0}°")
}

fn found(group: &GroupSummary, way: Way) -> (String, String, Table) {
    let models = models_of(group, way);
    let mut columns = vec![Column::text("axis"), Column::number("of")];
    columns.extend(models.iter().map(|model| Column::text(model.letter())));
    let mut table = Table::new(columns);
    for axis in axes_of(group) {
        let of = models.iter().find_map(|model| Some(figures_of(group, axis, *model, way)?.found.of));
        let mut row = vec![Cell::text(axis), of.map_or(Cell::missing(), |of| Cell::number(of as f64, 0))];
        row.extend(models.iter().map(|model| {
            figures_of(group, axis, *model, way)
                .map_or(Cell::missing(), |f| Cell::text(with_interval(f.found, f.found_interval)))
        }));
        table = table.row(row);
    }
    let lead = format!(
        "Instances of the part that were found within {} (slants: {}), in percent, with Wilson's 95 % interval. With \
         one instance, only the best detection counts; three instances are matched one to one. Each axis has its own \
         pictures, the same for every model. The models do not know the camera's height.",
        limits(TOLERANCE),
        limits(SLANT_TOLERANCE)
    );
    (format!("found, {}", way.name()), lead, table)
}

fn thirds(group: &GroupSummary) -> (String, String, Table) {
    let models = models_of(group, Way::WithCheck);
    let mut columns = vec![Column::text("axis"), Column::text("from"), Column::text("to")];
    columns.extend(models.iter().map(|model| Column::text(model.letter())));
    let mut table = Table::new(columns);
    for axis in axes_of(group) {
        let of = |model: ModelKind, third: usize| Some(figures_of(group, axis, model, Way::WithCheck)?.thirds[third]);
        let range = |third: usize| models.iter().find_map(|model| of(*model, third)?.range);
        // On the axis of instances, the parameter is constant, so the thirds do not differ in difficulty.
        if range(0) == range(2) && range(0).is_some_and(|[low, high]| low == high) {
            continue;
        }
        for third in 0..3 {
            let Some([low, high]) = range(third) else { continue };
            let mut row = vec![Cell::text(axis), Cell::text(format!("{low:.2}")), Cell::text(format!("{high:.2}"))];
            row.extend(models.iter().map(|model| share(of(*model, third).unwrap_or_default().found, Tone::Plain)));
            table = table.row(row);
        }
    }
    let lead = "Instances found with the check, in the first, the middle and the last third of each axis' pictures. The \
                difficulty increases along the axis. \"From\" and \"to\" are the height relative to the usual one, the \
                tilt in degrees, the covered fraction of the part, the light as a fraction of the usual light, and the \
                blur in pixels; the parameters of the other axes are counts or ratios.";
    ("found, by difficulty along the axis".to_owned(), lead.to_owned(), table)
}

fn lowest_parts(group: &GroupSummary) -> (String, String, Table) {
    let mut columns = vec![Column::text("axis")];
    for way in Way::ALL {
        columns.extend(models_of(group, way).iter().map(|model| Column::text(model.letter()).group(way.name())));
    }
    let mut table = Table::new(columns);
    for axis in axes_of(group) {
        let mut row = vec![Cell::text(axis)];
        for way in Way::ALL {
            row.extend(models_of(group, way).iter().map(|model| {
                figures_of(group, axis, *model, way).map_or(Cell::missing(), |f| Cell::text(lowest_shares(&f.parts)))
            }));
        }
        table = table.row(row);
    }
    ("the part found least often".to_owned(), "Instances found of the part with the lowest fraction.".to_owned(), table)
}

fn wrong(group: &GroupSummary) -> (String, String, Table) {
    let mut columns = vec![Column::text("axis"), Column::number("pictures")];
    for way in Way::ALL {
        columns.extend(models_of(group, way).iter().map(|model| Column::number(model.letter()).group(way.name())));
    }
    let mut table = Table::new(columns);
    for axis in axes_of(group) {
        let pictures = group.axes.iter().find(|f| f.axis == axis).map_or(0, |f| f.pictures);
        let mut row = vec![Cell::text(axis), Cell::number(pictures as f64, 0)];
        for way in Way::ALL {
            row.extend(models_of(group, way).iter().map(|model| {
                figures_of(group, axis, *model, way).map_or(Cell::missing(), |f| Cell::number(f.wrong as f64, 0))
            }));
        }
        table = table.row(row);
    }
    let lead = "Accepted detections (score 0.5 and above) that are not correct: beside the part, rotated relative to \
                it, or elsewhere. With one instance, there is at most one per picture.";
    ("wrong detections".to_owned(), lead.to_owned(), table)
}

fn errors(group: &GroupSummary) -> (String, String, Table) {
    let mut columns = vec![Column::text("axis"), Column::text("")];
    columns.extend(models_of(group, Way::WithCheck).iter().flat_map(|model| {
        [Column::text("mm").group(model.letter().to_owned()), Column::text("°").group(model.letter().to_owned())]
    }));
    let mut table = Table::new(columns);
    for axis in axes_of(group) {
        for way in Way::ALL.into_iter().filter(|way| !models_of(group, *way).is_empty()) {
            let mut row = vec![Cell::text(axis), Cell::text(way.name())];
            for model in models_of(group, Way::WithCheck) {
                let figures = figures_of(group, axis, model, way);
                let told = |pick: fn(&AxisFigures) -> Option<[f64; 2]>| {
                    Cell::text(figures.and_then(pick).map_or("–".to_owned(), |[a, b]| format!("{a:.2} / {b:.2}")))
                };
                row.extend([told(|f| f.distance_mm), told(|f| f.turn_deg)]);
            }
            table = table.row(row);
        }
    }
    let lead = "Median and 90th percentile of the position errors on the table and of the angle errors of all \
                accepted detections, correct or not, modulo the part's symmetry.";
    ("errors of detections".to_owned(), lead.to_owned(), table)
}

fn look_alikes(group: &GroupSummary) -> (String, String, Table) {
    let shown: Vec<(Way, ModelKind)> =
        Way::ALL.into_iter().flat_map(|way| models_of(group, way).into_iter().map(move |model| (way, model))).collect();
    let mut columns = vec![Column::text("look-alike"), Column::number("pictures")];
    columns.extend(shown.iter().map(|(way, model)| Column::text(model.letter()).group(way.name())));
    let mut table = Table::new(columns);
    let mut kinds = distinct(group.look_alikes.iter().map(|figures| figures.kind.as_str()));
    // The two sums come last, because their order of appearance depends on the first model's look-alikes.
    let sums = [LookAlikeFigures::SAME_SIZE, LookAlikeFigures::SIZE_ALONE];
    kinds.retain(|kind| !sums.contains(kind));
    for kind in kinds.into_iter().chain(sums) {
        let figures = |way: Way, model: ModelKind| {
            group.look_alikes.iter().find(|f| f.kind == kind && f.model == model && f.way == way)
        };
        let pictures = shown.iter().find_map(|(way, model)| Some(figures(*way, *model)?.accepted.of));
        let label = if sums.contains(&kind) { format!("all of {kind}") } else { kind.to_owned() };
        let mut row = vec![Cell::text(label), pictures.map_or(Cell::missing(), |of| Cell::number(of as f64, 0))];
        row.extend(shown.iter().map(|(way, model)| match figures(*way, *model) {
            Some(f) if sums.contains(&kind) => Cell::text(with_interval(f.accepted, f.accepted_interval)),
            Some(f) => share(f.accepted, Tone::Plain),
            None => Cell::missing(),
        }));
        table = table.row(row);
    }
    let lead = "Pictures in which a similar part replaces the taught one, and how often it was accepted: lower is \
                better. Sums in percent, with Wilson's 95 % interval. A difference in size alone \
                is not visible without a calibrated camera, so there are two sums.";
    ("look-alikes accepted as the part".to_owned(), lead.to_owned(), table)
}

fn grasps(group: &GroupSummary) -> (String, String, Table) {
    let mut table = Table::new(vec![
        Column::text("error"),
        Column::text("model"),
        Column::text("held"),
        Column::text("held, %"),
        Column::text("at the first look").group("of these"),
        Column::text("after further looks").group("of these"),
        Column::text("part held least often"),
        Column::text("last detection, mm"),
    ]);
    for figures in &group.grasps {
        table = table.row(vec![
            Cell::text(figures.condition.description()),
            Cell::text(figures.model.letter()),
            share(figures.held, Tone::Plain),
            Cell::text(with_interval(figures.held, figures.held_interval)),
            share(figures.held_at_first_look, Tone::Plain),
            share(figures.held_after_further_looks, Tone::Plain),
            Cell::text(lowest_shares(&figures.parts)),
            Cell::text(figures.distance_mm.map_or("–".to_owned(), |[a, b]| format!("{a:.2} / {b:.2}"))),
        ]);
    }
    let lead = "Grasp attempts with the check, the same scenes and robot starts under every error. Held at the first look: the \
                part was found in the first picture from the look-out pose and in the first from above it. After \
                further looks: the camera was moved for at least one further picture. The last column is the median \
                and the 90th percentile of the last detection's position error, as the robot computes it.";
    ("grasps under errors".to_owned(), lead.to_owned(), table)
}

fn failures(group: &GroupSummary) -> (String, String, Table) {
    let steps: Vec<&str> = AttemptRecord::steps().collect();
    let mut columns = vec![Column::text("error"), Column::text("model"), Column::text("failed")];
    columns.extend(steps.iter().map(|step| Column::number(*step)));
    let mut table = Table::new(columns);
    for figures in &group.grasps {
        let failed = Share { count: figures.held.of - figures.held.count, of: figures.held.of };
        let mut row = vec![
            Cell::text(figures.condition.description()),
            Cell::text(figures.model.letter()),
            share(failed, Tone::Plain),
        ];
        row.extend(steps.iter().map(|step| {
            let count = figures.failures_by_step.get(*step).copied().unwrap_or(0);
            Cell::number(count as f64, 0)
        }));
        table = table.row(row);
    }
    let lead = "The step at which each failed attempt ended. \"teach\": there was no model to try.";
    ("failed grasps, by step".to_owned(), lead.to_owned(), table)
}

fn by_part(group: &GroupSummary) -> (String, String, Table) {
    let axes = axes_of(group);
    let mut columns = vec![Column::text("part"), Column::text("model"), Column::text("")];
    columns.extend(axes.iter().map(|axis| Column::number(*axis)));
    let mut table = Table::new(columns);
    for object in &group.objects {
        for way in Way::ALL {
            for model in models_of(group, way) {
                let mut row = vec![Cell::text(part_name(object)), Cell::text(model.letter()), Cell::text(way.name())];
                row.extend(axes.iter().map(|axis| {
                    let parts = figures_of(group, axis, model, way).map_or(&[][..], |figures| &figures.parts);
                    number(share_of(parts, object).map(|share| share.count as f64), 0)
                }));
                table = table.row(row);
            }
        }
    }
    let each = group.axes.iter().flat_map(|figures| &figures.parts).map(|part| part.share.of).min().unwrap_or(0);
    let lead = format!("Instances found: of {each} on every axis, of three times as many on the axis of instances.");
    ("found, every part and model".to_owned(), lead, table)
}

fn grasps_by_part(group: &GroupSummary) -> (String, String, Table) {
    let mut columns = vec![Column::text("part")];
    columns.extend(
        group
            .grasps
            .iter()
            .map(|figures: &GraspFigures| Column::text(figures.model.letter()).group(figures.condition.name())),
    );
    let mut table = Table::new(columns);
    for object in &group.objects {
        let mut row = vec![Cell::text(part_name(object))];
        row.extend(
            group.grasps.iter().map(|figures| {
                share_of(&figures.parts, object).map_or(Cell::missing(), |held| share(held, Tone::Plain))
            }),
        );
        table = table.row(row);
    }
    ("held, every part".to_owned(), "Components of the sums above.".to_owned(), table)
}

fn share_of(parts: &[PartShare], object: &str) -> Option<Share> {
    parts.iter().find(|part| part.object == object).map(|part| part.share)
}

fn quantities_from_simulator() -> Titled {
    let mut table =
        Table::new(vec![Column::text("quantity"), Column::text("source"), Column::text("measured with an error")]);
    for row in known_from_simulator() {
        table = table.row([row.what, row.source, row.error].map(Cell::text).into());
    }
    Titled {
        title: "Quantities that the robot gets from the simulator".to_owned(),
        lead: "Quantities that the simulated robot knows exactly and that would have to be measured for a real \
               one."
            .to_owned(),
        table,
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::simulated::axes::{AttemptSettings, AxisSettings, GraspCondition, Seconds, Third};
    use crate::simulated::settings::TeachingSettings;
    use crate::{PartGroup, wilson_interval};

    fn share_of_parts(counts: [(&str, usize); 2]) -> Vec<PartShare> {
        counts.map(|(object, count)| PartShare { object: object.into(), share: Share { count, of: 20 } }).into()
    }

    fn group(group: PartGroup, parts: [(&str, usize); 2]) -> GroupSummary {
        let parts = share_of_parts(parts);
        let found: Share = parts.iter().map(|part| part.share).sum();
        let axis = |model: ModelKind, way| AxisFigures {
            axis: "tilt",
            model,
            way,
            found,
            found_interval: wilson_interval(found),
            wrong: 3,
            pictures: 40,
            distance_mm: Some([0.5, 1.25]),
            turn_deg: None,
            thirds: [5, 4, 3].map(|count| Third { found: Share { count, of: 13 }, range: Some([5.0, 9.5]) }),
            parts: parts.clone(),
        };
        let look_alike = |kind: &str, count| {
            let accepted = Share { count, of: 20 };
            LookAlikeFigures {
                kind: kind.into(),
                model: ModelKind::C,
                way: Way::WithCheck,
                accepted,
                accepted_interval: wilson_interval(accepted),
                parts: Vec::new(),
            }
        };
        let held = Share { count: 18, of: 20 };
        let grasps = GraspFigures {
            condition: GraspCondition::HandEye,
            model: ModelKind::C,
            held,
            held_interval: wilson_interval(held),
            held_at_first_look: Share { count: 15, of: 20 },
            held_after_further_looks: Share { count: 3, of: 20 },
            failures_by_step: BTreeMap::from([("close".to_owned(), 2)]),
            distance_mm: Some([2.0, 3.5]),
            parts: parts.clone(),
        };
        GroupSummary {
            group,
            objects: parts.iter().map(|part| part.object.clone()).collect(),
            axes: vec![
                axis(ModelKind::C, Way::WithCheck),
                axis(ModelKind::C, Way::NetworkAlone),
                axis(ModelKind::S, Way::WithCheck),
            ],
            look_alikes: vec![
                look_alike("size 0.90", 12),
                look_alike(LookAlikeFigures::SAME_SIZE, 5),
                look_alike(LookAlikeFigures::SIZE_ALONE, 12),
                look_alike("mirrored", 5),
            ],
            grasps: vec![grasps],
        }
    }

    fn summary(remaining: usize) -> AxesSummary {
        let teaching =
            TeachingSettings { preset: "edge".into(), steps: None, time_budget: None, seed: 1, program: None };
        AxesSummary {
            axis_settings: AxisSettings { axes: 1, teaching: teaching.clone(), axis_views: 20, search_points: None },
            grasp_settings: AttemptSettings { errors: 1, teaching, attempts: 10, search_points: None },
            remaining,
            seconds: Seconds::default(),
            groups: vec![
                group(PartGroup::Paper, [("pendulum", 20), ("rod_end", 14)]),
                group(PartGroup::HeldOut, [("key", 3), ("pliers", 1)]),
            ],
        }
    }

    #[test]
    fn the_two_groups_are_never_added_up() {
        let text = markdown(&summary(0), Vec::new(), &[("seed", "1".to_owned())], "sdg evaluate --axes");
        // 34 of 40, and separately 4 of 40.
        assert!(text.contains("| tilt | 40 | 85.0 (70.9 to 92.9) | 85.0 (70.9 to 92.9) |"), "{text}");
        assert!(text.contains("| tilt | 40 | 10.0 (4.0 to 23.1) | 10.0 (4.0 to 23.1) |"), "{text}");
        assert!(text.contains("The paper's parts: found, network alone") && text.contains("Held-out parts: found"));
        assert!(!text.contains("38 of 80") && !text.contains("Not complete"), "{text}");
        assert!(text.contains("| tilt | 14 of 20, rod end | 14 of 20, rod end | 14 of 20, rod end |"), "{text}");
        assert!(text.contains("1 of 20, pliers"), "{text}");
        assert!(text.contains("| tilt | 5.00 | 9.50 | 4 of 13 | 4 of 13 |"), "{text}");
    }

    #[test]
    fn look_alikes_of_the_same_size_and_of_another_stand_apart() {
        let text = markdown(&summary(0), Vec::new(), &[], "");
        let places = [
            "| size 0.90 | 20 | 12 of 20 |",
            "| mirrored | 20 | 5 of 20 |",
            "| all of same size | 20 | 25.0 (",
            "| all of size alone | 20 | 60.0 (",
        ]
        .map(|row| text.find(row).unwrap_or_else(|| panic!("{row} in {text}")));
        assert!(places.is_sorted(), "{places:?}");
    }

    #[test]
    fn grasps_tell_first_from_further_looks_and_what_is_known_from_simulator() {
        let text = markdown(&summary(2), Vec::new(), &[], "");
        let row = "| hand-eye wrong by 2 mm and 0.5° | C | 18 of 20 | 90.0 (69.9 to 97.2) | 15 of 20 | 3 of 20 |";
        assert!(text.contains(row), "{text}");
        assert!(text.contains("camera intrinsics") && text.contains("height of the marks above the table"), "{text}");
        assert!(text.contains("**Not complete: 2 units"), "{text}");
    }
}
