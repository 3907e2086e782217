//! What no body could follow, or no scheme serve, is refused: with both sides, the place and the remedy.
#![cfg(feature = "solve")]

#[cfg(feature = "fit")]
use rkpm::error::FitError;
use rkpm::error::{BoundaryError, ContactError, GeometryError, Incompatible, OutputError};
use rkpm::kernel::WendlandC2;
use rkpm::material::{Prony, Viscoelastic};
use rkpm::mesh::CellShape;
use rkpm::prelude::*;
use rkpm::scene::{Partition, SolverChoice};
use rkpm::solve::{Newton, StepControl};
use rkpm::term::PressureField;

fn rubber() -> Rubber {
    Rubber::neo_hookean(0.5, 1e3).unwrap()
}

fn block() -> Scene<2> {
    Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber()).hold((1, Side::Min))
}

fn region() -> Region {
    let outline = Outline::at([0.0, 0.0]).line("bottom", [2.0, 0.0]).line("right", [2.0, 1.0]).line("top", [0.0, 1.0]);
    Region::new(outline.close("left")).unwrap()
}

fn mesh() -> Mesh<2> {
    let points = (0..9).map(|k| Point::<2>::new((k % 3) as f64, (k / 3) as f64)).collect();
    let cells = [0, 1, 3, 4].iter().flat_map(|&k| [k, k + 1, k + 4, k + 3]).collect();
    Mesh::new(points, &[(CellShape::Quadrangle, cells)], &[]).unwrap()
}

fn refusal<const D: usize>(scene: &Scene<D>, scheme: &Scheme) -> Error {
    scene.discretize(scheme).err().expect("a refusal")
}

#[test]
fn settings_that_no_body_follows() {
    let (drawn, meshed) = (Scene::new(region(), PlaneStrain, rubber()), Scene::new(mesh(), PlaneStrain, rubber()));
    let graded = || Scheme::default().graded(|x| 1.0 + x[0]);
    let wide = |rule| Scheme::default().particles([5, 5]).rule(rule).pressure_field(PressureField::Constant, 2);
    let layout = Layout::Jittered { amount: 0.1, seed: 1 };
    for (scene, scheme, what, with) in [
        (block(), graded(), "Scheme::graded", "block"),
        (meshed.clone(), graded(), "Scheme::graded", "mesh"),
        (drawn.clone(), Scheme::default().across(2), "Scheme::across", "region"),
        (meshed.clone(), Scheme::default().particles([5]), "particles", "mesh"),
        (meshed.clone(), Scheme::default().spacing(0.3), "spacing", "mesh"),
        (meshed.clone(), Scheme::default().layout(layout.clone()), "Scheme::layout", "mesh"),
        (meshed.clone(), Scheme::default().seed(3), "Scheme::seed", "mesh"),
        (drawn, Scheme::default().layout(layout), "Scheme::layout", "region"),
        (block(), Scheme::default().seed(3), "Scheme::seed", "block"),
        (block(), Scheme::default().partition(Partition::Voronoi), "Scheme::partition", "block"),
        (block(), Scheme::elements(2).dilation(1.2), "Scheme::dilation", "finite elements"),
        (block(), Scheme::elements(1).kernel(WendlandC2), "kernel", "finite elements"),
        (block(), Scheme::elements(1).solver_choice(SolverChoice::Krylov), "Krylov", "finite elements"),
        (block(), wide(Rule::Scni), "pressure_field", "integration rule"),
        (block(), wide(Rule::Nodal), "pressure_field", "integration rule"),
        (block(), wide(Rule::Gauss { zones: Some(vec![2, 2]), points: None }), "pressure_field", "integration rule"),
    ] {
        let error = refusal(&scene, &scheme);
        let Error::Incompatible(found) = &error else { panic!("{error}") };
        assert!(found.what.contains(what) && found.with.contains(with), "{error}");
    }
    // What another body follows is no mistake; what the body's own scheme asks for is.
    let both = Scene::assembly(PlaneStrain)
        .body("part", mesh(), rubber())
        .body("block", Block::new([0.0, 2.0], [2.0, 3.0]), rubber())
        .hold(Place::on((1, Side::Max)).of("block"));
    assert!(both.discretize(&Scheme::default().particles([5, 3])).is_ok());
    let own = both.scheme_of("part", |scheme| scheme.particles([7]));
    assert!(matches!(refusal(&own, &Scheme::default()), Error::Incompatible(_)));
}

#[test]
fn numbers_that_are_none() {
    let count = |scheme: &Scheme, what: &str| match refusal(&block(), scheme) {
        Error::Geometry(GeometryError::Count { what: found, .. }) => assert!(found.contains(what), "{found}"),
        error => panic!("{error}"),
    };
    count(&Scheme::default().order(0), "order of the basis");
    count(&Scheme::default().rule(Rule::Smoothed { parts: 1000 }), "sub-cells");
    count(&Scheme::default().pressure_field(PressureField::Linear, 1_000_000_000), "pressure zone");
    for radius in [-0.5, 0.0, f64::NAN] {
        let error = Region::new(Outline::circle("rim", [0.0, 0.0], radius)).unwrap_err();
        assert!(error.to_string().contains("radius not above zero"), "{error}");
    }
}

#[test]
fn names_that_are_empty() {
    let named = |scene: Scene<2>| match refusal(&scene, &Scheme::default().particles([5, 3])) {
        Error::Boundary(BoundaryError::Nameless { what }) => what,
        error => panic!("{error}"),
    };
    assert_eq!(named(block().hold("")), "the place of a condition, a load or a contact");
    assert_eq!(named(block().name(" ", (0, Side::Min))), "a place");
    assert_eq!(named(block().rigid("", (0, Side::Min))), "a rigid body");
    let plane = RigidSurface::plane([0.0, 1.5], [0.0, -1.0]).named("");
    assert_eq!(named(block().contact((1, Side::Max), plane)), "a rigid surface");
    let nameless = Scene::assembly(PlaneStrain).body("", Block::new([0.0, 0.0], [1.0, 1.0]), rubber());
    assert_eq!(named(nameless), "a body");
}

#[test]
fn bodies_that_overlap() {
    let two = |low: f64| {
        Scene::assembly(PlaneStrain)
            .body("lower", Block::new([0.0, 0.0], [2.0, 1.0]), rubber())
            .body("upper", Block::new([0.0, low], [2.0, low + 1.0]), rubber())
            .hold(Place::on((1, Side::Min)).of("lower"))
    };
    let scheme = Scheme::default().particles([5, 5]);
    assert!(two(1.0).discretize(&scheme).is_ok());
    let error = refusal(&two(0.5), &scheme);
    assert!(matches!(&error, Error::Boundary(BoundaryError::Overlap { first, .. }) if first == "lower"), "{error}");
    assert!(rkpm::check::scene(&two(0.5), &scheme).is_err());
}

#[test]
fn surfaces_that_are_not_faced() {
    // Behind the block, seen from its upper face.
    let below = RigidSurface::plane([0.0, -0.5], [0.0, 1.0]).moving([0.0, 0.6]);
    let scheme = Scheme::default().particles([5, 3]);
    let error = refusal(&block().contact((1, Side::Max), below.clone()), &scheme);
    assert!(matches!(error, Error::Contact(ContactError::FacesAway { .. })), "{error}");
    assert!(rkpm::check::scene(&block().contact((1, Side::Max), below), &scheme).is_err());
}

/// Faces of two bodies that look the same way, one behind the other's body, are refused in the plane, in space and of radial lines. Faces
/// side by side, as of a flap that folds over, and those of one body, which come to look at each other where it folds, are taken.
#[test]
fn faces_that_look_away_from_each_other() {
    fn two<const D: usize>(kinematics: impl Kinematics<D> + 'static) -> Scene<D> {
        let block = |low: f64| {
            let (mut min, mut max) = ([0.0; D], [2.0; D]);
            (min[D - 1], max[D - 1]) = (low, low + 1.0);
            Block::new(min, max)
        };
        Scene::assembly(kinematics)
            .body("lower", block(3.0), rubber())
            .body("upper", block(4.2), rubber())
            .hold(Place::on((D - 1, Side::Min)).of("lower"))
            .hold(Place::on((D - 1, Side::Max)).of("upper"))
    }
    fn refused<const D: usize>(kinematics: impl Kinematics<D> + Clone + 'static) {
        let on = |side: Side, of: &str| Place::<D>::on((D - 1, side)).of(of);
        let scheme = Scheme::default().particles([4; D]);
        for side in [Side::Max, Side::Min] {
            let scene = two(kinematics.clone()).contact_between(on(side, "lower"), on(side, "upper"), "joint");
            match refusal(&scene, &scheme) {
                Error::Contact(ContactError::FacesAway { contact, at }) => {
                    let height = if side == Side::Max { 4.0 } else { 3.0 };
                    assert!(contact.contains("joint") && (at[D - 1] - height).abs() < 1e-9, "{contact} {at:?}");
                }
                error => panic!("{error}"),
            }
        }
        let right = two(kinematics).contact_between(on(Side::Max, "lower"), on(Side::Min, "upper"), "joint");
        assert!(right.discretize(&scheme).is_ok());
    }
    refused(RadialCylinder);
    refused(PlaneStrain);
    refused(Solid);
    let scheme = Scheme::default().particles([9, 3]);
    let flap = Scene::assembly(PlaneStrain)
        .body("base", Block::new([0.0, 0.0], [2.0, 1.0]), rubber())
        .body("flap", Block::new([2.0, 0.8], [4.0, 1.0]), rubber())
        .hold(Place::on((1, Side::Min)).of("base"));
    let [base, folded] = ["base", "flap"].map(|body| Place::<2>::on((1, Side::Max)).of(body));
    assert!(flap.contact_between(base, folded, "lip").discretize(&scheme).is_ok());
    let half = |left: bool| Place::<2>::on((1, Side::Max)).within(move |x| (x[0] < 1.0) == left);
    assert!(block().contact_between(half(true), half(false), "fold").discretize(&scheme).is_ok());
}

#[test]
fn runs_that_a_law_cannot_follow() {
    let law = Viscoelastic::new(rubber(), Prony::of_instantaneous([(0.4, 2.0)]).unwrap());
    let pad = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, law)
        .hold((1, Side::Min))
        .traction((1, Side::Max), [0.01, 0.0])
        .over_time(10.0);
    let stepping = Stepping { control: StepControl::ArcLength, ..Stepping::default() };
    let problem = pad.discretize(&Scheme::default().particles([5, 3]).stepping(stepping)).unwrap();
    let error = problem.run().unwrap_err();
    assert!(matches!(&error, Error::Incompatible(Incompatible { what, .. }) if what.contains("ArcLength")), "{error}");
}

#[test]
fn sizes_that_can_not_be_meant() {
    let scheme = Scheme::default().particles([5, 3]);
    let law = Rubber::neo_hookean(0.5, 1e15).unwrap();
    let stiff = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, law).hold((1, Side::Min));
    let error = refusal(&stiff, &scheme).to_string();
    assert!(error.contains("bulk over shear modulus") && error.contains("rounding"), "{error}");
    let error = refusal(&block().traction((1, Side::Max), [1e9, 0.0]), &scheme).to_string();
    assert!(error.contains("traction") && error.contains("units"), "{error}");
}

#[test]
fn messages_that_say_what_is_wrong() {
    let krylov = Scene::new(mesh(), PlaneStrain, rubber());
    let error = refusal(&krylov, &Scheme::default().solver_choice(SolverChoice::Krylov)).to_string();
    assert!(error.contains("Krylov") && error.contains("not in 3D"), "{error}");
    let nowhere = Place::on((1, Side::Max)).within(|x: &Point<2>| x[0] > 3.0);
    let error = refusal(&block().pressure(nowhere, 0.1), &Scheme::default().particles([5, 3])).to_string();
    assert!(error.contains("[0.0, 1.0]") && error.contains("[2.0, 1.0]"), "{error}");
}

/// Radial forces on a ring that is rigid balance each other.
#[test]
fn a_radial_force_on_an_axisymmetric_rigid_body_is_refused() {
    let plate = |force| {
        Scene::new(Block::new([1.0, 0.0], [2.0, 1.0]), Axisymmetric, Rubber::neo_hookean(0.5, 100.0).unwrap())
            .hold((1, Side::Min))
            .rigid("plate", (1, Side::Max))
            .with(Load::force("plate", force))
    };
    let scheme = Scheme::default().particles([5, 5]);
    assert!(plate([0.0, -0.1]).discretize(&scheme).is_ok());
    let error = refusal(&plate([0.5, 0.0]), &scheme);
    assert!(matches!(&error, Error::Incompatible(Incompatible { what, .. }) if what == "a radial force"), "{error}");
}

#[test]
fn a_moment_out_of_the_plane_is_refused() {
    let plate = |moment| {
        Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e2).unwrap())
            .hold((1, Side::Min))
            .rigid("plate", (1, Side::Max))
            .with(Load::moment("plate", moment))
    };
    let scheme = Scheme::default().particles([5, 3]);
    assert!(plate([0.0, 0.0, 0.01]).discretize(&scheme).is_ok());
    for moment in [[0.01, 0.0, 0.0], [0.0, 0.01, 0.02]] {
        let error = refusal(&plate(moment), &scheme);
        assert!(
            matches!(&error, Error::Incompatible(Incompatible { what, .. }) if what.contains("moment") && what.contains("plate")),
            "{error}"
        );
    }
}

#[test]
fn an_amplitude_that_nothing_follows_is_refused() {
    let half = || Amplitude::table(vec![(0.0, 0.0), (1.0, 0.5)]).unwrap();
    let block = || {
        Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e2).unwrap())
            .hold((1, Side::Min))
    };
    let (top, scheme) = ((1, Side::Max), Scheme::default().particles([5, 3]));
    let springs = block().with(Load::elastic_foundation(top, 1.0).amplitude(half()));
    assert!(matches!(refusal(&springs, &scheme), Error::Incompatible(_)));
    let plate = || RigidSurface::plane([1.0, 1.0], [0.0, -1.0]).named("plate");
    for (surface, unturned) in
        [(plate().turning_along(half()), true), (plate().turning([1.0, 1.0], 0.1).driven([1.0, 1.0], 0.1), false)]
    {
        let error = refusal(&block().contact(top, surface), &scheme);
        let Error::Contact(found) = &error else { panic!("{error}") };
        assert_eq!(matches!(found, ContactError::Unturned { .. }), unturned, "{error}");
        assert_eq!(matches!(found, ContactError::DrivenTwice { .. }), !unturned, "{error}");
    }
    // The order in which a turn and its amplitude are given says nothing.
    let angle = |surface| {
        let problem = block().contact(top, surface).discretize(&scheme).unwrap();
        let path = problem.run().unwrap();
        problem.contact(path.last(), "plate").unwrap().angle
    };
    let low = || plate().moving([0.0, -0.05]);
    let turned =
        [low().turning_along(half()).turning([1.0, 1.0], 0.02), low().turning([1.0, 1.0], 0.02).turning_along(half())]
            .map(angle);
    assert_eq!(turned, [0.01; 2]);
}

#[test]
fn a_name_with_another_ending_is_refused() {
    // Both would have been written as push_0.pvd.
    let problem = block().discretize(&Scheme::default().particles([4, 3])).unwrap();
    let path = problem.run().unwrap();
    for name in ["push_0.5", "push_0.7"] {
        let file = std::env::temp_dir().join(name);
        assert!(matches!(problem.write(&path, &file), Err(Error::Output(OutputError::Ending { .. }))), "{name}");
        let stages = rkpm::scene::Stages::new("push", block()).run(&Scheme::default().particles([4, 3])).unwrap();
        let error = rkpm::scene::write_stages(&stages, &file).unwrap_err();
        assert!(matches!(error, Error::Output(OutputError::Ending { .. })), "{error}");
    }
}

#[test]
fn places_and_names_are_told_apart() {
    let left = || Place::on((0, Side::Min)).within(|x: &Point<2>| x[1] > 0.4);
    let scene = block().prescribe(left(), 0, 0.1);
    let problem = scene.discretize(&Scheme::default().particles([5, 5])).unwrap();
    let state = problem.run().unwrap().last().clone();
    // Another function is another part, though both are written alike.
    let error = problem.reaction(&state, left()).unwrap_err().to_string();
    assert!(error.contains("Condition::named"), "{error}");
    // A condition without a name acts on a part with one.
    let error = refusal(&scene.name("top", (1, Side::Max)).hold("top").without("top"), &Scheme::default());
    assert!(matches!(error, Error::Boundary(BoundaryError::UnknownName { .. })), "{error}");
    assert!(!error.to_string().contains("acts on") && error.to_string().contains("Condition::named"), "{error}");
}

#[test]
fn causes_are_errors() {
    fn newton() -> Result<(), Box<dyn std::error::Error>> {
        let problem = block().discretize(&Scheme::default().particles([4, 3]))?;
        problem.equilibrium()?.solve(Rhs::Force(&[1.0]))?;
        Ok(())
    }
    assert!(newton().unwrap_err().is::<rkpm::error::Cause>());
}

#[cfg(feature = "fit")]
#[test]
fn a_weight_of_no_test_is_refused() {
    use rkpm::fit::TestData;
    use rkpm::material::Mode;
    let points = [[1.1, 0.1], [1.2, 0.2]];
    let early = TestData::default().weighted(Mode::Uniaxial, 2.0);
    assert!(matches!(early, Err(FitError::Unweighted { mode: "uniaxial" })), "{:?}", early.err());
    let late = TestData::default().with(Mode::Uniaxial, points).unwrap().weighted(Mode::Uniaxial, 2.0).unwrap();
    assert_eq!(late.tests()[0].weight, 2.0);
}

/// Its energy is the whole: a second volumetric one would make it many times as stiff.
#[cfg(feature = "fit")]
#[test]
fn a_foam_takes_no_bulk_modulus() {
    use rkpm::fit::{Fit, Law, TestData};
    use rkpm::material::{FoamTerm, Mode};
    let foam = Rubber::foam([FoamTerm { shear: 0.3, exponent: 3.5, poisson: 0.2 }]).unwrap();
    let points = [0.7, 0.85, 1.2, 1.5].map(|stretch| [stretch, Mode::Uniaxial.state(&foam, stretch).unwrap().stress]);
    let data = TestData::default().with(Mode::Uniaxial, points).unwrap();
    let report = Fit::new(Law::Foam(1)).allow_unstable().to(&data).unwrap();
    let refused = report.rubber(1e3).err().unwrap().to_string();
    assert!(report.compressible && refused.contains("Report::law"), "{refused}");
}

/// Results by a name have one meaning.
#[test]
fn names_of_rigid_bodies_and_of_named_places_are_no_others() {
    let plate = block().hold((1, Side::Min)).rigid("plate", (1, Side::Max));
    let down = |place: Place<2>| Condition::on(place).displacement([0.0, -0.1]);
    let error = refusal(&plate.with(down(Place::on((0, Side::Max))).named("plate")), &Scheme::default());
    assert!(matches!(error, Error::Boundary(BoundaryError::NameOfBody { .. })), "{error}");
    let low = block().name("low", (1, Side::Min)).hold((1, Side::Min));
    let error = refusal(&low.with(down(Place::on((1, Side::Max))).named("low")), &Scheme::default());
    assert!(matches!(error, Error::Boundary(BoundaryError::NameOfPart { .. })), "{error}");
}

/// A place by a name, and some of it, is the same place each time it is looked up.
#[test]
fn some_of_a_named_place_is_found_again() {
    let some = Place::from("top").within(|x: &Point<2>| x[0] > 0.9);
    let named = block().hold((1, Side::Min)).name("top", Place::on((1, Side::Max)).within(|x: &Point<2>| x[0] < 1.6));
    let scene = named.with(Condition::on(some.clone()).displacement([0.0, -0.1]));
    let problem = scene.discretize(&Scheme::default().particles([9, 5])).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    let force = problem.reaction(path.last(), some).unwrap()[1];
    assert!(force < 0.0);
    assert_eq!(force, problem.reaction(path.last(), "top").unwrap()[1]);
    assert_eq!(force, problem.reaction(path.last(), (1, Side::Max)).unwrap()[1]);
}

#[test]
fn settings_of_one_body_that_only_the_whole_can_have() {
    let blocks = || {
        Scene::assembly(PlaneStrain)
            .scheme_of("second", |scheme| scheme.particles([7, 5]))
            .body("first", Block::new([0.0, 0.0], [1.0, 1.0]), rubber())
            .body("second", Block::new([1.0, 0.0], [2.0, 1.0]), rubber())
            .hold(Place::on((1, Side::Min)).of("first"))
    };
    // A change that comes before its body is made all the same, and that of a body that never comes is refused.
    let scheme = Scheme::default().particles([5, 5]);
    let problem = blocks().discretize(&scheme).unwrap();
    assert_eq!(problem.discrete_bodies()[1].nodes().len(), 35);
    assert!(blocks().scheme_of("third", |scheme| scheme).discretize(&scheme).is_err());
    // A second change of a body leaves the first one as it is.
    let twice = blocks().scheme_of("second", |scheme| scheme.dilation(1.2)).discretize(&scheme).unwrap();
    assert_eq!(twice.discrete_bodies()[1].nodes().len(), 35);
    // A scheme in place of that of the scene has its defaults; what it sets itself would be dropped.
    let stepped = scheme.clone().stepping(Stepping { first: 0.5, ..Stepping::default() });
    let elements = blocks().scheme_of("first", |_| Scheme::elements(1).particles([5, 5]));
    assert!(elements.discretize(&stepped).is_ok());
    assert!(elements.discretize(&scheme.clone().dilation(1.2).kernel(WendlandC2)).is_ok());
    let own = blocks().scheme_of("first", |scheme| scheme.newton(Newton { iterations: 7, ..Newton::default() }));
    assert!(matches!(refusal(&own, &stepped), Error::Incompatible(_)));
    let zones = Scheme::elements(2).particles([5, 5]).pressure_field(PressureField::Linear, 2);
    assert!(matches!(refusal(&block(), &zones), Error::Incompatible(_)));
    let growing = block().with_expansion(Value::motion(|_: &Point<2>, load| 1.0 + 0.02 * load));
    assert!(matches!(refusal(&growing, &scheme), Error::Incompatible(_)));
}

/// A function of the load factor is asked for its values within the run alone, and may be steep at its start.
#[test]
fn functions_of_the_load_are_not_asked_beyond_it() {
    let root = Amplitude::Function(std::sync::Arc::new(|load: f64| {
        assert!((0.0..=1.0).contains(&load), "{load}");
        load.sqrt()
    }));
    let pressed = |amplitude: Amplitude| {
        let top = Load::traction((1, Side::Max), [0.0, -0.05]).amplitude(amplitude.clone());
        let side = Condition::on((0, Side::Max)).component(0, 0.05).amplitude(amplitude);
        block().hold((1, Side::Min)).with(top).with(side)
    };
    let energy = |scene: &Scene<2>| {
        let problem = scene.discretize(&Scheme::default().particles([9, 5])).unwrap();
        problem.energy(problem.run().unwrap().completed().unwrap().last()).unwrap()
    };
    let (found, expected) = (energy(&pressed(root)), energy(&pressed(Amplitude::Ramp)));
    assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
}

/// Beyond the stretch at which a law locks there is no state, and looking for one comes to an end.
#[test]
fn a_law_that_locks_has_no_state_beyond() {
    let gent = Rubber::gent(0.4, 8.0, 1e3).unwrap();
    assert!(rkpm::material::Mode::Uniaxial.state(&gent, 20.0).is_none());
    let sheet = Scene::new(Block::new([0.0, 0.0], [1.0, 1.0]), PlaneStress { thickness: 1.0 }, gent)
        .prescribe((1, Side::Min), 1, 0.0)
        .prescribe((1, Side::Max), 1, 0.0)
        .prescribe((0, Side::Min), 0, 0.0)
        .prescribe((0, Side::Max), 0, 5.0);
    let path = sheet.discretize(&Scheme::default().particles([4, 4])).unwrap().run().unwrap();
    assert!(path.last().load > 0.1 && path.completed().is_err());
}

#[test]
fn certificates_are_those_of_one_body() {
    let both = Scene::assembly(PlaneStrain).body("first", Block::new([0.0, 0.0], [1.0, 1.0]), rubber()).body(
        "second",
        Block::new([1.0, 0.0], [2.0, 1.0]),
        rubber(),
    );
    let scheme = Scheme::default().particles([4, 4]);
    let gradient = rkpm::nalgebra::Matrix2::new(0.1, 0.0, 0.0, 0.0);
    for error in [
        rkpm::check::spurious_modes(&both, &scheme).err(),
        rkpm::check::inf_sup(&both, &scheme).err(),
        rkpm::check::patch_test(&both, &gradient, &scheme).err(),
    ] {
        assert!(matches!(error, Some(Error::Incompatible(_))), "{error:?}");
    }
}
