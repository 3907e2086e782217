//! From scene and scheme to a problem.

use std::sync::Arc;

use crate::assembly::Model;
use crate::boundary::{Constraints, LagrangeMultipliers, MixedTransformation};
use crate::cells::{Cells, Lattice, Layout, Unstructured};
use crate::error::{ApproximationError, BoundaryError, Error, GeometryError};
use crate::geometry::{Domain, Part, Point};
use crate::linear::{Direct, Krylov};
use crate::material::{FreeThickness, Material};
use crate::particles::Particles;
use crate::quadrature::Points;
use crate::shape::{Approximation, FiniteElements};
use crate::solve::Analysis;
use crate::table::ShapeTable;
use crate::term::{Amplitude, Body, FollowerPressure, Pointwise, PressureField};

use super::conditions::{Placed, rows};
use super::contact::{self, Contact};
use super::cover::{self, KernelFunctions};
use super::load::{LoadKind, Shared, Varying, dead};
use super::place::Spot;
use super::problem::Evaluate;
use super::scheme::{Dilation, Enforcing, Functions, PressureScheme, Resolution, RowKind, Rule, Scheme};
use super::{Load, Place, Problem, Scene, Source, Value, resolve};

/// Gauss points per cell in 1D where the basis is quadratic or higher.
const FINE: usize = 7;

/// Rows up to which the mixed transformation is the default: beyond, its dense faces cost more than multipliers.
const TRANSFORMATION_ROWS: usize = 600;

/// How many times finer facets are integrated where a load acts on a part of a part.
const FINER: usize = 4;

/// How boundaries are integrated: sub-facets per direction and Gauss points on each.
#[derive(Clone, Copy)]
pub(super) struct FacetRule {
    pub parts: usize,
    pub gauss: usize,
}

/// What becomes of a condition that can't be added to the rows: the error itself, or leave to go on without it.
pub(super) type Refused<'a> = &'a mut dyn FnMut(Error) -> Result<(), Error>;

pub(super) fn discretize<const D: usize>(
    scene: &Scene<D>,
    scheme: &Scheme,
    refused: Refused<'_>,
) -> Result<Problem<D>, Error> {
    if let PressureScheme::Field { size: 0, .. } = scheme.pressure {
        let needed = "at least 1 is needed";
        return Err(GeometryError::Count { what: "cells per direction of a pressure zone", count: 0, needed }.into());
    }
    let cells = cells(scene, scheme)?;
    match scheme.functions {
        Functions::Particles => particles(scene, scheme, cells, refused),
        Functions::Elements => elements(scene, scheme, cells, refused),
    }
}

/// The material as the kinematics moves it.
fn material<const D: usize>(scene: &Scene<D>) -> Result<Arc<dyn Material>, Error> {
    if !scene.kinematics.is_plane_stress() {
        return Ok(scene.material.clone());
    }
    if scene.material.memory().is_some() {
        let what = "a law that remembers in a sheet in plane stress";
        return Err(GeometryError::Unsuited { what, needed: "a solid model, or an elastic law" }.into());
    }
    Ok(Arc::new(FreeThickness(scene.material.clone())))
}

/// The table of the body, with the scene's free expansion.
fn expanding<const D: usize>(scene: &Scene<D>, table: ShapeTable<D>) -> Result<ShapeTable<D>, Error> {
    match &scene.expansion {
        None => Ok(table),
        Some(stretch) => table.expanding(|x| stretch.at(x, 1.0)),
    }
}

/// A body with the clock of the scene.
fn clocked<const D: usize>(
    scene: &Scene<D>,
    body: Body<D, Arc<dyn Material>>,
) -> Result<Body<D, Arc<dyn Material>>, Error> {
    let Some(clock) = &scene.clock else { return Ok(body) };
    clock.validate()?;
    const LOOKS: usize = 64;
    let times = (0..=LOOKS).map(|k| clock.evaluate(k as f64 / LOOKS as f64).0);
    let times: Vec<f64> = match clock {
        Amplitude::Table(pairs) => pairs.iter().map(|p| p.1).collect(),
        _ => times.collect(),
    };
    if !times.iter().all(|t| t.is_finite()) || times.windows(2).any(|w| w[1] < w[0]) {
        return Err(BoundaryError::Amplitude { what: "the time of a clock is not finite, or falls" }.into());
    }
    Ok(body.with_clock(clock.clone()))
}

/// The particles of a scene under a scheme and the cells between them.
pub(super) fn cells<const D: usize>(scene: &Scene<D>, scheme: &Scheme) -> Result<Arc<dyn Cells<D>>, Error> {
    Ok(match &scene.source {
        Source::Domain(domain) => {
            let counts = counts(&**domain, scheme)?;
            super::space::refuse(scheme, &counts)?;
            Arc::new(Lattice::new(&**domain, counts, &scheme.layout)?)
        }
        Source::Cells(cells) => cells.clone(),
        Source::Scattered(scatter) => scatter(scheme)?,
        Source::Mesh(mesh) => Arc::new(Unstructured::new(mesh)?),
    })
}

/// Where tables of loads come from: boundary parts and the body.
struct Tables<'a, const D: usize> {
    boundary: &'a dyn Fn(&Part, &Place<D>) -> Result<ShapeTable<D>, Error>,
    body: &'a dyn Fn(&Place<D>) -> Result<ShapeTable<D>, Error>,
}

/// Reproducing kernel particles.
fn particles<const D: usize>(
    scene: &Scene<D>,
    scheme: &Scheme,
    cells: Arc<dyn Cells<D>>,
    refused: Refused<'_>,
) -> Result<Problem<D>, Error> {
    let (approximation, raised) = covering(scheme, &*cells)?;
    let dilations = approximation.particles().supports().iter().map(|s| s.half_widths().max()).collect();
    let kinematics = &*scene.kinematics;
    let (table, facets, field) = body_table(scene, scheme, &*cells, &approximation)?;
    let body = clocked(scene, Body::new(expanding(scene, table)?, material(scene)?, field))?;
    let tables = Tables {
        boundary: &|part, place| {
            // Where a load ends within a facet, finer ones see it.
            let parts = facets.parts * if place.within.is_some() { FINER } else { 1 };
            let points = cells.boundary(part, parts, facets.gauss)?.points;
            ShapeTable::new(&approximation, &points.retained(|x| place.holds(x)), kinematics)
        },
        body: &|place| {
            let points = cells.gauss(2 + usize::from(scheme.order > 1))?;
            ShapeTable::new(&approximation, &points.retained(|x| place.holds(x)), kinematics)
        },
    };
    let (mut model, body) = model(scene, body, &*cells, &approximation, &tables)?;
    let over_boundary = match scheme.rows {
        RowKind::Auto => D > 1,
        RowKind::AtParticles => false,
        RowKind::OverBoundary => true,
    };
    let (rows, placed) = rows(scene, &*cells, &approximation, over_boundary.then_some(facets), refused)?;
    let volume = body.table().weights().iter().sum();
    let skins = contact::Skins {
        part: &|place| {
            let place = resolve(&scene.names, place);
            let Spot::Part(part) = &place.spot else {
                let needed = "a part of the boundary, or some of one";
                return Err(GeometryError::Unsuited { what: "contact of a point or of the body", needed }.into());
            };
            let whole = cells.contact_boundary(part, facets.parts, facets.gauss)?;
            let skin = whole.within(&|x| place.holds(x));
            let table = ShapeTable::new(&approximation, &skin.points, kinematics)?;
            Ok((skin, table))
        },
        points: &|points| ShapeTable::new(&approximation, points, &Unmeasured),
    };
    let contacts = contact::add(scene, &*cells, &rows, volume, &skins, &mut model)?;
    let auxiliary = super::space::auxiliary(scene, scheme, &*cells, &approximation, &body, &rows)?;
    let approximation = Box::new(approximation);
    let names = scene.names.clone();
    let discrete = Discrete { cells, approximation, dilations, raised, contacts, placed, names };
    let mut problem = finish(scheme, (model, body), rows, discrete)?;
    if let Some(auxiliary) = auxiliary {
        problem.analysis.enforcement = Box::new(LagrangeMultipliers);
        problem.analysis.solver = Box::new(Krylov::new(auxiliary));
    }
    Ok(problem)
}

/// The shape functions of a scheme on the particles of cells.
pub(crate) fn kernel_functions<const D: usize>(
    scheme: &Scheme,
    cells: &dyn Cells<D>,
) -> Result<KernelFunctions<D>, Error> {
    Ok(covering(scheme, cells)?.0)
}

/// The same with the number of particles whose supports were raised to cover the body.
fn covering<const D: usize>(scheme: &Scheme, cells: &dyn Cells<D>) -> Result<(KernelFunctions<D>, usize), Error> {
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
    if given != needed {
        let what = "particles that the cells make for their positions";
        return Err(ApproximationError::Length { what, given, particles: needed }.into());
    }
    // On lattices the default covers by construction, and a dilation that does not is the user's to know.
    if cells.lattice().is_some() {
        Ok((cover::functions(scheme, particles)?, 0))
    } else {
        cover::covering(scheme, particles, cells)
    }
}

/// Finite elements on the same lattice.
fn elements<const D: usize>(
    scene: &Scene<D>,
    scheme: &Scheme,
    cells: Arc<dyn Cells<D>>,
    refused: Refused<'_>,
) -> Result<Problem<D>, Error> {
    if scheme.rows == RowKind::OverBoundary {
        return Err(BoundaryError::Unsuitable {
            enforcement: "rows over boundaries",
            reason: "finite elements interpolate: prescribe values at nodes".into(),
        }
        .into());
    }
    if !scene.contacts.is_empty() || !scene.meetings.is_empty() {
        let needed = "particles: leave Scheme::elements out";
        return Err(GeometryError::Unsuited { what: "contact of finite elements", needed }.into());
    }
    let order = usize::from(scheme.order);
    let elements = FiniteElements::new(lattice_of(&*cells, "finite elements")?.clone(), order)?;
    let kinematics = &*scene.kinematics;
    let points = match &scheme.rule {
        Rule::Auto => order + 1,
        Rule::Gauss { zones: None, points } => points.unwrap_or(order + 1),
        _ => {
            return Err(GeometryError::Count {
                what: "integration zones of finite elements",
                count: 0,
                needed: "elements are integrated by Gauss points in each element",
            }
            .into());
        }
    };
    let field = match scheme.pressure {
        PressureScheme::Auto if order == 1 => PressureField::Constant,
        PressureScheme::Auto => PressureField::Linear,
        PressureScheme::Field { field, .. } => field,
    };
    let table = ShapeTable::of_elements(&elements, &elements.gauss(points)?, kinematics)?;
    // Q1/P0 and Q2/P1 as the literature has them: all of the volumetric energy projected.
    let body = clocked(scene, Body::zonal(expanding(scene, table)?, material(scene)?, field, 0.0))?;
    let tables = Tables {
        boundary: &|part, place| {
            let points = elements.boundary(part, points * if place.within.is_some() { FINER } else { 1 })?;
            ShapeTable::of_elements(&elements, &points.retained(|x| place.holds(x)), kinematics)
        },
        body: &|place| {
            ShapeTable::of_elements(&elements, &elements.gauss(points)?.retained(|x| place.holds(x)), kinematics)
        },
    };
    let model = model(scene, body, &*cells, &elements, &tables)?;
    let (rows, placed) = rows(scene, &*cells, &elements, None, refused)?;
    let dilations = (0..cells.positions().len()).map(|node| cells.local_spacing(node)).collect();
    finish(
        scheme,
        model,
        rows,
        Discrete {
            cells,
            approximation: Box::new(elements),
            dilations,
            raised: 0,
            contacts: Vec::new(),
            placed,
            names: scene.names.clone(),
        },
    )
}

type SceneModel<const D: usize> = (Model<D>, Arc<Body<D, Arc<dyn Material>>>);

/// Body and loads.
fn model<const D: usize, A: Approximation<D>>(
    scene: &Scene<D>,
    body: Body<D, Arc<dyn Material>>,
    cells: &dyn Cells<D>,
    approximation: &A,
    tables: &Tables<'_, D>,
) -> Result<SceneModel<D>, Error> {
    let body = Arc::new(body);
    let mut positions = cells.positions().to_vec();
    positions.extend(contact::carriages(scene, cells.positions()));
    let mut model = Model::new(positions);
    model.add(body.clone());
    for load in &scene.loads {
        if scene.kinematics.is_plane_stress() && matches!(load.kind, LoadKind::Pressure(_)) {
            let what = "a following pressure on the edge of a sheet in plane stress";
            let needed = "a traction: the area of the edge changes with the thickness, which is no unknown";
            return Err(GeometryError::Unsuited { what, needed }.into());
        }
        add_load(&mut model, load, &scene.resolve(&load.place), cells, approximation, tables)?;
    }
    Ok((model, body))
}

/// Adds a load at a place whose name was looked up.
fn add_load<const D: usize, A: Approximation<D>>(
    model: &mut Model<D>,
    load: &Load<D>,
    place: &Place<D>,
    cells: &dyn Cells<D>,
    approximation: &A,
    tables: &Tables<'_, D>,
) -> Result<(), Error> {
    let table = match &place.spot {
        Spot::Part(part) => (tables.boundary)(part, place)?,
        // A point load is a force already: it takes no measure.
        Spot::Point(at) => {
            if !cells.contains(at) {
                let what = load.label();
                return Err(BoundaryError::Outside { what, at: at.as_slice().to_vec() }.into());
            }
            ShapeTable::new(approximation, &Points::single(*at), &Unmeasured)?
        }
        Spot::Body => (tables.body)(place)?,
    };
    if table.is_empty() {
        let nearest = cells.positions().first().map(|x| x.as_slice().to_vec()).unwrap_or_default();
        return Err(BoundaryError::Empty { what: load.label(), nearest }.into());
    }
    let amplitude = load.amplitude.clone();
    match &load.kind {
        LoadKind::Dead(Value::Constant(force)) => model.add(Pointwise::new(table, dead(force, &amplitude))),
        LoadKind::Dead(value) => model.add(Pointwise::new(table, Varying { value: value.clone(), amplitude })),
        LoadKind::Total(value) => {
            let measure: f64 = table.weights().iter().sum();
            let force = value.at(&Point::zeros(), 1.0).map(|f| f / measure);
            model.add(Pointwise::new(table, dead(&force, &amplitude)))
        }
        LoadKind::Pressure(Value::Constant(pressure)) => {
            model.add(Pointwise::new(table, FollowerPressure { pressure: *pressure, amplitude }))
        }
        LoadKind::Pressure(value) => model.add(Pointwise::new(table, Varying { value: value.clone(), amplitude })),
        LoadKind::Integrand(integrand) => model.add(Pointwise::new(table, Shared(integrand.clone()))),
    };
    Ok(())
}

/// What a problem keeps of its discretisation.
struct Discrete<const D: usize> {
    cells: Arc<dyn Cells<D>>,
    approximation: Box<dyn Evaluate<D>>,
    dilations: Vec<f64>,
    raised: usize,
    contacts: Vec<Contact<D>>,
    placed: Vec<Placed<D>>,
    names: Vec<(String, Place<D>)>,
}

/// Binds the strategies.
fn finish<const D: usize>(
    scheme: &Scheme,
    (model, body): SceneModel<D>,
    rows: Constraints,
    discrete: Discrete<D>,
) -> Result<Problem<D>, Error> {
    let transform = match scheme.enforcing {
        Enforcing::Auto => rows.len() <= TRANSFORMATION_ROWS || scheme.functions == Functions::Elements,
        Enforcing::Transformation => true,
        Enforcing::Multipliers => false,
    };
    let mut analysis = if transform {
        Analysis::new(MixedTransformation::default(), Direct)
    } else {
        Analysis::new(LagrangeMultipliers, Direct)
    };
    analysis.newton = scheme.newton;
    analysis.stepping = scheme.stepping;
    let Discrete { cells, approximation, dilations, raised, contacts, placed, names } = discrete;
    Ok(Problem { model, rows, analysis, body, cells, approximation, dilations, raised, contacts, placed, names })
}

/// The lattice of the cells, for what needs one.
fn lattice_of<'a, const D: usize>(
    cells: &'a dyn Cells<D>,
    what: &'static str,
) -> Result<&'a Lattice<D>, GeometryError> {
    cells.lattice().ok_or_else(|| no_lattice(what))
}

fn no_lattice(what: &'static str) -> GeometryError {
    GeometryError::Unsuited { what, needed: "a lattice: make the scene with Scene::new on a block or mapped block" }
}

/// The default normalised dilation: best value for work by measurement.
pub(super) fn default_dilation(order: u8) -> f64 {
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
    for node in 0..dilations.len() {
        let mut index = [0; D];
        let mut rest = node;
        for i in 0..D {
            (index[i], rest) = (rest % counts[i], rest / counts[i]);
        }
        if (0..D).any(|i| index[i].min(counts[i] - 1 - index[i]) == 2) {
            dilations[lattice.node(index)] = OUTER;
        }
    }
    dilations
}

/// Particles along each axis.
fn counts<const D: usize>(domain: &dyn Domain<D>, scheme: &Scheme) -> Result<[usize; D], Error> {
    match &scheme.resolution {
        Resolution::Counts(counts) => per_axis(counts, "particle counts"),
        Resolution::Spacing(spacing) => {
            if !(*spacing > 0.0 && spacing.is_finite()) {
                return Err(GeometryError::Number {
                    what: "particle spacing",
                    value: *spacing,
                    needed: "give a finite length above zero",
                }
                .into());
            }
            let lengths = edge_lengths(domain);
            Ok(lengths.map(|longest| (longest / spacing - 1e-9).ceil().clamp(1.0, 1e12) as usize + 1))
        }
    }
}

/// The longest of the edges of a domain's unit cube along each axis, each measured in 16 pieces \[length\].
pub(crate) fn edge_lengths<const D: usize>(domain: &dyn Domain<D>) -> [f64; D] {
    std::array::from_fn(|axis| {
        let mut longest: f64 = 0.0;
        for edge in 0..1usize << D {
            let corner = Point::<D>::from_fn(|i, _| if i == axis { 0.0 } else { ((edge >> i) & 1) as f64 });
            let mut length = 0.0;
            let mut before = domain.position(&corner);
            for piece in 1..=16 {
                let mut at = corner;
                at[axis] = piece as f64 / 16.0;
                let next = domain.position(&at);
                length += (next - before).norm();
                before = next;
            }
            longest = longest.max(length);
        }
        longest
    })
}

/// One number for each axis; a single one stands for all.
pub(super) fn per_axis<const D: usize>(given: &[usize], what: &'static str) -> Result<[usize; D], Error> {
    if given.len() == 1 || given.len() == D {
        Ok(std::array::from_fn(|i| if given.len() == 1 { given[0] } else { given[i] }))
    } else {
        Err(GeometryError::Count { what, count: given.len(), needed: "give one number for each axis, or one for all" }
            .into())
    }
}

/// The table of the body, the facet rule that agrees with it, and the pressure field on its clusters.
fn body_table<const D: usize, A: Approximation<D>>(
    scene: &Scene<D>,
    scheme: &Scheme,
    cells: &dyn Cells<D>,
    approximation: &A,
) -> Result<(ShapeTable<D>, FacetRule, PressureField), Error> {
    // The quadratic basis asks for one sub-cell or point more per direction.
    let more = usize::from(scheme.order > 1);
    let (field, size) = match scheme.pressure {
        // One point for each particle: a pressure there is one constraint for two unknowns already.
        PressureScheme::Auto if matches!(scheme.rule, Rule::Scni | Rule::Nodal) => (PressureField::Pointwise, 1),
        PressureScheme::Auto if !cells.is_thin() => (PressureField::Linear, 2),
        PressureScheme::Auto => (PressureField::Constant, 1),
        PressureScheme::Field { field, size } => (field, size),
    };
    let kinematics = &*scene.kinematics;
    match &scheme.rule {
        Rule::Auto if D == 1 => {
            // Gauss points over whole zones, which end at particles; over single cells and more of them for functions whose
            // third and fourth order the error of the rule would hide.
            let points = match cells.lattice() {
                Some(lattice) if scheme.order < 2 => lattice.coarsened(size).gauss(5)?,
                _ => cells.gauss_in(if scheme.order < 2 { 5 } else { FINE }, &cells.zones(size))?,
            };
            let table = ShapeTable::new(approximation, &points, kinematics)?;
            Ok((table, FacetRule { parts: 1, gauss: 1 }, field))
        }
        // Averages would leave a basis that can do more at their second order.
        Rule::Auto if scheme.order > 1 && (D == 2 || cells.lattice().is_some()) => {
            let gauss = 2 + more;
            let smoothing = cells.smoothing(1, gauss, &cells.zones(size))?;
            let table = ShapeTable::consistent(approximation, &smoothing, kinematics)?;
            Ok((table, FacetRule { parts: 1, gauss }, field))
        }
        Rule::Auto | Rule::Smoothed { .. } => {
            let parts = if let Rule::Smoothed { parts } = scheme.rule { parts } else { 2 + more };
            let gauss = 2 + more;
            let smoothing = cells.smoothing(parts, gauss, &cells.zones(size))?;
            let table = ShapeTable::smoothed(approximation, &smoothing, kinematics)?;
            Ok((table, FacetRule { parts, gauss }, field))
        }
        Rule::Scni => {
            let gauss = 2 + more;
            let table = ShapeTable::smoothed(approximation, &cells.nodal_cells(gauss)?, kinematics)?;
            Ok((table, FacetRule { parts: 2, gauss }, field))
        }
        Rule::Nodal => {
            let gauss = 2 + more;
            let points = cells.nodal_cells(gauss)?.nodal(cells.positions());
            let table = ShapeTable::new(approximation, &points, kinematics)?;
            Ok((table, FacetRule { parts: 2, gauss }, field))
        }
        Rule::Gauss { zones, points } => {
            let (gauss, points) = match (zones, &scene.source) {
                (None, _) => {
                    // Two particles per direction and cell, and two more.
                    let points = points.unwrap_or(4);
                    (cells.gauss_in(points, &cells.zones(size))?, points)
                }
                // Equal zones of the domain, whatever the particles.
                (Some(zones), Source::Domain(domain)) => {
                    let counts: [usize; D] = per_axis(zones, "integration zones")?;
                    if counts.contains(&0) {
                        return Err(GeometryError::Count {
                            what: "integration zones",
                            count: 0,
                            needed: "at least 1 is needed",
                        }
                        .into());
                    }
                    let along = lattice_of(cells, "integration zones")?.cell_counts();
                    let default = (0..D).map(|i| along[i].div_ceil(counts[i]) + 3).max().unwrap_or(5);
                    let points = points.unwrap_or(default);
                    (
                        Lattice::new(&**domain, counts.map(|z| z.saturating_add(1)), &Layout::Regular)?
                            .gauss(points)?,
                        points,
                    )
                }
                (Some(_), _) => return Err(no_lattice("equal integration zones").into()),
            };
            let table = ShapeTable::new(approximation, &gauss, kinematics)?;
            Ok((table, FacetRule { parts: 1, gauss: points }, field))
        }
    }
}

/// Plain coordinates without hoops: the measure of a point.
pub(super) struct Unmeasured;

impl<const D: usize> crate::kinematics::Kinematics<D> for Unmeasured {
    fn hoop_components(&self) -> &'static [usize] {
        &[]
    }

    fn measure(&self, _: &Point<D>) -> f64 {
        1.0
    }
}
