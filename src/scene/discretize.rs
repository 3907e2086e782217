//! From scene and scheme to a problem.

use std::sync::Arc;

use crate::assembly::Model;
use crate::basis::Polynomial;
use crate::boundary::{Constraints, LagrangeMultipliers, MixedTransformation, Motion};
use crate::cells::{Lattice, Layout};
use crate::error::{BoundaryError, Error, GeometryError};
use crate::geometry::{Part, Point};
use crate::kernel::Kernel;
use crate::linear::Direct;
use crate::material::Material;
use crate::quadrature::Points;
use crate::shape::{Approximation, FiniteElements, ReproducingKernel};
use crate::solve::Analysis;
use crate::table::ShapeTable;
use crate::term::{Amplitude, Body, DeadLoad, FollowerPressure, Pointwise, PressureField};

use super::problem::Evaluate;
use super::scheme::{Dilation, Enforcing, Functions, Resolution, RowKind, Rule, Scheme, Volume};
use super::{LoadKind, Place, Problem, Scene, Value};

/// Rows up to which the mixed transformation is the default: beyond, its dense faces cost more than multipliers.
const TRANSFORMATION_ROWS: usize = 600;

/// How boundaries are integrated: sub-facets per direction and Gauss points on each.
#[derive(Clone, Copy)]
struct FacetRule {
    parts: usize,
    gauss: usize,
}

pub(super) fn discretize<const D: usize>(scene: &Scene<D>, scheme: &Scheme) -> Result<Problem<D>, Error> {
    let lattice = Lattice::new(&*scene.domain, counts(scene, scheme)?, &scheme.layout)?;
    match scheme.functions {
        Functions::Particles => particles(scene, scheme, lattice),
        Functions::Elements => elements(scene, scheme, lattice),
    }
}

/// Where tables of loads come from: boundary parts and the body.
struct Tables<'a, const D: usize> {
    boundary: &'a dyn Fn(&Part) -> Result<ShapeTable<D>, Error>,
    body: &'a dyn Fn() -> Result<ShapeTable<D>, Error>,
}

/// Reproducing kernel particles.
fn particles<const D: usize>(scene: &Scene<D>, scheme: &Scheme, lattice: Lattice<D>) -> Result<Problem<D>, Error> {
    let particles = match scheme.dilation {
        Dilation::Auto => lattice.particles(default_dilation::<D>(scheme.order))?,
        Dilation::Local(r) => lattice.particles(r)?,
        Dilation::Global(r) => lattice.particles_global(r)?,
    };
    let mut approximation: ReproducingKernel<D, Arc<dyn Kernel>, Polynomial<D>> =
        ReproducingKernel::new(particles, scheme.kernel.clone(), Polynomial::new(scheme.order))?;
    if let Some(limit) = scheme.rcond_limit {
        approximation = approximation.with_rcond_limit(limit);
    }
    let kinematics = &*scene.kinematics;
    let (table, facets, field) = body_table(scene, scheme, &lattice, &approximation)?;
    let body = Body::new(table, scene.material.clone(), field);
    let tables = Tables {
        boundary: &|part| {
            let points = lattice.boundary(part, facets.parts, facets.gauss)?.points;
            ShapeTable::new(&approximation, &points, kinematics)
        },
        body: &|| {
            let points = lattice.gauss(2 + usize::from(scheme.order > 1))?;
            ShapeTable::new(&approximation, &points, kinematics)
        },
    };
    let model = model(scene, body, &lattice, &approximation, &tables)?;
    let over_boundary = match scheme.rows {
        RowKind::Auto => D > 1,
        RowKind::AtParticles => false,
        RowKind::OverBoundary => true,
    };
    let rows = rows(scene, &lattice, &approximation, over_boundary.then_some(facets))?;
    finish(scheme, model, rows, lattice, Box::new(approximation))
}

/// Finite elements on the same lattice.
fn elements<const D: usize>(scene: &Scene<D>, scheme: &Scheme, lattice: Lattice<D>) -> Result<Problem<D>, Error> {
    if scheme.rows == RowKind::OverBoundary {
        return Err(BoundaryError::Unsuitable {
            enforcement: "rows over boundaries",
            reason: "finite elements interpolate: prescribe values at nodes".into(),
        }
        .into());
    }
    let order = usize::from(scheme.order);
    let elements = FiniteElements::new(lattice.clone(), order)?;
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
    let field = match scheme.volume {
        Volume::Auto if order == 1 => PressureField::Constant,
        Volume::Auto => PressureField::Linear,
        Volume::Field { field, .. } => field,
    };
    let table = ShapeTable::of_elements(&elements, &elements.gauss(points)?, kinematics)?;
    // Q1/P0 and Q2/P1 as the literature has them: all of the volumetric energy projected.
    let body = Body::zonal(table, scene.material.clone(), field, 0.0);
    let tables = Tables {
        boundary: &|part| ShapeTable::of_elements(&elements, &elements.boundary(part, points)?, kinematics),
        body: &|| ShapeTable::of_elements(&elements, &elements.gauss(points)?, kinematics),
    };
    let model = model(scene, body, &lattice, &elements, &tables)?;
    let rows = rows(scene, &lattice, &elements, None)?;
    finish(scheme, model, rows, lattice, Box::new(elements))
}

type SceneModel<const D: usize> = (Model<D>, Arc<Body<D, Arc<dyn Material>>>);

/// Body and loads.
fn model<const D: usize, A: Approximation<D>>(
    scene: &Scene<D>,
    body: Body<D, Arc<dyn Material>>,
    lattice: &Lattice<D>,
    approximation: &A,
    tables: &Tables<'_, D>,
) -> Result<SceneModel<D>, Error> {
    let body = Arc::new(body);
    let mut model = Model::new(lattice.positions().to_vec());
    model.add(body.clone());
    for load in &scene.loads {
        let table = match &load.place {
            Place::Part(part) => (tables.boundary)(part)?,
            // A point load is a force already: it takes no measure.
            Place::Particle(at) => {
                if !lattice.contains(at) {
                    let what = load.label.clone();
                    return Err(BoundaryError::Outside { what, at: at.as_slice().to_vec() }.into());
                }
                ShapeTable::new(approximation, &Points::single(*at), &Unmeasured)?
            }
            Place::Body => (tables.body)()?,
        };
        match &load.kind {
            LoadKind::Dead(force) => {
                model.add(Pointwise::new(table, DeadLoad { force: *force, amplitude: load.amplitude.clone() }));
            }
            LoadKind::Pressure(pressure) => {
                let integrand = FollowerPressure { pressure: *pressure, amplitude: load.amplitude.clone() };
                model.add(Pointwise::new(table, integrand));
            }
        }
    }
    Ok((model, body))
}

/// Binds the strategies.
fn finish<const D: usize>(
    scheme: &Scheme,
    (model, body): SceneModel<D>,
    rows: Constraints,
    lattice: Lattice<D>,
    approximation: Box<dyn Evaluate<D>>,
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
    Ok(Problem { model, rows, analysis, body, lattice, approximation })
}

/// The default normalised dilation: best value for work by measurement.
fn default_dilation<const D: usize>(order: u8) -> f64 {
    match (order, D) {
        (0 | 1, 3) => 0.75,
        (0 | 1, _) => 1.0,
        // Quadratic: 1.3; each further order needs one more ring of half a spacing.
        (order, _) => 1.3 + 0.5 * (f64::from(order) - 2.0),
    }
}

/// Particles along each axis.
fn counts<const D: usize>(scene: &Scene<D>, scheme: &Scheme) -> Result<[usize; D], Error> {
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
            // The longest of the edges along each axis, each measured in 16 pieces.
            Ok(std::array::from_fn(|axis| {
                let mut longest: f64 = 0.0;
                for edge in 0..1usize << D {
                    let corner = Point::<D>::from_fn(|i, _| if i == axis { 0.0 } else { ((edge >> i) & 1) as f64 });
                    let mut length = 0.0;
                    let mut before = scene.domain.position(&corner);
                    for piece in 1..=16 {
                        let mut at = corner;
                        at[axis] = piece as f64 / 16.0;
                        let next = scene.domain.position(&at);
                        length += (next - before).norm();
                        before = next;
                    }
                    longest = longest.max(length);
                }
                (longest / spacing - 1e-9).ceil().clamp(1.0, 1e7) as usize + 1
            }))
        }
    }
}

/// One number for each axis; a single one stands for all.
fn per_axis<const D: usize>(given: &[usize], what: &'static str) -> Result<[usize; D], Error> {
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
    lattice: &Lattice<D>,
    approximation: &A,
) -> Result<(ShapeTable<D>, FacetRule, PressureField), Error> {
    // The quadratic basis asks for one sub-cell or point more per direction.
    let more = usize::from(scheme.order > 1);
    let thick = lattice.cell_counts().iter().all(|&c| c > 1);
    let (field, size) = match scheme.volume {
        Volume::Auto if thick => (PressureField::Linear, 2),
        Volume::Auto => (PressureField::Constant, 1),
        Volume::Field { field, size } => (field, size),
    };
    let kinematics = &*scene.kinematics;
    match &scheme.rule {
        Rule::Auto if D == 1 => {
            // Gauss points over whole zones, which end at particles.
            let points = lattice.coarsened(size).gauss(5 + more)?;
            let table = ShapeTable::new(approximation, &points, kinematics)?;
            Ok((table, FacetRule { parts: 1, gauss: 1 }, field))
        }
        Rule::Auto | Rule::Smoothed { .. } => {
            let parts = if let Rule::Smoothed { parts } = scheme.rule { parts } else { 2 + more };
            let gauss = 2 + more;
            let smoothing = lattice.smoothing(parts, gauss, &lattice.zones(size))?;
            let table = ShapeTable::smoothed(approximation, &smoothing, kinematics)?;
            Ok((table, FacetRule { parts, gauss }, field))
        }
        Rule::Gauss { zones, points } => {
            let per_cell = zones.is_none();
            let zone_counts: [usize; D] = match zones {
                Some(zones) => per_axis(zones, "integration zones")?,
                None => lattice.cell_counts(),
            };
            if zone_counts.contains(&0) {
                return Err(GeometryError::Count {
                    what: "integration zones",
                    count: 0,
                    needed: "at least 1 is needed",
                }
                .into());
            }
            let points = points.unwrap_or_else(|| {
                let cells = lattice.cell_counts();
                (0..D).map(|i| cells[i].div_ceil(zone_counts[i]) + 3).max().unwrap_or(5)
            });
            let gauss = if per_cell {
                lattice.gauss_in(points, &lattice.zones(size))?
            } else {
                // Equal zones of the domain, whatever the particles.
                let zones = Lattice::new(&*scene.domain, zone_counts.map(|z| z + 1), &Layout::Regular)?;
                zones.gauss(points)?
            };
            let table = ShapeTable::new(approximation, &gauss, kinematics)?;
            Ok((table, FacetRule { parts: 1, gauss: points }, field))
        }
    }
}

/// Plain coordinates without hoops: the measure of a point.
struct Unmeasured;

impl<const D: usize> crate::kinematics::Kinematics<D> for Unmeasured {
    fn hoops(&self) -> &'static [usize] {
        &[]
    }

    fn measure(&self, _: &Point<D>) -> f64 {
        1.0
    }
}

/// Rows over boundaries with the given facet rule, or at particles without one.
fn rows<const D: usize, A: Approximation<D>>(
    scene: &Scene<D>,
    lattice: &Lattice<D>,
    approximation: &A,
    facets: Option<FacetRule>,
) -> Result<Constraints, Error> {
    let mut rows = Constraints::new();
    for condition in &scene.conditions {
        let (component, amplitude, label) = (condition.component, &condition.amplitude, condition.label.as_str());
        let nodes = match (&condition.place, facets) {
            (Place::Part(part), Some(facets)) => {
                for part in single_faces::<D>(part) {
                    let cells = lattice.boundary(&part, facets.parts, facets.gauss)?;
                    let kinematics = &*scene.kinematics;
                    match &condition.value {
                        Value::Field(field) => {
                            rows.over_boundary(
                                approximation,
                                &cells,
                                kinematics,
                                component,
                                &**field,
                                amplitude,
                                label,
                            )?;
                        }
                        Value::Motion(motion) => {
                            let motion = along(motion, amplitude);
                            rows.motion_over_boundary(approximation, &cells, kinematics, component, &motion, label)?;
                        }
                    }
                }
                continue;
            }
            (Place::Part(part), None) => lattice.boundary_nodes(part)?,
            (Place::Particle(at), _) => vec![particle_at(lattice, at, label)?],
            (Place::Body, _) => continue,
        };
        match &condition.value {
            Value::Field(field) => rows.at_particles(approximation, &nodes, component, &**field, amplitude, label)?,
            Value::Motion(motion) => {
                rows.motion_at_particles(approximation, &nodes, component, &along(motion, amplitude), label)?;
            }
        }
    }
    Ok(rows)
}

/// A motion whose load factor follows an amplitude.
fn along<const D: usize>(motion: &Motion<D>, amplitude: &Amplitude) -> Motion<D> {
    let (motion, amplitude) = (motion.clone(), amplitude.clone());
    Arc::new(move |x, load| motion(x, amplitude.evaluate(load).0))
}

/// The faces of a part one by one, so that each claims its corners in turn.
fn single_faces<const D: usize>(part: &Part) -> Vec<Part> {
    match part {
        Part::Whole => (0..D)
            .flat_map(|axis| {
                [crate::geometry::Side::Min, crate::geometry::Side::Max].map(|side| Part::Face { axis, side })
            })
            .collect(),
        other => vec![other.clone()],
    }
}

/// The particle that lies at a point, to a thousandth of its spacing.
fn particle_at<const D: usize>(lattice: &Lattice<D>, at: &Point<D>, label: &str) -> Result<usize, Error> {
    let distance = |node: usize| (lattice.positions()[node] - at).norm();
    let nearest = (0..lattice.positions().len()).min_by(|&a, &b| distance(a).total_cmp(&distance(b))).unwrap_or(0);
    if distance(nearest) <= 1e-3 * lattice.local_spacing(nearest).norm() {
        Ok(nearest)
    } else {
        let nearest = lattice.positions()[nearest].as_slice().to_vec();
        Err(BoundaryError::Empty { what: label.to_string(), nearest }.into())
    }
}
