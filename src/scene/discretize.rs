//! From scene and scheme to a problem.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::Matrix3;

use crate::assembly::Model;
use crate::boundary::{Constraints, LagrangeMultipliers, MixedTransformation};
use crate::cells::{Cells, Lattice, Layout, Unstructured, Zones};
use crate::error::{ApproximationError, BoundaryError, Error, GeometryError};
use crate::geometry::{Domain, Part, Point};
use crate::linear::{Direct, Krylov};
use crate::material::{FreeThickness, Material, initial_shear_modulus};
use crate::particles::Particles;
use crate::quadrature::Points;
use crate::shape::{Approximation, FiniteElements};
use crate::solve::Analysis;
use crate::table::ShapeTable;
use crate::term::{Amplitude, Body, FollowerPressure, Pointwise, PressureField};

use super::bond::{Ties, bond};
use super::conditions::{Placed, particle_at, rows, tie};
use super::contact::{self, Contact};
use super::cover::{self, KernelFunctions};
use super::load::{LoadKind, Shared, Varying, dead};
use super::member::{Evaluate, Member};
use super::place::Spot;
use super::recovery::Facets;
use super::rigid;
use super::scheme::{Dilation, Enforcing, Functions, PressureScheme, Resolution, RowKind, Rule, Scheme};
use super::sharing::Sharing;
use super::{BodyCells, BodyOf, Load, Place, Problem, Scene, Source, Value};

/// Gauss points per cell in 1D where the basis is quadratic or higher.
const FINE: usize = 7;

/// Rows up to which the mixed transformation is the default: beyond, its dense faces cost more than multipliers.
const TRANSFORMATION_ROWS: usize = 600;

/// How many times finer facets are integrated where a load acts on a part of a part.
const FINER: usize = 4;

/// How boundaries are integrated: sub-facets per direction and Gauss points on each.
#[derive(Clone, Copy)]
pub(crate) struct FacetRule {
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
    let all = all_cells(scene, scheme)?;
    let sharing = Sharing::of(scene, scheme, &all)?;
    let bodies = scene.bodies.len();
    let mut conditions: Vec<Vec<(usize, Place<D>)>> = vec![Vec::new(); bodies];
    for (number, condition) in scene.conditions.iter().enumerate() {
        let place = scene.resolve(&condition.place);
        if scene.rigid_at(&place).is_some() {
            continue;
        }
        let what = || condition.name.clone().unwrap_or_else(|| format!("condition on {}", condition.place));
        let Spot::Point(at) = &place.spot else {
            let of = scene.bodies_at(&place, what, &all, |_| true)?;
            of.into_iter().for_each(|body| conditions[body].push((number, place.clone())));
            continue;
        };
        let has_particle = |body: usize| particle_at(&*all[body].1, at, "").is_ok();
        for body in scene.bodies_at(&place, what, &all, has_particle)? {
            conditions[body].push((number, place.clone()));
        }
    }
    let mut loads: Vec<Vec<(usize, Place<D>)>> = vec![Vec::new(); bodies];
    for (number, load) in scene.loads.iter().enumerate() {
        let place = scene.resolve(&load.place);
        if scene.rigid_at(&place).is_some() {
            continue;
        }
        let contains = |body: usize| matches!(&place.spot, Spot::Point(at) if all[body].1.contains(at));
        for body in scene.bodies_at(&place, || load.label(), &all, contains)? {
            loads[body].push((number, place.clone()));
        }
    }
    let mut ties: Vec<Vec<(usize, Place<D>)>> = vec![Vec::new(); bodies];
    for (name, place) in &scene.rigids {
        let place = scene.resolve(place);
        let number = scene.rigid_names().iter().position(|other| other == name).unwrap_or(0);
        for body in scene.bodies_at(&place, || format!("rigid body {name}"), &all, |_| true)? {
            ties[body].push((number, place.clone()));
        }
    }
    let particles_of_all: usize = all.iter().map(|(_, cells)| cells.positions().len()).sum();
    let total = particles_of_all + contact::carriage_count(scene) + scene.rigid_names().len() * (D + 1);
    let mut first = 0;
    let mut made = Vec::with_capacity(bodies);
    for (number, body) in scene.bodies.iter().enumerate() {
        let (scheme, cells) = (&all[number].0, all[number].1.clone());
        let (conditions, loads, ties) = (&conditions[number], &loads[number], &ties[number]);
        let of = Of { scene, body, scheme, cells, conditions, loads, ties, first, total, sharing: &sharing };
        first += of.cells.positions().len();
        made.push(match scheme.functions {
            Functions::Particles => particles(&of, refused)?,
            Functions::Elements => elements(&of, refused)?,
        });
    }
    finish(scene, scheme, &all, made, &sharing)
}

/// The material as the kinematics moves it.
fn material<const D: usize>(scene: &Scene<D>, own: &Arc<dyn Material>) -> Result<Arc<dyn Material>, Error> {
    if !scene.kinematics.is_plane_stress() {
        return Ok(own.clone());
    }
    if own.memory().is_some() {
        let what = "a law that remembers in a sheet in plane stress";
        return Err(GeometryError::Unsuited { what, needed: "a solid model, or an elastic law" }.into());
    }
    Ok(Arc::new(FreeThickness(own.clone())))
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

/// The particles of each body under its own scheme and the cells between them.
pub(super) fn all_cells<const D: usize>(scene: &Scene<D>, scheme: &Scheme) -> Result<BodyCells<D>, Error> {
    let of = |body: &BodyOf<D>| {
        let scheme = body.scheme.as_ref().map_or_else(|| scheme.clone(), |own| own(scheme.clone()));
        if let PressureScheme::Field { size: 0, .. } = scheme.pressure {
            let (what, needed) = ("cells per direction of a pressure zone", "at least 1 is needed");
            return Err(GeometryError::Count { what, count: 0, needed }.into());
        }
        let cells: Arc<dyn Cells<D>> = match &body.source {
            Source::Domain(domain) => {
                let counts = counts(&**domain, &scheme)?;
                super::space::refuse(&scheme, &counts)?;
                Arc::new(Lattice::new(&**domain, counts, &scheme.layout)?)
            }
            Source::Cells(cells) => cells.clone(),
            Source::Scattered(scatter) => scatter(&scheme)?,
            Source::Mesh(mesh) => {
                let rigid = scene.rigid_volumes(mesh);
                match rigid.is_empty() {
                    true => Arc::new(Unstructured::new(mesh)?),
                    false => Arc::new(Unstructured::new(&mesh.without(&rigid)?)?),
                }
            }
        };
        Ok((scheme, cells))
    };
    scene.bodies.iter().map(of).collect()
}

/// A body that is discretised: what of the scene is about it, and its nodes among all.
struct Of<'a, const D: usize> {
    scene: &'a Scene<D>,
    body: &'a BodyOf<D>,
    scheme: &'a Scheme,
    cells: Arc<dyn Cells<D>>,
    conditions: &'a [(usize, Place<D>)],
    loads: &'a [(usize, Place<D>)],
    /// Rigid bodies, by their numbers, and the parts tied to them.
    ties: &'a [(usize, Place<D>)],
    first: usize,
    total: usize,
    sharing: &'a Sharing,
}

/// A body that was discretised; rows and conditions count nodes within the body.
struct Made<const D: usize> {
    member: Member<D>,
    facets: FacetRule,
    rows: Constraints,
    placed: Vec<Placed<D>>,
    /// Loads with the tables of their places.
    loads: Vec<(usize, ShapeTable<D>)>,
    /// The rows that tie parts to rigid bodies, by the numbers of these.
    ties: Vec<(usize, Range<usize>)>,
    /// An iterative solver, where one is chosen.
    krylov: Option<Krylov>,
}

/// Where tables of loads come from: boundary parts and the body.
struct Tables<'a, const D: usize> {
    boundary: &'a dyn Fn(&Part, &Place<D>) -> Result<ShapeTable<D>, Error>,
    body: &'a dyn Fn(&Place<D>) -> Result<ShapeTable<D>, Error>,
}

/// Reproducing kernel particles.
fn particles<const D: usize>(of: &Of<'_, D>, refused: Refused<'_>) -> Result<Made<D>, Error> {
    let Of { scene, scheme, cells, .. } = of;
    let (approximation, raised) = covering(scheme, &**cells)?;
    let dilations = approximation.particles().supports().iter().map(|s| s.half_widths().max()).collect();
    let kinematics = &*scene.kinematics;
    let sharing = of.sharing;
    let (table, facets, field) = body_table(of, &approximation)?;
    let (table, law) = (of.among_all(expanding(scene, table)?), material(scene, &of.body.material)?);
    let mut body = clocked(scene, Body::projecting(table, law, field, scheme.measure))?;
    if let Some(fewest) = sharing.fewest(body.fewest()) {
        body = body.with_fewest(fewest);
    }
    let tables = Tables {
        boundary: &|part, place| {
            // Where a load ends within a facet, finer ones see it.
            let parts = facets.parts * if place.within.is_some() { FINER } else { 1 };
            let points = cells.boundary(part, parts, facets.gauss)?.points;
            let points = sharing.points(points.retained(|x| place.holds(x)));
            ShapeTable::new(&approximation, &points, kinematics)
        },
        body: &|place| {
            let zones = sharing.zones(&**cells, Zones::single(cells.cell_count()));
            let points = cells.gauss_in(2 + usize::from(scheme.order > 1), &zones)?;
            ShapeTable::new(&approximation, &points.retained(|x| place.holds(x)), kinematics)
        },
    };
    let over_boundary = match scheme.rows {
        RowKind::Auto => D > 1,
        RowKind::AtParticles => false,
        RowKind::OverBoundary => true,
    };
    let loads = load_tables(of, &approximation, &tables)?;
    let rule = over_boundary.then_some(facets);
    let (mut rows, placed) = rows(scene, of.conditions, &**cells, &approximation, rule, refused)?;
    let ties = of.tied(&mut rows, &approximation, rule)?;
    // Several bodies are solved by factors.
    // Factors leave out parts of the matrix of contact, which sweeps over them put right.
    let alone = scene.bodies.len() == 1 && scene.rigids.is_empty() && scene.contacts.is_empty();
    let krylov = match alone {
        true => super::space::krylov(scene, scheme, &**cells, &approximation, &body, &rows, sharing)?,
        false => None,
    };
    let member = of.member(body, Box::new(approximation), Facets::OfCells(facets), dilations, raised);
    Ok(Made { member, facets, rows, placed, loads, ties, krylov })
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
fn elements<const D: usize>(of: &Of<'_, D>, refused: Refused<'_>) -> Result<Made<D>, Error> {
    let Of { scene, scheme, cells, .. } = of;
    if scheme.rows == RowKind::OverBoundary {
        return Err(BoundaryError::Unsuitable {
            enforcement: "rows over boundaries",
            reason: "finite elements interpolate: prescribe values at nodes".into(),
        }
        .into());
    }
    let order = usize::from(scheme.order);
    let elements = FiniteElements::new(lattice_of(&**cells, "finite elements")?.clone(), order)?;
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
    let sharing = of.sharing;
    let own = sharing.run(Zones::single(elements.element_count()));
    let table = ShapeTable::of_elements(&elements, &elements.gauss_in(points, &own)?, kinematics)?;
    // Q1/P0 and Q2/P1 as the literature has them: all of the volumetric energy projected.
    let law = material(scene, &of.body.material)?;
    let body = clocked(scene, Body::zonal(of.among_all(expanding(scene, table)?), law, field, 0.0))?;
    let tables = Tables {
        boundary: &|part, place| {
            let points = elements.boundary(part, points * if place.within.is_some() { FINER } else { 1 })?;
            let points = sharing.element_points(points.retained(|x| place.holds(x)));
            ShapeTable::of_elements(&elements, &points, kinematics)
        },
        body: &|place| {
            ShapeTable::of_elements(
                &elements,
                &elements.gauss_in(points, &own)?.retained(|x| place.holds(x)),
                kinematics,
            )
        },
    };
    let loads = load_tables(of, &elements, &tables)?;
    let (mut rows, placed) = rows(scene, of.conditions, &**cells, &elements, None, refused)?;
    let ties = of.tied(&mut rows, &elements, None)?;
    let dilations = (0..cells.positions().len()).map(|node| cells.local_spacing(node)).collect();
    let facets = FacetRule { parts: 1, gauss: points };
    let member = of.member(body, Box::new(elements), Facets::OfElements { order, gauss: points }, dilations, 0);
    Ok(Made { member, facets, rows, placed, loads, ties, krylov: None })
}

impl<const D: usize> Of<'_, D> {
    /// A table of the body with the numbers that its nodes have among all.
    fn among_all(&self, table: ShapeTable<D>) -> ShapeTable<D> {
        if self.first == 0 && table.node_count() == self.total { table } else { table.shifted(self.first, self.total) }
    }

    /// Adds the rows that tie parts of the body to rigid ones.
    fn tied<A: Approximation<D>>(
        &self,
        rows: &mut Constraints,
        approximation: &A,
        rule: Option<FacetRule>,
    ) -> Result<Vec<(usize, Range<usize>)>, Error> {
        let names = self.scene.rigid_names();
        let mut ties = Vec::with_capacity(self.ties.len());
        for (number, place) in self.ties {
            let first = rows.len();
            tie(rows, self.scene, (names[*number], place), &*self.cells, approximation, rule)?;
            ties.push((*number, first..rows.len()));
        }
        Ok(ties)
    }

    fn member(
        &self,
        body: Body<D, Arc<dyn Material>>,
        approximation: Box<dyn Evaluate<D>>,
        facets: Facets,
        dilations: Vec<f64>,
        raised: usize,
    ) -> Member<D> {
        let nodes = self.first..self.first + self.cells.positions().len();
        let (name, cells, body) = (self.body.name.clone(), self.cells.clone(), Arc::new(body));
        let facets = (!self.scene.kinematics.is_plane_stress()).then_some(facets);
        Member { name, nodes, body, cells, approximation, facets, dilations, raised }
    }
}

/// The tables of the loads on a body.
fn load_tables<const D: usize, A: Approximation<D>>(
    of: &Of<'_, D>,
    approximation: &A,
    tables: &Tables<'_, D>,
) -> Result<Vec<(usize, ShapeTable<D>)>, Error> {
    let mut made = Vec::with_capacity(of.loads.len());
    for (number, place) in of.loads {
        let load = &of.scene.loads[*number];
        if of.scene.kinematics.is_plane_stress() && matches!(load.kind, LoadKind::Pressure(_)) {
            let what = "a following pressure on the edge of a sheet in plane stress";
            let needed = "a traction: the area of the edge changes with the thickness, which is no unknown";
            return Err(GeometryError::Unsuited { what, needed }.into());
        }
        if let LoadKind::Moment(_) = load.kind {
            let needed = "a rigid body: tie the part to one by Scene::rigid";
            return Err(GeometryError::Unsuited { what: "a moment on a part that may deform", needed }.into());
        }
        let table = match &place.spot {
            Spot::Part(part) => (tables.boundary)(part, place)?,
            // A point load is a force already: it takes no measure.
            Spot::Point(at) => {
                if !of.cells.contains(at) {
                    let what = load.label();
                    return Err(BoundaryError::Outside { what, at: at.as_slice().to_vec() }.into());
                }
                ShapeTable::new(approximation, &of.sharing.points(Points::single(*at)), &Unmeasured)?
            }
            Spot::Body => (tables.body)(place)?,
        };
        let mut points = [table.weights().len() as f64];
        of.sharing.total(&mut points);
        if points[0] == 0.0 {
            let nearest = of.cells.positions().first().map(|x| x.as_slice().to_vec()).unwrap_or_default();
            return Err(BoundaryError::Empty { what: load.label(), nearest }.into());
        }
        made.push((*number, of.among_all(table)));
    }
    Ok(made)
}

/// Adds a load over a table of its place, `measure` being that of the place on all bodies.
fn add_load<const D: usize>(model: &mut Model<D>, load: &Load<D>, table: ShapeTable<D>, measure: f64) {
    let amplitude = load.amplitude.clone();
    match &load.kind {
        LoadKind::Dead(Value::Constant(force)) => model.add(Pointwise::new(table, dead(force, &amplitude))),
        LoadKind::Dead(value) => model.add(Pointwise::new(table, Varying { value: value.clone(), amplitude })),
        LoadKind::Total(force) => model.add(Pointwise::new(table, dead(&force.map(|f| f / measure), &amplitude))),
        LoadKind::Pressure(Value::Constant(pressure)) => {
            model.add(Pointwise::new(table, FollowerPressure { pressure: *pressure, amplitude }))
        }
        LoadKind::Pressure(value) => model.add(Pointwise::new(table, Varying { value: value.clone(), amplitude })),
        LoadKind::Integrand(integrand) => model.add(Pointwise::new(table, Shared(integrand.clone()))),
        // Refused with its table.
        LoadKind::Moment(_) => model,
    };
}

/// Puts the bodies together, bonds them where they share faces, and binds the strategies.
fn finish<const D: usize>(
    scene: &Scene<D>,
    scheme: &Scheme,
    all: &BodyCells<D>,
    made: Vec<Made<D>>,
    sharing: &Sharing,
) -> Result<Problem<D>, Error> {
    let mut positions: Vec<Point<D>> = made.iter().flat_map(|m| m.member.cells.positions().iter().copied()).collect();
    let particle_positions = positions.clone();
    positions.extend(contact::carriages(scene, &positions));
    let (mut rows, mut placed, mut ties) = (Constraints::new(), Vec::new(), Vec::new());
    let mut krylov = None;
    let (mut members, mut rules, mut tables) = (Vec::new(), Vec::new(), Vec::new());
    for Made { member, facets, rows: own, placed: mine, loads, ties: tied, krylov: own_krylov } in made {
        let (row, node) = (rows.len(), member.nodes.start);
        krylov = own_krylov;
        let shifted = |range: Range<usize>, by: usize| range.start + by..range.end + by;
        if members.is_empty() {
            rows = own;
        } else {
            rows.append(own, node, D);
        }
        placed.extend(mine.into_iter().map(|placed| Placed {
            rows: shifted(placed.rows.clone(), row),
            nodes: shifted(placed.nodes.clone(), node),
            ..placed
        }));
        ties.extend(tied.into_iter().map(|(number, range)| (number, shifted(range, row))));
        members.push(member);
        rules.push(facets);
        tables.extend(loads);
    }
    let bonded = bond_all(scene, &members, &rules, &mut rows, &mut placed)?;
    let frames = rigid::frames(scene, &ties, &mut rows, &mut placed, &mut positions)?;
    let mut model = Model::new(positions);
    if let Some(ranks) = sharing.ranks() {
        model.share(ranks);
    }
    members.iter().for_each(|member: &Member<D>| {
        model.add(member.body.clone());
    });
    // In the order of the scene.
    tables.sort_by_key(|(number, _)| *number);
    let mut measures = vec![0.0; scene.loads.len()];
    tables.iter().for_each(|(number, table)| measures[*number] += table.weights().iter().sum::<f64>());
    sharing.total(&mut measures);
    for (number, table) in tables {
        add_load(&mut model, &scene.loads[number], table, measures[number]);
    }
    let modulus = |member: &Member<D>| member.body.material().response(&Matrix3::identity()).tangent[(0, 0)];
    let shear = |member: &Member<D>| initial_shear_modulus(&**member.body.material());
    for frame in &frames {
        let stiffest = members.iter().map(modulus).fold(0.0, f64::max);
        model.add_whole(frame.stay(stiffest, members.iter().map(shear).fold(0.0, f64::max)));
    }
    for load in &scene.loads {
        if let Some((number, point)) = scene.rigid_at(&scene.resolve(&load.place)) {
            frames[number].load(&mut model, load, point)?;
        }
    }
    let contacts = touching(scene, all, (&members, &rules), &rows, &particle_positions, &mut model)?;
    rigid::held(scene, &frames, &rows, model.positions())?;
    let elements = members.len() == 1 && scheme.functions == Functions::Elements;
    let transform = match scheme.enforcing {
        Enforcing::Auto => !bonded && frames.is_empty() && (rows.len() <= TRANSFORMATION_ROWS || elements),
        Enforcing::Transformation => true,
        Enforcing::Multipliers => false,
    };
    let mut analysis = if transform {
        Analysis::new(MixedTransformation::default(), Direct)
    } else {
        Analysis::new(LagrangeMultipliers, Direct)
    };
    if let Some(solver) = &scheme.solver {
        if krylov.is_none() && solver.cycle(&[]).is_some() {
            let needed = "one body of particles on a lattice in space, or a direct solver";
            return Err(GeometryError::Unsuited { what: "a solver of preconditioners", needed }.into());
        }
        analysis.solver = Box::new(solver.clone());
    }
    if let Some(krylov) = krylov {
        analysis = Analysis::new(LagrangeMultipliers, krylov);
    }
    analysis.newton = scheme.newton;
    analysis.stepping = scheme.stepping;
    Ok(Problem { model, rows, analysis, members, contacts, frames, placed, names: scene.names.clone() })
}

/// Adds the contacts of a scene.
fn touching<const D: usize>(
    scene: &Scene<D>,
    all: &BodyCells<D>,
    (members, rules): (&[Member<D>], &[FacetRule]),
    rows: &Constraints,
    positions: &[Point<D>],
    model: &mut Model<D>,
) -> Result<Vec<Contact<D>>, Error> {
    let (total, kinematics) = (model.positions().len(), &*scene.kinematics);
    let skins = |place: &Place<D>| {
        let place = scene.resolve(place);
        let Spot::Part(part) = &place.spot else {
            let needed = "a part of the boundary, or some of one";
            return Err(GeometryError::Unsuited { what: "contact of a point or of the body", needed }.into());
        };
        let of = scene.bodies_at(&place, || format!("contact of {place}"), all, |_| true)?;
        let body = of.first().copied().unwrap_or(0);
        let (member, rule) = (&members[body], rules[body]);
        let whole = member.cells.contact_boundary(part, rule.parts, rule.gauss)?;
        let mut skin = whole.within(&|x| place.holds(x));
        let table = member.approximation.tabulate(&skin.points, kinematics)?.shifted(member.nodes.start, total);
        skin.hats.iter_mut().flatten().for_each(|hat| hat.0 += member.nodes.start as u32);
        Ok((skin, table))
    };
    let volume = members.iter().flat_map(|member| member.body.table().weights()).sum();
    contact::add(scene, positions, rows, volume, &skins, model)
}

/// Bonds all bodies that share faces and are not kept apart; whether there are any.
fn bond_all<const D: usize>(
    scene: &Scene<D>,
    members: &[Member<D>],
    rules: &[FacetRule],
    rows: &mut Constraints,
    placed: &mut Vec<Placed<D>>,
) -> Result<bool, Error> {
    if members.len() < 2 {
        return Ok(false);
    }
    let unknowns = members.last().map_or(0, |last| last.nodes.end * D);
    let mut ties = Ties::new::<D>(rows, unknowns);
    let mut bonded = false;
    for (second, later) in members.iter().enumerate() {
        for (first, earlier) in members[..second].iter().enumerate() {
            let names = [&earlier.name, &later.name];
            let kept = |pair: &[String; 2]| names == [&pair[0], &pair[1]] || names == [&pair[1], &pair[0]];
            if scene.apart.iter().any(kept) {
                continue;
            }
            let before = rows.len();
            bonded |= bond(rows, &mut ties, [earlier, later], [rules[first], rules[second]], &*scene.kinematics)?;
            // The force of the bond is that on the earlier body.
            let (name, place) = (Some(format!("bond of {} and {}", names[0], names[1])), Place::body());
            if rows.len() > before {
                placed.push(Placed { name, place, rows: before..rows.len(), nodes: earlier.nodes.clone() });
            }
        }
    }
    Ok(bonded)
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
        if (0..D).any(|i| index[i] == 2 || counts[i] - 1 - index[i] == 2) {
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
    of: &Of<'_, D>,
    approximation: &A,
) -> Result<(ShapeTable<D>, FacetRule, PressureField), Error> {
    let sharing = of.sharing;
    let (scene, scheme, cells) = (of.scene, of.scheme, &*of.cells);
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
                Some(lattice) if scheme.order < 2 => sharing.points(lattice.coarsened(size).gauss(5)?),
                _ => {
                    cells.gauss_in(if scheme.order < 2 { 5 } else { FINE }, &sharing.zones(cells, cells.zones(size)))?
                }
            };
            let table = ShapeTable::new(approximation, &points, kinematics)?;
            Ok((table, FacetRule { parts: 1, gauss: 1 }, field))
        }
        // Averages would leave a basis that can do more at their second order.
        Rule::Auto if scheme.order > 1 && (D == 2 || cells.lattice().is_some()) => {
            let gauss = 2 + more;
            let smoothing = sharing.smoothing(cells, [1, gauss], cells.zones(size))?;
            let table = ShapeTable::consistent(approximation, &smoothing, kinematics)?;
            Ok((table, FacetRule { parts: 1, gauss }, field))
        }
        Rule::Auto | Rule::Smoothed { .. } => {
            let parts = if let Rule::Smoothed { parts } = scheme.rule { parts } else { 2 + more };
            let gauss = 2 + more;
            let smoothing = sharing.smoothing(cells, [parts, gauss], cells.zones(size))?;
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
            let (gauss, points) = match (zones, &of.body.source) {
                (None, _) => {
                    // Two particles per direction and cell, and two more.
                    let points = points.unwrap_or(4);
                    (cells.gauss_in(points, &sharing.zones(cells, cells.zones(size)))?, points)
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
                    let lattice = Lattice::new(&**domain, counts.map(|z| z.saturating_add(1)), &Layout::Regular)?;
                    (sharing.points(lattice.gauss(points)?), points)
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
