//! Walls have particles enough across them, or are refused.

use approx::assert_abs_diff_eq;
use rkpm::check;
use rkpm::error::{Error, GeometryError};
use rkpm::prelude::*;
use rkpm::solve::DoubtCause;

fn rubber() -> Rubber {
    Rubber::neo_hookean(0.5, 1e3).unwrap()
}

fn energy<const D: usize>(scene: &Scene<D>, scheme: &Scheme) -> Result<f64, Error> {
    let problem = scene.discretize(scheme)?;
    let path = problem.run()?.completed()?;
    problem.energy(path.last())
}

/// A block with names for the ends of an axis, as a closed surface.
fn solid(sides: [f64; 3], axis: usize) -> Solid3 {
    let along: [f64; 3] = std::array::from_fn(|i| if i == axis { 1.0 } else { 0.0 });
    let far = along.map(|n| n * sides[axis]);
    let block = Shape::block([0.0; 3], sides).solid(0.5).unwrap();
    let low = Select::plane([0.0; 3], along.map(|n| -n));
    block.name("low", low).unwrap().name("high", Select::plane(far, along)).unwrap()
}

/// A plate of 3 by 3 by 1, bonded on both faces and pressed.
fn pressed(plate: impl Into<Geometry<3>>, low: Place<3>, high: Place<3>) -> Scene<3> {
    let press = Condition::on(high).displacement([0.0, 0.0, -0.005]);
    Scene::new(plate, Solid, rubber()).hold(low).with(press)
}

/// Reference: quadratic elements with linear pressures, four of them through the thickness.
#[test]
fn a_bonded_plate_of_one_spacing_gets_particles_inside() {
    let faces = [(2, Side::Min), (2, Side::Max)];
    let block = || pressed(Block::new([0.0; 3], [3.0, 3.0, 1.0]), faces[0].into(), faces[1].into());
    let reference = energy(&block(), &Scheme::elements(2).particles([17, 17, 9])).unwrap();
    let scene = pressed(solid([3.0, 3.0, 1.0], 2), "low".into(), "high".into());
    let scheme = Scheme::default().spacing(1.0);
    let error = energy(&scene, &scheme).unwrap() / reference - 1.0;
    println!("{error:+.3}");
    assert!(error.abs() < 0.05, "{error}");
    assert!(check::scene(&scene, &scheme).unwrap().refused.is_empty());
    // One cell across is no choice of a spacing, neither of a block.
    assert!(block().discretize(&scheme).is_ok());
}

/// A strip of 4 by 1, fixed at one end, the other one moved across: in the plane and as a slice of the same between fixed planes.
/// Reference: quadratic elements with linear pressures, 16 of them through the thickness.
#[test]
fn a_strip_of_one_spacing_bends() {
    let block = || Block::new([0.0, 0.0], [4.0, 1.0]);
    let moved = |scene: Scene<2>, [low, high]: [Place<2>; 2]| {
        scene.hold(low).with(Condition::on(high).displacement([0.0, 0.02]))
    };
    let ends = || [(0, Side::Min).into(), (0, Side::Max).into()];
    let plane = moved(Scene::new(block(), PlaneStrain, rubber()), ends());
    let reference = energy(&plane, &Scheme::elements(2).particles([65, 33])).unwrap();
    let outline = Outline::at([0.0, 0.0]).line("low side", [4.0, 0.0]).line("high", [4.0, 1.0]);
    let region = Region::new(outline.line("high side", [0.0, 1.0]).close("low")).unwrap();
    let region = moved(Scene::new(region, PlaneStrain, rubber()), ["low".into(), "high".into()]);
    let slice = solid([4.0, 1.0, 3.0], 0);
    let sides = [([0.0; 3], -1.0), ([0.0, 0.0, 3.0], 1.0)].map(|(at, n)| Select::plane(at, [0.0, 0.0, n]));
    let slice =
        sides.into_iter().zip(["front", "back"]).fold(slice, |slice, (side, name)| slice.name(name, side).unwrap());
    let slice = Scene::new(&slice, Solid, rubber())
        .hold("low")
        .with(Condition::on("high").displacement([0.0, 0.02, 0.0]))
        .prescribe("front", 2, 0.0)
        .prescribe("back", 2, 0.0);
    let scheme = Scheme::default().spacing(1.0);
    let found = [("region", energy(&region, &scheme).unwrap()), ("surface", energy(&slice, &scheme).unwrap() / 3.0)];
    for (name, found) in found {
        let error = found / reference - 1.0;
        println!("{name}: {error:+.3}");
        assert!(error.abs() < 0.05, "{name} {error}");
    }
    // What is allowed is what it was: one spacing across does not bend.
    let allowed = energy(&region, &scheme.thin_walls()).unwrap() / reference - 1.0;
    assert!(allowed > 1.0, "{allowed}");
}

/// Counts of a block are taken as they are: where no displacement is free the error says where, how thick, and what would do.
#[test]
fn a_bonded_block_of_one_cell_is_refused() {
    let scene = pressed(Block::new([0.0; 3], [3.0, 3.0, 1.0]), (2, Side::Min).into(), (2, Side::Max).into());
    let scheme = Scheme::default().particles([4, 4, 2]);
    let error = scene.discretize(&scheme).map(|_| ()).unwrap_err();
    let Error::Geometry(GeometryError::LockedWall { at, thickness, spacing, .. }) = error else { panic!("{error}") };
    assert_abs_diff_eq!(thickness, 1.0, epsilon = 1e-9);
    assert_abs_diff_eq!(at[2], 0.5, epsilon = 1e-9);
    assert_abs_diff_eq!(spacing, 0.5, epsilon = 1e-9);
    assert!(matches!(
        check::scene(&scene, &scheme).unwrap().refused[..],
        [Error::Geometry(GeometryError::LockedWall { .. })]
    ));
    assert!(scene.discretize(&scheme.thin_walls()).is_ok());
}

/// What cannot be refined enough is an error with the place, the thickness and a spacing that does.
#[test]
fn walls_much_thinner_than_a_spacing_are_refused() {
    let outline = Outline::at([0.0, 0.0]).line("low side", [9.0, 0.0]).line("high", [9.0, 0.1]);
    let region = Region::new(outline.line("high side", [0.0, 0.1]).close("low")).unwrap();
    let scene = Scene::new(region, PlaneStrain, rubber()).hold("low").prescribe("high", 1, 0.01);
    let error = scene.discretize(&Scheme::default().spacing(1.0)).map(|_| ()).unwrap_err();
    let Error::Geometry(GeometryError::WallAcross { thickness, needed, .. }) = error else { panic!("{error}") };
    assert_abs_diff_eq!(thickness, 0.1, epsilon = 1e-9);
    // Six spacings of 1/32 of what is asked for.
    assert_abs_diff_eq!(needed, 0.1 * 32.0 / 6.0, epsilon = 1e-9);
    assert!(scene.discretize(&Scheme::default().spacing(needed)).is_ok());
}

/// Walls whose refinement takes ten thousand particles more than asked for are left, and the answer says so.
#[test]
fn wide_thin_walls_are_left_and_told() {
    let outline = Outline::at([0.0, 0.0]).line("low side", [600.0, 0.0]).line("high", [600.0, 1.0]);
    let region = Region::new(outline.line("high side", [0.0, 1.0]).close("low")).unwrap();
    let strip = Scene::new(region, PlaneStrain, rubber()).hold("low").prescribe("high", 0, 1.0);
    told(&strip, 1_300);
    let plate = solid([40.0, 40.0, 1.0], 0);
    let plate = Scene::new(&plate, Solid, rubber()).hold("low").prescribe("high", 0, 0.1);
    told(&plate, 6_000);
}

fn told<const D: usize>(scene: &Scene<D>, most: usize) {
    let scheme = Scheme::default().spacing(1.0);
    let problem = scene.discretize(&scheme).unwrap();
    let particles = problem.cells().positions().len();
    assert!(particles < most, "{particles}");
    let path = problem.run().unwrap().reached().unwrap();
    let doubts = problem.verdict(&path).unwrap();
    assert!(doubts.iter().any(|doubt| matches!(doubt.cause, DoubtCause::ThinWall { .. })), "{doubts:?}");
    let found = check::scene(scene, &scheme).unwrap();
    assert!(matches!(found.thin_walls[..], [GeometryError::ThinLeft { .. }]), "{:?}", found.thin_walls);
    assert!(!found.holds());
    let meant = scene.discretize(&scheme.thin_walls()).unwrap();
    assert!(meant.cells().left_thin().is_none());
    assert_eq!(meant.cells().positions().len(), particles);
}
