//! Bad contacts are refused with what, where and what to do.

use rkpm::Error;
use rkpm::contact::{ContactError, Profile};
use rkpm::error::GeometryError;
use rkpm::prelude::*;
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
            assert!(depth > 0.09 && depth < 0.1 && (at[0] - 0.5).abs() < 0.1 && at[1] == 1.0, "{depth} {at:?}");
            assert!(contact.contains("shaft"));
        }
        other => panic!("{other}"),
    }
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
