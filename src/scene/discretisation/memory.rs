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

/// Particles of a body in space: of all, and along its longest side.
#[derive(Clone, Copy)]
pub(super) struct Size {
    pub particles: f64,
    pub longest: f64,
}

impl Size {
    /// Of a lattice with so many particles along each axis.
    pub(super) fn of(counts: &[usize]) -> Size {
        let counts = counts.iter().map(|&c| c as f64);
        Size { particles: counts.clone().product(), longest: counts.fold(1.0, f64::max) }
    }

    /// Unknowns of a band that is so many layers of a mean cross section wide.
    pub(super) fn band(self, layers: f64) -> f64 {
        (3.0 * self.particles / self.longest * layers).min(3.0 * self.particles)
    }
}

/// Bytes that a model takes at its peak. `alike`: spacings are even.
pub(super) fn needed(size: Size, reach: f64, iterates: bool, alike: bool) -> f64 {
    let particles = size.particles;
    let each = if iterates && alike { PER_PARTICLE_ALIKE } else { PER_PARTICLE };
    // Neighbours grow with the volume of supports.
    let mut bytes = particles * each * reach.max(1.0).powi(3);
    if !iterates {
        // Half of the band is filled, and the library works on another part of it.
        bytes += 0.5 * 8.0 * 3.0 * particles * size.band(4.0 * reach.max(1.0));
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
        let cube = Size::of(&[47; 3]);
        // 104 430 particles took 1.3 GB.
        assert!((1.3e9..2.0e9).contains(&needed(cube, 1.0, true, true)));
        assert!(needed(cube, 1.0, true, false) < 8.5e9);
        assert!(needed(cube, 1.0, false, true) > 2.0 * needed(cube, 1.0, true, false));
    }
}
