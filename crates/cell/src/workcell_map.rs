//! The map of a workcell. The base's x points right, its y points up.

use image::{Rgb, RgbImage};
use nalgebra::Point2;
use sdg_geometry::{BoundingBox, Polygon};
use sdg_kinematics::collision::Obstacle;
use sdg_report::{Color, Pen, draw_box, draw_label, draw_line, draw_polygon, label_bounds, shade_polygon};
use sdg_robot::workcell::Workcell;
use sdg_robot::{LookOut, Place};

use crate::hand_reach::Reach;
use crate::obstacle_outline::seen_from_above;

/// Pixels per metre of the map.
const PX_PER_M: f64 = 720.0;
/// Margin around the map, in pixels.
const FRAME_PX: f64 = 46.0;
/// Height of the legend below the map, in pixels.
const KEY_PX: f64 = 74.0;
const TEXT_PX: f64 = 9.0;
/// The footprint of the arm's base (x, y), in metres.
const FOOT_M: [[f64; 2]; 2] = [[-0.17, 0.09], [-0.11, 0.11]];
/// Spacing of the grid lines, in metres.
const LINES_M: f64 = 0.1;

const GROUND: Rgb<u8> = Rgb([250, 249, 246]);
const LINE: Color = Color([223, 222, 217]);
const INK: Color = Color([58, 60, 66]);
const REACHED: Color = Color([46, 160, 103]);
const WORKSPACE: Color = Color([52, 101, 214]);
const PLACE: Color = Color([196, 92, 16]);
const OBSTACLE: Color = Color([122, 92, 150]);
const LOOK: Color = Color([20, 120, 150]);
const PAPER: Color = Color([250, 249, 246]);

/// The drawn area: x and y in the base frame, in metres.
pub struct WorkcellMap {
    x_m: [f64; 2],
    y_m: [f64; 2],
}

impl WorkcellMap {
    /// Chooses an area that contains the workspace, the table, the places and the arm's base.
    pub fn around(workcell: &Workcell) -> Self {
        let (min, max) = (workcell.workspace.min_m, workcell.workspace.max_m);
        let mut map = Self { x_m: [min.x.min(FOOT_M[0][0]), max.x], y_m: [min.y.min(-0.2), max.y.max(0.2)] };
        let corners = workcell.places.iter().flat_map(Place::corners);
        let table = workcell.table_m.iter().flat_map(|[x, y]| [Point2::new(x[0], y[0]), Point2::new(x[1], y[1])]);
        for p in corners.chain(table) {
            map.x_m = [map.x_m[0].min(p.x), map.x_m[1].max(p.x)];
            map.y_m = [map.y_m[0].min(p.y), map.y_m[1].max(p.y)];
        }
        let round = |[low, high]: [f64; 2]| {
            [((low - 0.02) / LINES_M).floor() * LINES_M, ((high + 0.02) / LINES_M).ceil() * LINES_M]
        };
        Self { x_m: round(map.x_m), y_m: round(map.y_m) }
    }

    /// The drawn area: x and y in the base frame, in metres.
    pub fn area_m(&self) -> [[f64; 2]; 2] {
        [self.x_m, self.y_m]
    }

    fn px(&self, p: Point2<f64>) -> Point2<f64> {
        Point2::new(FRAME_PX + (p.x - self.x_m[0]) * PX_PER_M, FRAME_PX + (self.y_m[1] - p.y) * PX_PER_M)
    }

    fn polygon(&self, corners: &[Point2<f64>]) -> Polygon {
        Polygon { vertices: corners.iter().map(|&p| self.px(p)).collect() }
    }

    fn bounds(&self, [x, y]: [[f64; 2]; 2]) -> BoundingBox {
        let (upper_left, lower_right) = (self.px(Point2::new(x[0], y[1])), self.px(Point2::new(x[1], y[0])));
        BoundingBox { x1: upper_left.x, y1: upper_left.y, x2: lower_right.x, y2: lower_right.y }
    }

    /// Draws the map.
    pub fn draw(&self, workcell: &Workcell, reach: &Reach) -> RgbImage {
        let width = (self.x_m[1] - self.x_m[0]) * PX_PER_M + 2.0 * FRAME_PX;
        let height = (self.y_m[1] - self.y_m[0]) * PX_PER_M + 2.0 * FRAME_PX + KEY_PX;
        let mut image = RgbImage::from_pixel(width.ceil() as u32, height.ceil() as u32, GROUND);
        let most = reach.squares.iter().map(|square| square.num_turns).max().unwrap_or(0);
        for square in &reach.squares {
            let half = 0.5 * reach.grid_m;
            let (x, y) = (square.at_m.x, square.at_m.y);
            let corners = [[-half, -half], [half, -half], [half, half], [-half, half]];
            let corners = corners.map(|[dx, dy]| Point2::new(x + dx, y + dy));
            shade_polygon(
                &mut image,
                &self.polygon(&corners),
                REACHED,
                0.45 * square.num_turns as f64 / most.max(1) as f64,
            );
        }
        let mut labels = Labels::default();
        self.draw_lines(&mut image);
        if let Some(table) = workcell.table_m {
            draw_box(&mut image, &self.bounds(table), &pen(INK, 2.0));
        }
        let (min, max) = (workcell.workspace.min_m, workcell.workspace.max_m);
        draw_box(&mut image, &self.bounds([[min.x, max.x], [min.y, max.y]]), &pen(WORKSPACE, 2.0).dashed(9.0, 6.0));
        draw_box(&mut image, &self.bounds(FOOT_M), &pen(INK, 2.0));
        labels.add(self.px(Point2::new(FOOT_M[0][0] + 0.01, 0.0)), "robot", INK);
        for obstacle in &workcell.obstacles {
            self.draw_obstacle(&mut image, obstacle, &mut labels);
        }
        for place in &workcell.places {
            self.draw_place(&mut image, place, &mut labels);
        }
        let arm = workcell.robot.geometry();
        for (index, look_out) in workcell.look_outs.iter().enumerate() {
            let at = self.px(match look_out {
                LookOut::CameraAt { at_m, .. } => Point2::from(*at_m),
                // The tcp, because the camera may be beside the robot.
                LookOut::Joints(q) => Point2::from(arm.forward(q).translation.vector.xy()),
            });
            for (dx, dy) in [(7.0, 0.0), (0.0, 7.0)] {
                let [from, to] = [-1.0, 1.0].map(|s| Point2::new(at.x + s * dx, at.y + s * dy));
                draw_line(&mut image, from, to, &pen(LOOK, 2.0));
            }
            labels.add(Point2::new(at.x + 9.0, at.y - 4.0), &format!("look {}", index + 1), LOOK);
        }
        labels.draw(&mut image);
        self.draw_key(&mut image, workcell, most);
        image
    }

    /// Draws a grid, with lengths in mm at the edges.
    fn draw_lines(&self, image: &mut RgbImage) {
        let thin = pen(LINE, 1.0);
        let steps = |[low, high]: [f64; 2]| {
            let (first, last) = ((low / LINES_M).round() as i64, (high / LINES_M).round() as i64);
            first..=last
        };
        for step in steps(self.x_m) {
            let x = step as f64 * LINES_M;
            let [from, to] = [self.y_m[0], self.y_m[1]].map(|y| self.px(Point2::new(x, y)));
            draw_line(image, from, to, &thin);
            let text = if step == 0 { "x 0 mm".to_owned() } else { format!("{}", step * 100) };
            draw_label(image, Point2::new(from.x - 14.0, from.y + 24.0), &text, PAPER, TEXT_PX);
        }
        for step in steps(self.y_m) {
            let y = step as f64 * LINES_M;
            let [from, to] = [self.x_m[0], self.x_m[1]].map(|x| self.px(Point2::new(x, y)));
            draw_line(image, from, to, &thin);
            let text = if step == 0 { "y 0".to_owned() } else { format!("{}", step * 100) };
            draw_label(image, Point2::new(from.x - 42.0, from.y + 8.0), &text, PAPER, TEXT_PX);
        }
    }

    fn draw_obstacle(&self, image: &mut RgbImage, obstacle: &Obstacle, labels: &mut Labels) {
        let Some(outline) = seen_from_above(obstacle) else {
            // A plane has no outline.
            return;
        };
        let polygon = self.polygon(&outline);
        shade_polygon(image, &polygon, OBSTACLE, 0.45);
        draw_polygon(image, &polygon, &pen(OBSTACLE, 2.0));
        // Above the upper edge of the outline.
        let top = outline.iter().map(|p| p.y).fold(f64::NEG_INFINITY, f64::max);
        let at = self.px(Point2::new(obstacle.base_from_obstacle.translation.x, top));
        labels.add(Point2::new(at.x - 12.0, at.y - 4.0), &obstacle.name, OBSTACLE);
    }

    fn draw_place(&self, image: &mut RgbImage, place: &Place, labels: &mut Labels) {
        let corners = place.corners();
        if corners.len() > 1 {
            draw_polygon(image, &self.polygon(&corners), &pen(PLACE, 2.0));
        }
        for cell in 1..=place.num_cells() {
            let Ok(goal) = place.goal(cell) else { continue };
            let (sin, cos) = goal.yaw_rad.sin_cos();
            let at = Point2::from(goal.at_m);
            // The marked line, with a cross stroke at its end.
            let ends = [-0.018, 0.018].map(|s| self.px(Point2::new(at.x + s * cos, at.y + s * sin)));
            draw_line(image, ends[0], ends[1], &pen(PLACE, 2.0));
            let tip = [-0.006, 0.006]
                .map(|s| self.px(Point2::new(at.x + 0.018 * cos - s * sin, at.y + 0.018 * sin + s * cos)));
            draw_line(image, tip[0], tip[1], &pen(PLACE, 2.0));
        }
        let upper = corners.iter().copied().max_by(|a, b| (a.y - a.x * 1e-3).total_cmp(&(b.y - b.x * 1e-3)));
        let at = self.px(upper.unwrap_or_else(|| Point2::from(place.at_m)));
        let text = match place.num_cells() {
            1 => place.name.clone(),
            num => format!("{}:1 to {num}", place.name),
        };
        // The label must be above the mark of a single pose.
        let above_px = if corners.len() > 1 { 4.0 } else { 0.03 * PX_PER_M };
        labels.add(Point2::new(at.x, at.y - above_px), &text, PLACE);
    }

    fn draw_key(&self, image: &mut RgbImage, workcell: &Workcell, most: usize) {
        let mut x = FRAME_PX;
        let y = FRAME_PX + (self.y_m[1] - self.y_m[0]) * PX_PER_M + 52.0;
        let is_tcp = |look_out: &LookOut| matches!(look_out, LookOut::Joints(_));
        let at_look_out = match (workcell.look_outs.iter().all(is_tcp), workcell.look_outs.iter().any(is_tcp)) {
            (true, _) => "tcp at a look-out",
            (false, true) => "camera or tcp at a look-out",
            (false, false) => "camera at a look-out",
        };
        let mut entries = vec![
            ("reached (paler: at fewer angles of the hand)", REACHED),
            ("workspace", WORKSPACE),
            ("place", PLACE),
            ("obstacle", OBSTACLE),
            (at_look_out, LOOK),
        ];
        if most == 0 {
            entries.remove(0);
        }
        if workcell.table_m.is_some() {
            entries.push(("table", INK));
        }
        let mut row = 0.0;
        for (text, color) in entries {
            let probe = label_bounds(image, Point2::new(0.0, 100.0), text, TEXT_PX);
            if x + 20.0 + probe.x2 > f64::from(image.width()) - 8.0 {
                (x, row) = (FRAME_PX, row + 24.0);
            }
            let square = BoundingBox { x1: x, y1: y + row - 12.0, x2: x + 12.0, y2: y + row };
            let corners = square.corners().to_vec();
            shade_polygon(image, &Polygon { vertices: corners }, color, if color == REACHED { 0.45 } else { 1.0 });
            draw_label(image, Point2::new(x + 14.0, y + row + 3.0), text, PAPER, TEXT_PX);
            x += 26.0 + probe.x2;
        }
    }
}

/// Places labels so that they do not overlap.
#[derive(Default)]
struct Labels(Vec<(Point2<f64>, String, Color)>);

impl Labels {
    fn add(&mut self, at: Point2<f64>, text: &str, color: Color) {
        self.0.push((at, text.to_owned(), color));
    }

    fn draw(self, image: &mut RgbImage) {
        let mut taken: Vec<BoundingBox> = Vec::new();
        for (at, text, color) in self.0 {
            let overlaps = |bounds: &BoundingBox| {
                taken.iter().any(|other| {
                    bounds.x1 < other.x2 && other.x1 < bounds.x2 && bounds.y1 < other.y2 && other.y1 < bounds.y2
                })
            };
            // Moves the label down step by step until it overlaps no other label.
            let mut place = at;
            let mut bounds = label_bounds(image, place, &text, TEXT_PX);
            while overlaps(&bounds) && bounds.y2 < f64::from(image.height()) - 1.0 {
                place.y += 4.0;
                bounds = label_bounds(image, place, &text, TEXT_PX);
            }
            draw_label(image, place, &text, color, TEXT_PX);
            taken.push(bounds);
        }
    }
}

fn pen(color: Color, width: f64) -> Pen {
    Pen::new(color).width(width).without_halo()
}

#[cfg(test)]
mod tests {
    use super::*;
    use sdg_kinematics::JointVector;

    #[test]
    fn look_outs_by_joints_are_drawn_at_the_tcp() {
        let shipped = include_str!("../../../datasets/workcell/workcell.toml");
        let joints_deg = [50.0, -45.0, 0.0, -135.0, 0.0, 90.0, 45.0];
        let head = shipped.split("[[look_out]]").next().unwrap();
        let workcell = Workcell::from_toml(&format!("{head}[[look_out]]\njoints_deg = {joints_deg:?}\n")).unwrap();
        let reach = Reach::of(&workcell, [[0.4, 0.5], [0.0, 0.1]], 0.1, 0.02).unwrap();
        let map = WorkcellMap::around(&workcell);
        let tcp_m = workcell.robot.geometry().forward(&JointVector::from(joints_deg.map(f64::to_radians))).translation;
        let at = map.px(Point2::new(tcp_m.x, tcp_m.y));
        let found = map.draw(&workcell, &reach).get_pixel(at.x as u32, at.y as u32).0;
        assert!((0..3).all(|k| found[k].abs_diff(LOOK.0[k]) < 12), "{found:?} at {at}");
    }
}
