//! Before the solve: what stands between a scene and its solution.

use std::fmt;

use nalgebra::{DMatrix, Matrix3};

use crate::boundary::dependent_rows;
use crate::cells::Cells;
use crate::compiled::compiled;
use crate::error::{ApproximationError, BoundaryError, Error, GeometryError};
use crate::geometry::Point;
use crate::material::Material;
use crate::paper::Cover;
use crate::scene::{Functions, Problem, Scene, Scheme, kernel_functions};
use crate::shape::{Approximation, ShapeFunctions};
use crate::term::{Body, PressureField};

use super::{Finding, Report};

/// Reciprocal condition number below which gradients start to lose digits (2e-8 off at 1e-6…1e-5, 1e-3 off at the
/// limit of 1e-8 where points are refused).
const RCOND: f64 = 1e-6;
/// Energy of a motion and what rows see of it, squares relative to stiffness and size, below which it is free.
/// Rounding leaves 1e-15; a radial motion of a far, thin ring has 1e-6.
const FREE: f64 = 1e-12;
/// Gauss points per direction and cell at which the cover is sampled, beside the particles: the loads' and bodies'
/// own points lie between them.
const SAMPLES: usize = 4;

/// Bulk over shear modulus above which a point's volume counts as a constraint.
const STIFF: f64 = 20.0;

/// Connected cells in which too few particles cover some points.
#[derive(Debug, Clone, PartialEq)]
pub struct UncoveredRegion {
    /// The cells, by rising index.
    pub cells: Vec<usize>,
    /// Corners of the smallest box around the sampled points that are uncovered \[length\].
    pub bounds: [Vec<f64>; 2],
}

/// A rigid motion that neither conditions nor energy resist: $u = t + \Omega\\,(X - X_0)$.
#[derive(Debug, Clone, PartialEq)]
pub struct FreeMotion {
    /// The translation $t$, components relative to the largest displacement of the motion.
    pub translation: Vec<f64>,
    /// $\Omega_{ij} = -\Omega_{ji}$, $i > j$, as (i, j, part of the largest displacement that it gives).
    pub rotations: Vec<(usize, usize, f64)>,
    /// The centre $X_0$ of the rotations: the mean position of the particles \[length\].
    pub centre: Vec<f64>,
}

impl fmt::Display for FreeMotion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Parts below a hundredth say nothing to a reader.
        let mut word = "";
        for (axis, part) in self.translation.iter().enumerate().filter(|(_, part)| part.abs() > 0.01) {
            write!(f, "{word}{part:.2} of a translation along axis {axis}")?;
            word = " and ";
        }
        for (i, j, part) in self.rotations.iter().filter(|r| r.2.abs() > 0.01) {
            write!(f, "{word}{part:.2} of a rotation in the plane of axes {j} and {i}")?;
            word = " and ";
        }
        Ok(())
    }
}

/// What a scene under a scheme is checked for before it is solved; all of it, where
/// [`discretize`](Scene::discretize) stops at the first error.
#[derive(Debug, Default)]
pub struct Diagnosis {
    /// The smallest reciprocal condition number of the moment matrix at the sampled points; `None` for finite
    /// elements, which have none.
    pub cover: Option<Cover>,
    /// Regions without enough particles; nothing below is known where there are any.
    pub uncovered: Vec<UncoveredRegion>,
    /// Conditions that could not be taken: conflicts with earlier ones, selections of nothing.
    pub refused: Vec<Error>,
    /// Rows that depend on earlier ones.
    pub dependent: Vec<BoundaryError>,
    /// Rigid motions left free.
    pub free: Vec<FreeMotion>,
    /// Pressure unknowns of the body; its points, where it has none and resists changes of volume.
    pub pressures: usize,
    /// Displacement unknowns that the rows leave.
    pub displacements: usize,
    /// Whether a single cell spans a thickness of the body.
    pub thin: bool,
    /// Pressures per displacement above which a nearly incompressible body locks: those of the continuum, one
    /// pressure for `D` displacements at each point.
    pub most_pressures: f64,
}

impl Diagnosis {
    /// Whether nothing was found.
    pub fn holds(&self) -> bool {
        self.report().holds()
    }

    /// The same as laws, each with how far it is from being kept and where.
    pub fn report(&self) -> Report {
        let count =
            |law: &'static str, found: usize, at: String| Finding { law, violation: found as f64, tolerance: 0.0, at };
        let list = |words: Vec<String>| words.join("; ");
        let regions = self.uncovered.iter().map(|r| {
            format!(
                "{} cells between X = {:?} and {:?}: raise the dilation or add particles",
                r.cells.len(),
                r.bounds[0],
                r.bounds[1]
            )
        });
        let mut report = Report::default();
        report.findings.push(count("particles cover the body", self.uncovered.len(), list(regions.collect())));
        match &self.cover {
            Some(cover) if self.uncovered.is_empty() => report.findings.push(Finding {
                law: "moment matrices are well conditioned",
                violation: 1.0 / cover.rcond,
                tolerance: 1.0 / RCOND,
                at: format!("X = {:?}: raise the dilation there", cover.at),
            }),
            Some(_) => {}
            None => report.unchecked.push("moment matrices: finite elements have none".into()),
        }
        if !self.uncovered.is_empty() {
            report.unchecked.push("conditions, motions and pressures: the body is not covered".into());
            return report;
        }
        let words = |errors: Vec<String>| list(errors);
        report.findings.push(count(
            "conditions agree and select something",
            self.refused.len(),
            words(self.refused.iter().map(ToString::to_string).collect()),
        ));
        report.findings.push(count(
            "rows are independent",
            self.dependent.len(),
            words(self.dependent.iter().map(ToString::to_string).collect()),
        ));
        let motions = self.free.iter().map(|m| format!("{m}: hold it"));
        report.findings.push(count("no rigid motion is free", self.free.len(), list(motions.collect())));
        if self.pressures == 0 {
            report.unchecked.push("pressures per displacement: the body has no pressures".into());
        } else {
            report.findings.push(Finding {
                law: "pressures leave displacements their freedom",
                violation: self.pressures as f64 / self.displacements.max(1) as f64,
                tolerance: self.most_pressures,
                at: format!(
                    "{} pressures or points, {} displacements: project the volumetric energy on larger zones, which a material allows by its split",
                    self.pressures, self.displacements
                ),
            });
        }
        if self.thin {
            let bending = "bending: one cell spans the thickness, which does for membranes; give a body that bends two cells or more";
            report.unchecked.push(bending.into());
        }
        report
    }
}

/// Checks a scene under a scheme before anything is solved: uncovered regions, conditions that conflict or depend
/// on each other, rigid motions left free, the ratio of pressures to displacements, the smallest reciprocal
/// condition number.
///
/// Costs about as much as [`discretize`](Scene::discretize) and one assembly.
///
/// # Errors
/// Where no particles can be placed or a load can't be tabulated: bad geometry, counts, supports, values.
///
/// ```
/// use rkpm::check;
/// use rkpm::prelude::*;
/// let block = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3)?);
/// // Held along axis 0 alone: it may still slide along axis 1.
/// let scene = block.prescribe(Side::Min, 0, 0.0).prescribe(Side::Max, 0, 0.1);
/// let diagnosis = check::scene(&scene, &Scheme::default().particles([5, 5]))?;
/// assert!(!diagnosis.holds());
/// assert_eq!(diagnosis.free[0].to_string(), "1.00 of a translation along axis 1");
/// # Ok::<(), rkpm::Error>(())
/// ```
pub fn scene<const D: usize>(scene: &Scene<D>, scheme: &Scheme) -> Result<Diagnosis, Error> {
    compiled!(D: (scene: &Scene<D> = scene; scheme: &Scheme = scheme) -> Result<Diagnosis, Error> { measured(scene, scheme) })
}

fn measured<const D: usize>(scene: &Scene<D>, scheme: &Scheme) -> Result<Diagnosis, Error> {
    let mut diagnosis = Diagnosis { most_pressures: 1.0 / D as f64, ..Diagnosis::default() };
    if scheme.functions == Functions::Particles {
        for (scheme, cells) in scene.cells(scheme)? {
            if scheme.functions != Functions::Particles {
                continue;
            }
            let (cover, uncovered) = cover(&kernel_functions(&scheme, &*cells)?, &*cells)?;
            diagnosis.uncovered.extend(uncovered);
            diagnosis.thin |= D > 1 && cells.is_thin();
            diagnosis.cover = Some(match diagnosis.cover.take() {
                Some(other) if other.rcond <= cover.rcond => Cover { lost: other.lost + cover.lost, ..other },
                Some(other) => Cover { lost: other.lost + cover.lost, ..cover },
                None => cover,
            });
        }
        if !diagnosis.uncovered.is_empty() {
            return Ok(diagnosis);
        }
    }
    let problem = match scene.discretize_leniently(scheme) {
        Ok((problem, refused)) => {
            diagnosis.refused = refused;
            problem
        }
        // A gap between the samples.
        Err(Error::Approximation(
            ApproximationError::Uncovered { at, .. } | ApproximationError::Singular { at, .. },
        )) => {
            diagnosis.uncovered.push(UncoveredRegion { cells: Vec::new(), bounds: [at.clone(), at] });
            return Ok(diagnosis);
        }
        Err(error) => return Err(error),
    };
    diagnosis.dependent = dependent_rows(problem.rows().rows());
    diagnosis.free = free_motions(&problem);
    diagnosis.pressures = problem.members().iter().map(|member| pressures::<D>(member.body())).sum();
    let rows = problem.rows().len() - diagnosis.dependent.len();
    diagnosis.displacements = problem.model().unknowns().saturating_sub(rows);
    Ok(diagnosis)
}

/// The pressures of a body, or the points that constrain its volume.
fn pressures<const D: usize>(body: &Body<D, std::sync::Arc<dyn Material>>) -> usize {
    let table = body.table();
    match body.field() {
        PressureField::Displacement if body.material().split().is_none() && !stiff(body.material()) => 0,
        // Without pressures of its own each point constrains the volume all the same.
        PressureField::Displacement | PressureField::Pointwise => table.len(),
        PressureField::Constant => table.clusters().len(),
        PressureField::Linear => table.clusters().len() * (D + 1),
    }
}

/// Whether a material resists a change of volume at rest so much more than one of shape that it locks.
fn stiff(material: &dyn Material) -> bool {
    let tangent = material.response(&Matrix3::identity()).tangent;
    let bulk: f64 = (0..9).map(|k| tangent[(4 * (k / 3), 4 * (k % 3))]).sum::<f64>() / 9.0;
    bulk > STIFF * tangent[(1, 1)]
}

/// The cover at particles and points in cells, and the regions where there is none.
fn cover<const D: usize, A: Approximation<D>>(
    approximation: &A,
    cells: &dyn Cells<D>,
) -> Result<(Cover, Vec<UncoveredRegion>), Error> {
    let points = cells.gauss(SAMPLES)?;
    let mut cover = Cover { rcond: f64::INFINITY, at: Vec::new(), lost: 0 };
    let mut scratch = A::Scratch::default();
    let mut psi = ShapeFunctions::default();
    let mut is_lost = |at: &Point<D>| {
        let rcond = approximation.evaluate_values(at, &mut scratch, &mut psi).map_or(0.0, |()| psi.rcond);
        if rcond < cover.rcond {
            (cover.rcond, cover.at) = (rcond, at.as_slice().to_vec());
        }
        cover.lost += usize::from(rcond == 0.0);
        rcond == 0.0
    };
    let at_particles: Vec<bool> = cells.positions().iter().map(&mut is_lost).collect();
    let mut gaps = Vec::new();
    if points.groups.len() != cells.cell_count() + 1 {
        let (count, needed) = (points.groups.len().saturating_sub(1), "Cells::gauss_in gives one for each zone");
        return Err(GeometryError::Count { what: "groups of points in single cells", count, needed }.into());
    }
    for (cell, group) in points.groups.windows(2).enumerate() {
        let corners = cells.corners(cell);
        if let Some(&count) = corners.iter().find(|&&corner| corner >= at_particles.len()) {
            let needed = "Cells::corners names particles of Cells::positions, counted from 0";
            return Err(GeometryError::Count { what: "corner of a cell", count, needed }.into());
        }
        let lost_corners = corners.iter().filter(|&&c| at_particles[c]).map(|&c| cells.positions()[c]);
        let inside = points.positions[group[0]..group[1]].iter().copied().filter(&mut is_lost);
        let lost: Vec<Point<D>> = lost_corners.chain(inside).collect();
        if !lost.is_empty() {
            gaps.push(Gap { cell, corners, lost });
        }
    }
    Ok((cover, joined(&gaps, at_particles.len())))
}

/// A cell with uncovered points.
struct Gap<const D: usize> {
    cell: usize,
    corners: Vec<usize>,
    lost: Vec<Point<D>>,
}

/// Cells that share corners, joined to regions.
fn joined<const D: usize>(gaps: &[Gap<D>], particles: usize) -> Vec<UncoveredRegion> {
    let mut holders: Vec<Vec<usize>> = vec![Vec::new(); particles];
    for (number, gap) in gaps.iter().enumerate() {
        gap.corners.iter().for_each(|&corner| holders[corner].push(number));
    }
    let mut seen = vec![false; gaps.len()];
    let mut regions = Vec::new();
    for first in 0..gaps.len() {
        if std::mem::replace(&mut seen[first], true) {
            continue;
        }
        let (mut region, mut open) = (Vec::new(), vec![first]);
        let (mut low, mut high) = (Point::<D>::repeat(f64::INFINITY), Point::<D>::repeat(f64::NEG_INFINITY));
        while let Some(gap) = open.pop() {
            let Gap { cell, corners, lost } = &gaps[gap];
            region.push(*cell);
            for x in lost {
                (low, high) = (low.inf(x), high.sup(x));
            }
            for &corner in corners {
                for &other in &holders[corner] {
                    if !std::mem::replace(&mut seen[other], true) {
                        open.push(other);
                    }
                }
            }
        }
        region.sort_unstable();
        regions.push(UncoveredRegion { cells: region, bounds: [low.as_slice().to_vec(), high.as_slice().to_vec()] });
    }
    regions
}

/// Combinations of translations and infinitesimal rotations that cost no energy at rest and that no row sees.
fn free_motions<const D: usize>(problem: &Problem<D>) -> Vec<FreeMotion> {
    let (model, rows) = (problem.model(), problem.rows());
    let positions = model.positions();
    let centre = positions.iter().sum::<Point<D>>() / positions.len() as f64;
    let size = positions.iter().map(|x| (x - centre).norm()).fold(0.0, f64::max);
    let mut kinds: Vec<(usize, Option<usize>)> = (0..D).map(|i| (i, None)).collect();
    kinds.extend((0..D).flat_map(|i| (0..i).map(move |j| (i, Some(j)))));
    // Shape functions reproduce linear fields: their values at the particles are the coefficients.
    let motion = |kind: &(usize, Option<usize>)| -> Vec<f64> {
        let value = |x: Point<D>, k: usize| match *kind {
            (i, None) => f64::from(u8::from(k == i)),
            (i, Some(j)) if k == i => x[j] / size,
            (i, Some(j)) if k == j => -x[i] / size,
            _ => 0.0,
        };
        positions.iter().flat_map(|x| (0..D).map(move |k| value(x - centre, k))).collect()
    };
    let motions: Vec<Vec<f64>> = kinds.iter().map(motion).collect();
    let m = motions.len();
    let mut assembler = model.assembler();
    let mut system = Default::default();
    assembler.assemble(model, &vec![0.0; model.unknowns()], &model.start(), 0.0, &mut system);
    let pattern = assembler.pattern();
    let stiffness = (0..pattern.size()).map(|c| system.values[pattern.columns[c]].abs()).fold(0.0, f64::max);
    let energies: Vec<Vec<f64>> = motions
        .iter()
        .map(|motion| {
            let mut force = vec![0.0; motion.len()];
            pattern.multiply_add(&system.values, motion, &mut force);
            force
        })
        .collect();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut resistance =
        DMatrix::<f64>::from_fn(m, m, |a, b| dot(&motions[a], &energies[b]) / (stiffness * positions.len() as f64));
    for row in rows.rows() {
        let scale: f64 = row.entries.iter().map(|e| e.1.abs()).sum();
        let seen: Vec<f64> =
            motions.iter().map(|r| row.entries.iter().map(|&(k, c)| c * r[k]).sum::<f64>() / scale).collect();
        for a in 0..m {
            for b in 0..m {
                resistance[(a, b)] += seen[a] * seen[b];
            }
        }
    }
    if !resistance.iter().all(|r| r.is_finite()) {
        return Vec::new();
    }
    let resistance = (&resistance + resistance.transpose()) * 0.5;
    let spectrum = resistance.symmetric_eigen();
    let free: Vec<usize> = (0..m).filter(|&k| spectrum.eigenvalues[k] <= FREE).collect();
    // Any basis of the space serves; the reduced one has a translation or rotation of its own in each motion.
    let mut basis = DMatrix::<f64>::from_fn(free.len(), m, |a, k| spectrum.eigenvectors[(k, free[a])]);
    reduce(&mut basis);
    (0..free.len())
        .map(|a| {
            let largest = basis.row(a).iter().copied().max_by(|v, w| v.abs().total_cmp(&w.abs())).unwrap_or(1.0);
            let part = |k: usize| basis[(a, k)] / largest;
            FreeMotion {
                translation: (0..D).map(part).collect(),
                rotations: (D..m).map(|k| (kinds[k].0, kinds[k].1.unwrap_or(0), part(k))).collect(),
                centre: centre.as_slice().to_vec(),
            }
        })
        .collect()
}

/// Gauss–Jordan elimination with row and column pivots: the rows span the same space.
fn reduce(basis: &mut DMatrix<f64>) {
    let mut used = Vec::new();
    for row in 0..basis.nrows() {
        let column = (0..basis.ncols())
            .filter(|c| !used.contains(c))
            .max_by(|&a, &b| basis[(row, a)].abs().total_cmp(&basis[(row, b)].abs()));
        let Some(column) = column else { return };
        used.push(column);
        let pivot = basis[(row, column)];
        for other in (0..basis.nrows()).filter(|&other| other != row) {
            let factor = basis[(other, column)] / pivot;
            for c in 0..basis.ncols() {
                let change = factor * basis[(row, c)];
                basis[(other, c)] -= change;
            }
        }
    }
}
