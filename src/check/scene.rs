//! Before the solve: what stands between a scene and its solution.

use std::fmt;

use crate::boundary::dependent;
use crate::compiled::compiled;
use crate::each::EachOf;
use crate::error::{ApproximationError, BoundaryError, Error, GeometryError};
use crate::geometry::{Mat3, Vec3};
use crate::material::{Material, Past};
use crate::paper::Cover;
use crate::scene::{
    ApproximationChoice, FixedInside, FreeMotion, Scene, Scheme, Value, fixed_inside, free_motions, is_stiff,
    kernel_functions,
};
use crate::term::{Amplitude, Body, PressureField};

use super::cover::{UncoveredRegion, cover};
use super::{Finding, Report};

/// Reciprocal condition number below which gradients start to lose digits (2e-8 off at 1e-6…1e-5, 1e-3 off at the
/// limit of 1e-8 where points are refused).
const RCOND: f64 = 1e-6;

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
    /// Conditions whose values do not hold at an edge, because those of another face do.
    pub overruled: Vec<BoundaryError>,
    /// Walls that are left with few particle spacings across, the thinnest one of each body.
    pub thin_walls: Vec<GeometryError>,
    /// Rows that depend on earlier ones.
    pub dependent: Vec<BoundaryError>,
    /// Rigid motions left free.
    pub free: Vec<FreeMotion>,
    /// Particles whose displacement is prescribed and that end deep in a rigid surface.
    pub inside: Vec<FixedInside>,
    /// Pressure unknowns of the body; its points, where it has none and resists changes of volume.
    pub pressures: usize,
    /// Displacement unknowns that the rows leave.
    pub displacements: usize,
    /// Settings without effect on a run of the scene: pairs of tables beyond a load factor of 1, a law that relaxes in a scene without time.
    pub without_effect: Vec<String>,
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
        let region = |r: &UncoveredRegion| {
            let [low, high] = &r.bounds;
            format!("{} cells between X = {low:?} and {high:?}: raise the dilation or add particles", r.cells.len())
        };
        let mut report = Report::default();
        report.findings.push(none("particles cover the body", self.uncovered.iter().map(region)));
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
        let motion = |m: &FreeMotion| format!("{m}: hold it by a condition, or by the friction of a contact");
        report.findings.extend([
            none("conditions agree and select something", &self.refused),
            none("conditions agree at common edges", &self.overruled),
            none("walls have enough spacings across", &self.thin_walls),
            none("rows are independent", &self.dependent),
            none("settings have an effect", &self.without_effect),
            none("no rigid motion is free", self.free.iter().map(motion)),
            none("rigid surfaces stay outside of particles whose displacement is prescribed", &self.inside),
        ]);
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

/// The finding of a law that is kept where nothing was found.
fn none(law: &'static str, found: impl IntoIterator<Item = impl ToString>) -> Finding {
    let found: Vec<String> = found.into_iter().map(|found| found.to_string()).collect();
    Finding { law, violation: found.len() as f64, tolerance: 0.0, at: found.join("; ") }
}

/// The text of its [`report`](Diagnosis::report).
impl fmt::Display for Diagnosis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.report().fmt(f)
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
/// assert_eq!(diagnosis.free[0].to_string(), "a translation along axis 1");
/// # Ok::<(), rkpm::Error>(())
/// ```
pub fn scene<const D: usize>(scene: &Scene<D>, scheme: &Scheme) -> Result<Diagnosis, Error> {
    compiled!(D: (scene: &Scene<D> = scene; scheme: &Scheme = scheme) -> Result<Diagnosis, Error> { measured(scene, scheme) })
}

fn measured<const D: usize>(scene: &Scene<D>, scheme: &Scheme) -> Result<Diagnosis, Error> {
    let mut diagnosis = Diagnosis { most_pressures: 1.0 / D as f64, ..Diagnosis::default() };
    for (scheme, cells) in scene.cells(scheme)? {
        if scheme.approximation != ApproximationChoice::Particles {
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
    diagnosis.without_effect = without_effect(scene);
    if let Some(moved) = largest_motion(scene) {
        diagnosis.without_effect.extend(problem.out_of_reach(moved));
    }
    // What a run would trip over before its first step.
    problem.analysis().check_settings(problem.model())?;
    diagnosis.overruled = problem.equations().overruled().to_vec();
    let bodies = problem.discrete_bodies().iter();
    diagnosis.thin_walls = bodies.filter_map(|body| body.cells().left_thin().cloned()).collect();
    diagnosis.dependent = dependent(problem.equations().equations());
    diagnosis.free = free_motions(&problem, true);
    diagnosis.inside = fixed_inside(&problem);
    // A sheet takes its volume from its thickness, which is free.
    let bodies = problem.discrete_bodies().iter().filter(|_| !scene.kinematics.is_plane_stress());
    diagnosis.pressures = bodies.map(|member| pressures::<D>(member.body())).sum();
    let equations = problem.equations().len() - diagnosis.dependent.len();
    diagnosis.displacements = problem.model().unknowns().saturating_sub(equations);
    Ok(diagnosis)
}

/// Settings without effect on a run of a scene, with what to do.
fn without_effect<const D: usize>(scene: &Scene<D>) -> Vec<String> {
    let mut found = Vec::new();
    for condition in &scene.conditions {
        push_long(&mut found, &condition.amplitude, &format!("a condition on {}", condition.place));
    }
    for load in &scene.loads {
        push_long(&mut found, &load.amplitude, &load.label());
    }
    for contact in &scene.contacts {
        for amplitude in contact.surface.amplitudes() {
            push_long(&mut found, amplitude, &format!("surface `{}`", contact.surface.name));
        }
    }
    if let Some(clock) = &scene.clock {
        push_long(&mut found, clock, "the clock of the scene");
        if clock.value(1.0) > clock.value(0.0) {
            return found;
        }
    }
    for body in &scene.bodies {
        if relaxes(&*body.material) {
            let of = if body.name.is_empty() { "the body".to_string() } else { format!("body `{}`", body.name) };
            let remedy = "relaxes and no time passes: give the scene a time above zero by Scene::over_time";
            found.push(format!("the law of {of} {remedy}"));
        }
    }
    found
}

/// Says so where a table goes on beyond the end of a run.
fn push_long(found: &mut Vec<String>, amplitude: &Amplitude, of: &str) {
    if let Amplitude::Table(pairs) = amplitude
        && let Some((last, _)) = pairs.last().filter(|last| last.0 > 1.0)
    {
        found.push(format!(
            "the table of {of} goes on to {last}, a run ends at a load factor of 1: divide its first numbers by {last}"
        ));
    }
}

/// Whether a law stores another energy in a sudden strain than in one that takes its time.
fn relaxes(law: &dyn Material) -> bool {
    let memory = law.rest();
    let stretched = Mat3::from_diagonal(&Vec3::new(1.1, 1.0, 1.0 / 1.1));
    let [sudden, slow] = [0.0, f64::MAX].each(|elapsed| law.energy_from(&stretched, Past { memory: &memory, elapsed }));
    sudden != slow
}

/// The largest displacement that conditions prescribe \[length\]; none where they do so by functions.
fn largest_motion<const D: usize>(scene: &Scene<D>) -> Option<f64> {
    let values = scene.conditions.iter().flat_map(|condition| {
        let amplitudes = (0..=16).map(|k| condition.amplitude.value(f64::from(k) / 16.0).abs());
        let most = amplitudes.fold(0.0, f64::max);
        condition.prescribed.iter().map(move |(_, value)| match value {
            Value::Constant(value) => Some(value.abs() * most),
            _ => None,
        })
    });
    values.sum()
}

/// The pressures of a body, or the points that constrain its volume.
fn pressures<const D: usize>(body: &Body<D>) -> usize {
    let table = body.table();
    match body.field() {
        PressureField::Displacement if body.material().volumetric().is_none() && !is_stiff(body.material()) => 0,
        // Without pressures of its own each point constrains the volume all the same.
        PressureField::Displacement | PressureField::Pointwise => table.point_count(),
        PressureField::Constant => table.clusters().count(),
        PressureField::Linear => table.clusters().count() * (D + 1),
    }
}
