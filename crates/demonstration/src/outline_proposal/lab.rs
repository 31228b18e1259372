//! Colours in CIE L*a*b*, where equal distances correspond to about equal perceived differences.

use std::sync::LazyLock;

/// A colour: L in 0 to 100, a and b around 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Lab(pub [f32; 3]);

/// sRGB's transfer curve, for each of its 256 levels.
static LINEAR: LazyLock<[f32; 256]> = LazyLock::new(|| {
    std::array::from_fn(|level| {
        let value = level as f32 / 255.0;
        if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
    })
});

impl Lab {
    /// The colour of an sRGB pixel under D65.
    ///
    /// # Source
    /// IEC 61966-2-1 and CIE 15.
    pub fn from_srgb(rgb: [u8; 3]) -> Self {
        let [r, g, b] = rgb.map(|level| LINEAR[usize::from(level)]);
        // X, Y and Z, relative to those of the white point.
        let x = (0.412_456_4 * r + 0.357_576_1 * g + 0.180_437_5 * b) / 0.950_47;
        let y = 0.212_672_9 * r + 0.715_152_2 * g + 0.072_175 * b;
        let z = (0.019_333_9 * r + 0.119_192 * g + 0.950_304_1 * b) / 1.088_83;
        let compress = |t: f32| if t > 0.008_856 { t.cbrt() } else { 7.787 * t + 16.0 / 116.0 };
        let [fx, fy, fz] = [x, y, z].map(compress);
        Self([116.0 * fy - 16.0, 500.0 * (fx - fy), 200.0 * (fy - fz)])
    }

    /// The square of the distance between two colours.
    pub fn distance_squared(&self, other: &Self) -> f32 {
        self.0.iter().zip(&other.0).map(|(a, b)| (a - b) * (a - b)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_colors() {
        // Values of sRGB's primaries and grey from colour tables, to a tenth.
        for (rgb, lab) in [
            ([255, 255, 255], [100.0, 0.0, 0.0]),
            ([0, 0, 0], [0.0, 0.0, 0.0]),
            ([255, 0, 0], [53.2, 80.1, 67.2]),
            ([0, 0, 255], [32.3, 79.2, -107.9]),
            ([119, 119, 119], [50.0, 0.0, 0.0]),
        ] {
            let found = Lab::from_srgb(rgb);
            let off = found.distance_squared(&Lab(lab)).sqrt();
            assert!(off < 0.15, "{rgb:?}: {found:?}");
        }
    }
}
