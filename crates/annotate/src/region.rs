//! The searched region of a picture, as set on the page.

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};

/// A rectangle of whole pixels of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Region {
    /// Left edge.
    pub x: u32,
    /// Upper edge.
    pub y: u32,
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Width and height of the pictures that it applies to; `None` for pictures of any size.
    #[serde(default)]
    pub picture: Option<[u32; 2]>,
}

/// The searched region of pictures, in place of the region in a model's file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Searched {
    /// The whole picture.
    All,
    /// A part of it.
    Part(Region),
}

impl Searched {
    pub(crate) fn of(region: Option<Region>) -> Self {
        region.map_or(Self::All, Self::Part)
    }

    /// The region; `None` for the whole picture.
    pub fn region(self) -> Option<Region> {
        match self {
            Self::All => None,
            Self::Part(region) => Some(region),
        }
    }
}

impl Region {
    /// # Errors
    /// The region is empty or extends beyond the picture.
    pub(crate) fn check(&self) -> Result<()> {
        let refuse = |expected: String, found: String| Err(Error::Request { what: "region", expected, found });
        if self.width == 0 || self.height == 0 {
            return refuse("at least 1 × 1 pixels".to_owned(), format!("{} × {}", self.width, self.height));
        }
        let ends = [self.x, self.y].map(u64::from);
        let (right, bottom) = (ends[0] + u64::from(self.width), ends[1] + u64::from(self.height));
        match self.picture {
            Some([width, height]) if right > u64::from(width) || bottom > u64::from(height) => {
                let found = format!("one that ends at ({right}, {bottom})");
                refuse(format!("a part of the picture of {width} × {height} pixels"), found)
            }
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regions_are_parts_of_their_picture() {
        let region = |x: u32, width: u32| Region { x, y: 10, width, height: 20, picture: Some([640, 480]) };
        assert!(region(0, 640).check().is_ok() && region(600, 40).check().is_ok());
        let outside = region(600, 41).check().unwrap_err().to_string();
        assert!(
            outside.contains("a part of the picture of 640 × 480 pixels") && outside.contains("(641, 30)"),
            "{outside}"
        );
        assert!(region(u32::MAX, u32::MAX).check().is_err());
        assert!(region(0, 0).check().unwrap_err().to_string().contains("0 × 20"));
        assert!(Region { picture: None, ..region(9000, 5) }.check().is_ok());
    }
}
