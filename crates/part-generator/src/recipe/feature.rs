//! The effect of a feature on the surface above the points of its shape.

use super::shape::Shape;

/// The surface above a point of the table: material between `bottom` and `top`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct State {
    /// Highest point, in millimetres; not positive if there is no material.
    pub top: f32,
    /// Lowest point, in millimetres.
    pub bottom: f32,
    /// Index of the material.
    pub material: u8,
}

impl State {
    /// No material.
    pub const EMPTY: Self = Self { top: 0.0, bottom: 0.0, material: 0 };

    /// Whether there is material.
    pub fn is_covered(&self) -> bool {
        self.top > 0.0
    }

    fn fill(&mut self, bottom: f32, top: f32, material: u8) {
        self.bottom = if self.is_covered() { self.bottom.min(bottom) } else { bottom };
        if top > self.top {
            self.top = top;
            self.material = material;
        }
    }
}

/// The profile of a surface towards the edge of its shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Edge {
    /// Width of the profile, from the edge inwards.
    pub width: f32,
    /// Height difference.
    pub drop: f32,
    /// Whether the profile is round; otherwise it is a straight chamfer.
    pub round: bool,
}

impl Edge {
    /// A sharp edge.
    pub const SHARP: Self = Self { width: 0.0, drop: 0.0, round: false };

    /// A chamfer of 45 degrees.
    pub fn chamfer(width: f32) -> Self {
        Self { width, drop: width, round: false }
    }

    /// A quarter of a circle.
    pub fn rounded(radius: f32) -> Self {
        Self { width: radius, drop: radius, round: true }
    }

    /// The height difference at `depth` inside the shape.
    fn fall(&self, depth: f32) -> f32 {
        if depth >= self.width {
            return 0.0;
        }
        let t = 1.0 - depth / self.width;
        self.drop * if self.round { 1.0 - (1.0 - t * t).max(0.0).sqrt() } else { t }
    }
}

/// A section of a turned part with varying radius.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Ripple {
    /// Start on the axis.
    pub from: f32,
    /// End on the axis.
    pub to: f32,
    /// Length of one period: a thread's pitch.
    pub pitch: f32,
    /// Depth of the valleys.
    pub depth: f32,
    /// Kind of the variation.
    pub kind: RippleKind,
}

/// How a turned section differs from a cylinder.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RippleKind {
    /// A right-handed helix with the given pitch.
    Thread,
    /// A left-handed helix with the given pitch: the mirror image of a thread.
    LeftThread,
    /// Valleys along the axis.
    Knurl,
    /// Six flats; `depth` and `pitch` are ignored.
    Hexagon,
}

/// The operation of a feature.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Operation {
    /// Material from `bottom` to `top`.
    Add {
        /// Lower side.
        bottom: f32,
        /// Upper side.
        top: f32,
        /// Profile of the upper side's edge.
        edge: Edge,
    },
    /// Like `Add` from the table, with a fillet onto lower material around it.
    Blend {
        /// Upper side.
        top: f32,
        /// Profile of the upper side's edge.
        edge: Edge,
        /// Radius of the fillet.
        fillet: f32,
    },
    /// A sheet whose upper side rises or falls along x, across the shape.
    Slope {
        /// Upper side at the smallest x.
        from: f32,
        /// Upper side at the largest x.
        to: f32,
        /// Thickness of the sheet.
        thickness: f32,
        /// Half of the shape's length along x.
        half_length: f32,
    },
    /// A round bar along the shape, which must be a path.
    Tube,
    /// A body turned about the x axis.
    Turned {
        /// Radius over x: points (x, radius) between which it is linear.
        profile: Vec<[f32; 2]>,
        /// Height of the axis.
        axis_z: f32,
        /// Threads, knurls and hexagons.
        ripples: Vec<Ripple>,
    },
    /// Removes everything above `floor`; everything if `floor` is not positive.
    Cut {
        /// Height of the remaining material.
        floor: f32,
        /// Chamfer around the cut, in the material of the feature.
        chamfer: f32,
        /// Whether the floor gets the feature's material: a machined seat.
        machined: bool,
    },
    /// Raises the surface, or lowers it if `by` is negative, with slopes at the edge of the shape.
    Emboss {
        /// Height of the step.
        by: f32,
        /// Width of the slope.
        width: f32,
    },
    /// Changes the material but not the height: print, label, mark.
    Paint,
}

impl Operation {
    /// Whether the operation adds material to empty points.
    pub fn adds(&self) -> bool {
        matches!(self, Self::Add { .. } | Self::Blend { .. } | Self::Slope { .. } | Self::Tube | Self::Turned { .. })
    }
}

/// A shape at a position, and its operation.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Feature {
    /// The shape in the feature's own frame.
    pub shape: Shape,
    /// Position of its origin in the part's frame.
    pub center: [f32; 2],
    /// Rotation, in radians from x to y.
    pub turn: f32,
    /// The operation.
    pub operation: Operation,
    /// Index of its material.
    pub material: u8,
    /// Features of one group move together; of group 0, the body, only a corner, bend or end moves.
    pub group: u16,
}

/// A feature with the values that are equal for all points.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Prepared<'a> {
    feature: &'a Feature,
    sin_cos: [f32; 2],
    /// Square of the distance beyond which the feature has no effect.
    reach_squared: f32,
}

impl Prepared<'_> {
    /// Applies the feature to the surface above a point in the part's frame.
    pub fn apply(&self, x: f32, y: f32, state: &mut State) {
        let (px, py) = (x - self.feature.center[0], y - self.feature.center[1]);
        if px * px + py * py <= self.reach_squared {
            let [sin, cos] = self.sin_cos;
            self.feature.apply_local(cos * px + sin * py, cos * py - sin * px, state);
        }
    }
}

impl Feature {
    /// Precomputes the values that are equal for all points.
    pub fn prepare(&self) -> Prepared<'_> {
        let (sin, cos) = self.turn.sin_cos();
        let reach = match &self.operation {
            Operation::Blend { fillet, .. } => self.shape.reach() + fillet,
            Operation::Cut { chamfer, .. } => self.shape.reach() + chamfer,
            Operation::Turned { profile, .. } => profile.iter().map(|[x, r]| x.hypot(*r)).fold(0.0, f32::max),
            _ => self.shape.reach(),
        };
        Prepared { feature: self, sin_cos: [sin, cos], reach_squared: reach * reach }
    }

    /// Applies the feature to the surface above a point in its own frame.
    fn apply_local(&self, lx: f32, ly: f32, state: &mut State) {
        if let Operation::Turned { profile, axis_z, ripples } = &self.operation {
            turned(profile, *axis_z, ripples, lx, ly, self.material, state);
            return;
        }
        let (distance, z) = self.shape.locate(lx, ly);
        let depth = -distance;
        let inside = depth > 0.0;
        match &self.operation {
            Operation::Add { bottom, top, edge } if inside => {
                state.fill(*bottom, (top - edge.fall(depth)).max(bottom + 0.05), self.material);
            }
            Operation::Blend { top, edge, fillet } => {
                let fallen = (top - edge.fall(depth.max(0.0))).max(0.05);
                if inside {
                    state.fill(0.0, fallen, self.material);
                } else if state.is_covered() && distance < *fillet && state.top < fallen {
                    let rise = fillet * (1.0 - distance / fillet).powi(2);
                    state.top = (state.top + rise).min(fallen);
                }
            }
            Operation::Slope { from, to, thickness, half_length } if inside => {
                let top = from + (to - from) * (0.5 + 0.5 * lx / half_length).clamp(0.0, 1.0);
                state.fill((top - thickness).max(0.0), top, self.material);
            }
            Operation::Tube if inside => {
                if let Shape::Path { radius, .. } = &self.shape {
                    let across = distance + radius;
                    let rise = (radius * radius - across * across).max(0.0).sqrt();
                    // Only one layer is stored above a point. A raised strand is filled down to the table; otherwise
                    // the material below it would be lost, and the part would fall apart.
                    let bottom = if z > 1.6 * radius { 0.0 } else { (z - rise).max(0.0) };
                    state.fill(bottom, z + rise, self.material);
                }
            }
            Operation::Cut { floor, chamfer, machined } if state.is_covered() => {
                if inside {
                    if *floor <= 0.0 {
                        *state = State::EMPTY;
                    } else if state.top > *floor {
                        state.top = floor.max(state.bottom + 0.05);
                        if *machined {
                            state.material = self.material;
                        }
                    }
                } else if distance < *chamfer {
                    state.top = (state.top - (chamfer - distance)).max(state.bottom + 0.05);
                    state.material = self.material;
                }
            }
            Operation::Emboss { by, width } if inside && state.is_covered() => {
                state.top = (state.top + by * (depth / width).min(1.0)).max(state.bottom + 0.05);
            }
            Operation::Paint if inside && state.is_covered() => state.material = self.material,
            _ => {}
        }
    }

    /// Bounding box of the material that the feature can add: [min x, min y, max x, max y].
    pub fn bounds(&self) -> [f32; 4] {
        let (sin, cos) = self.turn.sin_cos();
        let corners: Vec<[f32; 2]> = match (&self.operation, &self.shape) {
            (Operation::Turned { profile, .. }, _) => profile.iter().flat_map(|&[x, r]| [[x, r], [x, -r]]).collect(),
            (_, Shape::Rectangle { half: [hx, hy], .. }) => vec![[*hx, *hy], [-*hx, *hy], [*hx, -*hy], [-*hx, -*hy]],
            (_, Shape::Polygon { vertices, corner }) => vertices
                .iter()
                .flat_map(|v| [[v[0] - corner, v[1] - corner], [v[0] + corner, v[1] + corner]])
                .chain(vertices.iter().flat_map(|v| [[v[0] + corner, v[1] - corner], [v[0] - corner, v[1] + corner]]))
                .collect(),
            (_, Shape::Path { points, radius }) => points
                .iter()
                .flat_map(|p| {
                    [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]]
                        .map(|[a, b]: [f32; 2]| [p[0] + a * radius, p[1] + b * radius])
                })
                .collect(),
            (_, shape) => {
                let r = shape.reach();
                let c = self.center;
                return [c[0] - r, c[1] - r, c[0] + r, c[1] + r];
            }
        };
        corners.iter().fold([f32::MAX, f32::MAX, f32::MIN, f32::MIN], |b, &[x, y]| {
            let (gx, gy) = (self.center[0] + cos * x - sin * y, self.center[1] + sin * x + cos * y);
            [b[0].min(gx), b[1].min(gy), b[2].max(gx), b[3].max(gy)]
        })
    }

    /// Mirrors across the y axis of the part.
    pub fn mirror(&mut self) {
        self.center[0] = -self.center[0];
        self.turn = -self.turn;
        self.shape.mirror();
        match &mut self.operation {
            Operation::Turned { profile, ripples, .. } => {
                profile.iter_mut().for_each(|point| point[0] = -point[0]);
                profile.reverse();
                for ripple in ripples {
                    (ripple.from, ripple.to) = (-ripple.to, -ripple.from);
                    ripple.kind = match ripple.kind {
                        RippleKind::Thread => RippleKind::LeftThread,
                        RippleKind::LeftThread => RippleKind::Thread,
                        other => other,
                    };
                }
            }
            Operation::Slope { from, to, .. } => std::mem::swap(from, to),
            _ => {}
        }
        if let Shape::Lobed { .. } = self.shape {
            self.turn += std::f32::consts::PI;
        }
    }
}

/// The upper and lower side of a body turned about x at height `axis_z`.
fn turned(profile: &[[f32; 2]], axis_z: f32, ripples: &[Ripple], x: f32, y: f32, material: u8, state: &mut State) {
    let Some(idx) = profile.windows(2).position(|ends| x >= ends[0][0] && x < ends[1][0]) else { return };
    let ([x0, r0], [x1, r1]) = (profile[idx], profile[idx + 1]);
    let mut radius = r0 + (r1 - r0) * (x - x0) / (x1 - x0).max(1e-6);
    if y.abs() >= radius {
        return;
    }
    let mut flats = false;
    for ripple in ripples.iter().filter(|ripple| x >= ripple.from && x < ripple.to) {
        let around = (y / radius).asin();
        match ripple.kind {
            RippleKind::Thread | RippleKind::LeftThread => {
                let hand = if ripple.kind == RippleKind::Thread { 1.0 } else { -1.0 };
                let phase = (x / ripple.pitch + hand * around / std::f32::consts::TAU).rem_euclid(1.0);
                radius -= ripple.depth * (2.0 * phase - 1.0).abs();
            }
            RippleKind::Knurl => {
                let phase = (around * radius / ripple.pitch).rem_euclid(1.0);
                radius -= ripple.depth * (2.0 * phase - 1.0).abs();
            }
            RippleKind::Hexagon => flats = true,
        }
    }
    if y.abs() >= radius {
        return;
    }
    let rise = if flats {
        // Corners at ±radius, one flat on top: the flat's half width is half of the radius.
        let apothem = radius * 0.866;
        if y.abs() < 0.5 * radius { apothem } else { (radius - y.abs()) * 1.732 }
    } else {
        (radius * radius - y * y).sqrt()
    };
    state.fill((axis_z - rise).max(0.0), axis_z + rise, material);
}
