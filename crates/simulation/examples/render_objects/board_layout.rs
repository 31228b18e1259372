//! Positions of all components on the circuit board as seen from above, in metres.

/// Side of the square that the textures of board and plastics cover.
pub const SPAN: f64 = 0.11;
/// Length of the board; its centre is beside the grasp (`MIDDLE_X`), because the connectors at -x are heavier.
pub const LENGTH: f64 = 0.092;
pub const WIDTH: f64 = 0.052;
pub const MIDDLE_X: f64 = 0.004;
pub const THICKNESS: f64 = 0.0016;
pub const STANDOFF: f64 = 0.0080;
pub const TOP: f64 = STANDOFF + THICKNESS;
/// Fixing holes at the corners: x of both ends, and y.
pub const FIXINGS: ([f64; 2], f64) = ([-0.0385, 0.0465], 0.0225);
/// Open holes, x and y.
pub const OPEN_HOLES: [(f64, f64); 2] = [(-0.0210, 0.0222), (0.0190, -0.0228)];

/// A cuboid on the board: centre and size as seen from above, and height.
pub struct Block {
    pub at: (f64, f64),
    pub size: (f64, f64),
    pub height: f64,
}

pub const fn block(x: f64, y: f64, length: f64, width: f64, height: f64) -> Block {
    Block { at: (x, y), size: (length, width), height }
}

pub const CONTROLLER: Block = block(0.0040, 0.0020, 0.0120, 0.0120, 0.0014);
pub const DRIVER: Block = block(0.0275, 0.0100, 0.0100, 0.0040, 0.0016);
pub const MEMORY: Block = block(-0.0160, -0.0005, 0.0050, 0.0040, 0.0016);
pub const RELAY: Block = block(0.0275, -0.0080, 0.0190, 0.0152, 0.0155);
pub const TERMINALS: [Block; 2] =
    [block(0.0455, -0.0085, 0.0082, 0.0203, 0.0102), block(0.0455, 0.0110, 0.0082, 0.0102, 0.0102)];
pub const JACK: Block = block(-0.0365, -0.0130, 0.0140, 0.0092, 0.0108);
pub const HEADER: Block = block(0.0080, 0.0208, 0.0254, 0.0050, 0.0025);
pub const USB: Block = block(-0.0355, 0.0100, 0.0165, 0.0120, 0.0108);
pub const CRYSTAL: Block = block(0.0040, -0.0105, 0.0110, 0.0045, 0.0034);
pub const BUTTON: Block = block(-0.0245, -0.0215, 0.0060, 0.0060, 0.0034);
/// Electrolytic capacitors: x, y, radius, height.
pub const CANS: [(f64, f64, f64, f64); 3] =
    [(-0.0215, -0.0110, 0.0040, 0.0105), (-0.0110, -0.0185, 0.0040, 0.0105), (-0.0205, 0.0125, 0.00315, 0.0080)];
/// Resistors and small capacitors: x, y, and whether they lie along y.
pub const CHIPS: [(f64, f64, bool); 18] = [
    (-0.0090, 0.0105, false),
    (-0.0090, 0.0130, false),
    (-0.0090, 0.0155, false),
    (-0.0050, -0.0075, true),
    (-0.0065, 0.0045, true),
    (-0.0065, 0.0000, true),
    (0.0135, 0.0055, true),
    (0.0135, 0.0005, true),
    (0.0135, -0.0045, true),
    (0.0000, 0.0125, false),
    (0.0045, 0.0125, false),
    (0.0090, 0.0125, false),
    (0.0230, 0.0165, false),
    (0.0275, 0.0165, false),
    (0.0320, 0.0165, false),
    (-0.0145, 0.0075, false),
    (0.0090, -0.0185, false),
    (0.0135, -0.0185, false),
];
/// Light-emitting diodes: x, y.
pub const LAMPS: [(f64, f64); 3] = [(0.0290, 0.0220), (0.0330, 0.0220), (0.0370, 0.0220)];
