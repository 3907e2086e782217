//! What `check::scene` finds before a solve, and that it finds nothing where there is nothing.
#![cfg(feature = "solve")]

use std::sync::Arc;

use approx::abs_diff_eq;
use rkpm::cells::{BoundaryCells, Cells, Smoothing, Zones};
use rkpm::check::{self, Diagnosis};
use rkpm::error::{ApproximationError, BoundaryError, GeometryError};
use rkpm::prelude::*;
use rkpm::scene::{ConstraintKind, ConstraintMethod};

fn rubber() -> Rubber {
    Rubber::yeoh(0.373, -0.031, 0.005, 1e5).unwrap()
}

fn square() -> Scene<2> {
    Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber())
}

fn cube() -> Scene<3> {
    Scene::new(Block::new([0.0; 3], [1.0; 3]), Solid, rubber())
}

fn diagnose<const D: usize>(scene: &Scene<D>, scheme: &Scheme) -> Diagnosis {
    check::scene(scene, scheme).unwrap()
}

/// The laws that are broken, in the order of the report.
fn broken(diagnosis: &Diagnosis) -> Vec<&'static str> {
    diagnosis.report().violations().map(|finding| finding.law).collect()
}

#[test]
fn sound_scenes_have_no_findings() {
    let held = square().hold(Side::Min).prescribe(Side::Max, 0, 0.1);
    for scheme in
        [Scheme::default().particles([5, 5]), Scheme::default().particles([7, 6]).order(2), Scheme::elements(1)]
    {
        let diagnosis = diagnose(&held, &scheme);
        assert!(diagnosis.holds(), "{}", diagnosis.report());
    }
    let held = cube().hold(Side::Min).traction(Side::Max, [0.1, 0.0, 0.0]);
    let diagnosis = diagnose(&held, &Scheme::default().particles([4]));
    assert!(diagnosis.holds(), "{}", diagnosis.report());
    let tube = Scene::new(Block::new([6.0], [8.0]), RadialCylinder, rubber()).pressure(Side::Min, 0.1);
    let diagnosis = diagnose(&tube, &Scheme::default());
    // Hoops hold it: no condition is needed.
    assert!(diagnosis.holds(), "{}", diagnosis.report());
    assert_eq!((diagnosis.pressures, diagnosis.displacements), (8, 9));
}

#[test]
fn free_rigid_motions_are_counted_and_named() {
    let scheme = Scheme::default().particles([5, 4]);
    assert_eq!(diagnose(&square(), &scheme).free.len(), 3);
    assert_eq!(diagnose(&cube(), &Scheme::default().particles([3])).free.len(), 6);
    let ring = |inner: f64| Scene::new(Block::new([inner, 0.0], [inner + 1.0, 1.0]), Axisymmetric, rubber());
    // A far, thin ring resists a radial motion by little, and resists it.
    for inner in [0.0, 1.0, 1000.0] {
        let free = diagnose(&ring(inner), &scheme).free;
        assert_eq!(free.len(), 1, "{inner}: {free:?}");
        assert_eq!(free[0].to_string(), "a translation along axis 1");
    }
    // Pinned at one particle: it turns about it.
    let pinned = square().prescribe(Place::at([0.0, 0.0]), 0, 0.0).prescribe(Place::at([0.0, 0.0]), 1, 0.0);
    let free = diagnose(&pinned, &scheme).free;
    assert_eq!(free.len(), 1);
    let motion = |x: [f64; 2]| -> [f64; 2] {
        // Parts are relative to the largest displacement: rotations to that of the farthest particle.
        let arm = (1.0f64 + 0.25).sqrt();
        let (i, j, part) = free[0].rotations[0];
        let mut u = [free[0].translation[0], free[0].translation[1]];
        u[i] += part * (x[j] - free[0].centre[j]) / arm;
        u[j] -= part * (x[i] - free[0].centre[i]) / arm;
        u
    };
    // The pin of particle functions that do not interpolate is exact for rigid motions all the same.
    assert!(abs_diff_eq!(motion([0.0, 0.0])[..], [0.0; 2][..], epsilon = 1e-6), "{free:?}");
    assert!(motion([2.0, 1.0]).iter().any(|u| u.abs() > 0.5));
    // An end that may slide: free along the other axis, and not turning.
    let slides = diagnose(&square().prescribe(Side::Min, 0, 0.0), &scheme);
    assert_eq!(broken(&slides), ["no rigid motion is free"]);
    assert_eq!(slides.free[0].to_string(), "a translation along axis 1");
    // In 3D a held plane leaves two translations and the rotation in it.
    let sliding = diagnose(&cube().prescribe((2, Side::Min), 2, 0.0), &Scheme::default().particles([3]));
    let mut names: Vec<String> = sliding.free.iter().map(ToString::to_string).collect();
    names.sort();
    assert_eq!(
        names,
        ["a rotation in the plane of axes 0 and 1", "a translation along axis 0", "a translation along axis 1"]
    );
}

/// Plates without friction hold a body between them across, not along; friction, a corner or a round tool do. What nothing but contact
/// holds is looked at body by body, and a round body that could roll is held by the run itself.
#[test]
fn bodies_that_contact_lets_slide_are_named() {
    let scheme = Scheme::default().particles([7, 5]);
    let between = |friction: f64| {
        let floor = RigidSurface::plane([0.0, 0.0], [0.0, 1.0]).friction(friction).named("floor");
        let lid = RigidSurface::plane([0.0, 1.0], [0.0, -1.0]).moving([0.0, -0.1]).named("lid");
        square().contact((1, Side::Min), floor).contact((1, Side::Max), lid)
    };
    let sliding = diagnose(&between(0.0), &scheme);
    assert_eq!(broken(&sliding), ["no rigid motion is free"]);
    let names: Vec<String> = sliding.free.iter().map(ToString::to_string).collect();
    assert_eq!(names, ["a translation along axis 0"]);
    let text = sliding.to_string();
    assert!(text.contains("translation along axis 0") && text.contains("friction"), "{text}");
    assert_eq!(text, sliding.report().to_string());
    let wall =
        |scene: Scene<2>| scene.contact((0, Side::Min), RigidSurface::plane([0.0, 0.0], [1.0, 0.0]).named("wall"));
    let pushed = |scene: Scene<2>| {
        scene.contact((0, Side::Max), RigidSurface::plane([2.0, 0.0], [-1.0, 0.0]).pushed([-1.0, 0.0]).named("pushed"))
    };
    for held in
        [between(0.3), wall(between(0.0)), pushed(wall(between(0.0))), between(0.0).prescribe((1, Side::Max), 0, 0.0)]
    {
        let diagnosis = diagnose(&held, &scheme);
        assert!(diagnosis.holds(), "{diagnosis}");
    }
    // A surface that is pushed gives way along its own way.
    assert_eq!(diagnose(&pushed(between(0.0)), &scheme).free.len(), 1);
    let roller = RigidSurface::shaft([1.0, 2.0], 1.0).moving([0.0, -0.1]);
    let rolled = square().prescribe((1, Side::Min), 1, 0.0).contact((1, Side::Max), roller);
    assert!(diagnose(&rolled, &scheme).holds());
    let on = |friction: f64| {
        Scene::assembly(PlaneStrain)
            .body("lower", Block::new([0.0, 0.0], [2.0, 1.0]), rubber())
            .body("upper", Block::new([0.5, 1.0], [1.5, 2.0]), rubber())
            .hold(Place::on((1, Side::Min)).of("lower"))
            .contact(
                Place::on((1, Side::Max)).of("upper"),
                RigidSurface::plane([0.0, 2.0], [0.0, -1.0]).moving([0.0, -0.1]),
            )
            .with(
                ContactPair::between(
                    Place::on((1, Side::Max)).of("lower"),
                    Place::on((1, Side::Min)).of("upper"),
                    "joint",
                )
                .friction(friction),
            )
    };
    let free: Vec<String> = diagnose(&on(0.0), &scheme).free.iter().map(ToString::to_string).collect();
    assert_eq!(free, ["a translation along axis 0 of upper"]);
    assert!(diagnose(&on(0.3), &scheme).holds());
    let ring = Region::with_holes(Outline::circle("rim", [0.0, 0.0], 0.2), [Outline::circle("bore", [0.0, 0.0], 0.12)]);
    let plate = |y: f64, up: f64| RigidSurface::plane([0.0, y], [0.0, up]);
    let ring = Scene::new(ring.unwrap(), PlaneStrain, rubber())
        .contact("rim", plate(-0.2, 1.0).named("floor"))
        .contact("rim", plate(0.2, -1.0).moving([0.0, -0.04]).named("top"));
    let free = diagnose(&ring, &Scheme::default().particles([12])).free;
    assert_eq!(free.iter().map(ToString::to_string).collect::<Vec<_>>(), ["a translation along axis 0"]);
}

#[test]
fn all_conflicts_are_named_at_once() {
    let scheme = Scheme::default().particles([5, 4]).constraint_kind(ConstraintKind::AtParticles);
    let scene = square()
        .hold(Side::Min)
        .prescribe(Side::Min, 0, 0.3)
        .prescribe(Place::at([0.6, 0.3]), 1, 0.1)
        .prescribe(Place::at([0.0, 1.0]), 1, 0.2);
    let diagnosis = diagnose(&scene, &scheme);
    assert_eq!(broken(&diagnosis), ["conditions agree and select something"]);
    assert_eq!(diagnosis.refused.len(), 3, "{:?}", diagnosis.refused);
    assert!(matches!(diagnosis.refused[0], Error::Boundary(BoundaryError::Conflict { component: 0, .. })));
    assert!(matches!(diagnosis.refused[1], Error::Boundary(BoundaryError::Empty { .. })));
    assert!(matches!(diagnosis.refused[2], Error::Boundary(BoundaryError::Conflict { component: 1, .. })));
    // Where discretize stops at the first.
    assert_eq!(scene.discretize(&scheme).err().unwrap().to_string(), diagnosis.refused[0].to_string());
    assert!(diagnosis.report().to_string().contains("u_0 on face (0, Min)"));
}

#[test]
fn dependent_rows_are_found_and_not_counted() {
    // Values at all particles leave nothing to say over a face; cells whose faces list their particles say so at once.
    let lattice = Block::new([0.0, 0.0], [2.0, 1.0]).lattice([4, 3]).unwrap();
    let positions = lattice.positions().to_vec();
    let cells = Arc::new(Gapped { lattice, edge: f64::INFINITY, lists: false });
    let at_all =
        |scene: Scene<2>| positions.iter().fold(scene, |scene, x| scene.prescribe(Place::at([x[0], x[1]]), 0, 0.0));
    let known = diagnose(&at_all(square()).hold(Side::Min), &Scheme::default().particles([4, 3]));
    assert!(known.holds() && known.dependent.is_empty(), "{}", known.report());
    let scene = at_all(Scene::new(Geometry::cells(cells), PlaneStrain, rubber())).hold(Side::Min);
    for constraint_method in [ConstraintMethod::Transformation, ConstraintMethod::Multipliers] {
        let scheme = Scheme::default().particles([4, 3]).constraint_method(constraint_method);
        let diagnosis = diagnose(&scene, &scheme);
        assert_eq!(broken(&diagnosis), ["rows are independent"], "{}", diagnosis.report());
        assert_eq!(diagnosis.dependent.len(), 3);
        assert_eq!(diagnosis.displacements, 12 - 3);
        assert!(
            matches!(diagnosis.dependent[0], BoundaryError::Dependent { equation: 12, .. }),
            "{:?}",
            diagnosis.dependent
        );
        // What the run would stop at, one by one.
        let refusal = scene.discretize(&scheme).unwrap().run().unwrap_err();
        assert!(matches!(refusal, Error::Boundary(BoundaryError::Dependent { .. })), "{refusal}");
    }
}

#[test]
fn schemes_that_lock_have_too_many_pressures() {
    let scene = square().hold(Side::Min);
    let locking = diagnose(&scene, &Scheme::paper(1.0).particles([9, 5]));
    assert_eq!(broken(&locking), ["pressures leave displacements their freedom"]);
    // 4 × 4 points in each of 32 cells.
    assert_eq!((locking.pressures, locking.displacements), (512, 90 - 10));
    assert_eq!(locking.most_pressures, 0.5);
}

/// A lattice whose particles beyond `edge` along axis 0 have supports too small to meet, and whose faces may keep their
/// particles to themselves.
struct Gapped {
    lattice: Lattice<2>,
    edge: f64,
    lists: bool,
}

impl Cells<2> for Gapped {
    fn positions(&self) -> &[Point<2>] {
        self.lattice.positions()
    }
    fn cell_count(&self) -> usize {
        self.lattice.cell_count()
    }
    fn corners(&self, cell: usize) -> Vec<usize> {
        Cells::corners(&self.lattice, cell)
    }
    fn local_spacing(&self, particle: usize) -> f64 {
        Cells::local_spacing(&self.lattice, particle)
    }
    fn particles(&self, r: f64) -> Result<Particles<2>, ApproximationError> {
        let whole = self.lattice.particles(r)?;
        let supports = whole.positions().iter().zip(whole.supports());
        let supports =
            supports.map(|(x, s)| if x[0] > self.edge { Support::Box(s.half_widths() * 0.1) } else { *s }).collect();
        Particles::new(whole.positions().to_vec(), supports)
    }
    fn particles_global(&self, r: f64) -> Result<Particles<2>, ApproximationError> {
        self.particles(r)
    }
    fn is_thin(&self) -> bool {
        self.lattice.is_thin()
    }
    fn zones(&self, size: usize) -> Zones {
        self.lattice.zones(size)
    }
    fn gauss_in(&self, n: usize, zones: &Zones) -> Result<Points<2>, GeometryError> {
        self.lattice.gauss_in(n, zones)
    }
    fn smoothing(&self, parts: usize, gauss: usize, zones: &Zones) -> Result<Smoothing<2>, GeometryError> {
        self.lattice.smoothing(parts, gauss, zones)
    }
    fn nodal_cells(&self, gauss: usize) -> Result<Smoothing<2>, GeometryError> {
        self.lattice.nodal_cells(gauss)
    }
    fn boundary_pieces(&self, part: &Part, parts: usize, gauss: usize) -> Result<Vec<BoundaryCells<2>>, GeometryError> {
        self.lattice.boundary_pieces(part, parts, gauss)
    }
    // On a lattice supports are taken as they are given.
    fn lattice(&self) -> Option<&Lattice<2>> {
        Some(&self.lattice)
    }
    fn boundary(&self, part: &Part, parts: usize, gauss: usize) -> Result<BoundaryCells<2>, GeometryError> {
        self.lattice.boundary(part, parts, gauss)
    }
    fn boundary_nodes(&self, part: &Part) -> Result<Vec<usize>, GeometryError> {
        if self.lists { self.lattice.boundary_nodes(part) } else { Ok(Vec::new()) }
    }
    fn contains(&self, at: &Point<2>) -> bool {
        self.lattice.contains(at)
    }
}

#[test]
fn uncovered_regions_are_bounded() {
    let lattice = Block::new([0.0, 0.0], [8.0, 2.0]).lattice([9, 3]).unwrap();
    let cells = Arc::new(Gapped { lattice, edge: 5.5, lists: true });
    let scene = Scene::new(Geometry::cells(cells), PlaneStrain, rubber()).hold(Side::Min);
    let diagnosis = diagnose(&scene, &Scheme::default());
    assert_eq!(broken(&diagnosis), ["particles cover the body"]);
    let [region] = diagnosis.uncovered.as_slice() else { panic!("{:?}", diagnosis.uncovered) };
    // Particles at 6 and beyond reach 0.2 far; those at 5 reach to 7, but lie on one line. The first points sampled
    // beyond the particles at 6 lie 0.069 of a cell away.
    assert!(abs_diff_eq!(region.bounds[0][0], 6.0694, epsilon = 1e-4), "{region:?}");
    assert_eq!(region.bounds[1], [8.0, 2.0]);
    assert!(region.cells.iter().all(|c| c % 8 >= 6) && region.cells.contains(&7) && region.cells.contains(&15));
    assert_eq!(diagnosis.cover.as_ref().map(|c| c.rcond), Some(0.0));
    assert!(matches!(scene.discretize(&Scheme::default()), Err(Error::Approximation(_))));
    // A quadratic basis on supports for a linear one: one region that spreads over most of the body.
    let square = square().hold(Side::Min);
    let diagnosis = diagnose(&square, &Scheme::default().particles([5, 4]).order(2).dilation(0.7));
    assert_eq!(diagnosis.uncovered.len(), 1);
    assert!(diagnosis.uncovered[0].cells.len() > 6, "{:?}", diagnosis.uncovered);
}

#[test]
fn badly_conditioned_moments_are_found_before_they_are_refused() {
    // Narrow supports of a linear basis: the second layer of particles barely reaches the first.
    let scheme = |r: f64| Scheme::default().particles([5, 5]).dilation(r).rcond_limit(1e-12);
    let scene = square().hold(Side::Min);
    let narrow = diagnose(&scene, &scheme(0.504));
    let cover = narrow.cover.as_ref().unwrap();
    assert!(cover.rcond < 1e-6 && cover.rcond > 0.0, "{cover:?}");
    assert_eq!(broken(&narrow), ["moment matrices are well conditioned"]);
    assert!(diagnose(&scene, &scheme(0.7)).holds());
}

#[test]
fn what_cannot_be_placed_at_all_is_an_error() {
    let nowhere = Scene::new(Block::new([0.0, 0.0], [0.0, 1.0]), PlaneStrain, rubber());
    assert!(matches!(check::scene(&nowhere, &Scheme::default()), Err(Error::Geometry(_))));
    let nan = square().traction(Side::Max, [f64::NAN, 0.0]);
    assert!(matches!(check::scene(&nan, &Scheme::default()), Err(Error::Boundary(_))));
}

/// A material of one's own that can't be split is integrated as it is: stiff against changes of volume it locks.
#[test]
fn stiff_materials_that_cannot_be_split_are_found() {
    struct Whole(Rubber);
    impl Material for Whole {
        fn energy_from(&self, f: &rkpm::nalgebra::Matrix3<f64>, _: rkpm::material::Past<'_>) -> f64 {
            self.0.energy(f)
        }
        fn response_from(
            &self,
            f: &rkpm::nalgebra::Matrix3<f64>,
            _: rkpm::material::Past<'_>,
        ) -> rkpm::material::Response {
            self.0.response(f)
        }
    }
    for (bulk, sound) in [(5.0, true), (1e3, false)] {
        let rubber = Whole(Rubber::neo_hookean(0.5, bulk).unwrap());
        let scene = Scene::new(Block::new([0.0, 0.0], [1.0, 1.0]), PlaneStrain, rubber).hold((0, Side::Min));
        let diagnosis = check::scene(&scene, &Scheme::default().particles([7])).unwrap();
        assert_eq!(diagnosis.holds(), sound, "{}", diagnosis.report());
    }
}

#[test]
fn one_cell_through_a_thin_body_is_said() {
    let beam = Scene::new(Block::new([0.0, 0.0], [20.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3).unwrap())
        .hold((0, Side::Min));
    let said = |across: usize| {
        let diagnosis = diagnose(&beam, &Scheme::default().particles([21, across]));
        assert!(diagnosis.holds());
        let report = diagnosis.report().to_string();
        assert_eq!(report.contains("bending"), diagnosis.thin);
        diagnosis.thin
    };
    assert!(said(2) && !said(3));
}

#[test]
fn settings_without_effect_are_found() {
    use rkpm::material::{Prony, Viscoelastic};
    let scheme = Scheme::default().particles([9, 7]);
    let seconds = || Amplitude::table(vec![(0.0, 0.0), (2.0, 1.0), (20.0, 1.0)]).unwrap();
    let relaxing =
        Viscoelastic::new(Rubber::neo_hookean(0.5, 1e3).unwrap(), Prony::of_instantaneous([(0.4, 2.0)]).unwrap());
    let pad = |amplitude: Amplitude| {
        Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, relaxing.clone())
            .hold((1, Side::Min))
            .with(Condition::on((1, Side::Max)).displacement([0.2, 0.0]).amplitude(amplitude))
    };
    let found = diagnose(&pad(seconds()), &scheme).without_effect;
    assert_eq!(found.len(), 2, "{found:?}");
    assert!(found[0].contains("goes on to 20") && found[1].contains("Scene::over_time"), "{found:?}");
    assert!(diagnose(&pad(Amplitude::Ramp).over_time(20.0), &scheme).holds());
    // Surfaces and loads follow tables too.
    let plate = RigidSurface::plane([0.0, 1.0], [0.0, -1.0]).moving_along([0.0, -0.1], seconds()).named("plate");
    let pressed = square().hold((1, Side::Min)).contact((1, Side::Max), plate);
    let found = diagnose(&pressed, &scheme);
    assert_eq!(broken(&found), ["settings have an effect"]);
    assert!(found.without_effect[0].contains("`plate`"), "{:?}", found.without_effect);
    let pulled = square().hold((1, Side::Min)).with(Load::traction((1, Side::Max), [0.0, 0.1]).amplitude(seconds()));
    assert_eq!(broken(&diagnose(&pulled, &scheme)), ["settings have an effect"]);
}
