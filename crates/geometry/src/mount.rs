/// The body to which a camera is fixed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mount {
    /// To the robot's hand: it moves with the flange.
    Hand,
    /// To the robot's base or the room, beside the robot.
    Base,
}

impl Mount {
    /// The name in files and of options.
    pub fn name(self) -> &'static str {
        match self {
            Self::Hand => "hand",
            Self::Base => "base",
        }
    }
}
