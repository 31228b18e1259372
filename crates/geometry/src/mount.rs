/// The body to which a camera is fixed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mount {
    /// The robot's hand: the camera moves with the flange.
    Hand,
    /// The robot's base, or a fixed place in the room.
    Base,
}

impl Mount {
    /// The name in files and options.
    pub fn name(self) -> &'static str {
        match self {
            Self::Hand => "hand",
            Self::Base => "base",
        }
    }
}
