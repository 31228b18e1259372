//! `[[place]]`, `[[tray]]` and `[[bin]]` of a workcell file.

use serde::Deserialize;
use toml::Spanned;

use super::error::WorkcellError;
use super::source::{MAX_REACH_MM, Numbers, Source};
use crate::place::{Place, PlaceKind};
use crate::safety::WorkspaceBox;

/// Maximum number of cells of a tray along each axis.
const MAX_CELLS: i64 = 100;
/// Limits of the pitch of cells and of the size of bins, mm.
const PITCHES_MM: [f64; 2] = [5.0, 1000.0];
/// Smallest and largest height above the table of the surface under the parts, mm.
const SURFACES_MM: [f64; 2] = [0.0, 500.0];

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PlaceSection {
    name: Spanned<String>,
    at_mm: Spanned<Numbers<2>>,
    yaw_deg: Option<Spanned<f64>>,
    height_mm: Option<Spanned<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TraySection {
    name: Spanned<String>,
    first_mm: Spanned<Numbers<2>>,
    columns: Spanned<i64>,
    rows: Spanned<i64>,
    pitch_mm: Spanned<Numbers<2>>,
    yaw_deg: Option<Spanned<f64>>,
    height_mm: Option<Spanned<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct BinSection {
    name: Spanned<String>,
    at_mm: Spanned<Numbers<2>>,
    size_mm: Spanned<Numbers<2>>,
    yaw_deg: Option<Spanned<f64>>,
    height_mm: Option<Spanned<f64>>,
}

/// The areas in which places must lie.
pub(super) struct Room<'w> {
    pub(super) table_height_m: f64,
    pub(super) table_m: Option<[[f64; 2]; 2]>,
    pub(super) workspace: &'w WorkspaceBox,
}

pub(super) fn places(
    source: &Source<'_>,
    places: &[Spanned<PlaceSection>],
    trays: &[Spanned<TraySection>],
    bins: &[Spanned<BinSection>],
    room: &Room<'_>,
) -> Result<Vec<Place>, WorkcellError> {
    let mut read: Vec<Place> = Vec::new();
    let mut add = |name: &Spanned<String>, at: usize, place: Place| {
        if place.name.is_empty() || place.name.contains(':') {
            return Err(source.expected(name, "name", "a name without \":\"", format!("\"{}\"", place.name)));
        }
        if read.iter().any(|other| other.name == place.name) {
            return Err(source.expected(name, "name", "a unique name", format!("a second \"{}\"", place.name)));
        }
        room.check(&place).map_err(|why| source.error(at, why))?;
        read.push(place);
        Ok(())
    };
    for section in places {
        let PlaceSection { name, at_mm, yaw_deg, height_mm } = section.get_ref();
        let place = common(source, name, (at_mm, "at_mm"), yaw_deg, height_mm, PlaceKind::Pose, room)?;
        add(name, at_mm.span().start, place)?;
    }
    for section in trays {
        let TraySection { name, first_mm, columns, rows, pitch_mm, yaw_deg, height_mm } = section.get_ref();
        let pitch_m = lengths_m(source, pitch_mm, "pitch_mm")?;
        let cells = [count(source, columns, "columns")?, count(source, rows, "rows")?];
        let kind = PlaceKind::Tray { cells, pitch_m };
        let place = common(source, name, (first_mm, "first_mm"), yaw_deg, height_mm, kind, room)?;
        add(name, first_mm.span().start, place)?;
    }
    for section in bins {
        let BinSection { name, at_mm, size_mm, yaw_deg, height_mm } = section.get_ref();
        let kind = PlaceKind::Bin { size_m: lengths_m(source, size_mm, "size_mm")? };
        let place = common(source, name, (at_mm, "at_mm"), yaw_deg, height_mm, kind, room)?;
        add(name, at_mm.span().start, place)?;
    }
    Ok(read)
}

fn common(
    source: &Source<'_>,
    name: &Spanned<String>,
    (at_mm, at_name): (&Spanned<Numbers<2>>, &str),
    yaw_deg: &Option<Spanned<f64>>,
    height_mm: &Option<Spanned<f64>>,
    kind: PlaceKind,
    room: &Room<'_>,
) -> Result<Place, WorkcellError> {
    let Numbers(at) = *at_mm.get_ref();
    if !at.iter().all(|value| value.abs() <= MAX_REACH_MM) {
        let expected = format!("x and y within {MAX_REACH_MM} mm of the base");
        return Err(source.expected(at_mm, at_name, &expected, format!("{at:?}")));
    }
    let yaw_deg = yaw_deg.as_ref().map(|yaw| source.number(yaw, "yaw_deg", [-360.0, 360.0])).transpose()?;
    let height_mm = height_mm.as_ref().map(|height| source.length_mm(height, "height_mm", SURFACES_MM)).transpose()?;
    Ok(Place {
        name: name.get_ref().clone(),
        at_m: at.map(|value| value * 1e-3),
        yaw_rad: yaw_deg.unwrap_or(0.0).to_radians(),
        surface_m: room.table_height_m + height_mm.unwrap_or(0.0) * 1e-3,
        kind,
    })
}

fn count(source: &Source<'_>, found: &Spanned<i64>, name: &str) -> Result<u32, WorkcellError> {
    match u32::try_from(*found.get_ref()) {
        Ok(count) if (1..=MAX_CELLS).contains(&i64::from(count)) => Ok(count),
        _ => Err(source.expected(found, name, &format!("a whole number from 1 to {MAX_CELLS}"), found.get_ref())),
    }
}

fn lengths_m(source: &Source<'_>, found: &Spanned<Numbers<2>>, name: &str) -> Result<[f64; 2], WorkcellError> {
    let [min, max] = PITCHES_MM;
    let Numbers(lengths) = *found.get_ref();
    if lengths.iter().all(|length| (min..=max).contains(length)) {
        return Ok(lengths.map(|length| length * 1e-3));
    }
    Err(source.expected(found, name, &format!("lengths from {min} to {max} mm"), format!("{lengths:?}")))
}

impl Room<'_> {
    /// Checks that the corners of a place are on the table and its cells in the workspace; otherwise returns the
    /// reason.
    fn check(&self, place: &Place) -> Result<(), String> {
        let name = &place.name;
        if let Some([x, y]) = self.table_m {
            for corner in place.corners() {
                if !(x[0]..=x[1]).contains(&corner.x) || !(y[0]..=y[1]).contains(&corner.y) {
                    let [left, right, front, back] = [x[0], x[1], y[0], y[1]].map(|value| value * 1e3);
                    return Err(format!(
                        "\"{name}\" reaches over the table's edge: its corner is at ({:.0}, {:.0}) mm, the table is from {left:.0} to \
                         {right:.0} mm along x and from {front:.0} to {back:.0} mm along y",
                        corner.x * 1e3,
                        corner.y * 1e3
                    ));
                }
            }
        }
        for cell in 1..=place.num_cells() {
            let Ok(goal) = place.goal(cell) else { continue };
            let p = [goal.at_m[0], goal.at_m[1], goal.surface_m];
            for (k, axis) in ['x', 'y', 'z'].into_iter().enumerate() {
                // The tcp is above the surface under the part.
                let min_m = if axis == 'z' { f64::NEG_INFINITY } else { self.workspace.min_m[k] };
                let max_m = self.workspace.max_m[k];
                if !(min_m..=max_m).contains(&p[k]) {
                    return Err(format!(
                        "\"{}\" is at {axis} = {:.0} mm, outside the workspace of {:.0} to {:.0} mm",
                        goal.name,
                        p[k] * 1e3,
                        self.workspace.min_m[k] * 1e3,
                        max_m * 1e3
                    ));
                }
            }
        }
        Ok(())
    }
}
