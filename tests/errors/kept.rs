//! What a scene, a law or a motion is made of is kept, or refused: nothing is lost without a word.
#![cfg(feature = "solve")]

use std::sync::{Arc, LazyLock};

use rkpm::cells::{Smoothing, Zones};
use rkpm::error::{ContactError, Invalid, MaterialError, SolveError};
use rkpm::kinematics::Kinematics;
use rkpm::material::{
    InitialModuli, Material, MixedLogarithmicVolume, Mullins, NearlyIncompressible, Past, Prestretched, Prony,
    Response, Viscoelastic,
};
use rkpm::nalgebra::{Matrix3, Vector3};
use rkpm::prelude::*;
use rkpm::solid::Shape;
use rkpm::study::Quantity;
use rkpm::table::ShapeTable;

fn rubber() -> Rubber {
    Rubber::neo_hookean(0.5, 1e3).unwrap()
}

fn prony() -> Prony {
    Prony::of_instantaneous([(0.4, 2.0)]).unwrap()
}

fn block(law: impl Material + 'static) -> Scene<2> {
    Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, law)
}

fn coarse() -> Scheme {
    Scheme::default().particles([7, 4])
}

/// A quantity at the end of a run.
fn at_end(scene: &Scene<2>, quantity: &Quantity<2>) -> f64 {
    let problem = scene.discretize(&coarse()).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    quantity.evaluate(&problem, path.last()).unwrap()
}

#[test]
fn what_is_stressed_without_a_displacement_has_its_energy() {
    let clamped = |law: Box<dyn Material>| block(law).hold(Part::Whole);
    let energy = |scene: &Scene<2>| at_end(scene, &Quantity::energy());
    assert_eq!(energy(&clamped(Box::new(rubber()))), 0.0);
    // The whole block would like to be larger: F_e = 1/s at each point, over s³ of its volume.
    for s in [1.001, 0.999] {
        let exact = 2.0 * s * s * s * rubber().energy(&Matrix3::from_diagonal_element(1.0 / s));
        let found = energy(&clamped(Box::new(rubber())).with_expansion(s));
        assert!((found / exact - 1.0).abs() < 1e-9, "{s}: {found} {exact}");
    }
    let before = Matrix3::from_diagonal(&Vector3::new(1.2, 0.9, 1.0 / (1.2 * 0.9)));
    let exact = 2.0 * rubber().energy(&before);
    let found = energy(&clamped(Box::new(Prestretched::new(rubber(), before).unwrap())));
    assert!((found / exact - 1.0).abs() < 1e-9, "{found} {exact}");
}

#[test]
fn what_is_moved_without_a_strain_is_displaced() {
    let moved = || block(rubber()).prescribe(Part::Whole, 0, 0.5).prescribe(Part::Whole, 1, 0.0);
    let found = at_end(&moved(), &Quantity::displacement([1.0, 0.5], 0));
    assert!((found - 0.5).abs() < 1e-12, "{found}");
    // Springs under the lower side, ½ k u² over its length of 2.
    let found = at_end(&moved().with(Load::elastic_foundation((1, Side::Min), 3.0)), &Quantity::energy());
    assert!((found - 0.5 * 3.0 * 0.25 * 2.0).abs() < 1e-9, "{found}");
}

/// A law that overrides what others leave as it is, and is one only where it says so.
#[derive(Clone)]
struct Measured(Rubber, Result<(), MaterialError>);

impl Material for Measured {
    fn energy_from(&self, f: &Matrix3<f64>, _: Past<'_>) -> f64 {
        self.0.energy(f)
    }
    fn response_from(&self, f: &Matrix3<f64>, _: Past<'_>) -> Response {
        self.0.response(f)
    }
    fn initial_moduli(&self) -> InitialModuli {
        InitialModuli { shear: 7.0, bulk: 11.0 }
    }
    fn settled(&self, f: &Matrix3<f64>, _: Past<'_>) -> Matrix3<f64> {
        f * 2.0
    }
    fn validate(&self) -> Result<(), MaterialError> {
        self.1.clone()
    }
    fn relaxation(&self) -> Option<&Prony> {
        static SERIES: LazyLock<Prony> = LazyLock::new(prony);
        Some(&SERIES)
    }
}

#[test]
fn wrapped_laws_keep_what_they_override() {
    for valid in [Ok(()), Err(MaterialError::Empty)] {
        let law = || Measured(rubber(), valid.clone());
        let shared = || Arc::new(law()) as Arc<dyn Material>;
        let mut all: Vec<(&str, Box<dyn Material>)> = vec![
            ("Box", Box::new(Box::new(law()))),
            ("Arc", Box::new(Arc::new(law()))),
            ("Arc of dyn", Box::new(shared())),
            ("&", Box::new(&*Box::leak(Box::new(law())))),
            ("Viscoelastic", Box::new(Viscoelastic::new(law(), prony()))),
            ("Arc in Viscoelastic", Box::new(Viscoelastic::new(shared(), prony()))),
        ];
        match Mullins::new(shared(), 1.5, 0.5, 0.1) {
            Ok(softening) => all.push(("Mullins", Box::new(softening))),
            Err(error) => assert_eq!(Err(error), valid),
        }
        for (name, wrapped) in &all {
            assert_eq!(wrapped.initial_moduli(), InitialModuli { shear: 7.0, bulk: 11.0 }, "{name}");
            let rest = wrapped.rest();
            let settled = wrapped.settled(&Matrix3::identity(), Past { memory: &rest, elapsed: 0.0 });
            assert_eq!(settled, Matrix3::identity() * 2.0, "{name}");
            assert_eq!(wrapped.relaxation(), Some(&prony()), "{name}");
            assert_eq!(wrapped.validate(), valid, "{name}");
        }
    }
    let law = Measured(rubber(), Err(MaterialError::Empty));
    // Moduli of a stretched body are others; what the law refuses is refused all the same.
    let stretched = Prestretched::new(law.clone(), Matrix3::from_diagonal_element(1.1)).unwrap();
    assert_eq!(stretched.validate(), Err(MaterialError::Empty));
    assert!((stretched.settled(&Matrix3::identity(), Past::NONE) - Matrix3::identity() * 2.0).norm() < 1e-14);
    assert!(matches!(block(law).discretize(&coarse()), Err(Error::Material(MaterialError::Empty))));
}

#[test]
fn laws_with_a_memory_within_others_are_kept_or_refused() {
    let softening = |law: Rubber| Mullins::new(law, 1.5, 0.5, 0.1).unwrap();
    let nested = Mullins::new(Viscoelastic::new(rubber(), prony()), 1.5, 0.5, 0.1);
    assert!(matches!(nested, Err(MaterialError::Invalid(Invalid { value: 13.0, .. }))), "{nested:?}");
    let shared = || Arc::new(softening(rubber())) as Arc<dyn Material>;
    let stretch = Matrix3::from_diagonal_element(1.0);
    let laws: [(usize, Arc<dyn Material>); 4] = [
        (14, Arc::new(Viscoelastic::new(softening(rubber()), prony()))),
        (14, Arc::new(Viscoelastic::new(shared(), prony()))),
        (26, Arc::new(Viscoelastic::new(Viscoelastic::new(rubber(), prony()), prony()))),
        (1, Arc::new(Prestretched::new(softening(rubber()), stretch).unwrap())),
    ];
    for (memory, law) in laws {
        assert_eq!(law.memory(), memory);
        assert!(block(law).hold((1, Side::Min)).discretize(&coarse()).is_ok());
    }
    // A distortional energy that softens beside any volumetric one.
    let shape = rubber().distortional;
    let volumetric = MixedLogarithmicVolume::new(1e3).unwrap();
    let whole = NearlyIncompressible { distortional: Mullins::new(shape, 1.5, 0.5, 0.1).unwrap(), volumetric };
    let f = Matrix3::from_diagonal(&Vector3::new(1.3, 0.9, 0.85));
    let past = Past { memory: &[0.4], elapsed: 0.0 };
    assert_eq!((whole.memory(), whole.energy_from(&f, past)), (1, softening(rubber()).energy_from(&f, past)));
}

/// Without pressures of its own a law that remembers keeps its volumetric part all the same.
#[test]
fn laws_that_remember_resist_changes_of_volume_in_every_form() {
    let lattice = Block::new([0.0, 0.0], [1.0, 1.0]).lattice([4, 4]).unwrap();
    let functions = ReproducingKernel::new(lattice.particles(1.0).unwrap(), CubicSpline, Polynomial::linear()).unwrap();
    let displacement: Vec<f64> = (0..32).map(|k| 0.02 * (k as f64).sin()).collect();
    for field in [PressureField::Displacement, PressureField::Pointwise, PressureField::Constant, PressureField::Linear]
    {
        let points = lattice.gauss_in(2, &lattice.zones(3)).unwrap();
        let table = ShapeTable::new(&functions, &points, &PlaneStrain).unwrap();
        let filled = Mullins::new(rubber(), 1.5, 0.5, 0.1).unwrap();
        let report =
            rkpm::check::term(&Body::new(table, Viscoelastic::new(filled, prony()), field), &displacement, 1.0);
        let report = report.unwrap();
        assert!(report.holds(), "{field:?}: {report}");
    }
}

/// Filled rubber that relaxes, pulled twice: the second time it is softer, and both times it relaxes.
#[test]
fn what_softens_and_relaxes_does_both() {
    let course = Amplitude::table(vec![(0.0, 0.0), (0.25, 1.0), (0.5, 0.0), (0.75, 1.0), (1.0, 1.0)]).unwrap();
    let force = |law: Arc<dyn Material>| {
        let pulled = Condition::on((0, Side::Max)).component(0, 1.0).amplitude(course.clone()).named("pull");
        let scene = block(law).hold((0, Side::Min)).with(pulled).over_time(40.0);
        let problem = scene.discretize(&coarse().stepping(Stepping::equal(16))).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        let of = |load: f64| {
            let step = path.steps.iter().find(|step| (step.state.load - load).abs() < 1e-9).unwrap();
            problem.reaction(&step.state, "pull").unwrap()[0]
        };
        [of(0.25), of(0.5 + 0.125), of(0.75), of(1.0)]
    };
    let filled = || Mullins::new(rubber(), 1.5, 0.5, 0.1).unwrap();
    let both = force(Arc::new(Viscoelastic::new(filled(), prony())));
    let relaxing = force(Arc::new(Viscoelastic::new(rubber(), prony())));
    let softening = force(Arc::new(filled()));
    assert!(both[1] < 0.99 * relaxing[1] && both[3] < 0.9 * softening[3], "{both:?} {relaxing:?} {softening:?}");
    // The first pull softens nothing; after a long time the softened law is left, relaxed.
    assert!((both[0] / relaxing[0] - 1.0).abs() < 1e-9, "{both:?} {relaxing:?}");
    assert!((both[3] / softening[3] - 0.6).abs() < 0.02, "{both:?} {softening:?}");
}

/// There and back again within a run.
fn returns() -> Amplitude {
    Amplitude::Function(Arc::new(|load: f64| (std::f64::consts::PI * load).sin()))
}

#[test]
fn motions_and_loads_that_return_are_followed() {
    let filled = || Mullins::new(rubber(), 1.5, 0.5, 0.1).unwrap();
    let held = || block(filled()).hold((1, Side::Min));
    let plate = RigidSurface::plane([0.0, 1.0], [0.0, -1.0]).moving_along([0.0, -0.1], returns()).named("plate");
    let moving = Value::motion(|_: &Point<2>, load| [0.05 * (std::f64::consts::PI * load).sin(), 0.0]);
    for (name, scene) in [
        ("plate", held().contact((1, Side::Max), plate)),
        ("condition", held().with(Condition::on((1, Side::Max)).displacement([0.0, -0.1]).amplitude(returns()))),
        ("traction", held().with(Load::traction((1, Side::Max), [0.05, 0.0]).amplitude(returns()))),
        ("pressure", held().with(Load::pressure((1, Side::Max), 0.05).amplitude(returns()))),
        ("traction that moves", held().with(Load::traction((1, Side::Max), moving))),
    ] {
        let problem = scene.discretize(&coarse()).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        let moved = |step: &rkpm::solve::Step| problem.displacement(&step.state, &[0.7, 1.0].into()).unwrap().norm();
        let farthest = path.steps.iter().map(moved).fold(0.0, f64::max);
        assert!(farthest > 5e-3, "{name}: {farthest} in {} steps", path.steps.len());
    }
}

#[test]
fn a_plane_that_turns_through_a_body_does_not_come_out_behind_it() {
    for angle in [1.0, std::f64::consts::TAU, 2.0 * std::f64::consts::TAU] {
        let plane = RigidSurface::plane([0.0, 1.0], [0.0, -1.0]).turning([1.0, 1.2], angle).named("plane");
        let scene = block(rubber()).hold((1, Side::Min)).contact((1, Side::Max), plane);
        let path = scene.discretize(&Scheme::default()).unwrap().run().unwrap();
        assert!(path.last().load < 0.5, "{angle}: {:?} at {}", path.ending, path.last().load);
    }
}

/// The points of a rule of second order in a box, four of them.
fn four_points(points: &[(Point<3>, f64)]) -> Vec<(Point<3>, f64)> {
    let volume: f64 = points.iter().map(|point| point.1).sum();
    let centre = points.iter().map(|(x, w)| x * *w).sum::<Point<3>>() / volume;
    // The eight points stand as far from the middle along each axis.
    let away = (points[0].0 - centre).abs();
    let signs = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
    signs.iter().map(|sign| (centre + Point::<3>::from(*sign).component_mul(&away), volume / 4.0)).collect()
}

#[test]
fn gradients_of_a_sub_cell_follow_from_its_own_points() {
    let lattice = Block::new([0.0; 3], [3.0, 2.0, 2.0]).lattice([4, 3, 3]).unwrap();
    let particles = lattice.particles(1.2).unwrap();
    let kernel = ReproducingKernel::new(particles, CubicSpline, Polynomial::linear()).unwrap();
    let cells = 12u32;
    let table = |order: Vec<u32>, few: u32| {
        let place = order.iter().position(|&cell| cell == few).unwrap();
        let zones = Zones::new(order, (0..=cells as usize).collect());
        let mut smoothing: Smoothing<3> = lattice.smoothing(1, 2, &zones).unwrap();
        smoothing.interior[place] = four_points(&smoothing.interior[place]);
        let solid: &dyn Kinematics<3> = &Solid;
        ShapeTable::consistent(&kernel, &smoothing, solid).unwrap()
    };
    let (first, last) = (table((0..cells).collect(), 0), table((0..cells).rev().collect(), 0));
    assert_eq!(first.point_count(), 4 + 11 * 8);
    for (point, at) in first.positions().iter().enumerate() {
        let other = last.positions().iter().position(|x| (x - at).norm() < 1e-12).expect("the same points");
        assert_eq!(first.nodes(point), last.nodes(other));
        let apart = first.gradients(point).iter().zip(last.gradients(other)).map(|(a, b)| (a - b).abs());
        assert!(apart.fold(0.0, f64::max) < 1e-12, "at {at:?}");
    }
}

#[test]
fn contacts_and_foundations_that_can_not_act() {
    let held = || block(rubber()).hold((1, Side::Min));
    let top = || Place::<2>::on((1, Side::Max));
    let plane = || RigidSurface::plane([0.0, 1.1], [0.0, -1.0]).named("plane");
    let refused = |scene: &Scene<2>| match scene.discretize(&coarse()) {
        Err(Error::Contact(error)) => error,
        other => panic!("{:?}", other.map(|_| ()).map_err(|error| error.to_string())),
    };
    let nothing = refused(&held().contact(top().within(|x| x[0] > 5.0), plane().moving([0.0, -0.2])));
    assert!(matches!(nothing, ContactError::NoFacet { .. }), "{nothing}");
    let nothing = refused(&held().contact_between(top().within(|x| x[0] > 5.0), (0, Side::Max), "none"));
    assert!(matches!(nothing, ContactError::NoFacet { .. }), "{nothing}");
    for scene in [
        held().contact_between((1, Side::Max), (1, Side::Max), "same"),
        held().name("top", (1, Side::Max)).contact_between("top", (1, Side::Max), "same"),
    ] {
        let same = refused(&scene);
        assert!(matches!(same, ContactError::SameFace { .. }), "{same}");
    }
    for surface in [plane().moving([0.0, -0.2]).pushed([0.0, -0.2]), plane().pushed([0.0, -0.2]).moving([0.0, -0.2])] {
        let twice = refused(&held().contact((1, Side::Max), surface));
        assert!(matches!(twice, ContactError::DrivenTwice { .. }), "{twice}");
    }
    let apart = refused(&held().contact((1, Side::Max), plane().interference(1.0)));
    assert!(matches!(apart, ContactError::NoOverlap { gap, .. } if (gap - 0.1).abs() < 1e-12), "{apart}");
    let two = Scene::assembly(PlaneStrain)
        .body("lower", Block::new([0.0, 0.0], [2.0, 1.0]), rubber())
        .body("upper", Block::new([0.5, 1.2], [1.5, 2.0]), rubber())
        .unbonded("lower", "upper")
        .hold(Place::on((1, Side::Min)).of("lower"))
        .hold(Place::on((1, Side::Max)).of("upper"));
    let apart =
        refused(&two.press_fit(Place::on((1, Side::Max)).of("lower"), Place::on((1, Side::Min)).of("upper"), "fit"));
    assert!(matches!(apart, ContactError::NoOverlap { .. }), "{apart}");

    for (scene, value) in [
        (held().with(Load::elastic_foundation((1, Side::Max), -1000.0)), -1000.0),
        (held().with(Load::normal_elastic_foundation((1, Side::Max), -1.0)), -1.0),
        (held().with(Load::elastic_foundation((1, Side::Max), f64::INFINITY)), f64::INFINITY),
    ] {
        let error = scene.discretize(&coarse()).and_then(|problem| problem.run()).expect_err("a refusal");
        let of_foundation = |invalid: &Invalid| invalid.what.contains("foundation") && invalid.value == value;
        let found = match &error {
            Error::Invalid(invalid) | Error::Solve(SolveError::Invalid(invalid)) => of_foundation(invalid),
            _ => false,
        };
        assert!(found, "{error:?}");
    }
}

#[test]
fn tolerances_that_rounding_can_not_reach() {
    use rkpm::solve::Newton;
    for tolerance in [1e-300, 1e-17, 0.0, f64::NAN] {
        let scheme = coarse().newton(Newton { tolerance, ..Newton::default() });
        let scene = block(rubber()).hold((1, Side::Min)).prescribe((1, Side::Max), 0, 0.1);
        let error = scene.discretize(&scheme).and_then(|problem| problem.run()).expect_err("a refusal");
        assert!(matches!(&error, Error::Invalid(invalid) if invalid.what.contains("tolerance")), "{error}");
    }
}

#[test]
fn voxels_without_a_value_cut_no_holes() {
    let mut values: Vec<f64> = (0..64).map(|k| if (1..3).contains(&(k % 4)) { 1.0 } else { 0.0 }).collect();
    assert!(Shape::voxels([4; 3], [1.0; 3], values.clone(), 0.5).is_ok());
    assert!(Shape::voxels([4; 3], [1.0; 3], values.clone(), f64::NAN).is_err());
    values[21] = f64::NAN;
    let error = Shape::voxels([4; 3], [1.0; 3], values, 0.5).unwrap_err();
    assert!(error.to_string().contains("voxel"), "{error}");
}

#[test]
fn gmsh_files_with_parametric_nodes_and_comments_first() {
    let elements = "$Elements\n1\n1 3 2 5 1 1 2 3 4\n$EndElements\n";
    let format = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n";
    let parametric =
        "$ParametricNodes\n4\n1 0 0 0 0 1\n2 1 0 0 1 1 0.5\n3 1 1 0 2 1 0.25 0.5\n4 0 1 0 3 4\n$EndParametricNodes\n";
    let plain = "$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 1 1 0\n4 0 1 0\n$EndNodes\n";
    let comments = "$Comments\nby hand\n$EndComments\n";
    for text in [
        format!("{format}{plain}{elements}"),
        format!("{format}{parametric}{elements}"),
        format!("{comments}{format}{plain}{elements}"),
        format!("{comments}{format}{comments}{parametric}{comments}{elements}"),
    ] {
        let mesh = Mesh::<2>::parse(text.as_bytes()).unwrap_or_else(|error| panic!("{text}\n{error}"));
        assert_eq!(mesh.total(), 1.0);
    }
    for text in ["$Comments\nby hand\n", "solid part\nfacet", "$Comments\n$EndComments\n", ""] {
        let error = Mesh::<2>::parse(text.as_bytes()).unwrap_err();
        assert!(error.to_string().contains("$MeshFormat"), "{error}");
    }
}

#[cfg(feature = "chart")]
#[test]
fn elements_around_a_bore_are_drawn() {
    use rkpm::scene::Field;
    let quarter = |unit: &Point<2>| {
        let (radius, angle) = (6.0 + 4.0 * unit[0], 0.5 * std::f64::consts::PI * unit[1]);
        Point::<2>::new(radius * angle.cos(), radius * angle.sin())
    };
    let tube = Scene::new(rkpm::geometry::Mapped(quarter), PlaneStrain, rubber())
        .prescribe((1, Side::Min), 1, 0.0)
        .prescribe((1, Side::Max), 0, 0.0)
        .pressure((0, Side::Min), 0.02);
    for scheme in [Scheme::default(), Scheme::elements(1), Scheme::elements(2)] {
        let problem = tube.discretize(&scheme.particles([5, 9])).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        for field in [Field::Displacement, Field::LargestStretch, Field::MisesStress] {
            let picture = problem.picture(path.last(), field).unwrap();
            let svg = picture.to_svg().unwrap();
            // Letters of the image may spell anything.
            assert!(svg.lines().filter(|line| !line.contains("base64")).all(|line| !line.contains("NaN")));
        }
    }
}

/// A ring with a slot: what is refined beside it stays two ends, whose opening takes the force that it takes without refinement.
#[test]
fn refined_cells_are_not_joined_across_a_slot() {
    let ring = |unit: &Point<2>| {
        let (radius, angle) = (1.0 + 0.4 * unit[0], 0.01 + (std::f64::consts::TAU - 0.02) * unit[1]);
        Point::<2>::new(radius * angle.cos(), radius * angle.sin())
    };
    let scene = Scene::new(Mapped(ring), PlaneStrain, rubber())
        .hold((1, Side::Min))
        .prescribe((1, Side::Max), 0, 0.0)
        .prescribe((1, Side::Max), 1, -0.02);
    let force = |scene: &Scene<2>, scheme: &Scheme| {
        let problem = scene.discretize(scheme).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        problem.reaction(path.last(), (1, Side::Max)).unwrap()[1]
    };
    let plain = force(&scene, &Scheme::default().particles([5, 49]));
    let cells = rkpm::cells::Refined::new(Arc::new(Mapped(ring)), [4, 48]).unwrap();
    for cells in [cells.clone(), cells.refined(&[0, 1]).unwrap()] {
        let found = force(&scene.with_cells(Arc::new(cells)), &Scheme::default());
        assert!((found / plain - 1.0).abs() < 0.05, "{found} {plain}");
    }
}
