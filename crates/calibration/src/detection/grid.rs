//! Grows a grid from one saddle point, neighbour by neighbour.
//!
//! Legend: a grid's positions `[i, j]` count from the first saddle point, and may be negative. The axes `i` and `j`
//! have the same orientation as the board's x and y seen from the printed side: `j` is to the left of `i` (y of pixels
//! points down).

use std::collections::{BTreeMap, VecDeque};

use nalgebra::{Point2, Vector2};

use super::saddle::Saddle;

/// Column and row in a grid.
pub(super) type Place = [i32; 2];

/// The four neighbours of a position: offset, axis and sign.
const NEIGHBOURS: [(Place, usize, f64); 4] =
    [([1, 0], 0, 1.0), ([-1, 0], 0, -1.0), ([0, 1], 1, 1.0), ([0, -1], 1, -1.0)];
/// Largest distance of a neighbour from its predicted position, in steps. Perspective shortens steps
/// by up to a sixth.
const MAX_OFF: f64 = 0.3;
/// Largest deviation of the first neighbours from the edges' directions: the sine of 14 degrees.
const MAX_SINE: f64 = 0.25;
/// Minimum ratio of the strengths of neighbouring corners. Light decreases along a board, but not abruptly.
const MIN_STRENGTH: f64 = 0.05;
/// Maximum number of saddle points from which grids are grown: the strongest that are not yet in a grid.
const MAX_SEEDS: usize = 60;

/// Corners in a grid.
#[derive(Debug, Clone, Default)]
pub(super) struct Grid {
    /// Positions in the picture, in pixels.
    pub(super) corners: BTreeMap<Place, Point2<f64>>,
    /// Whether the square between `[0, 0]` and `[1, 1]` is dark.
    pub(super) first_is_dark: bool,
}

impl Grid {
    pub(super) fn len(&self) -> usize {
        self.corners.len()
    }

    /// Number of corners along both axes.
    pub(super) fn extent(&self) -> [usize; 2] {
        [0, 1].map(|axis| {
            let along = || self.corners.keys().map(|place| place[axis]);
            match (along().min(), along().max()) {
                (Some(low), Some(high)) => (high - low + 1) as usize,
                _ => 0,
            }
        })
    }

    /// The grid in a picture `factor` times as large.
    pub(super) fn scaled(&self, factor: f64) -> Self {
        let corners = self.corners.iter().map(|(place, pixel)| (*place, pixel * factor)).collect();
        Self { corners, ..*self }
    }

    /// Minimum width of the squares around a corner, in pixels: the distance between opposite edges.
    pub(super) fn width(&self, place: Place) -> Option<f64> {
        let ways = |axis: usize| {
            let of_axis = NEIGHBOURS.iter().filter(move |(_, of, _)| *of == axis);
            of_axis.filter_map(move |(direction, ..)| self.way(place, *direction))
        };
        let widths = ways(0).flat_map(|u| ways(1).map(move |v| u.perp(&v).abs() / u.norm().max(v.norm())));
        widths.min_by(f64::total_cmp)
    }

    /// The vector from a corner to its neighbour. Beyond the grid's border it is extrapolated with perspective, from
    /// the last two steps and their ratio.
    fn way(&self, [i, j]: Place, [di, dj]: Place) -> Option<Vector2<f64>> {
        let at = |steps: i32| self.corners.get(&[i + steps * di, j + steps * dj]);
        let here = at(0)?;
        if let Some(there) = at(1) {
            return Some(there - here);
        }
        let last = here - at(-1)?;
        let shrinkage = at(-2).map_or(1.0, |before| last.norm() / (at(-1).unwrap_or(here) - before).norm());
        Some(last * shrinkage.min(1.0))
    }

    /// The corners around the square between `[i, j]` and `[i + 1, j + 1]`, if all four are present.
    pub(super) fn square(&self, [i, j]: Place) -> Option<[Point2<f64>; 4]> {
        let at = |di, dj| self.corners.get(&[i + di, j + dj]).copied();
        Some([at(0, 0)?, at(1, 0)?, at(0, 1)?, at(1, 1)?])
    }
}

/// Grids of at least four corners from at most [`MAX_SEEDS`] seeds, largest first.
pub(super) fn grow_all(saddles: &[Saddle]) -> Vec<Grid> {
    let mut is_used = vec![false; saddles.len()];
    let mut grids = Vec::new();
    let mut seeds = 0;
    for seed in 0..saddles.len() {
        if is_used[seed] || seeds == MAX_SEEDS {
            continue;
        }
        seeds += 1;
        let Some(growth) = Growth::start(saddles, seed) else { continue };
        let members = growth.grown();
        if members.len() >= 4 {
            for member in members.values() {
                is_used[*member] = true;
            }
            grids.push(grid(saddles, &members));
        }
    }
    grids.sort_by_key(|grid| std::cmp::Reverse(grid.len()));
    grids
}

struct Growth<'a> {
    saddles: &'a [Saddle],
    members: BTreeMap<Place, usize>,
    /// Steps to the next positions along i and j, by position.
    steps: BTreeMap<Place, [Vector2<f64>; 2]>,
}

impl<'a> Growth<'a> {
    /// Starts at a saddle point that has a neighbour along each edge.
    fn start(saddles: &'a [Saddle], seed: usize) -> Option<Self> {
        let first = &saddles[seed];
        let step = |edge: Vector2<f64>| {
            let ways = saddles.iter().filter(|other| is_neighbour(first, other)).map(|other| other.place - first.place);
            let along = ways.filter(|way| way.perp(&edge).abs() < MAX_SINE * way.norm() && way.norm() > 0.0);
            let nearest = along.min_by(|a, b| a.norm().total_cmp(&b.norm()))?;
            // The step points along the edge's direction, so that the orientation of both steps is known.
            Some(if nearest.dot(&edge) < 0.0 { -nearest } else { nearest })
        };
        let [edge, other_edge] = first.edges();
        let (mut u, mut v) = (step(edge)?, step(other_edge)?);
        if u.perp(&v) > 0.0 {
            (u, v) = (v, u);
        }
        let steps = BTreeMap::from([([0, 0], [u, v])]);
        Some(Self { saddles, members: BTreeMap::from([([0, 0], seed)]), steps })
    }

    fn grown(mut self) -> BTreeMap<Place, usize> {
        let mut is_used = vec![false; self.saddles.len()];
        for member in self.members.values() {
            is_used[*member] = true;
        }
        let mut waiting = VecDeque::from([[0, 0]]);
        while let Some(place) = waiting.pop_front() {
            for ([di, dj], axis, sign) in NEIGHBOURS {
                let next = [place[0] + di, place[1] + dj];
                if self.members.contains_key(&next) {
                    continue;
                }
                let from = &self.saddles[self.members[&place]];
                let step = self.step(place, axis, sign);
                let expected = from.place + step;
                let radius = MAX_OFF * step.norm();
                let candidates = self.saddles.iter().enumerate().filter(|(k, other)| {
                    !is_used[*k] && (other.place - expected).norm() < radius && is_neighbour(from, other)
                });
                let off = |k: usize| (self.saddles[k].place - expected).norm();
                let Some(found) = candidates.map(|(k, _)| k).min_by(|a, b| off(*a).total_cmp(&off(*b))) else {
                    continue;
                };
                is_used[found] = true;
                let mut steps = self.steps[&place];
                steps[axis] = (self.saddles[found].place - from.place) * sign;
                self.members.insert(next, found);
                self.steps.insert(next, steps);
                waiting.push_back(next);
            }
        }
        self.members
    }

    /// The step to the next position: that of a neighbouring row if known, otherwise the last step along this axis.
    fn step(&self, [i, j]: Place, axis: usize, sign: f64) -> Vector2<f64> {
        let [along, across] = if axis == 0 { [[1, 0], [0, 1]] } else { [[0, 1], [1, 0]] };
        let sign_i = sign as i32;
        let at = |place: Place| self.members.get(&place).map(|k| self.saddles[*k].place);
        let beside = [1, -1].into_iter().find_map(|side| {
            let row = [i + side * across[0], j + side * across[1]];
            let next = [row[0] + sign_i * along[0], row[1] + sign_i * along[1]];
            Some(at(next)? - at(row)?)
        });
        beside.unwrap_or_else(|| self.steps[&[i, j]][axis] * sign)
    }
}

fn is_neighbour(first: &Saddle, other: &Saddle) -> bool {
    other.strength > MIN_STRENGTH * first.strength
        && first.strength > MIN_STRENGTH * other.strength
        && first.is_opposite(other)
}

fn grid(saddles: &[Saddle], members: &BTreeMap<Place, usize>) -> Grid {
    let corners: BTreeMap<Place, Point2<f64>> = members.iter().map(|(place, k)| (*place, saddles[*k].place)).collect();
    let mut grid = Grid { corners, first_is_dark: false };
    // From each corner of a dark square, brightness decreases towards the square's centre. The corners vote, with
    // alternating sign for alternating squares.
    let mut votes = 0;
    for (place, k) in members {
        let Some([here, .., opposite]) = grid.square(*place) else { continue };
        let way = opposite - here;
        let falls = (way.transpose() * saddles[*k].hessian * way)[0] < 0.0;
        let is_even = (place[0] + place[1]).rem_euclid(2) == 0;
        votes += if falls == is_even { 1 } else { -1 };
    }
    grid.first_is_dark = votes > 0;
    grid
}
