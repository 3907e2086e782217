//! The shape functions of a scheme on the particles of cells.

use crate::cells::{Cells, Lattice};
use crate::error::{ApproximationError, Error};
use crate::particles::Particles;

use super::cover;
use super::cover::KernelFunctions;
use crate::scene::{Dilation, Scheme};

/// The shape functions of a scheme on the particles of cells.
pub(crate) fn kernel_functions<const D: usize>(
    scheme: &Scheme,
    cells: &dyn Cells<D>,
) -> Result<KernelFunctions<D>, Error> {
    Ok(covering(scheme, cells)?.0)
}

/// The same with the number of particles whose supports were raised to cover the body.
pub(crate) fn covering<const D: usize>(
    scheme: &Scheme,
    cells: &dyn Cells<D>,
) -> Result<(KernelFunctions<D>, usize), Error> {
    let particles = match scheme.dilation {
        Dilation::Auto => match cells.lattice() {
            Some(lattice) if D == 3 && scheme.order == 2 => lattice.particles_with(&narrow(lattice))?,
            _ => cells.particles(default_dilation(scheme.order))?,
        },
        Dilation::Local(r) => cells.particles(r)?,
        Dilation::Global(r) => cells.particles_global(r)?,
        Dilation::Neighbour { rank, factor } => Particles::by_neighbour(cells.positions().to_vec(), rank, factor)?,
    };
    let (given, needed) = (particles.positions().len(), cells.positions().len());
    ensure!(
        given == needed,
        ApproximationError::Length {
            what: "particles that the cells make for their positions",
            given,
            particles: needed
        }
    );
    // On lattices the default covers by construction, and a dilation that does not is the user's to know.
    match cells.lattice() {
        Some(lattice) if lattice.runs_along_axes() => Ok((cover::approximation(scheme, particles)?, 0)),
        // Ends of a bent one may come close to each other.
        Some(_) => {
            let seen = cover::visibility(&particles, cells, &cover::facets(cells), || cells.connections());
            Ok((cover::approximation(scheme, particles)?.seeing(seen), 0))
        }
        None => cover::covering(scheme, particles, cells),
    }
}

/// The default normalised dilation: best value for work by measurement.
pub(crate) fn default_dilation(order: u8) -> f64 {
    match order {
        0 | 1 => 1.0,
        // Quadratic: 1.3; each further order needs one more ring of half a spacing.
        order => 1.3 + 0.5 * (f64::from(order) - 2.0),
    }
}

/// Supports of quadratic functions in space: as narrow as inner particles allow, which see three others along each axis
/// where a particle stands and four between, and wider from the third particle on, for the boundary to see three.
fn narrow<const D: usize>(lattice: &Lattice<D>) -> Vec<f64> {
    const INNER: f64 = 1.0;
    const OUTER: f64 = 1.2;
    let counts = lattice.counts();
    let mut dilations = vec![INNER; lattice.positions().len()];
    for index in lattice.indices() {
        if (0..D).any(|i| index[i] == 2 || counts[i] - 1 - index[i] == 2) {
            dilations[lattice.node(index)] = OUTER;
        }
    }
    dilations
}
