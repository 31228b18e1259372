//! Gaussian blur of pictures in linear light, and rows extended beyond the picture.

/// Copies a row of pixels, three values each, extended at both ends by `reach` copies of the first and the last pixel.
pub(crate) fn pad_row(row: &[f32], reach: usize, padded: &mut [f32]) {
    let (start, end) = (3 * reach, 3 * reach + row.len());
    padded[start..end].copy_from_slice(row);
    for k in 0..start {
        padded[k] = row[k % 3];
        padded[end + k] = row[row.len() - 3 + k % 3];
    }
}

/// Blurs a picture by a Gaussian, first along one axis, then along the other; `spare` has the length of the picture.
pub(crate) fn blur(light: &mut [[f32; 3]], spare: &mut [[f32; 3]], width: usize, sigma: f32) {
    let height = light.len() / width;
    let reach = ((2.3 * sigma).ceil() as usize).clamp(1, 12);
    let weights: Vec<f32> = (0..=reach).map(|d| (-0.5 * (d as f32 / sigma).powi(2)).exp()).collect();
    let total = weights[0] + 2.0 * weights[1..].iter().sum::<f32>();
    let weights: Vec<f32> = weights.iter().map(|w| w / total).collect();
    // Channels of neighbouring pixels are adjacent in memory: the loops below are vectorised.
    let (light, spare, row_len) = (light.as_flattened_mut(), spare.as_flattened_mut(), 3 * width);
    let mut padded = vec![0.0f32; row_len + 6 * reach];
    let start = 3 * reach;
    for (row, out) in light.chunks_exact(row_len).zip(spare.chunks_exact_mut(row_len)) {
        pad_row(row, reach, &mut padded);
        out.iter_mut().zip(&padded[start..]).for_each(|(out, center)| *out = center * weights[0]);
        for (d, &weight) in weights.iter().enumerate().skip(1) {
            let (left, right) = (&padded[start - 3 * d..][..row_len], &padded[start + 3 * d..][..row_len]);
            for ((out, a), b) in out.iter_mut().zip(left).zip(right) {
                *out += (a + b) * weight;
            }
        }
    }
    let row = |y: isize| {
        let y = y.clamp(0, height as isize - 1) as usize;
        &spare[y * row_len..(y + 1) * row_len]
    };
    for (y, out) in light.chunks_exact_mut(row_len).enumerate() {
        out.iter_mut().zip(row(y as isize)).for_each(|(out, center)| *out = center * weights[0]);
        for (d, &weight) in weights.iter().enumerate().skip(1) {
            let (above, below) = (row(y as isize - d as isize), row(y as isize + d as isize));
            for ((out, a), b) in out.iter_mut().zip(above).zip(below) {
                *out += (a + b) * weight;
            }
        }
    }
}
