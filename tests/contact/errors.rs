//! Bad contacts are refused with what, where and what to do.

use approx::{abs_diff_eq, assert_abs_diff_eq};
use rkpm::Error;
use rkpm::contact::{ContactError, Profile, Surface, Triangulated};
use rkpm::error::{BoundaryError, GeometryError};
use rkpm::kinematics::Kinematics;
use rkpm::prelude::*;
use rkpm::scene::Stages;
use rkpm::solve::{Cause, Ending};

fn block() -> Scene<2> {
    Scene::new(Block::new([0.0, 0.0], [1.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3).unwrap())
}

fn refused(scene: Scene<2>) -> Error {
    match scene.discretize(&Scheme::default().particles([5])) {
        Err(error) => error,
        Ok(_) => panic!("taken"),
    }
}

#[test]
fn bodies_inside_a_surface_at_the_start() {
    let scene = block().hold((1, Side::Min)).contact((1, Side::Max), RigidSurface::shaft([0.5, 1.2], 0.3));
    match refused(scene) {
        Error::Contact(ContactError::Penetrates { depth, at, contact }) => {
            assert!(
                depth > 0.09 && depth < 0.1 && abs_diff_eq!(at[0], 0.5, epsilon = 0.1) && at[1] == 1.0,
                "{depth} {at:?}"
            );
            assert!(contact.contains("shaft"));
        }
        other => panic!("{other}"),
    }
}

/// A radial line is refused and pressed alike whatever the unit of length is.
#[test]
fn radial_lines_in_any_unit() {
    let line = |unit: f64| Scene::new(Block::new([6.0 * unit], [8.0 * unit]), RadialCylinder, rubber());
    let plate = |unit: f64, at: f64| RigidSurface::plane([at * unit], [-1.0]).named("plate");
    let scheme = Scheme::default().particles([9]);
    let pressure = |unit: f64| {
        match line(unit).contact(Side::Max, plate(unit, 7.9)).discretize(&scheme) {
            Err(Error::Contact(ContactError::Penetrates { depth, .. })) => {
                assert_abs_diff_eq!(depth / unit, 0.1, epsilon = 1e-9);
            }
            other => panic!("{unit}: {:?}", other.map(|_| ()).map_err(|error| error.to_string())),
        }
        let pressed = line(unit).contact(Side::Max, plate(unit, 8.0).moving([-0.1 * unit]));
        let problem = pressed.discretize(&scheme).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        problem.contact(path.last(), "plate").unwrap().peak_pressure()
    };
    let [expected, found] = [1.0, 1e-3].map(pressure);
    assert!(expected > 1e-3, "{expected}");
    assert_abs_diff_eq!(found / expected, 1.0, epsilon = 1e-8);
}

/// A contact that is new in a later stage, and in which the body has come to begin, is refused as one of a first stage is; not one that the body
/// has just come to.
#[test]
fn bodies_inside_a_contact_of_a_later_stage() {
    let scheme = Scheme::default().particles([5, 5]);
    let penetrates = |stages: Stages<2>, taken: bool| match stages.run(&scheme).map_err(Error::from) {
        Ok(_) => assert!(taken),
        Err(Error::Contact(ContactError::Penetrates { depth, .. })) => {
            assert!(!taken && abs_diff_eq!(depth, 0.1, epsilon = 1e-6), "{depth}");
        }
        Err(error) => panic!("{error}"),
    };
    let lifted = || block().with(Condition::on((1, Side::Min)).displacement([0.0, 0.1]));
    let lid = |at: f64| {
        move |scene: Scene<2>| scene.contact((1, Side::Max), RigidSurface::plane([0.0, at], [0.0, -1.0]).named("lid"))
    };
    penetrates(Stages::new("still", block().hold((1, Side::Min))).then("lid", lid(0.9)), false);
    penetrates(Stages::new("lifted", lifted()).then("lid", lid(1.0)), false);
    penetrates(Stages::new("lifted", lifted()).then("lid", lid(1.1)), true);
    let two = |down: f64| {
        let scene = Scene::assembly(PlaneStrain)
            .body("lower", Block::new([0.0, 0.0], [1.0, 1.0]), rubber())
            .body("upper", Block::new([0.0, 1.2], [1.0, 2.2]), rubber())
            .hold(Place::on((1, Side::Min)).of("lower"))
            .with(Condition::on(Place::on((1, Side::Max)).of("upper")).displacement([0.0, -down]));
        Stages::new("down", scene).then("joint", |scene| {
            scene.contact_between(Place::on((1, Side::Max)).of("lower"), Place::on((1, Side::Min)).of("upper"), "joint")
        })
    };
    penetrates(two(0.3), false);
    penetrates(two(0.2), true);
}

#[test]
fn surfaces_without_an_inside() {
    let flat = Profile::at([0.0, 2.0]).line([1.0, 2.0]).close();
    let error = refused(block().contact((1, Side::Max), RigidSurface::profile(flat)));
    assert!(
        matches!(&error, Error::Geometry(GeometryError::Shape { what, .. }) if what.contains("no inside")),
        "{error}"
    );
    let error = refused(block().contact((1, Side::Max), RigidSurface::shaft([0.5, 3.0], 0.0)));
    assert!(error.to_string().contains("radius"), "{error}");
    let error = refused(block().contact((1, Side::Max), RigidSurface::plane([0.5, 3.0], [0.0, 0.0])));
    assert!(error.to_string().contains("normal"), "{error}");
}

#[test]
fn friction_below_zero() {
    for value in [-0.1, f64::NAN, f64::INFINITY] {
        let error =
            refused(block().contact((1, Side::Max), RigidSurface::plane([0.0, 2.0], [0.0, -1.0]).friction(value)));
        assert!(matches!(error, Error::Invalid(_)), "{error}");
    }
}

#[test]
fn parts_and_names_that_do_not_exist() {
    let error = refused(block().contact("rim", RigidSurface::plane([0.0, 2.0], [0.0, -1.0])));
    assert!(error.to_string().contains("rim"), "{error}");
    let twice = block()
        .contact((1, Side::Max), RigidSurface::plane([0.0, 2.0], [0.0, -1.0]))
        .contact((1, Side::Min), RigidSurface::plane([0.0, -2.0], [0.0, 1.0]));
    assert!(matches!(refused(twice), Error::Contact(ContactError::Twice { .. })));
    let scene = block().contact((1, Side::Max), RigidSurface::plane([0.0, 2.0], [0.0, -1.0]).named("lid"));
    let problem = scene.discretize(&Scheme::default().particles([5])).unwrap();
    let error = problem.contact(&problem.at_rest(), "plate").unwrap_err();
    assert!(matches!(&error, Error::Contact(ContactError::Unknown { known, .. }) if known == "lid"), "{error}");
}

#[test]
fn surfaces_that_nothing_holds() {
    let surface = RigidSurface::plane([0.0, 2.0], [0.0, -1.0]).pushed([0.0, 0.0]);
    assert!(matches!(refused(block().contact((1, Side::Max), surface)), Error::Contact(ContactError::Unheld { .. })));
    // Pushed away from the body for ever: the run stalls and says so.
    let surface = RigidSurface::plane([0.0, 2.0], [0.0, -1.0]).pushed([0.0, 1.0]);
    let scene = block().hold((1, Side::Min)).contact((1, Side::Max), surface);
    let path = scene.discretize(&Scheme::default().particles([3])).unwrap().run().unwrap();
    assert!(matches!(path.ending, Ending::Stalled(_)), "{:?}", path.ending);
}

#[test]
fn motions_that_are_not_finite() {
    let surface = RigidSurface::plane([0.0, 2.0], [0.0, -1.0]).moving([0.0, f64::NAN]);
    let error = refused(block().contact((1, Side::Max), surface));
    assert!(matches!(error, Error::Invalid(_)), "{error}");
}

#[test]
fn open_profiles_that_are_passed_at_their_end() {
    let short = Profile::at([-1.0, 1.2]).line([0.8, 1.2]);
    let surface = RigidSurface::profile(short).moving([0.0, -0.3]).named("lid");
    let scene = block().hold((1, Side::Min)).contact((1, Side::Max), surface);
    let problem = scene.discretize(&Scheme::default().particles([7])).unwrap();
    // The run ends before the first step that would lie beyond the end, and keeps its path.
    let path = problem.run().unwrap();
    match &path.ending {
        Ending::Stalled(stalled) => {
            assert!(matches!(&stalled.cause, Cause::Refused(why) if why.contains("open end")), "{stalled}");
        }
        other => panic!("{other:?}"),
    }
    assert!(path.last().load > 0.5 && problem.contact(path.last(), "lid").is_ok(), "{}", path.last().load);
}

fn rubber() -> Rubber {
    Rubber::neo_hookean(0.5, 1e3).unwrap()
}

/// Two blocks that overlap along the last axis by more than contact looks for faces behind each other, and by less.
fn overlapping<const D: usize>(kinematics: impl Kinematics<D> + 'static, overlap: f64, fitted: bool) -> Scene<D> {
    let up = D - 1;
    let block = |low: f64| {
        let (mut min, mut max) = ([0.0; D], [1.0; D]);
        (min[up], max[up]) = (low, low + 1.0);
        Block::new(min, max)
    };
    let on = |side: Side, of: &str| Place::<D>::on((up, side)).of(of);
    let scene = Scene::assembly(kinematics)
        .body("lower", block(0.0), rubber())
        .body("upper", block(1.0 - overlap), rubber())
        .hold(on(Side::Min, "lower"))
        .hold(on(Side::Max, "upper"));
    let (first, second) = (on(Side::Max, "lower"), on(Side::Min, "upper"));
    if fitted { scene.press_fit(first, second, "fit") } else { scene.contact_between(first, second, "joint") }
}

/// Bodies that begin in each other without a stage that says so, be it by a part of a cell or by half of themselves; with one they are taken.
#[test]
fn bodies_inside_each_other_at_the_start() {
    fn check<const D: usize>(kinematics: impl Kinematics<D> + Clone + 'static) {
        let scheme = Scheme::default().particles([7]);
        for overlap in [0.02, 0.1, 0.3, 0.5] {
            let error = match overlapping(kinematics.clone(), overlap, false).discretize(&scheme) {
                Err(error) => error,
                Ok(_) => panic!("{overlap} taken"),
            };
            let expected = matches!(error, Error::Contact(ContactError::Penetrates { .. }))
                || matches!(error, Error::Boundary(BoundaryError::Overlap { .. }));
            assert!(expected, "{overlap}: {error}");
            assert!(overlapping(kinematics.clone(), overlap, true).discretize(&scheme).is_ok());
        }
        assert!(overlapping(kinematics, 0.0, false).discretize(&scheme).is_ok());
    }
    check(PlaneStrain);
    check(Solid);
    // A disc within a square: no face of one looks at one of the other.
    let square = Outline::at([0.0, 0.0]).line("rim", [4.0, 0.0]).line("rim", [4.0, 4.0]).line("rim", [0.0, 4.0]);
    let scene = Scene::assembly(PlaneStrain)
        .body("square", Region::new(square.close("rim")).unwrap(), rubber())
        .body("disc", Region::new(Outline::circle("edge", [2.0, 2.0], 0.5)).unwrap(), rubber())
        .hold("rim")
        .contact_between("rim", "edge", "joint");
    assert!(matches!(refused(scene), Error::Boundary(BoundaryError::Overlap { .. })));
}

#[test]
fn friction_between_bodies_below_zero() {
    for value in [-0.1, f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for pair in
            [ContactPair::between((1, Side::Max), (0, Side::Min), "joint"), ContactPair::itself((1, Side::Max), "fold")]
        {
            let error = refused(block().with(pair.friction(value)));
            assert!(matches!(error, Error::Invalid(_)), "{error}");
        }
    }
}

fn cube() -> Scene<3> {
    Scene::new(Block::new([0.0; 3], [1.0; 3]), Solid, rubber()).hold((2, Side::Min))
}

/// A sheet of two triangles about the axis of the cube, which looks down.
fn sheet(size: f64) -> Triangulated {
    let corner = |[x, y]: [f64; 2]| Point::<3>::new(0.5 - size * x, 0.5 + size * y, 1.1);
    let corners = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]].map(corner);
    Triangulated::new(corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]])
}

/// Tools in space that bound nothing.
#[test]
fn tools_without_extent() {
    let high = [0.5, 0.5, 3.0];
    let points = |last: f64| vec![[0.0, 0.0, 2.0].into(), [1.0, 0.0, 2.0].into(), [0.5 * last, last, 2.0].into()];
    let tools = [
        RigidSurface::sphere(high, 0.0),
        RigidSurface::sphere(high, f64::INFINITY),
        RigidSurface::cylinder(high, [0.0; 3], 1.0),
        RigidSurface::cylinder(high, [1.0, 0.0, 0.0], -1.0),
        RigidSurface::sleeve(high, [1.0, 0.0, 0.0], 0.0),
        RigidSurface::cone(high, [0.0, 0.0, 1.0], 0.0),
        RigidSurface::new(Triangulated::new(Vec::new(), Vec::new())),
        // A triangle without area, corners that do not exist, and two triangles back to back.
        RigidSurface::new(Triangulated::new(points(0.0), vec![[0, 1, 2]])),
        RigidSurface::new(Triangulated::new(points(1.0), vec![[0, 1, 3]])),
        RigidSurface::new(Triangulated::new(points(f64::NAN), vec![[0, 1, 2]])),
        RigidSurface::new(Triangulated::new(points(1.0), vec![[0, 1, 2], [0, 2, 1]])),
    ];
    for (number, tool) in tools.into_iter().enumerate() {
        match cube().contact((2, Side::Max), tool).discretize(&Scheme::default().particles([3])) {
            Err(Error::Invalid(_) | Error::Geometry(GeometryError::Shape { .. })) => {}
            Err(other) => panic!("{number}: {other}"),
            Ok(_) => panic!("{number}: taken"),
        }
    }
}

/// An open sheet presses as a plane does while the body stays under it; one that the body reaches beyond is refused, along borders and at their
/// corners.
#[test]
fn open_tools_in_space() {
    let run = |surface: RigidSurface<3>| {
        let scene = cube().contact((2, Side::Max), surface.moving([0.0, 0.0, -0.2]).named("lid"));
        let problem = scene.discretize(&Scheme::default().particles([4])).unwrap();
        let path = problem.run().unwrap();
        (problem, path)
    };
    let force = |surface: RigidSurface<3>| {
        let (problem, path) = run(surface);
        let path = path.completed().unwrap();
        assert!(path.iterations < 30, "{}", path.iterations);
        problem.contact(path.last(), "lid").unwrap().force[2]
    };
    let plane = force(RigidSurface::plane([0.5, 0.5, 1.1], [0.0, 0.0, -1.0]));
    assert_abs_diff_eq!(force(RigidSurface::new(sheet(3.0))) / plane, 1.0, epsilon = 1e-9);
    let (_, path) = run(RigidSurface::new(sheet(0.8)));
    match &path.ending {
        Ending::Stalled(stalled) => {
            assert!(matches!(&stalled.cause, Cause::Refused(why) if why.contains("open end")), "{stalled}");
        }
        other => panic!("{other:?}"),
    }
    for beyond in [[1.5, 0.6, 1.0], [1.5, 1.6, 1.0], [-0.5, 1.6, 1.2]] {
        assert!(sheet(1.0).nearest(&beyond.into()).passed_end, "{beyond:?}");
    }
    assert!(!sheet(1.0).nearest(&[0.7, 0.6, 1.0].into()).passed_end);
}

/// A part that two bodies have: one of them would not touch.
#[test]
fn parts_of_several_bodies() {
    let square = |x: f64| {
        let outline =
            Outline::at([x, 0.0]).line("low", [x + 1.0, 0.0]).line("right", [x + 1.0, 1.0]).line("top", [x, 1.0]);
        Region::new(outline.close("left")).unwrap()
    };
    let rubber = || Rubber::neo_hookean(0.5, 1e3).unwrap();
    let two = Scene::assembly(PlaneStrain)
        .body("near", square(0.0), rubber())
        .body("far", square(3.0), rubber())
        .body("tall", Block::new([5.0, 0.0], [6.0, 2.0]), rubber())
        .hold("low")
        .hold(Place::on((1, Side::Min)).of("tall"));
    let plate = || RigidSurface::plane([0.0, 1.0], [0.0, -1.0]).moving([0.0, -0.1]);
    for scene in [
        two.clone().contact("top", plate()),
        two.clone().contact_between("right", Place::on(Side::Min).of("tall"), "gap"),
    ] {
        match refused(scene) {
            Error::Boundary(BoundaryError::Ambiguous { known, .. }) => assert_eq!(known, "near; far"),
            other => panic!("{other}"),
        }
    }
    assert!(two.contact(Place::on("top").of("far"), plate()).discretize(&Scheme::default().particles([5])).is_ok());
}
