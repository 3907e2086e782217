//! Pieces of one's own and vectors that do not fit: refused, or answered by NaN, and never by a panic.
#![cfg(feature = "solve")]

use std::sync::Arc;

use approx::assert_abs_diff_eq;
use rkpm::assembly::{Pattern, StateRef, System};
use rkpm::boundary::{Enforcement, MixedTransformation, Reduction};
use rkpm::cells::{BoundaryCells, Cells, Refined, Scatter, Smoothing, Triangulation, Voronoi, Zones};
use rkpm::check;
use rkpm::contact::{Nearest, Surface};
use rkpm::error::{ApproximationError, GeometryError, SolveError};
use rkpm::material::{Mullins, Past, Prony, Response, Viscoelastic, VolumetricEnergy};
use rkpm::nalgebra::Matrix3;
use rkpm::prelude::*;
use rkpm::scene::ConstraintKind;
use rkpm::solve::{EnclosedVolume, Functional};
use rkpm::term::{Coupling, Element, TermState, TermStep, View};

fn lattice() -> Lattice<2> {
    Block::new([0.0, 0.0], [2.0, 1.0]).lattice([5, 4]).unwrap()
}

type ApproximationChoice = ReproducingKernel<2, CubicSpline, Polynomial<2>>;

fn functions() -> ApproximationChoice {
    ReproducingKernel::new(lattice().particles(1.0).unwrap(), CubicSpline, Polynomial::linear()).unwrap()
}

fn rubber() -> Rubber {
    Rubber::neo_hookean(0.5, 100.0).unwrap()
}

/// A spring whose buffers come out longer or shorter, from a load on or in one state alone.
struct Spring {
    residual: usize,
    slope: usize,
    matrix: usize,
    when: fn(&View<'_>) -> bool,
}

impl Term for Spring {
    fn dim(&self) -> usize {
        1
    }
    fn clusters(&self) -> usize {
        1
    }
    fn nodes(&self, _: usize) -> &[u32] {
        &[0, 1]
    }
    fn linearize(&self, _: usize, view: View<'_>, out: &mut Element) {
        let force = view.displacement[1] - view.displacement[0];
        out.residual.copy_from_slice(&[-force, force]);
        if out.with_matrix {
            out.matrix.copy_from_slice(&[1.0, -1.0, -1.0, 1.0]);
        }
        if (self.when)(&view) {
            out.residual.resize(self.residual, 0.0);
            out.load_slope.resize(self.slope, 0.0);
            out.matrix.resize(if out.with_matrix { self.matrix } else { 0 }, 0.0);
        }
    }
    fn energy(&self, _: usize, view: View<'_>) -> f64 {
        0.5 * (view.displacement[1] - view.displacement[0]).powi(2)
    }
}

#[test]
fn terms_that_change_their_buffers() {
    let always = |_: &View<'_>| true;
    let report = |spring: Spring| check::term(&spring, &[0.1, 0.3], 1.0).unwrap();
    assert!(report(Spring { residual: 2, slope: 2, matrix: 4, when: always }).holds());
    for [residual, slope, matrix] in
        [[0, 2, 4], [1, 2, 4], [3, 2, 4], [2, 1, 4], [2, 5, 4], [2, 2, 0], [2, 2, 3], [2, 2, 9]]
    {
        let report = report(Spring { residual, slope, matrix, when: always });
        let broken: Vec<&str> = report.violations().map(|f| f.law).collect();
        assert_eq!(broken, ["linearize() keeps the lengths of its buffers"], "{residual} {slope} {matrix}");
    }
    // In some states alone: derivatives are none.
    let moved = |view: &View<'_>| view.displacement[0] != 0.1 || view.load != 1.0;
    let report = report(Spring { residual: 1, slope: 1, matrix: 1, when: moved });
    assert!(report.violations().any(|f| f.law == "the matrix is the derivative of the residual"));
}

/// Springs between nodes named in any order.
struct Between(Vec<[u32; 2]>);

impl Term for Between {
    fn dim(&self) -> usize {
        2
    }
    fn clusters(&self) -> usize {
        self.0.len()
    }
    fn nodes(&self, cluster: usize) -> &[u32] {
        &self.0[cluster]
    }
    fn linearize(&self, cluster: usize, view: View<'_>, out: &mut Element) {
        for i in 0..2 {
            let [a, b] = self.0[cluster].map(|node| view.displacement[2 * node as usize + i]);
            (out.residual[i], out.residual[2 + i]) = (a - b, b - a);
            if out.with_matrix {
                for (row, column, value) in [(i, i, 1.0), (i, 2 + i, -1.0), (2 + i, i, -1.0), (2 + i, 2 + i, 1.0)] {
                    out.matrix[4 * column + row] = value;
                }
            }
        }
    }
}

#[test]
fn terms_whose_nodes_fall_or_repeat() {
    let scene = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber())
        .hold((0, Side::Min))
        .traction((0, Side::Max), [0.1, 0.0]);
    let run = |pairs: Vec<[u32; 2]>| {
        let mut problem = scene.discretize(&Scheme::default().particles([5, 4])).unwrap();
        problem.add(Between(pairs));
        (problem.model().terms().len() - 1, problem.run())
    };
    assert!(run(vec![[0, 4], [5, 9]]).1.unwrap().completed().is_ok());
    for pairs in [vec![[0, 4], [9, 5]], vec![[0, 4], [5, 5]]] {
        let (added, result) = run(pairs);
        let error = result.unwrap_err();
        let expected = SolveError::Nodes { term: added, cluster: 1 };
        assert!(matches!(&error, Error::Solve(found) if *found == expected), "{error}");
        assert!(error.to_string().contains("cluster 1: Term::nodes() does not rise"), "{error}");
    }
}

/// A spring between two nodes in the plane that breaks a promise from a displacement on.
#[derive(Clone, Copy)]
struct Broken {
    nodes: [u32; 2],
    above: f64,
    force: f64,
    entry: f64,
    lower: f64,
}

impl Term for Broken {
    fn dim(&self) -> usize {
        2
    }
    fn clusters(&self) -> usize {
        1
    }
    fn nodes(&self, _: usize) -> &[u32] {
        &self.nodes
    }
    fn linearize(&self, _: usize, view: View<'_>, out: &mut Element) {
        let [a, b] = self.nodes.map(|node| view.displacement[2 * node as usize]);
        let broken = view.displacement.iter().any(|u| u.abs() >= self.above);
        let [force, entry, lower] = if broken { [self.force, self.entry, self.lower] } else { [1.0, 1.0, -1.0] };
        (out.residual[0], out.residual[2]) = (force * (a - b), b - a);
        if out.with_matrix {
            (out.matrix[0], out.matrix[2], out.matrix[8], out.matrix[10]) = (entry, lower, -1.0, 1.0);
        }
    }
}

#[test]
fn terms_that_break_their_promises_are_named() {
    let scene = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber()).hold((0, Side::Min)).prescribe(
        (0, Side::Max),
        0,
        0.2,
    );
    let run = |term: Broken| {
        let mut problem = scene.discretize(&Scheme::default().particles([5, 4])).unwrap();
        problem.add(term);
        problem.run().and_then(|path| Ok(path.completed()?))
    };
    let sound = Broken { nodes: [6, 19], above: 0.0, force: 1.0, entry: 1.0, lower: -1.0 };
    let displacement: Vec<f64> = (0..40).map(|k| 0.02 * (k as f64).sin()).collect();
    assert!(run(sound).is_ok());
    assert!(check::term(&sound, &displacement, 1.0).unwrap().holds());
    let broken = [
        (Broken { force: f64::NAN, ..sound }, "forces or load slopes are not finite"),
        (Broken { entry: f64::NAN, ..sound }, "entries of the matrix are not finite"),
        (Broken { lower: -0.5, ..sound }, "the matrix is not symmetric"),
    ];
    for (term, what) in broken {
        let report = check::term(&term, &displacement, 1.0).unwrap();
        assert!(report.violations().any(|finding| finding.at.contains(what)), "{report}");
        // From the first state on, which is not run, and in later ones, which the run does not pass.
        for above in [0.0, 0.15] {
            let error = run(Broken { above, ..term }).unwrap_err().to_string();
            assert!(error.contains("term 1 of the model, cluster 0") && error.contains(what), "{above}: {error}");
        }
    }
    let beyond = Broken { nodes: [6, 20], ..sound };
    let error = run(beyond).unwrap_err();
    let expected = SolveError::MissingNode { term: 1, cluster: 0, node: 20, nodes: 20 };
    assert!(matches!(&error, Error::Solve(found) if *found == expected), "{error}");
    let error = check::term(&beyond, &displacement, 1.0).unwrap_err().to_string();
    assert!(error.contains("cluster 0: Term::nodes() names node 20"), "{error}");
}

#[test]
fn terms_of_another_dimension() {
    let scene = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber()).hold((0, Side::Min));
    let mut problem = scene.discretize(&Scheme::default().particles([5, 4])).unwrap();
    let (rest, mut system) = (problem.at_rest(), System::default());
    assert!(problem.model().at(&rest).is_ok());
    problem.add(Spring { residual: 2, slope: 2, matrix: 4, when: |_| false });
    let expected = SolveError::Dimension { given: 1, needed: 2 };
    let rest = problem.at_rest();
    let mut assembler = problem.model().assembler();
    assert_eq!(problem.model().at(&rest).err(), Some(expected.clone()));
    assert_eq!(assembler.assemble(problem.model(), &rest, &mut system), Err(expected.clone()));
    let error = problem.run().unwrap_err();
    assert!(matches!(&error, Error::Solve(found) if *found == expected), "{error}");
    assert!(error.to_string().contains("1 displacement components at each node, the model has 2"), "{error}");
}

/// A lattice with something wrong about it.
struct Odd(Lattice<2>, u8);

impl Cells<2> for Odd {
    fn positions(&self) -> &[Point<2>] {
        if self.1 == 1 { &self.0.positions()[..12] } else { self.0.positions() }
    }
    fn cell_count(&self) -> usize {
        if self.1 == 2 { 99 } else { self.0.cell_count() }
    }
    fn corners(&self, cell: usize) -> Vec<usize> {
        if self.1 == 3 { vec![999] } else { Cells::corners(&self.0, cell) }
    }
    fn local_spacing(&self, particle: usize) -> f64 {
        Cells::local_spacing(&self.0, particle)
    }
    fn particles(&self, r: f64) -> Result<Particles<2>, ApproximationError> {
        if self.1 == 4 { Lattice::refined(&self.0, 2).unwrap().particles(r) } else { self.0.particles(r) }
    }
    fn particles_global(&self, r: f64) -> Result<Particles<2>, ApproximationError> {
        self.0.particles_global(r)
    }
    fn is_thin(&self) -> bool {
        self.0.is_thin()
    }
    fn zones(&self, size: usize) -> Zones {
        self.0.zones(size)
    }
    fn gauss_in(&self, n: usize, zones: &Zones) -> Result<Points<2>, GeometryError> {
        if self.1 == 5 { self.0.gauss_in(n, &self.0.zones(2)) } else { self.0.gauss_in(n, zones) }
    }
    fn smoothing(&self, parts: usize, gauss: usize, zones: &Zones) -> Result<Smoothing<2>, GeometryError> {
        self.0.smoothing(parts, gauss, zones)
    }
    fn nodal_cells(&self, gauss: usize) -> Result<Smoothing<2>, GeometryError> {
        self.0.nodal_cells(gauss)
    }
    fn boundary(&self, part: &Part, parts: usize, gauss: usize) -> Result<BoundaryCells<2>, GeometryError> {
        let mut facets = self.0.boundary(part, parts, gauss)?;
        match self.1 {
            8 => facets.points.normals.clear(),
            9 => facets.traces.clear(),
            10 => facets.traces[0][0].0 = 20,
            11 => facets = BoundaryCells { points: Points::empty(), traces: Vec::new() },
            13 => drop(facets.points.groups.remove(1)),
            _ => {}
        }
        Ok(facets)
    }
    fn boundary_nodes(&self, part: &Part) -> Result<Vec<usize>, GeometryError> {
        match self.1 {
            7 => Ok(vec![0, 99]),
            12 => Ok(Vec::new()),
            _ => self.0.boundary_nodes(part),
        }
    }
    fn drawn(&self) -> Vec<Vec<usize>> {
        if self.1 == 6 { vec![vec![0, 1, 20]] } else { self.0.drawn() }
    }
    fn contains(&self, at: &Point<2>) -> bool {
        self.0.contains(at)
    }
}

#[test]
fn scenes_over_cells_that_name_what_is_not_there() {
    let words = [
        "",
        "corner of a cell, by Cells::corners",
        "cell of a zone",
        "by Cells::corners: 999",
        "particles that the",
        "groups of",
    ];
    for (odd, word) in words.iter().enumerate() {
        let cells = Arc::new(Odd(lattice(), odd as u8));
        let scene = Scene::new(Geometry::cells(cells), PlaneStrain, rubber()).hold(Side::Min);
        match check::scene(&scene, &Scheme::default()) {
            Ok(diagnosis) => assert!(odd == 0 && diagnosis.holds()),
            Err(error) => assert!(odd > 0 && error.to_string().contains(word), "{odd}: {error}"),
        }
    }
}

/// A facet that spans three particles, which contact of deformable faces in the plane would leave out.
#[test]
fn facets_that_are_no_chords() {
    let scene = |odd: u8| {
        Scene::assembly(PlaneStrain)
            .body("lower", Geometry::cells(Arc::new(Odd(lattice(), odd))), rubber())
            .body("upper", Block::new([0.0, 1.5], [2.0, 2.5]), rubber())
            .scheme_of("upper", |scheme| scheme.particles([5, 4]))
            .hold(Place::on((1, Side::Max)).of("upper"))
            .contact_between(Place::on((1, Side::Max)).of("lower"), Place::on((1, Side::Min)).of("upper"), "joint")
    };
    assert!(scene(0).discretize(&Scheme::default()).is_ok());
    let error = scene(13).discretize(&Scheme::default()).err().unwrap().to_string();
    assert!(error.contains("a facet of 3 trace functions"), "{error}");
}

#[test]
fn nodes_that_are_not_there() {
    let mut equations = Constraints::default();
    // A node too many.
    let beyond = Spoilt(functions(), |psi| {
        psi.nodes.push(20);
        psi.values.push(0.0);
    });
    let error = equations.at_particles(&beyond, &[0], 0, &|_| 0.0, &Amplitude::Ramp, "u").unwrap_err();
    assert!(error.to_string().contains("20") && equations.equations().is_empty(), "{error}");
}

#[test]
fn tables_asked_for_points_and_vectors_that_are_not_there() {
    let table =
        ShapeTable::new(&functions(), &lattice().gauss_in(2, &lattice().zones(2)).unwrap(), &PlaneStrain).unwrap();
    let (fits, short) = (vec![0.0; 40], vec![0.0; 39]);
    assert_eq!(table.displacement(0, &fits), Point::<2>::zeros());
    assert!(table.displacement_gradient(0, &fits).iter().all(|h| *h == 0.0));
    for (point, d) in [(0, &short), (0, &vec![]), (table.point_count(), &fits), (usize::MAX, &fits)] {
        assert!(table.displacement(point, d).iter().all(|u| u.is_nan()));
        assert!(table.displacement_gradient(point, d).iter().all(|h| h.is_nan()));
    }
    for point in [table.point_count(), usize::MAX] {
        assert!(table.nodes(point).is_empty() && table.values(point).is_empty() && table.gradients(point).is_empty());
        assert!(table.clusters().local(point).is_empty());
        assert!(table.clusters().nodes(point).is_empty() && table.clusters().points(point).is_empty());
    }
    let body = Body::new(table, rubber(), PressureField::Linear);

    let mut model = Model::new(lattice().positions());
    model.add(body);
    let terms = model.start();
    let mut cut = terms.clone();
    cut[0].condensed.pop();
    let longer = vec![TermState { history: vec![0.0], ..terms[0].clone() }];
    let here = model.at(StateRef::new(&fits, &terms, 0.0)).unwrap();
    assert_abs_diff_eq!(here.energy(), 0.0, epsilon = 1e-12);
    let residual = here.residual();
    assert_abs_diff_eq!(residual[..], vec![0.0; residual.len()][..], epsilon = 1e-12);
    for (d, terms) in [(&short, &terms), (&vec![0.0; 41], &terms), (&fits, &cut), (&fits, &longer), (&fits, &vec![])] {
        assert!(is_refused(model.at(StateRef::new(d, terms, 0.0))));
    }
    let [steps, cut] = [&terms, &cut].map(|terms| vec![terms[0].condensed.clone()]);
    assert_eq!(here.advance(TermStep { displacement: &fits, load: 0.0 }, &mut steps.clone()), Ok(1.0));
    for (step, mut out) in [(&short, steps.clone()), (&fits, cut), (&fits, vec![])] {
        assert!(is_refused(here.advance(TermStep { displacement: step, load: 0.0 }, &mut out)));
    }
}

#[test]
fn assemblers_asked_for_models_and_vectors_of_others() {
    let body = || {
        let points = lattice().gauss_in(2, &lattice().zones(2)).unwrap();
        Body::new(ShapeTable::new(&functions(), &points, &PlaneStrain).unwrap(), rubber(), PressureField::Linear)
    };
    let model = |nodes: usize, bodies: usize| {
        let mut model = Model::new(&lattice().positions()[..nodes]);
        for _ in 0..bodies {
            model.add(body());
        }
        model
    };
    let mine = model(20, 1);
    let (fits, terms) = (vec![0.0; 40], mine.start());
    let (mut assembler, mut system) = (mine.assembler(), System::default());
    assembler.assemble(&mine, StateRef::new(&fits, &terms, 0.0), &mut system).unwrap();
    assert!(system.scale.is_finite() && system.residual.iter().chain(&system.values).all(|v| v.is_finite()));
    // Bodies of another model, two for one, and none.
    for other in [model(20, 2), model(20, 0)] {
        assert!(is_refused(assembler.assemble(&other, StateRef::new(&fits, &other.start(), 0.0), &mut system)));
    }
    for (d, terms) in [(&vec![0.0; 39], &terms), (&fits, &vec![]), (&fits, &vec![TermState::default()])] {
        let state = StateRef::new(d, terms, 0.0);
        assert!(is_refused(assembler.assemble(&mine, state, &mut system)));
    }
    // A body that reaches beyond the nodes of its model.
    let small = model(12, 1);
    let state = (vec![0.0; 24], small.start());
    let missing = small.assembler().assemble(&small, StateRef::new(&state.0, &state.1, 0.0), &mut system);
    assert!(matches!(missing, Err(SolveError::MissingNode { term: 0, nodes: 12, .. })), "{missing:?}");
    // Shape functions of fewer nodes than the model has, those of another lattice.
    let finer = Block::new([0.0, 0.0], [2.0, 1.0]).lattice([9, 7]).unwrap();
    let load = || {
        let points = lattice().boundary(&Side::Max.into(), 1, 2).unwrap().points;
        let table = ShapeTable::new(&functions(), &points, &PlaneStrain).unwrap();
        Pointwise::new(table, FollowerPressure { pressure: 0.1, amplitude: Amplitude::Ramp })
    };
    for term in [Arc::new(load()) as Arc<dyn Term>, Arc::new(body())] {
        let mut model = Model::new(finer.positions());
        model.add_shared(term);
        let state = (vec![0.0; 126], model.start());
        let other = model.assembler().assemble(&model, StateRef::new(&state.0, &state.1, 0.0), &mut system);
        assert!(matches!(other, Err(SolveError::OtherNodes { term: 0, given: 20, needed: 63 })), "{other:?}");
    }
}

/// Whether a state is said to be of another model.
fn is_refused<T>(outcome: Result<T, SolveError>) -> bool {
    matches!(outcome, Err(SolveError::OtherModel { .. }))
}

#[test]
fn patterns_and_lattices_asked_for_what_is_not_there() {
    let pattern = Pattern::from_columns(vec![vec![1], vec![], vec![]]);
    assert_eq!((pattern.column(0), pattern.find(1, 0)), (&[0, 1][..], Some(1)));
    for column in [3, 7, usize::MAX] {
        assert!(pattern.column(column).is_empty() && pattern.find(0, column).is_none());
    }
    assert!(pattern.find(1 << 32, 0).is_none() && Pattern::default().column(0).is_empty());
    let product = |values: usize, x: usize, y: usize| {
        let mut y = vec![0.0; y];
        pattern.multiply_add(&vec![1.0; values], &vec![1.0; x], &mut y);
        y
    };
    assert_eq!(product(4, 3, 3), [2.0, 2.0, 1.0]);
    for (values, x, y) in [(3, 3, 3), (4, 2, 3), (4, 3, 2), (0, 3, 3)] {
        assert!(product(values, x, y).iter().all(|y| y.is_nan()));
    }
    assert!(lattice().local_spacing(19).iter().all(|s| *s > 0.0));
    let refined = Refined::new(Arc::new(Block::new([0.0, 0.0], [1.0, 1.0])), [4, 4]).unwrap();
    for node in [20, 1000, usize::MAX] {
        assert!(lattice().local_spacing(node).iter().all(|s| s.is_nan()));
    }
    let square = Outline::at([0.0, 0.0]).line("b", [1.0, 0.0]).line("r", [1.0, 1.0]).line("t", [0.0, 1.0]).close("l");
    let (region, evenly) = (Region::new(square).unwrap(), |_: &Point<2>| 0.25);
    let triangles = Triangulation::scattered(&region, evenly, &Scatter::default()).unwrap();
    assert!(refined.local_spacing(1000).is_nan() && triangles.local_spacing(1000).is_nan());
}

#[test]
fn equations_and_functionals_asked_for_vectors_of_others() {
    let mut equations = Constraints::default();
    equations.at_particles(&functions(), &[19], 0, &|_| 0.1, &Amplitude::Ramp, "u").unwrap();
    let mut off = Vec::new();
    equations.violation(&[0.0; 40], 1.0, &mut off);
    assert_eq!(off, [0.1]);
    equations.violation(&[0.0; 3], 1.0, &mut off);
    assert!(off[0].is_nan());

    let coupling = vec![Coupling { left: vec![(1, 1.0)], right: vec![(2, 1.0)] }];
    for system in [System { skew: vec![(2, 0, 1.0)], ..System::default() }, System { coupling, ..System::default() }] {
        for (x, y) in [(3, 3), (2, 3), (3, 2)] {
            let (given, mut y) = (vec![1.0; x], vec![0.0; y]);
            system.skew_multiply_add(&given, &mut y);
            assert!(y.iter().all(|y| y.is_nan()) == (x.min(y.len()) < 3));
        }
    }

    let pattern = Pattern::from_columns((0..40).map(|column| (column..40).collect()).collect());
    let enforced = MixedTransformation::default().bind(&pattern, &equations).unwrap();
    let mut reduction = Reduction::new(enforced, &pattern, &equations).unwrap();
    for (entries, fits) in [(pattern.entries(), true), (3, false), (0, false)] {
        let mut values = Vec::new();
        reduction.reduce(&System { values: vec![1.0; entries], ..System::default() }, &mut values);
        assert!(!values.is_empty() && values.iter().all(|value| value.is_finite() == fits));
    }

    let face = lattice().boundary(&Side::Max.into(), 1, 2).unwrap().points;
    let volume = EnclosedVolume::new(ShapeTable::new(&functions(), &face, &PlaneStrain).unwrap()).unwrap();
    let (mut whole, mut short) = (vec![0.0; 40], vec![0.0; 39]);
    volume.gradient(&[0.0; 40], &mut whole);
    volume.gradient(&[0.0; 40], &mut short);
    assert!(short == whole[..39] && whole[38] != 0.0);
}

#[test]
fn limits_that_are_no_numbers() {
    let functions = functions().with_rcond_limit(f64::NAN);
    assert!(functions.shape_functions(&[0.7, 0.4].into()).is_ok());
    let scheme = Scheme::default().particles([5, 4]).rcond_limit(f64::NAN);
    let scene = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber()).hold((0, Side::Min));
    let Err(error) = scene.discretize(&scheme) else { panic!("a limit that is no number") };
    assert!(error.to_string().contains("the limit of the reciprocal condition number is NaN"), "{error}");
}

#[test]
fn dimensions_that_no_one_lives_in() {
    let says = |error: GeometryError| assert!(error.to_string().contains("1, 2 and 3 are possible"), "{error}");
    says(Block::<0>::new([], []).validate().unwrap_err());
    says(Block::<0>::new([], []).lattice([]).unwrap_err());
    says(Block::<4>::new([0.0; 4], [1.0; 4]).validate().unwrap_err());
    says(Block::<4>::new([0.0; 4], [1.0; 4]).lattice([2; 4]).unwrap_err());
    says(Lattice::<4>::from_positions([2; 4], vec![Point::zeros(); 16]).unwrap_err());
    let scaled = Mapped(|unit: &Point<4>| unit * 2.0);
    says(Lattice::new(&scaled, [2; 4], &Layout::Regular).unwrap_err());
    assert!(Block::<4>::new([0.0; 4], [1.0; 4]).particles([2; 4], 1.0).is_err());
}

/// Sub-cells that lack a facet or turn one inward, and normals that are areas.
#[test]
fn surfaces_that_do_not_close() {
    let smoothing = lattice().smoothing(2, 2, &lattice().zones(1)).unwrap();
    let table = |smoothing: &Smoothing<2>| ShapeTable::smoothed(&functions(), smoothing, &PlaneStrain);
    assert!(table(&smoothing).is_ok());
    let spoil: [fn(&mut Smoothing<2>); 4] = [
        |s| s.cells[7].truncate(3),
        |s| s.cells[7][0].1 *= -1.0,
        |s| s.cells[7][2] = s.cells[7][1],
        |s| s.facet_areas[0] *= 2.0,
    ];
    for spoil in spoil {
        let mut spoilt = smoothing.clone();
        spoil(&mut spoilt);
        let error = table(&spoilt).unwrap_err();
        assert!(matches!(error, Error::Geometry(GeometryError::Shape { .. })), "{error}");
        assert!(error.to_string().contains("do not close it"), "{error}");
    }
    let boundary = lattice().boundary(&Part::Whole, 2, 2).unwrap();
    assert!(boundary.validate(20).is_ok());
    for factor in [0.0, 0.5, 1.001] {
        let mut points = boundary.points.clone();
        points.normals[3] *= factor;
        let error = ShapeTable::new(&functions(), &points, &PlaneStrain).unwrap_err();
        assert!(error.to_string().contains("length of a normal"), "{error}");
    }
}

#[test]
fn zones_of_cells_that_are_not_there() {
    let square = Outline::at([0.0, 0.0]).line("b", [1.0, 0.0]).line("r", [1.0, 1.0]).line("t", [0.0, 1.0]).close("l");
    let region = Region::new(square).unwrap();
    let triangles = Triangulation::scattered(&region, |_: &Point<2>| 0.25, &Scatter::default()).unwrap();
    let refined = Refined::new(Arc::new(Block::new([0.0, 0.0], [1.0, 1.0])), [4, 4]).unwrap();
    let cells: [Box<dyn Cells<2>>; 4] =
        [Box::new(lattice()), Box::new(Voronoi::new(triangles.clone())), Box::new(triangles), Box::new(refined)];
    for cells in &cells {
        let good = Zones::single(cells.cell_count());
        assert!(cells.gauss_in(2, &good).is_ok() && cells.smoothing(2, 2, &good).is_ok());
        let bad = |cells: Vec<u32>, offsets: Vec<usize>| Zones::new(cells, offsets);
        let count = cells.cell_count();
        let mut twice = good.clone();
        twice.cells[1] = 0;
        let lacking = Zones::single(count - 1);
        for zones in
            [Zones::single(100_000), bad(vec![0, 1], vec![0, 5]), bad(vec![0, 1], vec![0, 2, 1]), twice, lacking]
        {
            assert!(matches!(cells.gauss_in(2, &zones), Err(GeometryError::Count { .. })));
            assert!(matches!(cells.smoothing(2, 2, &zones), Err(GeometryError::Count { .. })));
        }
        assert!(matches!(cells.smoothing(1_000_000, 2, &good), Err(GeometryError::Count { .. })));
    }
}

/// Springs between nodes 6 and 19 that claim condensed unknowns, and may couple an unknown that they lack.
struct Claiming(Vec<[usize; 2]>, u32);

impl Term for Claiming {
    fn dim(&self) -> usize {
        2
    }
    fn clusters(&self) -> usize {
        self.0.len()
    }
    fn nodes(&self, _: usize) -> &[u32] {
        &[6, 19]
    }
    fn unknowns(&self, cluster: usize) -> std::ops::Range<usize> {
        let [start, end] = self.0[cluster];
        start..end
    }
    fn linearize(&self, _: usize, _: View<'_>, out: &mut Element) {
        if out.with_matrix {
            out.coupling.push(Coupling { left: vec![(self.1, 1.0)], right: vec![(self.1, 1.0)] });
        }
    }
}

/// Ranges that run backwards were sliced by, and ones that clusters share were written over by the last of them.
#[test]
fn terms_whose_condensed_unknowns_are_others() {
    let scene = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber()).hold((0, Side::Min));
    let displacement = [0.0; 40];
    for (ranges, cluster) in [(vec![[0, 2], [5, 2]], 1), (vec![[0, 2], [0, 2]], 1), (vec![[1, 3], [0, 2]], 0)] {
        let [start, end] = ranges[cluster];
        let error = check::term(&Claiming(ranges.clone(), 0), &displacement, 1.0).unwrap_err();
        let expected = SolveError::Unknowns { term: 0, cluster, start, end };
        assert!(matches!(&error, Error::Solve(found) if *found == expected), "{error}");
        let mut problem = scene.discretize(&Scheme::default().particles([5, 4])).unwrap();
        problem.add(Claiming(ranges, 0));
        let expected = SolveError::Unknowns { term: 1, cluster, start, end };
        assert_eq!(problem.model().at(&problem.at_rest()).err(), Some(expected.clone()));
        let error = problem.run().unwrap_err();
        assert!(matches!(&error, Error::Solve(found) if *found == expected), "{error}");
        assert!(error.to_string().contains(&format!("Term::unknowns() returns {start}..{end}")), "{error}");
    }
    assert!(check::term(&Claiming(vec![[2, 4], [0, 2], [9, 9]], 0), &displacement, 1.0).is_ok());
    // A coupling beyond the cluster is a finding, as it is an error of a run.
    let report = check::term(&Claiming(vec![[0, 0]], 4), &displacement, 1.0).unwrap();
    assert!(report.violations().any(|finding| finding.at.contains("coupling names unknowns")), "{report}");
}

/// What boundaries and pictures are made of is looked at where cells hand it over; empty parts would leave conditions out in silence.
#[test]
fn scenes_over_cells_with_odd_boundaries() {
    let over = Scheme::default();
    let at = Scheme::default().constraint_kind(ConstraintKind::AtParticles);
    for (odd, scheme, word) in [
        (6, &over, "by Cells::drawn: 20"),
        (7, &over, "by Cells::boundary_nodes: 99"),
        (8, &over, "by Cells::boundary: 0"),
        (9, &over, "BoundaryCells::traces: 0"),
        (10, &over, "BoundaryCells::traces: 20"),
        (11, &over, "return them from Cells::boundary"),
        (12, &at, "Cells::boundary_nodes"),
    ] {
        let scene = Scene::new(Geometry::cells(Arc::new(Odd(lattice(), odd))), PlaneStrain, rubber()).hold(Side::Min);
        let error = scene.discretize(scheme).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains(word), "{odd}: {error}");
        // Those of a problem made by hand are looked at where results ask for them.
        if (8..=10).contains(&odd) {
            let table = ShapeTable::new(&functions(), &lattice().gauss(2).unwrap(), &PlaneStrain).unwrap();
            let body = Body::new(table, Arc::new(rubber()) as Arc<dyn Material>, PressureField::Constant);
            let problem = Problem::compose(Odd(lattice(), odd), functions(), body).unwrap();
            let grid = problem.vtk_grid(&problem.at_rest());
            assert!(grid.is_err_and(|error| error.to_string().contains(word)), "{odd}");
        }
    }
}

/// Kernel functions that are spoilt after a table was made of sound ones.
struct Spoilt(ApproximationChoice, fn(&mut ShapeFunctions<2>));

impl Approximation<2> for Spoilt {
    fn nodes(&self) -> &[Point<2>] {
        self.0.nodes()
    }
    fn evaluate(
        &self,
        at: &Point<2>,
        scratch: &mut Scratch,
        out: &mut ShapeFunctions<2>,
    ) -> Result<(), ApproximationError> {
        self.0.evaluate(at, scratch, out)?;
        (self.1)(out);
        Ok(())
    }
}

/// Queries evaluate functions that no table has seen: spoilt ones gave NaN, other values or a panic.
#[test]
fn problems_asked_with_functions_that_are_spoilt() {
    type Spoil = fn(&mut ShapeFunctions<2>);
    for (spoil, word) in [
        ((|_| {}) as Spoil, ""),
        (|psi| psi.values[0] = f64::NAN, "the value of a shape function is NaN"),
        (|psi| psi.gradients[0][0] = f64::NAN, "the gradient of a shape function is NaN"),
        (|psi| psi.values.truncate(1), "values at a point: 1 entries"),
        (|psi| psi.gradients.clear(), "gradients at a point: 0 entries"),
        (|psi| *psi.nodes.last_mut().unwrap() = 20, "do not exist"),
        (|psi| *psi = ShapeFunctions::default(), "the number of nodes that an approximation lists is 0"),
    ] {
        let table = ShapeTable::new(&functions(), &lattice().gauss(2).unwrap(), &PlaneStrain).unwrap();
        let body = Body::new(table, Arc::new(rubber()) as Arc<dyn Material>, PressureField::Constant);
        let problem = Problem::compose(lattice(), Spoilt(functions(), spoil), body).unwrap();
        match problem.displacement(&problem.at_rest(), &[0.9, 0.6].into()) {
            Ok(u) => assert!(word.is_empty() && u.norm() == 0.0),
            Err(error) => assert!(!word.is_empty() && error.to_string().contains(word), "{word}: {error}"),
        }
        assert_eq!(
            problem.particle_displacements(&problem.at_rest()).is_ok(),
            word.is_empty() || word.contains("gradient")
        );
    }
}

/// A ceiling without a gap above a height.
struct Ceiling(f64);

impl Surface<2> for Ceiling {
    fn nearest(&self, x: &Point<2>) -> Nearest<2> {
        Nearest::flat(if x[1] > self.0 { f64::NAN } else { 1.3 - x[1] }, [0.0, -1.0].into())
    }
}

/// A gap that is NaN was taken for an open one.
#[test]
fn surfaces_without_a_gap() {
    let scene = |height: f64| {
        Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber())
            .hold((1, Side::Min))
            .prescribe((1, Side::Max), 1, 0.2)
            .contact((1, Side::Max), RigidSurface::new(Ceiling(height)).named("ceiling"))
    };
    let problem = |height| scene(height).discretize(&Scheme::default().particles([5, 4]));
    assert!(problem(2.0).unwrap().run().unwrap().completed().is_ok());
    let error = problem(0.5).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("ceiling: gap or normal by Surface::nearest at x = "), "{error}");
    let error =
        problem(1.05).unwrap().run().and_then(|path| Ok(path.completed()?)).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("ceiling: gap or normal by Surface::nearest at x = "), "{error}");
}

/// A term that remembers how far node 19 has moved.
struct Remembering;

impl Term for Remembering {
    fn dim(&self) -> usize {
        2
    }
    fn nodes(&self, _: usize) -> &[u32] {
        &[19]
    }
    fn layout(&self) -> rkpm::term::Layout {
        rkpm::term::Layout { history: 1, ..Default::default() }
    }
    fn linearize(&self, _: usize, _: View<'_>, _: &mut Element) {}
    fn update(&self, view: View<'_>, next: &mut [f64]) {
        next[0] = view.displacement[38];
    }
}

/// Terms of one's own began at rest in a transfer, also between models that are the same.
#[test]
fn memories_of_terms_are_transferred() {
    let scene = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber()).hold((0, Side::Min)).prescribe(
        (0, Side::Max),
        0,
        0.2,
    );
    let problem = || {
        let mut problem = scene.discretize(&Scheme::default().particles([5, 4])).unwrap();
        problem.add(Remembering);
        problem
    };
    let path = problem().run().unwrap().completed().unwrap();
    let moved = problem().transfer(&problem(), path.last()).unwrap();
    assert!(moved.terms[1].history[0] > 0.1 && moved.terms[1] == path.last().terms[1]);
}

/// A rubber whose component 33 alone is NaN, and whose distortional energy depends on the volume once it remembers.
struct Late(Rubber, bool);

impl Material for Late {
    fn energy_from(&self, f: &Matrix3<f64>, past: Past<'_>) -> f64 {
        self.0.energy_from(f, past) + past.memory.first().map_or(0.0, |late| late * f.determinant())
    }
    fn response_from(&self, f: &Matrix3<f64>, past: Past<'_>) -> Response {
        self.0.response_from(f, past)
    }
    fn respond(&self, f: &Matrix3<f64>, past: Past<'_>, of: &[usize], stress: &mut [f64], tangent: &mut [f64]) {
        let whole = self.response_from(f, past);
        for (i, &a) in of.iter().enumerate() {
            stress[i] = whole.stress[(a / 3, a % 3)];
            if !tangent.is_empty() {
                of.iter().enumerate().for_each(|(j, &b)| tangent[i * of.len() + j] = whole.tangent[(a, b)]);
            }
        }
        if self.1 && of == [8] {
            stress[0] = f64::NAN;
        }
    }
    fn memory(&self) -> usize {
        usize::from(!self.1)
    }
    fn remember(&self, _: &Matrix3<f64>, _: Past<'_>, next: &mut [f64]) {
        next.fill(1.0);
    }
    fn volumetric(&self) -> Option<&dyn VolumetricEnergy> {
        self.0.volumetric()
    }
}

/// What sheets ask for alone, and what a law does once it remembers.
#[test]
fn laws_that_break_late() {
    let report = check::material(&Late(rubber(), true));
    assert!(report.violations().any(|f| f.law == "respond gives the components of response_from"), "{report}");
    let report = check::material(&Late(rubber(), false));
    let volume = report.finding("the distortional energy does not depend on the volume").unwrap();
    assert!(!volume.holds() && volume.at.contains("after a first step"), "{report}");
    let prony = || Prony::of_instantaneous([(0.3, 0.5), (0.2, 4.0)]).unwrap();
    assert!(check::material(&Viscoelastic::new(rubber(), prony())).holds());
    let filled = Mullins::new(rubber(), 1.5, 0.2, 0.1).unwrap();
    assert!(check::material(&Viscoelastic::new(filled, prony())).holds());
}
