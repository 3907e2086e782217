//! Large bodies in space: which solver they take, and what it needs beside the particles.

use std::sync::Arc;

use crate::assembly::{Model, Pattern};
use crate::boundary::{ConstraintEquation, Constraints};
use crate::cells::{Cells, Lattice, Layout};
use crate::contact::Obstacle;
use crate::each::{Each, array_of, point_of};
use crate::error::{Error, Incompatible, LinearError, SolveError};
use crate::geometry::{Bounds, Domain, Point, all_padded};
use crate::linear::{Auxiliary, Krylov, after_their_rows, multiplications, nested_dissection};
use crate::quadrature::Points;
use crate::shape::{Approximation, FiniteElements};
use crate::solve::StepControl;
use crate::table::ShapeTable;
use crate::term::{Body, PressureField};

use super::linear_fit::linear_fits;
use super::memory::Size;
use super::one_body::expanding;
use super::sharing::Sharing;
use super::unmeasured::Unmeasured;
use crate::scene::{
    ApproximationChoice, ConstraintMethod, Dilation, PressureScheme, Scene, Scheme, SolverChoice, Source,
};

/// Half the width of a band that takes as many operations as nested dissection does, in layers of particles: counted for
/// cubes with 9, 13 and 17 a side, where the factors of 2187, 6591 and 14 739 unknowns take 0.9, 11.5 and 73 times 1e9.
const REACH: f64 = 2.6;

/// Multiplications of factors, for each unknown, above which lattices are solved by iteration: 8 particles a side have less (0.249e6), 9 more
/// (0.4e6). Small models lose little by factors, which tell whether states are stable.
const WORTH_ON_LATTICES: f64 = 0.25e6;

/// The same for cut solids, which take more Krylov iterations.
const WORTH: f64 = 1e6;

/// Whether a scene's matrix is that of one body and of rigid surfaces against it: with several, rigid ones or contact between faces it
/// is solved by factors.
pub(crate) fn is_one_body<const D: usize>(scene: &Scene<D>) -> bool {
    scene.bodies.len() == 1 && scene.rigids.is_empty() && scene.contact_pairs.is_empty()
}

/// Whether particles in space are solved by iteration where their scene allows for it: by the problem alone, whatever else
/// the machine does. Contact rests on stable states, which factors alone tell: it is solved by iteration where that is requested.
/// Factors are worth `worth` operations for each unknown; `counted` tells whether they take more where a band of the mean cross section
/// takes less.
fn iterates<const D: usize>(
    scene: &Scene<D>,
    scheme: &Scheme,
    size: Size,
    worth: f64,
    counted: impl FnOnce() -> bool,
) -> bool {
    if scheme.approximation != ApproximationChoice::Particles {
        return false;
    }
    match scheme.solver_choice {
        SolverChoice::Direct => false,
        SolverChoice::Krylov => true,
        // An iteration enforces conditions by a method of its own.
        SolverChoice::Auto if scheme.constraint_method != ConstraintMethod::Auto => false,
        SolverChoice::Auto if !scene.contacts.is_empty() => false,
        // Directions depend on the mesh: fits to the corners of slivers stand for little.
        SolverChoice::Auto if scene.bodies.iter().any(|body| matches!(body.source, Source::Mesh(_))) => false,
        SolverChoice::Auto => size.band(REACH).powi(2) > worth || counted(),
    }
}

/// Multiplications of factors for each unknown: particles in one cluster of points are coupled, and those that one condition holds.
fn of_factors<const D: usize>(
    positions: &[Point<D>],
    table: &ShapeTable<D>,
    equations: &Constraints,
) -> Result<f64, LinearError> {
    let mut columns: Vec<Vec<u32>> = vec![Vec::new(); positions.len()];
    let mut most = vec![0usize; positions.len()];
    for cluster in 0..table.clusters().count() {
        let nodes = table.clusters().nodes(cluster);
        for (place, &node) in nodes.iter().enumerate() {
            let column = &mut columns[node as usize];
            column.extend_from_slice(&nodes[place..]);
            // Clusters share most of their particles.
            if column.len() > 2 * most[node as usize].max(nodes.len()) {
                column.sort_unstable();
                column.dedup();
                most[node as usize] = column.len();
            }
        }
    }
    // Conditions on the components of one particle stand together.
    let mut rows: Vec<u32> = vec![u32::MAX; positions.len()];
    for equation in equations.equations() {
        let row = &mut rows[equation.dependent / D];
        if *row == u32::MAX {
            *row = columns.len() as u32;
            columns.push(Vec::new());
        }
        let (row, mut last) = (*row, usize::MAX);
        for node in equation.entries.iter().map(|entry| entry.0 / D) {
            if std::mem::replace(&mut last, node) != node {
                columns[node].push(row);
            }
        }
    }
    let pattern = Pattern::from_columns(columns);
    let order = after_their_rows(
        &pattern,
        &nested_dissection(&pattern, positions.len(), D, &|node, axis| positions[node][axis]),
    );
    // Blocks of D by D to each entry, D unknowns to each particle.
    Ok(multiplications(&pattern, &order)? * (D * D) as f64 / pattern.size().max(1) as f64)
}

/// How far supports reach, in spacings.
fn reach(scheme: &Scheme) -> f64 {
    match scheme.dilation {
        Dilation::Local(r) | Dilation::Global(r) => r,
        _ => super::approximation::default_dilation(scheme.order),
    }
}

/// Whether the factors of a body fit into memory.
fn factors_fit(scheme: &Scheme, size: Size) -> bool {
    let limit = scheme.memory.or_else(super::memory::at_hand);
    limit.is_none_or(|limit| super::memory::needed(size, reach(scheme), false, false) <= limit as f64)
}

/// Refuses lattices in space that would not fit into memory, before they are built.
///
/// # Errors
/// [`SolveError::Memory`] with the bytes that the model would take and the size that fits.
pub(crate) fn refuse<const D: usize>(
    scene: &Scene<D>,
    scheme: &Scheme,
    domain: &dyn Domain<D>,
    counts: &[usize],
) -> Result<(), SolveError> {
    let limit = scheme.memory.or_else(super::memory::at_hand);
    let (Some(limit), 3, ApproximationChoice::Particles) = (limit, counts.len(), scheme.approximation) else {
        return Ok(());
    };
    // Each of several ranks takes its share.
    let ranks = scheme.solver.as_ref().and_then(|solver| solver.ranks()).map_or(1, |ranks| ranks.count()) as f64;
    let preconditioner = scheme.solver.as_ref().is_some_and(|solver| solver.preconditioner(&[]).is_some());
    let by_iteration = |counts: &[usize]| {
        let iterates = || iterates(scene, scheme, Size::of(counts), WORTH_ON_LATTICES, || false);
        preconditioner || is_one_body(scene) && iterates()
    };
    let alike = matches!(scheme.layout, Layout::Regular) && straight(domain);
    let takes =
        |counts: &[usize]| super::memory::needed(Size::of(counts), reach(scheme), by_iteration(counts), alike) / ranks;
    let (needed, limit) = (takes(counts), limit as f64);
    if !(needed > limit) {
        return Ok(());
    }
    let mut fits = 2;
    while fits < 10_000 && takes(&[fits + 1; 3]) <= limit {
        fits += 1;
    }
    Err(SolveError::Memory { particles: Size::of(counts).particles, needed, limit, fits })
}

/// Whether even steps of the unit cube are even steps of a domain, looked at in a few points.
fn straight<const D: usize>(domain: &dyn Domain<D>) -> bool {
    let corner = domain.position(&Point::from([0.0; D]));
    let edges: [_; D] = array_of(|axis| {
        let mut unit = Point::from([0.0; D]);
        unit[axis] = 1.0;
        domain.position(&unit) - corner
    });
    let size = edges.largest(|edge| edge.norm());
    [[0.5; 3], [1.0; 3], [0.2, 0.7, 0.4], [0.9, 0.3, 0.6]].iter().all(|t| {
        let even = edges.iter().zip(t).fold(corner, |sum, (edge, t)| sum + edge * *t);
        (domain.position(&point_of(|i| t[i.min(2)])) - even).norm() <= 1e-9 * size
    })
}

/// Particles of a body in space, of all and along its longest side, which has so many cells `along` each axis where it is no lattice.
fn size_of<const D: usize>(cells: &dyn Cells<D>, along: &[usize]) -> Size {
    match cells.lattice() {
        Some(lattice) => Size::of(&lattice.counts()),
        None => Size {
            particles: cells.positions().len() as f64,
            longest: along.iter().fold(1.0, |most: f64, &cells| most.max(cells as f64 + 1.0)),
        },
    }
}

/// The solution by iteration of a body, with elements beside its particles; none where it is not to be had.
///
/// # Errors
/// Where an iteration is requested by name and the scheme does not suit it.
pub(crate) fn krylov<const D: usize>(
    scene: &Scene<D>,
    scheme: &Scheme,
    cells: &dyn Cells<D>,
    approximation: &dyn Approximation<D>,
    body: &Body<D>,
    equations: &Constraints,
    sharing: &Sharing,
) -> Result<Option<Krylov>, Error> {
    let nodes: Vec<Point<3>> = all_padded(cells.positions());
    let preconditioner = scheme.solver.as_ref().and_then(|solver| solver.preconditioner(&nodes));
    if scheme.solver.is_some() && preconditioner.is_none() {
        // It takes the condensed system.
        return Ok(None);
    }
    let requested = scheme.solver_choice == SolverChoice::Krylov || preconditioner.is_some();
    if !scene.contacts.is_empty() && !requested {
        return Ok(None);
    }
    let refused = |with: &'static str, remedy: &'static str| match requested {
        true => Err(Incompatible::new("solution by Krylov iteration", with, remedy).into()),
        false => Ok(None),
    };
    if D != 3 {
        return refused("a body that is not in 3D", "a direct solver is cheap there: take SolverChoice::Auto");
    }
    if preconditioner.is_some() && cells.lattice().is_none() {
        let remedy = "leave the solver out and take SolverChoice::Krylov, or give a direct solver";
        return refused("a solver that only preconditions and cells that do not form a lattice", remedy);
    }
    let Places { places, cells: along } = Places::of(cells, body.table());
    let size = size_of(cells, &along);
    // Separators of solids may be wider than their mean cross section; a rank has a share of the table.
    let counted = || {
        let whole = cells.lattice().is_none() && sharing.ranks().is_none();
        whole && of_factors(cells.positions(), body.table(), equations).is_ok_and(|each| each > WORTH)
    };
    let worth = if cells.lattice().is_some() { WORTH_ON_LATTICES } else { WORTH };
    if !requested && !iterates(scene, scheme, size, worth, counted) {
        return Ok(None);
    }
    if scheme.constraint_method != ConstraintMethod::Auto {
        let remedy =
            "an iteration has one of its own: leave it out, or take SolverChoice::Auto, which then takes factors";
        return refused("Scheme::constraint_method", remedy);
    }
    if let Some((with, remedy)) = unsuited_contact(scene, scheme) {
        return refused(with, remedy);
    }
    let projected = matches!(body.field(), PressureField::Constant | PressureField::Linear);
    let Some(elements) = (match cells.lattice() {
        _ if !projected => None,
        Some(lattice) => elements_of(scene, scheme, (cells, lattice), body, sharing)?,
        None => {
            let stretch = |x: &Point<D>| scene.expansion.as_ref().map_or(1.0, |stretch| stretch.at(x, 1.0));
            let fitted = linear_fits(body.table(), cells.positions(), &*scene.kinematics, &stretch)?;
            Some(body.over(expanding(scene, fitted)?))
        }
    }) else {
        return refused("pressures that are not projected on zones of cells", "take the default rule and pressures");
    };
    let mut model = Model::new(cells.positions());
    if let Some(ranks) = sharing.ranks() {
        model.share(ranks);
    }
    model.set_clock(scene.clock.clone())?.add(elements.apart());
    let mut at = Points::empty();
    let own = Auxiliary::share(sharing.ranks().as_deref(), cells.positions().len());
    cells.positions()[own].iter().for_each(|position| {
        at.push(*position, 1.0);
        at.close_group();
    });
    let table = ShapeTable::new(approximation, &at, &Unmeasured)?;
    let mut values = (vec![0], Vec::new(), Vec::new());
    for point in 0..table.point_count() {
        values.1.extend_from_slice(table.nodes(point));
        values.2.extend_from_slice(table.values(point));
        values.0.push(values.1.len());
    }
    // Rows that move one component of particles in a neighbourhood; ties and motions of whole bodies hold none.
    let holds = |equation: &&ConstraintEquation| {
        let sum: f64 = equation.entries.summed(|e| e.1);
        sum.abs() > 0.5 * equation.measure() && equation.entries.iter().all(|e| e.0 % D == equation.dependent % D)
    };
    let held = equations.equations().iter().filter(holds).map(|equation| equation.dependent).collect();
    let auxiliary = Auxiliary { model: Arc::new(model), term: 0, values, places, cells: along, held };
    let mut krylov = Krylov::new(auxiliary);
    krylov.replaceable = !requested && factors_fit(scheme, size);
    Ok(Some(match preconditioner {
        Some(preconditioner) => krylov.with_preconditioner(preconditioner),
        None => krylov,
    }))
}

/// The first of a scene's contacts that can't be combined with solution by iteration, and what to do instead.
fn unsuited_contact<const D: usize>(scene: &Scene<D>, scheme: &Scheme) -> Option<(&'static str, &'static str)> {
    const DIRECT: &str = "take SolverChoice::Auto, which takes a direct solver";
    let any = |of: fn(&Obstacle) -> bool| scene.contacts.iter().any(|contact| of(&contact.surface));
    if scene.contacts.is_empty() {
        None
    } else if any(|surface| surface.friction > 0.0) {
        Some(("contact with friction", DIRECT))
    } else if any(Obstacle::is_free) {
        Some((
            "a rigid surface that is pushed or free to turn",
            "prescribe its motion or rotation, or take SolverChoice::Auto",
        ))
    } else if scheme.stepping.control == StepControl::ArcLength {
        Some(("contact under StepControl::ArcLength", "take StepControl::Load, or SolverChoice::Auto"))
    } else {
        None
    }
}

/// Linear elements on a lattice with the material and the zones of its body; none where the body's clusters are others.
fn elements_of<const D: usize>(
    scene: &Scene<D>,
    scheme: &Scheme,
    (cells, lattice): (&dyn Cells<D>, &Lattice<D>),
    body: &Body<D>,
    sharing: &Sharing,
) -> Result<Option<Body<D>>, Error> {
    let size = match scheme.pressure {
        PressureScheme::Auto if cells.is_thin() => 1,
        PressureScheme::Auto => 2,
        PressureScheme::Field { size, .. } => size,
    };
    let zones = sharing.zones(cells, cells.zones(size))?;
    if body.table().clusters().count() + 1 != zones.offsets.len() {
        return Ok(None);
    }
    let elements = FiniteElements::new(lattice.clone(), 1)?;
    let table = ShapeTable::of_alike_elements(&elements, &elements.gauss_in(2, &zones)?, &*scene.kinematics)?;
    let elastic = Body::projecting(table, body.law().clone(), body.field(), body.projected_measure());
    Ok(Some(sharing.smallest_zones_of(elastic)))
}

/// Where particles stand in the unit cube.
struct Places {
    places: Vec<[f64; 3]>,
    /// Cells of about the spacing of particles along each axis.
    cells: [usize; 3],
}

impl Places {
    /// Those of a lattice by its own axes, those of other cells in the box around them.
    fn of<const D: usize>(cells: &dyn Cells<D>, table: &ShapeTable<D>) -> Places {
        let positions = cells.positions();
        let mut places = vec![[0.0; 3]; positions.len()];
        if let Some(lattice) = cells.lattice() {
            let along = lattice.cell_counts();
            for index in lattice.indices() {
                for i in 0..3 {
                    places[lattice.node(index)][i] = index[i] as f64 / along[i] as f64;
                }
            }
            return Places { places, cells: array_of(|i| along[i]) };
        }
        let Bounds { low, high } = Bounds::of(positions);
        let spacing = (table.weights().iter().sum::<f64>() / positions.len() as f64).cbrt();
        let cells = array_of(|i| (((high[i] - low[i]) / spacing).round() as usize).max(1));
        for (place, x) in places.iter_mut().zip(positions) {
            *place = array_of(|i| (x[i] - low[i]) / (high[i] - low[i]).max(f64::MIN_POSITIVE));
        }
        Places { places, cells }
    }
}
