//! The trait of background partitions.

use nalgebra::SMatrix;

use crate::each::{Each, list_of};
use crate::error::{ApproximationError, GeometryError};
use crate::geometry::{Part, Point};
use crate::particles::{Particles, Support, check_dilation};
use crate::quadrature::Points;

use super::zones::free_corners;
use super::{BoundaryCells, Connections, Lattice, Smoothing, TraceChoice, ZoneParticles, Zones};

/// Particles and the background cells between them: one partition hands out everything that must agree.
///
/// What makes the patch test exact: [`smoothing`](Cells::smoothing) and [`boundary`](Cells::boundary) with
/// the same numbers use the same points on the boundary, and neighbouring sub-cells share theirs.
///
/// ```
/// use std::sync::Arc;
/// use rkpm::cells::{BoundaryCells, Cells, Smoothing, Zones};
/// use rkpm::error::{ApproximationError, GeometryError};
/// use rkpm::prelude::*;
/// /// A bar whose ends have names.
/// struct Bar(Lattice<1>);
/// fn end(part: &Part) -> Part {
///     match part {
///         Part::Named(name) if name == "wall" => Side::Min.into(),
///         Part::Named(name) if name == "grip" => Side::Max.into(),
///         other => other.clone(),
///     }
/// }
/// impl Cells<1> for Bar {
///     fn positions(&self) -> &[Point<1>] { self.0.positions() }
///     fn cell_count(&self) -> usize { self.0.cell_count() }
///     fn corners(&self, cell: usize) -> Vec<usize> { Cells::corners(&self.0, cell) }
///     fn local_spacing(&self, particle: usize) -> f64 { self.0.local_spacing(particle)[0] }
///     fn particles(&self, r: f64) -> Result<Particles<1>, ApproximationError> { self.0.particles(r) }
///     fn particles_global(&self, r: f64) -> Result<Particles<1>, ApproximationError> { self.0.particles_global(r) }
///     fn is_thin(&self) -> bool { self.0.is_thin() }
///     fn zones(&self, size: usize) -> Zones { self.0.zones(size) }
///     fn gauss_in(&self, n: usize, zones: &Zones) -> Result<Points<1>, GeometryError> { self.0.gauss_in(n, zones) }
///     fn smoothing(&self, parts: usize, gauss: usize, zones: &Zones) -> Result<Smoothing<1>, GeometryError> {
///         self.0.smoothing(parts, gauss, zones)
///     }
///     fn nodal_cells(&self, gauss: usize) -> Result<Smoothing<1>, GeometryError> { self.0.nodal_cells(gauss) }
///     fn boundary(&self, part: &Part, parts: usize, gauss: usize) -> Result<BoundaryCells<1>, GeometryError> {
///         self.0.boundary(&end(part), parts, gauss)
///     }
///     fn boundary_nodes(&self, part: &Part) -> Result<Vec<usize>, GeometryError> { self.0.boundary_nodes(&end(part)) }
///     fn contains(&self, at: &Point<1>) -> bool { self.0.contains(at) }
/// }
/// let bar = Bar(Block::new([0.0], [2.0]).lattice([5])?);
/// let rubber = Rubber::neo_hookean(0.5, 10.0)?;
/// let scene = Scene::new(Geometry::cells(Arc::new(bar)), RadialCylinder, rubber).prescribe("wall", 0, 0.0).prescribe("grip", 0, 0.1);
/// let problem = scene.discretize(&Scheme::default())?;
/// let path = problem.run()?.completed()?;
/// assert!((problem.displacement(path.last(), &[2.0].into())?[0] - 0.1).abs() < 1e-12);
/// # Ok::<(), rkpm::Error>(())
/// ```
pub trait Cells<const D: usize>: Send + Sync {
    /// Positions of the particles \[length\].
    fn positions(&self) -> &[Point<D>];

    /// Number of cells.
    fn cell_count(&self) -> usize;

    /// The particles at the corners of a cell: axis 0 running fastest in cells of lattices, around the cell
    /// in polygons.
    fn corners(&self, cell: usize) -> Vec<usize>;

    /// What is drawn, by the particles at its corners in the order of [`corners`](Cells::corners): the cells themselves
    /// where they lie between particles, the triangles dual to Voronoi cells.
    fn drawn(&self) -> Vec<Vec<usize>> {
        list_of(self.cell_count(), |cell| self.corners(cell))
    }

    /// What is drawn of bodies whose surface does not lie between particles: the vertices of the surface \[length\], and its facets by
    /// them, counter-clockwise seen from outside. They move as the body does there. By default there is none.
    fn drawn_surface(&self) -> Option<(Vec<Point<D>>, Vec<Vec<usize>>)> {
        None
    }

    /// Which cells share faces: near slots a function ends where no connected cells lead to its particle. By default those of
    /// [`drawn`](Cells::drawn) that have $D$ corners in common; where there are none, functions reach across slots.
    fn connections(&self) -> Option<Connections<D>> {
        Connections::between(self.positions(), self.drawn())
    }

    /// The distance from a particle to its neighbours \[length\]: on lattices and refined ones the length of
    /// [`spacings`](Cells::spacings), the diagonal of a cell.
    fn local_spacing(&self, particle: usize) -> f64;

    /// The largest distances from a particle to its neighbours along each axis \[length\]; the same in all directions unless
    /// the cells know better.
    fn spacings(&self, particle: usize) -> Point<D> {
        Point::repeat(self.local_spacing(particle))
    }

    /// Particles with supports of normalised dilation `r` (6.1) times the local spacing; by default balls.
    ///
    /// # Errors
    /// For $r \le \tfrac12$.
    fn particles(&self, r: f64) -> Result<Particles<D>, ApproximationError> {
        balls(self.positions(), r, &|particle| self.local_spacing(particle))
    }

    /// Particles with supports of normalised dilation `r` (6.1) times the largest spacing; by default balls.
    ///
    /// # Errors
    /// For $r \le \tfrac12$.
    fn particles_global(&self, r: f64) -> Result<Particles<D>, ApproximationError> {
        let spacings: Vec<f64> = list_of(self.positions().len(), |particle| self.local_spacing(particle));
        let largest = spacings.largest(|spacing| *spacing);
        balls(self.positions(), r, &|_| largest)
    }

    /// Whether a single cell spans a thickness of the body: linear pressures on zones are not stable then. By default not: zones may have
    /// boundary particles in their middle where there are no others.
    fn is_thin(&self) -> bool {
        false
    }

    /// Zones of cells that share a pressure, about `size` cells wide.
    fn zones(&self, size: usize) -> Zones;

    /// The directions along which linear pressures of each zone vary, as columns, those that are zero left out: where few
    /// displacements see a pressure its zone has a function less. By default all of space.
    fn pressure_directions(&self, zones: &Zones) -> Option<Vec<SMatrix<f64, D, D>>> {
        let _ = zones;
        None
    }

    /// The thinnest of the walls that are left with few spacings across, since to refine them takes many more particles than asked for: what
    /// [`check::scene`](crate::check::scene) and [`Problem::verdict`](crate::scene::Problem::verdict) tell. By default none.
    fn left_thin(&self) -> Option<&GeometryError> {
        None
    }

    /// What zones have of free particles, where of each particle a part is free: what tells whether displacements can follow the pressures of
    /// a zone. By default those at the corners of its cells.
    fn free_particles(&self, zones: &Zones, free: &dyn Fn(usize) -> f64) -> Vec<ZoneParticles<D>> {
        let corners: Vec<Vec<usize>> = list_of(self.cell_count(), |cell| self.corners(cell));
        free_corners(self.positions(), &corners, zones, free)
    }

    /// Gauss points, `n` per direction in each cell, grouped by zone.
    ///
    /// # Errors
    /// For an impossible number of points.
    fn gauss_in(&self, n: usize, zones: &Zones) -> Result<Points<D>, GeometryError>;

    /// Gauss points, `n` per direction in each cell, grouped by cell.
    ///
    /// # Errors
    /// For an impossible number of points.
    fn gauss(&self, n: usize) -> Result<Points<D>, GeometryError> {
        self.gauss_in(n, &Zones::single(self.cell_count()))
    }

    /// Sub-cells, `parts` per direction in each cell, `gauss` points per direction on each facet (the crate's own take one
    /// more where boundaries are curved), grouped by zone.
    ///
    /// # Errors
    /// For an impossible number of parts or points.
    fn smoothing(&self, parts: usize, gauss: usize, zones: &Zones) -> Result<Smoothing<D>, GeometryError>;

    /// One cell around each particle, in the order of particles and each in a group of its own, `gauss` points
    /// per direction on each facet; boundary facets are those of [`boundary`](Cells::boundary) with 2 parts.
    ///
    /// # Errors
    /// For an impossible number of points, and where there are no such cells: by default.
    fn nodal_cells(&self, gauss: usize) -> Result<Smoothing<D>, GeometryError> {
        let _ = gauss;
        Err(GeometryError::Unsuited { what: "nodal integration", needed: "a lattice or scattered particles" })
    }

    /// Facets of a boundary part, each cut into `parts` per direction with `gauss` points per direction (one more where
    /// [`smoothing`](Cells::smoothing) takes it).
    ///
    /// # Errors
    /// Where the part does not exist or the numbers are impossible.
    fn boundary(&self, part: &Part, parts: usize, gauss: usize) -> Result<BoundaryCells<D>, GeometryError>;

    /// The points of [`boundary`](Cells::boundary) alone, in any order of facets.
    ///
    /// # Errors
    /// As [`boundary`](Cells::boundary).
    fn boundary_points(&self, part: &Part, parts: usize, gauss: usize) -> Result<Points<D>, GeometryError> {
        Ok(self.boundary(part, parts, gauss)?.points)
    }

    /// The facets of a boundary part in smooth pieces: faces, lines, arcs, with trace functions that sum to one. Weak constraint equations
    /// are made piece by piece. By default a part is one piece.
    ///
    /// # Errors
    /// As [`boundary`](Cells::boundary).
    fn boundary_pieces(&self, part: &Part, parts: usize, gauss: usize) -> Result<Vec<BoundaryCells<D>>, GeometryError> {
        Ok(vec![self.boundary(part, parts, gauss)?])
    }

    /// The pieces of a boundary part as a condition takes them: facets within a place, trace functions of the particles whose equations
    /// belong to a piece.
    ///
    /// By default those of [`boundary_pieces`](Cells::boundary_pieces) within the place, with the functions of all their particles:
    /// conditions merge those whose equation belongs elsewhere into their neighbours'. Lattices make those of curved pieces anew, so that
    /// they give the normals.
    ///
    /// # Errors
    /// As [`boundary`](Cells::boundary).
    fn boundary_pieces_for(
        &self,
        part: &Part,
        parts: usize,
        gauss: usize,
        choice: &TraceChoice<'_, D>,
    ) -> Result<Vec<BoundaryCells<D>>, GeometryError> {
        let pieces = self.boundary_pieces(part, parts, gauss)?;
        Ok(match choice.within {
            Some(holds) => pieces.mapped(|cells| cells.within(holds)),
            None => pieces,
        })
    }

    /// Whether [`boundary_pieces_for`](Cells::boundary_pieces_for) gives pieces whose particles all belong to others functions of their
    /// neighbours' particles; by default not.
    fn rebuilds_traces(&self) -> bool {
        false
    }

    /// The facets of a boundary part with plain linear trace functions, which are positive and sum to one up to the ends of arcs: what
    /// contact pressures live on. By default those of [`boundary`](Cells::boundary).
    ///
    /// # Errors
    /// As [`boundary`](Cells::boundary).
    fn contact_boundary(&self, part: &Part, parts: usize, gauss: usize) -> Result<BoundaryCells<D>, GeometryError> {
        self.boundary(part, parts, gauss)
    }

    /// Particles on a boundary part, by rising index.
    ///
    /// # Errors
    /// Where the part does not exist.
    fn boundary_nodes(&self, part: &Part) -> Result<Vec<usize>, GeometryError>;

    /// Whether a point lies in the body, up to a tenth of a cell.
    fn contains(&self, at: &Point<D>) -> bool;

    /// Whether a point lies in the body, up to rounding: of several bodies this one is asked first.
    fn encloses(&self, at: &Point<D>) -> bool {
        self.contains(at)
    }

    /// The lattice, where the cells are one: finite elements and equal integration zones need it.
    fn lattice(&self) -> Option<&Lattice<D>> {
        None
    }
}

/// Particles whose supports are balls of normalised dilation `r` times a spacing.
fn balls<const D: usize>(
    positions: &[Point<D>],
    r: f64,
    spacing: &dyn Fn(usize) -> f64,
) -> Result<Particles<D>, ApproximationError> {
    check_dilation(r)?;
    let supports = list_of(positions.len(), |particle| Support::Ball(2.0 * r * spacing(particle)));
    Particles::new(positions.to_vec(), supports)
}

/// What rounding leaves of the place of a point in a cell.
pub(crate) const EDGE: f64 = 1e-9;

/// The body that a point lies in, the first one on an interface; near its surface outside all of them, one that it is nearly in.
pub(crate) fn member<'a, const D: usize>(
    mut bodies: impl Iterator<Item = &'a dyn Cells<D>> + Clone,
    at: &Point<D>,
) -> Option<usize> {
    bodies.clone().position(|cells| cells.encloses(at)).or_else(|| bodies.position(|cells| cells.contains(at)))
}

/// The bodies that a point lies in: several on an interface; near their surfaces outside all of them, the one that it is nearly in.
pub(crate) fn members<'a, const D: usize>(
    bodies: impl Iterator<Item = &'a dyn Cells<D>> + Clone,
    at: &Point<D>,
) -> Vec<usize> {
    let within: Vec<usize> =
        bodies.clone().enumerate().filter(|(_, cells)| cells.encloses(at)).map(|(body, _)| body).collect();
    if within.is_empty() { member(bodies, at).into_iter().collect() } else { within }
}

impl<const D: usize> Cells<D> for Lattice<D> {
    fn positions(&self) -> &[Point<D>] {
        self.positions()
    }

    fn cell_count(&self) -> usize {
        self.cell_count()
    }

    fn corners(&self, cell: usize) -> Vec<usize> {
        self.corner_nodes(cell)[..1 << D].to_vec()
    }

    fn local_spacing(&self, particle: usize) -> f64 {
        self.local_spacing(particle).norm()
    }

    fn spacings(&self, particle: usize) -> Point<D> {
        self.local_spacing(particle)
    }

    fn particles(&self, r: f64) -> Result<Particles<D>, ApproximationError> {
        self.particles(r)
    }

    fn particles_global(&self, r: f64) -> Result<Particles<D>, ApproximationError> {
        self.particles_global(r)
    }

    fn is_thin(&self) -> bool {
        self.cell_counts().contains(&1)
    }

    fn zones(&self, size: usize) -> Zones {
        self.zones(size)
    }

    fn gauss_in(&self, n: usize, zones: &Zones) -> Result<Points<D>, GeometryError> {
        self.gauss_in(n, zones)
    }

    fn smoothing(&self, parts: usize, gauss: usize, zones: &Zones) -> Result<Smoothing<D>, GeometryError> {
        self.smoothing(parts, gauss, zones)
    }

    fn nodal_cells(&self, gauss: usize) -> Result<Smoothing<D>, GeometryError> {
        self.nodal_cells(gauss)
    }

    fn boundary(&self, part: &Part, parts: usize, gauss: usize) -> Result<BoundaryCells<D>, GeometryError> {
        self.plain_boundary(part, parts, gauss)
    }

    fn boundary_pieces(&self, part: &Part, parts: usize, gauss: usize) -> Result<Vec<BoundaryCells<D>>, GeometryError> {
        self.boundary_pieces(part, parts, gauss)
    }

    fn boundary_pieces_for(
        &self,
        part: &Part,
        parts: usize,
        gauss: usize,
        choice: &TraceChoice<'_, D>,
    ) -> Result<Vec<BoundaryCells<D>>, GeometryError> {
        Ok(choice.of(self.boundary_pieces(part, parts, gauss)?))
    }

    fn boundary_nodes(&self, part: &Part) -> Result<Vec<usize>, GeometryError> {
        self.boundary_nodes(part)
    }

    fn contains(&self, at: &Point<D>) -> bool {
        self.contains(at)
    }

    fn encloses(&self, at: &Point<D>) -> bool {
        self.within(at, EDGE)
    }

    fn lattice(&self) -> Option<&Lattice<D>> {
        Some(self)
    }
}
