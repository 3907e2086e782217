//! Several bodies: bonded where they share faces, each with its own particles, material and approximation.

use std::sync::Arc;

use approx::{abs_diff_eq, assert_abs_diff_eq};
use nalgebra::SMatrix;
use rkpm::error::BoundaryError;
use rkpm::prelude::*;
use rkpm::scene::Rule;

/// k/µ = 5/3.
fn soft() -> Rubber {
    Rubber::neo_hookean(0.5, 5.0 / 3.0).unwrap()
}

fn stiff() -> Rubber {
    Rubber::neo_hookean(10.0, 100.0 / 3.0).unwrap()
}

/// Schemes of the two sides: matching or not, particles and finite elements side by side.
fn sides<const D: usize>() -> Vec<[Scheme; 2]> {
    // In one dimension the default rule is Gauss's, which no patch test passes with these functions: averages do.
    let rule = if D == 1 { Rule::Smoothed { parts: 2 } } else { Rule::Auto };
    let rk = |count: usize| Scheme::default().particles([count]).rule(rule.clone());
    let q1 = |count: usize| Scheme::elements(1).particles([count]);
    let q2 = |count: usize| Scheme::elements(2).particles([count]);
    match D {
        1 => vec![[rk(5), rk(5)], [rk(4), rk(9)], [q2(5), rk(7)], [q1(5), q2(5)]],
        2 => vec![
            [rk(5), rk(5)],
            [rk(4), rk(8)],
            [rk(9), rk(6)],
            [rk(5).seeded(3), rk(7).seeded(4)],
            [rk(5), q2(9)],
            [q1(8), rk(5)],
            [q1(4), q2(7)],
        ],
        _ => vec![[rk(4), rk(4)], [rk(4), rk(6)], [rk(4), q2(7)]],
    }
}

trait Seeded {
    fn seeded(self, seed: u64) -> Self;
}

impl Seeded for Scheme {
    fn seeded(self, seed: u64) -> Self {
        self.layout(Layout::Jittered { amount: 0.2, seed })
    }
}

/// Two blocks side by side along axis 0 under one homogeneous deformation, prescribed on all outer faces.
fn patch<const D: usize>(
    kinematics: impl Kinematics<D> + 'static,
    start: f64,
    gradient: SMatrix<f64, D, D>,
    [left, right]: &[Scheme; 2],
) -> f64 {
    let (mut low, mut middle, mut high) = ([0.0; D], [1.0; D], [1.0; D]);
    (low[0], middle[0], high[0]) = (start, start + 1.0, start + 1.8);
    let mut second = low;
    second[0] = start + 1.0;
    let (of_left, of_right) = (left.clone(), right.clone());
    let mut scene = Scene::assembly(kinematics)
        .body("left", Block::new(low, middle), soft())
        .body("right", Block::new(second, high), soft())
        .scheme_of("left", move |_| of_left.clone())
        .scheme_of("right", move |_| of_right.clone());
    for body in ["left", "right"] {
        for axis in 0..D {
            for side in [Side::Min, Side::Max] {
                if axis == 0 && (side == Side::Max) == (body == "left") {
                    continue;
                }
                let field = Value::field(move |x: &Point<D>| (gradient * x).into());
                scene = scene.with(Condition::on(Place::on((axis, side)).of(body)).displacement(field));
            }
        }
    }
    let mut problem = scene.discretize(&Scheme::default()).unwrap();
    // What Newton's method leaves is not the question.
    problem.analysis_mut().newton.tolerance = 1e-13;
    let path = problem.run().unwrap().completed().unwrap();
    let (mut error, mut size) = (0.0f64, 0.0f64);
    for (x, u) in problem.positions().iter().zip(problem.particle_displacements(path.last()).unwrap()) {
        error = error.max((u - gradient * x).norm());
        size = size.max((gradient * x).norm());
    }
    error / size
}

#[test]
fn homogeneous_deformations_pass_across_interfaces() {
    let mut worst = Vec::new();
    for schemes in sides::<1>() {
        worst.push(patch(RadialCylinder, 0.5, SMatrix::<f64, 1, 1>::new(0.2), &schemes));
    }
    println!("1D {worst:?}");
    let in_line = std::mem::take(&mut worst);
    for schemes in sides::<2>() {
        let gradient = SMatrix::<f64, 2, 2>::new(0.2, 0.15, -0.1, -0.12);
        worst.push(patch(PlaneStrain, 0.0, gradient, &schemes));
    }
    println!("plane {worst:?}");
    let in_plane = std::mem::take(&mut worst);
    for schemes in sides::<3>() {
        let gradient = SMatrix::<f64, 3, 3>::new(0.1, 0.1, 0.0, -0.1, 0.05, 0.07, 0.03, 0.0, -0.1);
        worst.push(patch(Solid, 0.0, gradient, &schemes));
    }
    println!("space {worst:?}");
    for errors in [&in_line, &in_plane, &worst] {
        assert!(errors.iter().all(|error| *error <= 1e-11), "{in_line:?} {in_plane:?} {worst:?}");
    }
}

/// In one dimension the default rule is Gauss's, which integrates these functions nearly: a bond adds nothing to what the rule
/// leaves in one body alone.
#[test]
fn in_line_bonds_leave_what_the_rule_leaves_in_one_body() {
    for counts in [[5, 5], [4, 9], [7, 6]] {
        let schemes = counts.map(|count| Scheme::default().particles([count]));
        let bonded = patch(RadialCylinder, 0.5, SMatrix::<f64, 1, 1>::new(0.2), &schemes);
        let alone = |start: f64, end: f64, count: usize| {
            let scene = Scene::new(Block::new([start], [end]), RadialCylinder, soft())
                .prescribe(Side::Min, 0, 0.2 * start)
                .prescribe(Side::Max, 0, 0.2 * end);
            let problem = scene.discretize(&Scheme::default().particles([count])).unwrap();
            let path = problem.run().unwrap().completed().unwrap();
            let particles = problem.positions().into_iter().zip(problem.particle_displacements(path.last()).unwrap());
            particles.map(|(x, u)| (u[0] - 0.2 * x[0]).abs()).fold(0.0, f64::max) / (0.2 * 2.3)
        };
        let single = alone(0.5, 1.5, counts[0]).max(alone(1.5, 2.3, counts[1]));
        println!("{counts:?}: bonded {bonded:.1e}, alone {single:.1e}");
        assert!(bonded <= 2.0 * single, "{counts:?}: {bonded} {single}");
    }
}

/// Error of the displacement beside a kink.
const KINK: f64 = 1e-9;

/// Layers pressed across have the same stress and a jump of the strain at their interface, which stays sharp: the
/// displacement there is that of two springs, and straight between.
#[test]
fn kinks_stay_sharp() {
    for [below, above] in sides::<2>() {
        let (of_below, of_above) = (below.clone(), above.clone());
        let mut scene = Scene::assembly(PlaneStrain)
            .body("soft", Block::new([0.0, 0.0], [1.0, 1.0]), soft())
            .body("stiff", Block::new([0.0, 1.0], [1.0, 2.0]), stiff())
            .scheme_of("soft", move |_| of_below.clone())
            .scheme_of("stiff", move |_| of_above.clone())
            .prescribe(Place::on((1, Side::Min)).of("soft"), 1, 0.0)
            .with(Condition::on(Place::on((1, Side::Max)).of("stiff")).component(1, -0.3).named("press"));
        for body in ["soft", "stiff"] {
            for side in [Side::Min, Side::Max] {
                scene = scene.prescribe(Place::on((0, side)).of(body), 0, 0.0);
            }
        }
        let mut problem = scene.discretize(&Scheme::default()).unwrap();
        problem.analysis_mut().newton.tolerance = 1e-12;
        let path = problem.run().unwrap().completed().unwrap();
        let stress = |rubber: &Rubber, stretch: f64| {
            let f = nalgebra::Matrix3::from_diagonal(&nalgebra::Vector3::new(1.0, stretch, 1.0));
            rubber.response(&f).stress[(1, 1)]
        };
        // Bisection for the stretch of the soft layer.
        let (mut low, mut high) = (0.6, 1.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            let other = 1.7 - middle;
            if stress(&soft(), middle) < stress(&stiff(), other) { low = middle } else { high = middle }
        }
        let force = problem.reaction(path.last(), "press").unwrap();
        assert_abs_diff_eq!(force[1] / stress(&soft(), low), 1.0, epsilon = KINK);
        for y in [0.3, 0.5, 0.9, 1.0, 1.05, 1.4] {
            let exact = if y <= 1.0 { (low - 1.0) * y } else { -0.3 + (0.7 - low) * (y - 2.0) };
            let found = problem.displacement(path.last(), &[0.4, y].into()).unwrap();
            assert!(abs_diff_eq!(found, Point::<2>::new(0.0, exact), epsilon = 0.5 * KINK), "{y}: {found} {exact}");
        }
        let bond = problem.reaction(path.last(), "bond of soft and stiff").unwrap();
        assert_abs_diff_eq!(bond, force, epsilon = 0.5 * KINK);
        let all = problem.deformation_gradients(path.last()).unwrap();
        for (_, f) in problem.points().zip(all).filter(|(x, _)| x[1] > 1.0) {
            assert_abs_diff_eq!(f[(1, 1)], 1.7 - low, epsilon = KINK);
        }
    }
}

/// Four blocks around a point, of any particles: bonds own the point once.
#[test]
fn bodies_meet_at_a_point() {
    let gradient = SMatrix::<f64, 2, 2>::new(0.2, 0.15, -0.1, -0.12);
    for counts in [[5, 5, 5, 5], [4, 5, 7, 6], [7, 4, 5, 9], [5, 7, 4, 6]] {
        let mut scene = Scene::assembly(PlaneStrain);
        for (number, count) in counts.into_iter().enumerate() {
            let corner = [(number % 2) as f64, (number / 2) as f64];
            let name = format!("block {number}");
            scene = scene.body(&*name, Block::new(corner, corner.map(|c| c + 1.0)), soft());
            scene = scene.scheme_of(&name, move |scheme| scheme.particles([count]));
            for (axis, upper) in [(0, number % 2), (1, number / 2)] {
                let side = if upper == 1 { Side::Max } else { Side::Min };
                let field = Value::field(move |x: &Point<2>| (gradient * x).into());
                scene = scene.with(Condition::on(Place::on((axis, side)).of(&*name)).displacement(field));
            }
        }
        let problem = scene.discretize(&Scheme::default()).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        for (x, u) in problem.positions().iter().zip(problem.particle_displacements(path.last()).unwrap()) {
            assert!(abs_diff_eq!(u, gradient * x, epsilon = 5e-12), "{counts:?} {x} {u}");
        }
    }
}

/// A small block on a larger one: the interface is the smaller face, whoever is coarser, and forces pass whole.
#[test]
fn faces_need_not_end_together() {
    for counts in [[9, 5], [5, 9], [6, 7]] {
        let scene = Scene::assembly(PlaneStrain)
            .body("base", Block::new([0.0, 0.0], [3.0, 1.0]), soft())
            .body("stud", Block::new([1.1, 1.0], [1.9, 2.0]), stiff())
            .scheme_of("base", move |scheme| scheme.particles([counts[0]]))
            .scheme_of("stud", move |scheme| scheme.particles([counts[1]]))
            .name("ground", Place::on((1, Side::Min)).of("base"))
            .hold("ground")
            .with(Condition::on(Place::on((1, Side::Max)).of("stud")).displacement([0.1, 0.0]).named("push"));
        let problem = scene.discretize(&Scheme::default()).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        let of = |name: &str| problem.reaction(path.last(), name).unwrap();
        let moment = |name: &str| problem.moment(path.last(), name, [0.0, 0.0]).unwrap()[2];
        assert!(of("push")[0] > 0.01);
        assert_abs_diff_eq!(of("push"), -of("ground"), epsilon = 5e-9 * of("push").norm());
        assert_abs_diff_eq!(
            of("push"),
            problem.reaction(path.last(), "bond of base and stud").unwrap(),
            epsilon = 5e-9
        );
        assert_abs_diff_eq!(moment("push"), -moment("ground"), epsilon = 1e-8 * moment("push").abs());
        // Apart they don't push each other.
        let apart = scene.clone().unbonded("stud", "base").discretize(&Scheme::default()).unwrap();
        let alone = apart.run().unwrap().completed().unwrap();
        assert_abs_diff_eq!(apart.reaction(alone.last(), "push").unwrap(), Point::<2>::zeros(), epsilon = 5e-10);
        assert!(apart.reaction(alone.last(), "bond of base and stud").is_err());
        let bonded = rkpm::check::scene(&scene, &Scheme::default()).unwrap();
        assert!(bonded.free.is_empty() && bonded.dependent.is_empty(), "{:?}", bonded.report());
    }
}

#[test]
fn faces_say_of_which_body_they_are() {
    let scene = || {
        Scene::assembly(PlaneStrain).body("a", Block::new([0.0, 0.0], [1.0, 1.0]), soft()).body(
            "b",
            Block::new([1.0, 0.0], [2.0, 1.0]),
            soft(),
        )
    };
    let refused = |scene: Scene<2>| scene.discretize(&Scheme::default().particles([4])).err().unwrap().to_string();
    assert!(refused(scene().hold(Side::Min)).contains("name the body by Place::of. The bodies are: a; b"));
    assert!(refused(scene().hold(Place::on(Side::Min).of("c"))).contains("no body is named \"c\"; there are: a; b"));
    assert!(refused(scene().scheme_of("c", |scheme| scheme)).contains("no body is named \"c\""));
    assert!(refused(scene().unbonded("a", "d")).contains("no body is named \"d\""));
    assert!(
        refused(scene().body("a", Block::new([5.0, 0.0], [6.0, 1.0]), soft())).contains("two bodies have the name a")
    );
    assert!(refused(scene().hold("rim")).contains("rim"));
    assert!(Scene::<2>::assembly(PlaneStrain).discretize(&Scheme::default()).is_err());
}

/// Stretch of the bore and energy of a thick incompressible tube of two neo-Hookean layers under a pressure, by
/// quadrature of $p = \int \mu(\lambda^2 - \lambda^{-2})\,R\,/r^2\,\mathrm dR$ with $r^2 = R^2 + c$.
fn layered_tube(radii: [f64; 3], shear: [f64; 2], pressure: f64) -> [f64; 2] {
    let integrate = |c: f64| {
        let (mut pressure, mut energy) = (0.0, 0.0);
        for layer in 0..2 {
            let n = 20_000;
            let width = (radii[layer + 1] - radii[layer]) / n as f64;
            for k in 0..n {
                let big = radii[layer] + (k as f64 + 0.5) * width;
                let square = big * big + c;
                let stretch = square / (big * big);
                pressure += shear[layer] * (stretch - 1.0 / stretch) * big / square * width;
                energy +=
                    0.5 * shear[layer] * (stretch + 1.0 / stretch - 2.0) * 2.0 * std::f64::consts::PI * big * width;
            }
        }
        (pressure, energy)
    };
    let (mut low, mut high) = (0.0, 10.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if integrate(middle).0 < pressure { low = middle } else { high = middle }
    }
    [(radii[0] * radii[0] + low).sqrt() - radii[0], integrate(low).1]
}

const RADII: [f64; 3] = [1.0, 1.5, 2.0];

/// Displacement of the bore and energy of the full turn per unit length, with `n` particles across each layer.
fn tube_in_line(n: usize, pressure: f64) -> [f64; 2] {
    let [soft, stiff] = [0.5, 10.0].map(|a10| Rubber::neo_hookean(a10, 4e4 * a10).unwrap());
    let scene = Scene::assembly(RadialCylinder)
        .body("inner", Block::new([RADII[0]], [RADII[1]]), soft)
        .body("outer", Block::new([RADII[1]], [RADII[2]]), stiff)
        .pressure(Place::on(Side::Min).of("inner"), pressure);
    let problem = scene.discretize(&Scheme::default().particles([n])).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    [problem.displacement(path.last(), &[RADII[0]].into()).unwrap()[0], problem.energy(path.last()).unwrap()]
}

/// The same of a quarter in the plane or, between two planes a tenth apart, in space.
fn quarter<const D: usize>(
    kinematics: impl Kinematics<D> + 'static,
    n: usize,
    around: [usize; 2],
    pressure: f64,
) -> [f64; 2] {
    let [soft, stiff] = [0.5, 10.0].map(|a10| Rubber::neo_hookean(a10, 4e4 * a10).unwrap());
    let height = 0.1;
    let ring = |inner: f64, outer: f64| {
        Mapped(move |unit: &Point<D>| {
            let (radius, angle) = (inner + (outer - inner) * unit[0], std::f64::consts::FRAC_PI_2 * unit[1]);
            Point::<D>::from_fn(|i, _| match i {
                0 => radius * angle.cos(),
                1 => radius * angle.sin(),
                _ => height * unit[2],
            })
        })
    };
    let mut scene = Scene::assembly(kinematics)
        .body("inner", ring(RADII[0], RADII[1]), soft)
        .body("outer", ring(RADII[1], RADII[2]), stiff)
        .pressure(Place::on(Side::Min).of("inner"), pressure);
    for (body, around) in ["inner", "outer"].into_iter().zip(around) {
        let mut counts = vec![n, around];
        counts.resize(D, 3);
        scene = scene.scheme_of(body, move |scheme| scheme.particles(counts.clone()));
        scene = scene.prescribe(Place::on((1, Side::Min)).of(body), 1, 0.0).prescribe(
            Place::on((1, Side::Max)).of(body),
            0,
            0.0,
        );
        if D == 3 {
            scene = scene.prescribe(Place::on((2, Side::Min)).of(body), 2, 0.0).prescribe(
                Place::on((2, Side::Max)).of(body),
                2,
                0.0,
            );
        }
    }
    let problem = scene.discretize(&Scheme::default()).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    let at = Point::<D>::from_fn(|i, _| if i == 0 { RADII[0] } else { 0.0 });
    let bore = problem.displacement(path.last(), &at).unwrap()[0];
    [bore, 4.0 * problem.energy(path.last()).unwrap() / if D == 3 { height } else { 1.0 }]
}

#[test]
fn a_tube_of_two_layers_meets_its_closed_form() {
    let pressure = 1.0;
    let exact = layered_tube(RADII, [1.0, 20.0], pressure);
    let off = |found: [f64; 2]| [found[0] / exact[0] - 1.0, found[1] / exact[1] - 1.0];
    for (n, allowed) in [(5, 0.01), (9, 0.003)] {
        let found = [
            off(tube_in_line(n, pressure)),
            off(quarter::<2>(PlaneStrain, n, [2 * n - 1; 2], pressure)),
            off(quarter::<3>(Solid, n, [2 * n - 1; 2], pressure)),
        ];
        println!("{n} + {n} across: {found:?}");
        assert!(found.iter().flatten().all(|error| error.abs() < allowed), "{n}: {found:?}");
    }
    // Facets on one side that are eight times as long. Between coarse functions on the stiff side the soft one bulges.
    for (around, allowed) in [([7, 49], 0.01), ([49, 7], 0.08)] {
        let found = off(quarter::<2>(PlaneStrain, 5, around, pressure));
        println!("{around:?} around: {found:?}");
        assert!(found.iter().all(|error| error.abs() < allowed), "{around:?}: {found:?}");
    }
}

/// Faces that are shared and can't be bonded are refused; bodies that touch at an edge or a corner, or gape from there, are not bonded.
#[test]
fn faces_too_unlike_to_be_bonded_are_refused() {
    fn bonds<const D: usize>(scene: &Scene<D>) -> Result<bool, BoundaryError> {
        match scene.discretize(&Scheme::default()) {
            Ok(problem) => Ok(problem.reaction(&problem.at_rest(), "bond of base and other").is_ok()),
            Err(Error::Boundary(error)) => Err(error),
            Err(error) => panic!("{error}"),
        }
    }
    fn two<const D: usize>(
        kinematics: impl Kinematics<D> + 'static,
        [base, other]: [(Geometry<D>, Vec<usize>); 2],
    ) -> Scene<D> {
        Scene::assembly(kinematics)
            .body("base", base.0, soft())
            .body("other", other.0, soft())
            .scheme_of("base", move |scheme| scheme.particles(base.1.clone()))
            .scheme_of("other", move |scheme| scheme.particles(other.1.clone()))
    }
    let base = |counts: [usize; 2]| (Geometry::from(Block::new([0.0, 0.0], [9.0, 1.0])), counts.to_vec());
    let plane =
        |low: [f64; 2], high: [f64; 2], counts: [usize; 2]| (Geometry::from(Block::new(low, high)), counts.to_vec());
    // A stud within one facet of its base.
    let stud = || plane([3.5, 1.0], [4.2, 2.0], [4, 4]);
    assert_eq!(bonds(&two(PlaneStrain, [base([4, 3]), stud()]).unbonded("base", "other")), Ok(false));
    assert_eq!(bonds(&two(PlaneStrain, [base([4, 3]), stud()])), Ok(true));
    assert_eq!(bonds(&two(PlaneStrain, [base([37, 3]), stud()])), Ok(true));
    // One facet of a quarter turn on many short ones.
    let ring = |inner: f64, around: usize| {
        let ring = Mapped(move |unit: &Point<2>| {
            let (sin, cos) = (std::f64::consts::FRAC_PI_2 * unit[1]).sin_cos();
            Point::<2>::new(cos, sin) * (inner + unit[0])
        });
        (Geometry::from(ring), vec![5, around])
    };
    let refused = bonds(&two(PlaneStrain, [ring(1.0, 2), ring(2.0, 33)])).unwrap_err();
    assert!(matches!(refused, BoundaryError::Unmatched { .. }), "{refused}");
    // At a corner, on a corner that gapes, and along an edge.
    assert_eq!(bonds(&two(PlaneStrain, [base([37, 5]), plane([9.0, 1.0], [12.0, 2.0], [3, 3])])), Ok(false));
    let gaping = Quadrilateral { corners: [[4.0, 1.0], [7.0, 1.9], [7.0, 2.9], [4.0, 2.0]] };
    assert_eq!(bonds(&two(PlaneStrain, [base([91, 3]), (Geometry::from(gaping), vec![4, 3])])), Ok(false));
    let space = |low: [f64; 3], high: [f64; 3], n: usize| (Geometry::from(Block::new(low, high)), vec![n]);
    let [fine, coarse] = [space([0.0; 3], [1.0; 3], 7), space([1.0, 0.0, 1.0], [3.0, 1.0, 2.0], 3)];
    assert_eq!(bonds(&two(Solid, [fine, coarse])), Ok(false));
}

/// A stud whose face ends within facets of its base, moved aside and down: the whole face is bonded, however coarse the base is. What is
/// left is the error of the base.
#[test]
fn a_stud_is_bonded_with_its_whole_face() {
    fn force<const D: usize>(
        kinematics: impl Kinematics<D> + 'static,
        blocks: [Block<D>; 2],
        counts: [usize; 2],
    ) -> f64 {
        let [base, stud] = blocks;
        let scene = Scene::assembly(kinematics)
            .body("base", base, soft())
            .body("stud", stud, soft())
            .scheme_of("base", move |scheme| scheme.spacing(6.0 / (counts[0] - 1) as f64))
            .scheme_of("stud", move |scheme| scheme.spacing(2.0 / (counts[1] - 1) as f64))
            .hold(Place::on((D - 1, Side::Min)).of("base"));
        let (mut way, top) = ([0.0; D], Place::on((D - 1, Side::Max)).of("stud"));
        (way[0], way[D - 1]) = (0.1, -0.1);
        let scene = scene.with(Condition::on(top).displacement(way).named("moved"));
        let problem = scene.discretize(&Scheme::default()).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        problem.reaction(path.last(), "moved").unwrap()[D - 1]
    }
    let plane = |counts| {
        let stud = Block::new([2.13, 2.0], [4.13, 3.0]);
        force(PlaneStrain, [Block::new([0.0, 0.0], [6.0, 2.0]), stud], counts)
    };
    let space = |counts| {
        let stud = Block::new([2.1, 2.2, 1.0], [4.1, 4.2, 2.0]);
        force(Solid, [Block::new([0.0; 3], [6.0, 6.0, 1.0]), stud], counts)
    };
    // Both blocks stand out beyond the other one.
    let aside = |counts| {
        let upper = Block::new([2.1, 1.2, 1.0], [6.1, 5.2, 2.0]);
        force(Solid, [Block::new([0.0; 3], [4.0, 4.0, 1.0]), upper], counts)
    };
    let fine = [plane([61, 21]), space([13, 5])];
    let off = aside([9, 5]) / aside([17, 7]) - 1.0;
    println!("aside: {off:.4}");
    assert!(off.abs() < 0.06, "{off}");
    for counts in [[7, 9], [7, 17], [13, 9], [31, 5]] {
        let off = plane(counts) / fine[0] - 1.0;
        println!("in the plane, {counts:?}: {off:.4}");
        assert!(off.abs() < 0.03, "{counts:?}: {off}");
    }
    for counts in [[5, 5], [7, 5], [7, 3]] {
        let off = space(counts) / fine[1] - 1.0;
        println!("in space, {counts:?}: {off:.4}");
        assert!(off.abs() < 0.05, "{counts:?}: {off}");
    }
}

/// What `within` selects on one of the bodies that have a part is enough; on none of them it is refused, on the whole body too.
#[test]
fn selections_are_those_of_all_bodies() {
    let rectangle = |from: f64, to: f64| {
        let outline =
            Outline::at([from, 0.0]).line("low", [to, 0.0]).line("right", [to, 1.0]).line("high", [from, 1.0]);
        Region::new(outline.close("left")).unwrap()
    };
    let scheme = Scheme::default().spacing(0.25);
    let bodies = || {
        let both = Scene::assembly(PlaneStrain).body("one", rectangle(0.0, 2.0), soft());
        both.body("two", rectangle(3.0, 4.0), soft()).hold("low")
    };
    let near = |x: &Point<2>| x[0] < 1.2;
    let moved = |place: Place<2>| Condition::on(place).displacement([0.1, 0.0]);
    let energy = |of: &dyn Fn(Place<2>) -> Place<2>| {
        let scene = bodies().with(moved(of("high".into()).within(near)));
        let scene = scene.with(Load::force(of("left".into()).within(|x| x[0] < 1.0), [0.01, 0.0]));
        let problem = scene.discretize(&scheme).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        problem.energy(path.last()).unwrap()
    };
    let (all, one) = (energy(&|place| place), energy(&|place| place.of("one")));
    assert!(all > 1e-3);
    assert_abs_diff_eq!(all / one, 1.0, epsilon = 1e-12);
    let nowhere = |place: Place<2>| place.within(|x| x[0] > 9.0);
    for place in [Place::from("high"), Place::body(), Place::body().of("two")].map(nowhere) {
        let error = bodies().with(moved(place.clone())).discretize(&scheme).err().unwrap();
        assert!(matches!(error, Error::Boundary(BoundaryError::Empty { .. })), "{error}");
        assert_eq!(rkpm::check::scene(&bodies().with(moved(place.clone())), &scheme).unwrap().refused.len(), 1);
        let error = bodies().with(Load::force(place, [0.1, 0.0])).discretize(&scheme).err().unwrap();
        assert!(matches!(error, Error::Boundary(BoundaryError::NoFacet { .. })), "{error}");
    }
}

/// A point of several bodies is refused unless they are bonded there.
#[test]
fn points_say_of_which_body_they_are() {
    let scheme = Scheme::default().particles([5, 5]);
    let two = |low: [f64; 2]| {
        Scene::assembly(PlaneStrain)
            .body("a", Block::new([0.0, 0.0], [1.0, 1.0]), soft())
            .body("b", Block::new(low, low.map(|x| x + 1.0)), soft())
            .hold(Place::on(Side::Min).of("a"))
            .hold(Place::on(Side::Max).of("b"))
    };
    let at = || Place::at([1.0, 1.0]);
    let push = |place: Place<2>| Load::force(place, [0.0, 0.1]);
    let held = |place: Place<2>| Condition::on(place).component(1, 0.1);
    let ambiguous = |scene: Scene<2>| match scene.discretize(&scheme) {
        Ok(_) => false,
        Err(Error::Boundary(BoundaryError::Ambiguous { known, .. })) => known == "a; b",
        Err(error) => panic!("{error}"),
    };
    // Side by side, side by side and apart, and at a corner alone.
    for (scene, bonded) in
        [(two([1.0, 0.0]), true), (two([1.0, 0.0]).unbonded("a", "b"), false), (two([1.0, 1.0]), false)]
    {
        assert_eq!(ambiguous(scene.clone().with(push(at()))), !bonded);
        assert_eq!(ambiguous(scene.clone().with(held(at()))), !bonded);
        assert!(!ambiguous(scene.clone().with(push(at().of("b"))).with(held(at().of("a")))));
    }
}

/// A soft pad bonded between plates a hundred times as stiff, pressed and sheared: beside elements of the same bodies.
#[test]
fn a_pad_between_stiff_plates_is_as_stiff_as_elements_say() {
    let force = |scheme: Scheme, [along, across]: [usize; 2]| {
        let rubber = |shear: f64| Rubber::neo_hookean(0.5 * shear, 1e3 * shear).unwrap();
        let mut scene = Scene::assembly(PlaneStrain);
        for (name, low, high, shear) in
            [("pad", 0.25, 1.25, 1.0), ("below", 0.0, 0.25, 100.0), ("above", 1.25, 1.5, 100.0)]
        {
            let own = if name == "pad" { across } else { 3 };
            scene = scene.body(name, Block::new([0.0, low], [4.0, high]), rubber(shear));
            scene = scene.scheme_of(name, move |scheme| scheme.particles([along, own]));
        }
        let scene = scene
            .hold(Place::on((1, Side::Min)).of("below"))
            .with(Condition::on(Place::on((1, Side::Max)).of("above")).displacement([0.2, -0.1]).named("plate"));
        let problem = scene.discretize(&scheme).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        problem.reaction(path.last(), "plate").unwrap()
    };
    let exact = force(Scheme::elements(2), [65, 17]);
    for counts in [[17, 5], [33, 9]] {
        let found = force(Scheme::default(), counts);
        println!("{counts:?}: {found} {exact}");
        assert!((0..2).all(|i| abs_diff_eq!(found[i] / exact[i], 1.0, epsilon = 0.01)), "{counts:?}: {found} {exact}");
    }
}

/// A condition on the parts of a name of all bodies has the same force on each as a condition of that body's own.
#[test]
fn reactions_of_one_body_by_conditions_on_all() {
    let rectangle = |from: f64, to: f64| {
        let outline =
            Outline::at([from, 0.0]).line("low", [to, 0.0]).line("right", [to, 1.0]).line("high", [from, 1.0]);
        Region::new(outline.close("left")).unwrap()
    };
    let bodies = || {
        Scene::assembly(PlaneStrain).body("one", rectangle(0.0, 2.0), soft()).body("two", rectangle(3.0, 4.0), stiff())
    };
    let down = |place: Place<2>| Condition::on(place).displacement([0.05, -0.1]);
    let all = bodies().hold("low").with(down(Place::from("high")).named("push"));
    let mut each = bodies();
    for body in ["one", "two"] {
        each = each.hold(Place::from("low").of(body)).with(down(Place::from("high").of(body)));
    }
    let solved = |scene: Scene<2>| {
        let problem = scene.discretize(&Scheme::default().spacing(0.25)).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        (path.last().clone(), problem)
    };
    let ((state, problem), (other, apart)) = (solved(all), solved(each));
    let about = [0.5, 0.25];
    for (spot, part) in [("push", "high"), ("low", "low")] {
        let mut sum = Point::<2>::zeros();
        for body in ["one", "two"] {
            let [place, same] = [spot, part].map(|name| Place::from(name).of(body));
            let force = problem.reaction(&state, place.clone()).unwrap();
            assert_abs_diff_eq!(force, apart.reaction(&other, same.clone()).unwrap(), epsilon = 1e-9);
            let turns = [problem.moment(&state, place, about), apart.moment(&other, same, about)];
            let [turn, expected] = turns.map(|moment| moment.unwrap()[2]);
            assert_abs_diff_eq!(turn, expected, epsilon = 1e-9);
            sum += force;
        }
        assert_abs_diff_eq!(sum, problem.reaction(&state, spot).unwrap(), epsilon = 1e-12);
        assert!(sum.norm() > 0.1);
    }
    assert!(problem.reaction(&state, Place::from("low").of("three")).is_err());
}

/// A point belongs to the body that it lies in, not to a coarser one whose margin reaches there: a thin layer slides on a block, both of
/// which are drawn, or are given as cells.
#[test]
fn points_near_an_interface_belong_to_the_body_that_they_lie_in() {
    let (block, layer) = (Block::new([0.0, 0.0], [20.0, 20.0]), Block::new([0.0, 20.0], [20.0, 21.0]));
    let cells = |block: &Block<2>, counts: [usize; 2]| Geometry::cells(Arc::new(block.lattice(counts).unwrap()));
    let drawn = Scene::assembly(PlaneStrain).body("block", block, soft()).body("layer", layer, soft());
    let drawn = drawn
        .scheme_of("block", |scheme| scheme.particles([5, 5]))
        .scheme_of("layer", |scheme| scheme.particles([21, 5]));
    let given = Scene::assembly(PlaneStrain).body("block", cells(&block, [5, 5]), soft()).body(
        "layer",
        cells(&layer, [21, 5]),
        soft(),
    );
    for scene in [drawn, given] {
        let moved = |side| Condition::on(Place::from((1, side)).of("layer")).displacement([1.0, 0.0]);
        let scene = scene
            .unbonded("block", "layer")
            .hold(Place::from((1, Side::Min)).of("block"))
            .with(moved(Side::Max))
            .with(moved(Side::Min));
        let problem = scene.discretize(&Scheme::default()).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        for y in [20.1, 20.3, 20.49] {
            let found = problem.displacement(path.last(), &[10.0, y].into()).unwrap();
            assert_abs_diff_eq!(found[0], 1.0, epsilon = 1e-9);
            assert_abs_diff_eq!(problem.stress(path.last(), &[10.0, y].into()).unwrap().norm(), 0.0, epsilon = 1e-9);
        }
        assert_abs_diff_eq!(problem.displacement(path.last(), &[10.0, 19.9].into()).unwrap()[0], 0.0, epsilon = 1e-9);
    }
}

/// Bodies that touch along inclined or curved faces do not overlap, however much finer one of them is.
#[test]
fn bodies_that_touch_do_not_overlap() {
    for angle in [0.0f64, 0.52, 2.0] {
        let (sin, cos) = angle.sin_cos();
        let turned = move |x: f64, y: f64| Point::<2>::new(cos * x - sin * y, sin * x + cos * y);
        let plate = Mapped(move |u: &Point<2>| turned(8.0 * u[0], 8.0 * u[1]));
        let rubber = Mapped(move |u: &Point<2>| turned(8.0 * u[0], 8.0 + u[1]));
        let scene = Scene::assembly(PlaneStrain).body("rubber", rubber, soft()).body("plate", plate, stiff());
        let scene = scene.hold(Place::from((1, Side::Min)).of("plate"));
        scene.discretize(&Scheme::default().particles([5, 5])).unwrap();
    }
}
