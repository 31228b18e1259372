//! A summary of the axes in a few lines.

use super::against::RunDifference;
use super::summary::AxesSummary;
use super::way::Way;

/// One line for each group, model and way (with the check, or by the network alone), and one for each model and
/// condition of the grasps.
pub fn summary_lines(summary: &AxesSummary) -> String {
    let mut text = String::new();
    let mut line = |line: String| text += &(line + "\n");
    for group in &summary.groups {
        line(format!("{}:", group.group.title()));
        let mut rows: Vec<_> = group.axes.iter().map(|figures| (figures.model, figures.way)).collect();
        rows.extend(group.look_alikes.iter().map(|figures| (figures.model, figures.way)));
        rows.sort_by_key(|(model, way)| (model.letter(), *way == Way::NetworkAlone));
        rows.dedup();
        for (model, way) in rows {
            let mut told: Vec<String> = group
                .axes
                .iter()
                .filter(|figures| (figures.model, figures.way) == (model, way))
                .map(|figures| format!("{} {}", figures.axis, figures.found))
                .collect();
            told.extend(
                group
                    .look_alikes
                    .iter()
                    .filter(|figures| (figures.model, figures.way) == (model, way) && figures.is_sum())
                    .map(|figures| format!("look-alikes of {} accepted {}", figures.kind, figures.accepted)),
            );
            line(format!("  {model} {}: {}", way.name(), told.join(", ")));
        }
        for figures in &group.grasps {
            line(format!(
                "  {} {}: held {}, {} of them at the first look",
                figures.model,
                figures.condition.name(),
                figures.held,
                figures.held_at_first_look.count
            ));
        }
    }
    text
}

/// One line for each comparison.
pub fn difference_lines(comparisons: &[RunDifference]) -> String {
    let mut text = String::new();
    let mut line = |line: String| text += &(line + "\n");
    for comparison in comparisons {
        let [low, high] = comparison.interval.map(|bound| 100.0 * bound);
        line(format!(
            "against, {}: {} {}, {}: {} and {}, difference {:.1} points ({low:.1} to {high:.1}), {}, cases needed {}",
            comparison.group.title().to_lowercase(),
            comparison.model,
            comparison.way.name(),
            comparison.axis,
            comparison.counts.first(),
            comparison.counts.second(),
            100.0 * comparison.difference,
            if comparison.differs { "differs" } else { "does not differ" },
            comparison.cases_needed.map_or("none".to_owned(), |cases| cases.to_string()),
        ));
    }
    text
}
