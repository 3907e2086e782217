//! What a model takes and what there is.

/// Bytes that the system can give without swapping, where it says so.
pub(crate) fn at_hand() -> Option<u64> {
    let info = std::fs::read_to_string("/proc/meminfo").ok()?;
    available(&info)
}

/// The line `MemAvailable` of Linux, in bytes.
fn available(info: &str) -> Option<u64> {
    let line = info.lines().find(|line| line.starts_with("MemAvailable:"))?;
    Some(1024 * line.split_whitespace().nth(1)?.parse::<u64>().ok()?)
}

/// Bytes that a lattice in space takes with supports of normalised dilation 1, for each particle: tables, matrix, conditions and
/// working memory, as runs with 1e4 and 1e5 particles took them.
pub(crate) const PER_PARTICLE: f64 = 70_000.0;
/// The same where the solution iterates and cells away from the faces share their rows.
const PER_PARTICLE_ALIKE: f64 = 15_000.0;

/// Bytes that a model of so many particles along each axis takes at its peak, and the particles that would fit into a
/// limit. `alike`: spacings are even.
pub(crate) fn needed(counts: &[usize], reach: f64, iterates: bool, alike: bool) -> f64 {
    let particles: f64 = counts.iter().map(|&c| c as f64).product();
    let each = if iterates && alike { PER_PARTICLE_ALIKE } else { PER_PARTICLE };
    // Neighbours grow with the volume of supports.
    let mut bytes = particles * each * reach.max(1.0).powi(3);
    if !iterates {
        let mut sorted: Vec<f64> = counts.iter().map(|&c| c as f64).collect();
        sorted.sort_by(f64::total_cmp);
        let unknowns = 3.0 * particles;
        let band = (3.0 * sorted[0] * sorted[1] * 4.0 * reach.max(1.0)).min(unknowns);
        // Half of the band is filled, and the library works on another part of it.
        bytes += 0.5 * 8.0 * unknowns * band;
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_read_in_bytes() {
        assert_eq!(available("MemTotal: 10 kB\nMemAvailable:   2048 kB\n"), Some(2048 * 1024));
        assert_eq!(available("MemTotal: 10 kB\n"), None);
        // 104 430 particles took 1.3 GB.
        assert!((1.3e9..2.0e9).contains(&needed(&[47, 47, 47], 1.0, true, true)));
        assert!(needed(&[47; 3], 1.0, true, false) < 8.5e9);
        assert!(needed(&[47; 3], 1.0, false, true) > 2.0 * needed(&[47; 3], 1.0, true, false));
    }
}
