//! Parts that begin inside each other.

use rkpm::Error;
use rkpm::prelude::*;
use rkpm::solve::EquilibriumPath;

const SHEAR: f64 = 0.5;
const BULK: f64 = 20.0;

fn rubber() -> Rubber {
    Rubber::neo_hookean(0.5 * SHEAR, BULK).unwrap()
}

fn solved(scene: &Scene<2>, scheme: &Scheme) -> (Problem<2>, EquilibriumPath) {
    let problem = scene.discretize(scheme).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    (problem, path)
}

/// Lamé's radial displacement per pressure at radius `a`, in plane strain: of a bush out to `b`, and inward of a solid shaft.
fn lame(a: f64, b: f64) -> [f64; 2] {
    let young = 9.0 * BULK * SHEAR / (3.0 * BULK + SHEAR);
    let nu = young / (2.0 * SHEAR) - 1.0;
    let factor = (1.0 + nu) / young * a;
    [factor * ((1.0 - 2.0 * nu) * a * a + b * b) / (b * b - a * a), factor * (1.0 - 2.0 * nu)]
}

fn quarter(name: &str, inner: f64, outer: f64) -> Region {
    let part = |what: &str| format!("{name} {what}");
    let outline = if inner > 0.0 {
        Outline::at([inner, 0.0])
            .line(&part("bottom"), [outer, 0.0])
            .arc(&part("rim"), [0.0, outer], [0.0, 0.0], Turn::Left)
            .line(&part("left"), [0.0, inner])
            .arc(&part("bore"), [inner, 0.0], [0.0, 0.0], Turn::Right)
    } else {
        Outline::at([0.0, 0.0])
            .line(&part("bottom"), [outer, 0.0])
            .arc(&part("rim"), [0.0, outer], [0.0, 0.0], Turn::Left)
            .line(&part("left"), [0.0, 0.0])
    };
    Region::new(outline).unwrap()
}

fn held(scene: Scene<2>, name: &str) -> Scene<2> {
    scene.prescribe(&*format!("{name} bottom"), 1, 0.0).prescribe(&*format!("{name} left"), 0, 0.0)
}

/// Mean of the pressures, weighted alike.
fn mean_pressure(problem: &Problem<2>, path: &EquilibriumPath) -> f64 {
    let fit = problem.contact(path.last(), "fit").unwrap();
    let pressures: Vec<f64> = fit.points.iter().filter(|p| p.is_active).map(|p| p.pressure).collect();
    pressures.iter().sum::<f64>() / pressures.len() as f64
}

/// Small interference: a bush that is shrunk on a shaft of rubber, and on a rigid one.
#[test]
fn lames_pressure() {
    let small = 1e-3;
    let scheme = Scheme::default().particles([14]);
    let [bush, shaft] = lame(1.0, 2.0);
    let both = Scene::assembly(PlaneStrain)
        .body("bush", quarter("bush", 1.0, 2.0), rubber())
        .body("shaft", quarter("shaft", 0.0, 1.0), rubber())
        .scheme_of("shaft", |scheme| scheme.particles([11]).seed(3));
    let pair = ContactPair::between("shaft rim", "bush bore", "fit").shrink_fit(small, 1.0);
    let rigid = RigidSurface::shaft([0.0, 0.0], 1.0).named("fit").shrink_fit(small, 1.0);
    let alone = held(Scene::new(quarter("bush", 1.0, 2.0), PlaneStrain, rubber()), "bush");
    let cases = [
        ("rubber", held(held(both, "bush"), "shaft").contact_pair(pair), bush + shaft),
        ("rigid", alone.contact("bush bore", rigid), bush),
    ];
    for (name, scene, compliance) in cases {
        let (problem, path) = solved(&scene, &scheme);
        let (found, expected) = (mean_pressure(&problem, &path), small / compliance);
        println!("{name}: {found:.6e} {expected:.6e}, off by {:.2e}", found / expected - 1.0);
        assert!((found / expected - 1.0).abs() < 5e-3, "{name}: {found} {expected}");
    }
}

/// A bush drawn a fifth less than its rigid shaft: its bore comes to lie on the shaft, whatever the stage; a shaft of rubber gives.
#[test]
fn large_interference_does_not_depend_on_the_stage() {
    let scene = |until: f64| {
        held(Scene::new(quarter("bush", 0.8, 2.0), PlaneStrain, rubber()), "bush")
            .contact("bush bore", RigidSurface::shaft([0.0, 0.0], 1.0).named("fit").interference(until))
    };
    let scheme = Scheme::default().particles([12]);
    let (problem, path) = solved(&scene(1.0), &scheme);
    let (other, later) = solved(&scene(0.3), &scheme);
    let (first, second) = (mean_pressure(&problem, &path), mean_pressure(&other, &later));
    assert!((first / second - 1.0).abs() < 1e-6, "{first} {second}");
    let fit = problem.contact(path.last(), "fit").unwrap();
    assert!(fit.points.iter().all(|p| p.is_active && p.gap.abs() < 1e-9), "{fit:?}");
    // The bore lies on the shaft on the mean.
    let off = fit.points.iter().map(|p| (p.position.norm() - 1.0).abs()).fold(0.0, f64::max);
    assert!(off < 5e-3, "{off}");
    // Two bodies, deep in each other.
    let pair = Scene::assembly(PlaneStrain)
        .body("bush", quarter("bush", 0.8, 2.0), rubber())
        .body("shaft", quarter("shaft", 0.0, 1.0), rubber())
        .press_fit("shaft rim", "bush bore", "fit");
    let (problem, path) = solved(&held(held(pair, "bush"), "shaft"), &scheme);
    let both = mean_pressure(&problem, &path);
    assert!(both < first && both > 0.5 * first, "{both} {first}");
}

/// Blocks between fixed ends that overlap: each gives by the half of it, with a uniform pressure.
#[test]
fn overlap_is_shared() {
    let overlap = 0.2;
    let (top, bottom, left) = ((1, Side::Max), (1, Side::Min), (0, Side::Min));
    let scene = Scene::assembly(PlaneStrain)
        .body("lower", Block::new([0.0, 0.0], [1.0, 1.0]), rubber())
        .body("upper", Block::new([0.0, 1.0 - overlap], [1.0, 2.0 - overlap]), rubber())
        .scheme_of("upper", |scheme| scheme.particles([7, 5]))
        .prescribe(Place::on(bottom).of("lower"), 1, 0.0)
        .prescribe(Place::on(left).of("lower"), 0, 0.0)
        .prescribe(Place::on(left).of("upper"), 0, 0.0)
        .prescribe(Place::on(top).of("upper"), 1, 0.0)
        .press_fit(Place::on(top).of("lower"), Place::on(bottom).of("upper"), "fit");
    let (problem, path) = solved(&scene, &Scheme::default().particles([5, 5]));
    for f in problem.deformation_gradients(path.last()).unwrap() {
        assert!((f[(1, 1)] - (1.0 - 0.5 * overlap)).abs() < 1e-8, "{f}");
    }
}

#[test]
fn stages_that_are_none() {
    let block = || Scene::new(Block::new([0.0, 0.0], [1.0, 1.0]), PlaneStrain, rubber());
    let refused = |scene: Scene<2>| scene.discretize(&Scheme::default().particles([4])).map(|_| ()).unwrap_err();
    let (top, bottom) = ((1, Side::Max), (1, Side::Min));
    for until in [0.0, -1.0, 2.0, f64::NAN] {
        let plane = RigidSurface::plane([0.0, 0.9], [0.0, -1.0]).interference(until);
        assert!(matches!(refused(block().contact(top, plane)), Error::Invalid(_)));
    }
    for amount in [0.0, -1.0, f64::NAN] {
        let pair = ContactPair::between(top, bottom, "fit").shrink_fit(amount, 1.0);
        assert!(matches!(refused(block().contact_pair(pair)), Error::Invalid(_)));
    }
    for friction in [-0.1, f64::NAN, f64::INFINITY] {
        let pair = ContactPair::between(top, bottom, "fit").friction(friction);
        assert!(matches!(refused(block().contact_pair(pair)), Error::Invalid(_)));
    }
    assert!(matches!(
        refused(block().contact_pair(ContactPair::itself(top, "fit").interference(1.0))),
        Error::Geometry(_)
    ));
}
