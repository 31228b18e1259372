//! The kinds of distractors.

/// Common workshop parts, some of which resemble shipped parts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DistractorKind {
    /// Hexagon head bolt on its side.
    Bolt,
    /// Hexagon nut.
    Nut,
    /// Flat washer.
    Washer,
    /// Plate with holes.
    Plate,
    /// Angle bracket.
    Bracket,
    /// Dowel pin or plain bar.
    Dowel,
    /// Ball bearing: two rings and a seal.
    Bearing,
    /// Block with a bore.
    Block,
    /// Spur gear.
    Gear,
    /// Bent tube without fittings, which resembles a fuel line.
    BentTube,
    /// Lever with two bored ends, which resembles a pendulum.
    Lever,
    /// Eye bolt, which resembles a rod end.
    EyeBolt,
    /// Coil spring.
    Spring,
    /// Stepped shaft.
    Shaft,
    /// Flange with bolt holes.
    Flange,
    /// Open-ended spanner.
    Spanner,
}

impl DistractorKind {
    /// All kinds.
    pub const ALL: [DistractorKind; 16] = [
        DistractorKind::Bolt,
        DistractorKind::Nut,
        DistractorKind::Washer,
        DistractorKind::Plate,
        DistractorKind::Bracket,
        DistractorKind::Dowel,
        DistractorKind::Bearing,
        DistractorKind::Block,
        DistractorKind::Gear,
        DistractorKind::BentTube,
        DistractorKind::Lever,
        DistractorKind::EyeBolt,
        DistractorKind::Spring,
        DistractorKind::Shaft,
        DistractorKind::Flange,
        DistractorKind::Spanner,
    ];
}
