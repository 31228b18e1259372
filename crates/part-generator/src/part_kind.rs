//! Manufacturing processes of parts.

/// The manufacturing process of a part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum PartKind {
    /// Punched out of sheet or plate.
    Stamping,
    /// Turned, lying on its side: shafts, screws, spindles.
    TurnedLying,
    /// Turned, standing on its face: rings, flanges, gears, knobs.
    TurnedStanding,
    /// Bent from wire or tube.
    BentWire,
    /// Bent from sheet.
    BentSheet,
    /// Cast.
    Cast,
    /// Moulded from plastic.
    Moulded,
}

impl PartKind {
    /// All kinds.
    pub const ALL: [Self; 7] = [
        Self::Stamping,
        Self::TurnedLying,
        Self::TurnedStanding,
        Self::BentWire,
        Self::BentSheet,
        Self::Cast,
        Self::Moulded,
    ];
}
