//! The colours of bands of values.
use crate::each::array_of;
/// Bands of colour between the smallest and the largest value.
pub(super) const BANDS: usize = 12;

/// The colour of a band: dark blue over green to yellow (the map viridis), which prints and colour-blind readers keep apart.
pub(super) fn colour(band: usize) -> [f64; 3] {
    const STOPS: [[f64; 3]; 9] = [
        [68.0, 1.0, 84.0],
        [71.0, 44.0, 122.0],
        [59.0, 81.0, 139.0],
        [44.0, 113.0, 142.0],
        [33.0, 144.0, 141.0],
        [39.0, 173.0, 129.0],
        [92.0, 200.0, 99.0],
        [170.0, 220.0, 50.0],
        [253.0, 231.0, 37.0],
    ];
    let at = band.min(BANDS - 1) as f64 / (BANDS - 1) as f64 * 8.0;
    let low = (at as usize).min(7);
    array_of(|i| STOPS[low][i] + (at - low as f64) * (STOPS[low + 1][i] - STOPS[low][i]))
}
