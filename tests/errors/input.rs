//! Bad input: each class is refused by a typed error that says where and what to do.
#![cfg(feature = "solve")]

use approx::{abs_diff_eq, assert_abs_diff_eq};
use rkpm::assembly::Pattern;
use rkpm::boundary::{ConstraintEquation, Eliminated, Enforced, Enforcement};
use rkpm::cells::Lattice;
use rkpm::error::{ApproximationError, BoundaryError, GeometryError, MaterialError, SolveError};
use rkpm::nalgebra::Vector3;
use rkpm::prelude::*;
use rkpm::quadrature::gauss_legendre;
use rkpm::scene::{ConstraintKind, ConstraintMethod, Rule};
use rkpm::solve::{EnclosedVolume, Newton, State};

const NAN: f64 = f64::NAN;
const INFINITY: f64 = f64::INFINITY;

fn rubber() -> Rubber {
    Rubber::yeoh(0.373, -0.031, 0.005, 1e3).unwrap()
}

/// A held block that is pulled: sound, until one thing about it is changed.
fn sound() -> Scene<2> {
    Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber()).hold(Side::Min).prescribe(Side::Max, 0, 0.1)
}

fn coarse() -> Scheme {
    Scheme::default().particles([5, 4])
}

/// The error of discretising and running, which must not come out as a path.
fn refusal<const D: usize>(scene: &Scene<D>, scheme: &Scheme) -> Error {
    match scene.discretize(scheme) {
        Err(error) => error,
        Ok(problem) => match problem.run() {
            Err(error) => error,
            Ok(path) => panic!("accepted, and ended with {:?}", path.ending),
        },
    }
}

/// Requires a variant, and that the message holds all of the words: the place, and what to do.
#[track_caller]
fn says(error: &impl std::fmt::Display, words: &[&str]) {
    let text = error.to_string();
    for word in words {
        assert!(text.contains(word), "“{word}” is missing in: {text}");
    }
}

/// An error of a given class and variant whose message holds the words.
macro_rules! refused {
    ($error:expr, $variant:pat, $words:expr) => {{
        let error = $error;
        assert!(matches!(error, $variant), "{error:?}");
        says(&error, &$words);
    }};
}

#[test]
fn the_sound_scene_runs() {
    // What all the tests below change one thing of.
    sound().discretize(&coarse()).unwrap().run().unwrap().completed().unwrap();
}

#[test]
fn geometry() {
    let on = |block: Block<2>| refusal(&Scene::new(block, PlaneStrain, rubber()).hold(Side::Min), &coarse());
    refused!(
        on(Block::new([0.0, 1.0], [2.0, 1.0])),
        Error::Geometry(GeometryError::Degenerate { axis: 1, .. }),
        ["block along axis 1 is 0e0", "give finite corners with max > min"]
    );
    refused!(
        on(Block::new([0.0, 0.0], [-2.0, 1.0])),
        Error::Geometry(GeometryError::Degenerate { axis: 0, .. }),
        ["axis 0 is -2e0", "max > min"]
    );
    for bad in [NAN, INFINITY] {
        refused!(
            on(Block::new([0.0, 0.0], [2.0, bad])),
            Error::Geometry(GeometryError::Degenerate { axis: 1, .. }),
            ["axis 1", "finite corners"]
        );
    }
    // A map that turns cells inside out.
    let mirrored = Mapped(|x: &Point<2>| Point::<2>::new(-x[0], x[1]));
    refused!(
        refusal(&Scene::new(mirrored, PlaneStrain, rubber()).hold(Side::Min), &coarse()),
        Error::Geometry(GeometryError::InvertedCell { cell: 0, .. }),
        ["cell 0", "distortion of the map"]
    );
    let nowhere = Mapped(|x: &Point<2>| Point::<2>::new(x[0] / 0.0 - x[0] / 0.0, x[1]));
    assert!(matches!(
        refusal(&Scene::new(nowhere, PlaneStrain, rubber()).hold(Side::Min), &coarse()),
        Error::Geometry(_)
    ));
    // Quadrilaterals whose corners run the wrong way round.
    let clockwise = Quadrilateral { corners: [[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]] };
    refused!(
        refusal(&Scene::new(clockwise, PlaneStrain, rubber()).hold(Side::Min), &coarse()),
        Error::Geometry(GeometryError::InvertedCell { .. }),
        ["volume"]
    );
}

#[test]
fn bodies_over_the_axis_of_revolution() {
    let across = Scene::new(Block::new([-1.0, 0.0], [1.0, 1.0]), Axisymmetric, rubber()).hold((1, Side::Min));
    refused!(
        refusal(&across, &coarse()),
        Error::Geometry(GeometryError::Kinematics { .. }),
        ["negative radius at X = [-", "distance from the axis"]
    );
}

#[test]
fn counts_and_layouts() {
    let with = |scheme: Scheme| refusal(&sound(), &scheme);
    refused!(
        with(Scheme::default().particles([5, 1])),
        Error::Geometry(GeometryError::Count { count: 1, .. }),
        ["nodes along an axis: 1 given", "at least 2"]
    );
    refused!(
        with(Scheme::default().particles([5, 4, 3])),
        Error::Geometry(GeometryError::Count { count: 3, .. }),
        ["particle counts: 3 given", "one number for each axis"]
    );
    refused!(
        with(Scheme::default().particles([1_000_000, 1_000_000])),
        Error::Geometry(GeometryError::Count { .. }),
        ["nodes of a lattice", "at most 2e7"]
    );
    for spacing in [0.0, -1.0, NAN] {
        refused!(
            with(Scheme::default().spacing(spacing)),
            Error::Invalid(_),
            ["particle spacing", "finite length above zero"]
        );
    }
    for amount in [0.5, -0.1, NAN] {
        refused!(with(coarse().layout(Layout::Jittered { amount, seed: 1 })), Error::Invalid(_), ["jitter", "0.5"]);
    }
    let folded = Layout::Graded(std::sync::Arc::new(|_, t| if t > 0.3 && t < 0.7 { 1.5 - t } else { t }));
    assert!(matches!(with(coarse().layout(folded)), Error::Geometry(GeometryError::InvertedCell { .. })));
    let short = Layout::Graded(std::sync::Arc::new(|_, t| 0.5 * t));
    refused!(with(coarse().layout(short)), Error::Invalid(_), ["graded coordinate", "maps 0 to 0 and 1 to 1"]);
    let few = Lattice::from_positions([2, 2], vec![Point::<2>::zeros(); 3]).unwrap_err();
    refused!(few, GeometryError::Count { count: 3, .. }, ["lattice positions: 3 given", "product of the counts"]);
}

#[test]
fn particles() {
    let ball = |n: usize| vec![Support::<2>::Ball(1.0); n];
    let at = |x: f64, y: f64| Point::<2>::new(x, y);
    refused!(
        Particles::<2>::new(vec![], vec![]).unwrap_err(),
        ApproximationError::Particle { .. },
        ["empty", "at least as many particles as the basis has terms"]
    );
    refused!(
        Particles::new(vec![at(0.0, 0.0), at(1.0, 0.0), at(0.0, 0.0)], ball(3)).unwrap_err(),
        ApproximationError::Particle { particle: 2, .. },
        ["particle 2", "same position", "remove one"]
    );
    for bad in [NAN, INFINITY] {
        refused!(
            Particles::new(vec![at(0.0, 0.0), at(1.0, bad)], ball(2)).unwrap_err(),
            ApproximationError::Particle { particle: 1, .. },
            ["particle 1", "not finite", "finite coordinates"]
        );
    }
    // −0 and 0 are the same place.
    assert!(Particles::new(vec![at(0.0, 0.0), at(-0.0, 0.0)], ball(2)).is_err());
    for r in [0.5, 0.3, -1.0, NAN, INFINITY] {
        refused!(
            refusal(&sound(), &coarse().dilation(r)),
            Error::Approximation(ApproximationError::Dilation { .. }),
            [&format!("r = {r}"), "use r >= 0.6"]
        );
        refused!(
            refusal(&sound(), &Scheme::paper(r).particles([5, 4])),
            Error::Approximation(ApproximationError::Dilation { .. }),
            ["(6.1)", "use r >= 0.6"]
        );
    }
    let few = Particles::new(vec![at(0.0, 0.0), at(1.0, 0.0)], ball(2)).unwrap();
    refused!(
        ReproducingKernel::new(few, CubicSpline, Polynomial::linear()).err().unwrap(),
        ApproximationError::Uncovered { covering: 2, needed: 3, .. },
        ["2 particles", "3 terms", "add particles"]
    );
}

#[test]
fn particles_at_one_place() {
    let helps = ["same position", "remove one", "a full ring", "symmetry", "draw a Region"];
    // A ring that closes on itself, but for rounding.
    let ring = Mapped(|unit: &Point<2>| {
        let (radius, angle) = (1.0 + unit[0], std::f64::consts::TAU * unit[1]);
        Point::<2>::new(radius * angle.cos(), radius * angle.sin())
    });
    let scene = Scene::new(ring, PlaneStrain, rubber()).hold(Side::Min);
    for nodes in [[4, 25], [3, 48]] {
        let error = refusal(&scene, &Scheme::default().particles(nodes));
        refused!(error, Error::Approximation(ApproximationError::Particle { .. }), helps);
    }
    // Whatever the sign of a zero, between others that sort in between.
    let mut positions: Vec<Point<2>> =
        [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-0.0, 0.5], [-0.0, 0.7], [0.0, 0.5]]
            .map(Point::from)
            .into();
    let count = positions.len();
    let balls = |count| vec![Support::Ball(3.0); count];
    let error = Particles::new(positions.clone(), balls(count)).unwrap_err();
    refused!(error, ApproximationError::Particle { particle: 6, .. }, helps);
    for rank in [1, 2, 4] {
        let error = Particles::by_neighbour(positions.clone(), rank, 1.5).unwrap_err();
        refused!(error, ApproximationError::Particle { particle: 6, .. }, helps);
    }
    positions[6] = Point::<2>::new(1e-13, 0.5);
    let error = Particles::by_neighbour(positions.clone(), 1, 1.5).unwrap_err();
    refused!(error, ApproximationError::Particle { particle: 6, .. }, helps);

    // Close is not one place: fine sets far from the origin, graded ones, thin ones, far particles, wide supports.
    let fine = Block::new([1e6, 1e6], [1e6 + 1e-3, 1e6 + 1e-3]).lattice([5, 5]).unwrap();
    fine.particles(1.0).unwrap();
    let graded = |power: i32| {
        let layout = Layout::Graded(std::sync::Arc::new(move |_, t: f64| t.powi(power)));
        Lattice::new(&Block::new([0.0, 0.0], [1.0, 1.0]), [8, 8], &layout).unwrap()
    };
    graded(12).particles(1.0).unwrap();
    graded(8).particles_global(1.0).unwrap();
    Block::new([0.0, 0.0], [1.0, 1e-6]).particles([5, 5], 1.0).unwrap();
    let mut far: Vec<Point<2>> = fine.positions().iter().map(|x| x - Point::<2>::repeat(1e6)).collect();
    far.push(Point::<2>::repeat(1e6));
    Particles::by_neighbour(far.clone(), 1, 2.0).unwrap();
    Particles::by_neighbour(far.clone(), 3, 2.0).unwrap();
    Particles::new(far, vec![Support::Ball(1e-3); 26]).unwrap();
    Block::new([0.0, 0.0], [1.0, 1.0]).particles([9, 9], 1e12).unwrap();
}

#[test]
fn supports() {
    let positions = vec![Point::<2>::new(0.0, 0.0), Point::<2>::new(1.0, 0.0)];
    let with = |supports: Vec<Support<2>>| Particles::new(positions.clone(), supports).unwrap_err();
    for bad in [0.0, -1.0, NAN, INFINITY] {
        for support in [Support::Ball(bad), Support::Box(Point::<2>::new(1.0, bad))] {
            refused!(
                with(vec![Support::Ball(1.0), support]),
                ApproximationError::Support { particle: 1, .. },
                ["support of particle 1", "finite lengths above zero", "r >= 0.6"]
            );
        }
    }
    refused!(
        with(vec![Support::Ball(1.0); 3]),
        ApproximationError::Length { given: 3, particles: 2, .. },
        ["supports: 3 entries for 2 particles", "one for each"]
    );
    let particles = || Particles::new(positions.clone(), vec![Support::Ball(1.0); 2]).unwrap();
    refused!(
        particles().with_volumes(vec![1.0]).unwrap_err(),
        ApproximationError::Length { given: 1, .. },
        ["volumes: 1 entries for 2"]
    );
    for bad in [0.0, -1.0, NAN] {
        refused!(
            particles().with_volumes(vec![1.0, bad]).unwrap_err(),
            ApproximationError::Particle { particle: 1, .. },
            ["particle 1", "volume", "give the volume"]
        );
    }
}

#[test]
fn uncovered_and_singular_points() {
    // A hole in the cover: the point and the remedy are named.
    let positions: Vec<_> = [0.0, 0.2, 0.4, 2.0, 2.2, 2.4].map(Point::<1>::new).into();
    let particles = Particles::new(positions, vec![Support::Ball(0.5); 6]).unwrap();
    let approximation = ReproducingKernel::new(particles, CubicSpline, Polynomial::linear()).unwrap();
    refused!(
        approximation.shape_functions(&Point::<1>::new(1.25)).unwrap_err(),
        ApproximationError::Uncovered { covering: 0, needed: 2, .. },
        ["X = [1.25]", "covered by 0 particles", "raise the dilation"]
    );
    // The same where a table meets it.
    let points = Block::new([0.0], [2.4]).lattice([2]).unwrap().gauss(3).unwrap();
    let error = ShapeTable::new(&approximation, &points, &RadialCylinder).unwrap_err();
    refused!(error, Error::Approximation(ApproximationError::Uncovered { .. }), ["X = [1.2", "raise the dilation"]);
    for bad in [NAN, INFINITY] {
        refused!(
            approximation.shape_functions(&Point::<1>::new(bad)).unwrap_err(),
            ApproximationError::Point { .. },
            ["evaluation point X = [", "not finite"]
        );
    }
    // Dilations that carry a linear basis but no quadratic one.
    let error = refusal(&sound(), &coarse().order(2).dilation(0.7));
    assert!(
        matches!(
            error,
            Error::Approximation(ApproximationError::Uncovered { .. } | ApproximationError::Singular { .. })
        ),
        "{error:?}"
    );
    says(&error, &["X = [", "raise the dilation there"]);
    // A guard set beyond reach names what it found.
    let particles = Block::new([0.0, 0.0], [1.0, 1.0]).particles([4, 4], 1.0).unwrap();
    let guarded = ReproducingKernel::new(particles, CubicSpline, Polynomial::linear()).unwrap().with_rcond_limit(0.99);
    refused!(
        guarded.shape_functions(&Point::<2>::new(0.5, 0.25)).unwrap_err(),
        ApproximationError::Singular { .. },
        ["X = [0.5, 0.25]", "reciprocal condition", "raise the dilation"]
    );
}

/// (1 − z²)³ with something else between 0.501 and 0.514, which no sample of the kernel meets.
struct Faulty(f64, f64);

impl Kernel for Faulty {
    fn value_and_slope(&self, z: f64) -> (f64, f64) {
        let q = (1.0 - z * z).max(0.0);
        if z > 0.501 && z < 0.514 { (self.0, self.1) } else { (q.powi(3), -6.0 * z * q * q) }
    }
}

#[test]
fn kernels() {
    let line = |support: Support<1>| {
        Particles::new((0..8).map(|i| Point::<1>::new(f64::from(i))).collect(), vec![support; 8]).unwrap()
    };
    let box_of = |half: f64| Support::Box(Point::<1>::new(half));
    let at = Point::<1>::new(3.01);
    // Seen at a point: particle 2 is 1.01 away, z = 0.505.
    for support in [Support::Ball(2.0), box_of(2.0)] {
        for (kernel, words) in [
            (Faulty(NAN, 0.0), ["the value of the kernel is NaN", "finite values"]),
            (Faulty(INFINITY, 0.0), ["the value of the kernel is inf", "finite values"]),
            (Faulty(-0.1, 0.0), ["the value of the kernel is -1e-1", "nowhere negative"]),
            (Faulty(0.4, NAN), ["the slope of the kernel is NaN", "finite slopes"]),
            (Faulty(0.4, INFINITY), ["the slope of the kernel is inf", "finite slopes"]),
        ] {
            let functions = ReproducingKernel::new(line(support), kernel, Polynomial::linear()).unwrap();
            let error = functions.shape_functions(&at).unwrap_err();
            says(&error, &["X = [3.01]", "z = 0.50", "particle 2"]);
            refused!(error, ApproximationError::Function { .. }, words);
        }
        // Nothing at all is no fault: the particle is left out.
        let functions = ReproducingKernel::new(line(support), Faulty(0.0, 0.0), Polynomial::linear()).unwrap();
        assert_eq!(functions.shape_functions(&at).unwrap().nodes, [3, 4, 5]);
    }
    // Seen at once.
    struct Everywhere(fn(f64) -> (f64, f64));
    impl Kernel for Everywhere {
        fn value_and_slope(&self, z: f64) -> (f64, f64) {
            (self.0)(z)
        }
    }
    for (kernel, word) in [
        (Everywhere(|z| ((1.0 - z * z) * (1.0 - 3.0 * z * z), -8.0 * z + 12.0 * z.powi(3))), "nowhere negative"),
        (Everywhere(|z| (1.0 - z, NAN)), "finite slopes"),
        (Everywhere(|_| (NAN, NAN)), "finite values"),
        (Everywhere(|_| (0.0, 0.0)), "positive value at the centre"),
    ] {
        let error = ReproducingKernel::new(line(Support::Ball(2.0)), kernel, Polynomial::linear()).err().unwrap();
        refused!(error, ApproximationError::Function { .. }, ["of the kernel", "z = 0", word]);
    }
    for width in [0.0, -0.4, NAN, INFINITY, 1e-4, 1e9] {
        let kernel: std::sync::Arc<dyn Kernel> = std::sync::Arc::new(Gaussian { width });
        let error = ReproducingKernel::new(line(Support::Ball(2.0)), kernel, Polynomial::linear()).err().unwrap();
        refused!(error, ApproximationError::Function { .. }, ["width of a Gaussian kernel", "0.01 and 1000"]);
    }
    for width in [0.05, 0.4, 10.0, 1e3] {
        let functions = ReproducingKernel::new(line(Support::Ball(2.0)), Gaussian { width }, Polynomial::linear());
        if width > 0.1 {
            let psi = functions.unwrap().shape_functions(&at).unwrap();
            assert_abs_diff_eq!(psi.values.iter().sum::<f64>(), 1.0, epsilon = 1e-12);
        }
    }
    // Supports far too wide: every particle looks alike, and more of the same would not help.
    let functions = ReproducingKernel::new(line(Support::Ball(1e7)), CubicSpline, Polynomial::linear()).unwrap();
    refused!(
        functions.shape_functions(&at).unwrap_err(),
        ApproximationError::Singular { covering: 8, .. },
        ["8 particles", "supports are too wide", "lower the dilation"]
    );
}

#[test]
fn functions_that_are_not_finite() {
    struct Basis1([fn(f64) -> f64; 2]);
    impl rkpm::basis::Basis<1> for Basis1 {
        fn len(&self) -> usize {
            2
        }
        fn fill(&self, x: &Point<1>, h: &mut [f64], dh: &mut [Point<1>]) {
            h.copy_from_slice(&[1.0, self.0[0](x[0])]);
            dh.copy_from_slice(&[Point::<1>::new(0.0), Point::<1>::new(self.0[1](x[0]))]);
        }
    }
    let particles = Block::new([0.0], [7.0]).particles([8], 1.2).unwrap();
    for (functions, word) in [
        ([|x| if x > 0.0 { NAN } else { x }, |_| 1.0] as [fn(f64) -> f64; 2], "a function of the basis is NaN"),
        ([|x| x, |x| if x < 0.0 { INFINITY } else { 1.0 }], "a slope of the basis is inf"),
    ] {
        let kernel = ReproducingKernel::new(particles.clone(), CubicSpline, Basis1(functions)).unwrap();
        let error = kernel.shape_functions(&Point::<1>::new(3.3)).unwrap_err();
        refused!(error, ApproximationError::Function { .. }, ["X = [3.3]", word]);
    }

    /// Linear finite elements over 0, 1, …, 7, spoilt by a function.
    struct Spoilt<F>(Vec<Point<1>>, F);
    impl<F: Fn(&mut ShapeFunctions<1>) + Send + Sync> Approximation<1> for Spoilt<F> {
        fn nodes(&self) -> &[Point<1>] {
            &self.0
        }
        fn evaluate(
            &self,
            at: &Point<1>,
            _: &mut Scratch,
            out: &mut ShapeFunctions<1>,
        ) -> Result<(), ApproximationError> {
            let left = (at[0] as u32).min(6);
            let t = at[0] - f64::from(left);
            (out.nodes, out.values) = (vec![left, left + 1], vec![1.0 - t, t]);
            (out.gradients, out.rcond) = (vec![Point::<1>::new(-1.0), Point::<1>::new(1.0)], 1.0);
            (self.1)(out);
            Ok(())
        }
    }
    let lattice = Block::new([0.0], [7.0]).lattice([8]).unwrap();
    let smoothing = lattice.smoothing(1, 1, &lattice.zones(1)).unwrap();
    let points = lattice.gauss(2).unwrap();
    type Spoil = fn(&mut ShapeFunctions<1>);
    for (spoil, word) in [
        ((|psi| psi.values[1] = NAN) as Spoil, "the value of a shape function is NaN"),
        (|psi| psi.values.truncate(1), "values at a point: 1 entries for 2"),
        (|psi| psi.values.push(0.0), "values at a point: 3 entries for 2"),
        (|psi| psi.nodes[1] = 8, "do not exist"),
        (|psi| psi.nodes.swap(0, 1), "do not rise"),
    ] {
        let traces = Spoilt(lattice.positions().to_vec(), spoil);
        says(&ShapeTable::new(&traces, &points, &RadialCylinder).unwrap_err(), &[word]);
        says(&ShapeTable::smoothed(&traces, &smoothing, &RadialCylinder).unwrap_err(), &[word]);
        let (mut rows, ramp) = (Constraints::default(), &Amplitude::Ramp);
        says(&rows.at_particles(&traces, &[3], 0, &|_| 0.1, ramp, "u").unwrap_err(), &[word]);
        let end = lattice.boundary(&Side::Max.into(), 1, 1).unwrap();
        says(&rows.over_boundary(&traces, &end, &RadialCylinder, 0, &|_| 0.1, ramp, "u").unwrap_err(), &[word]);
        assert!(rows.equations().is_empty());
    }
    let traces = Spoilt(lattice.positions().to_vec(), |psi: &mut ShapeFunctions<1>| psi.gradients[0][0] = NAN);
    let error = ShapeTable::new(&traces, &points, &RadialCylinder).unwrap_err();
    says(&error, &["the gradient of a shape function is NaN", "X = [0.2"]);
    let sound = Spoilt(lattice.positions().to_vec(), |_: &mut ShapeFunctions<1>| {});
    assert_eq!(ShapeTable::smoothed(&sound, &smoothing, &RadialCylinder).unwrap().point_count(), 7);
}

#[test]
fn sheets_whose_thickness_is_a_hoop() {
    /// A sheet whose thickness would be a hoop too.
    struct Thin;
    impl Kinematics<2> for Thin {
        fn hoop_components(&self) -> &'static [usize] {
            &[2]
        }
        fn measure(&self, at: &Point<2>) -> f64 {
            at[0]
        }
        fn is_plane_stress(&self) -> bool {
            true
        }
    }
    let lattice = Block::new([1.0, 0.0], [2.0, 1.0]).lattice([4, 4]).unwrap();
    let functions = ReproducingKernel::new(lattice.particles(1.0).unwrap(), CubicSpline, Polynomial::linear()).unwrap();
    let points = lattice.gauss(2).unwrap();
    let scene = Scene::new(Block::new([1.0, 0.0], [2.0, 1.0]), Thin, rubber()).hold(Side::Min);
    for error in [ShapeTable::new(&functions, &points, &Thin).unwrap_err(), refusal(&scene, &coarse())] {
        refused!(error, Error::Geometry(GeometryError::Count { .. }), ["entry of F", "is_plane_stress"]);
    }
}

#[test]
fn kinematics_that_measure_nothing() {
    /// A thickness and hoops of one's own.
    struct Own(fn(&Point<2>) -> f64, &'static [usize]);
    impl Kinematics<2> for Own {
        fn hoop_components(&self) -> &'static [usize] {
            self.1
        }
        fn measure(&self, at: &Point<2>) -> f64 {
            (self.0)(at)
        }
    }
    let lattice = Block::new([1.0, 0.0], [2.0, 1.0]).lattice([4, 4]).unwrap();
    let functions = ReproducingKernel::new(lattice.particles(1.0).unwrap(), CubicSpline, Polynomial::linear()).unwrap();
    let (points, smoothing) = (lattice.gauss(2).unwrap(), lattice.smoothing(2, 2, &lattice.zones(1)).unwrap());
    for (measure, word) in [
        ((|_| 0.0) as fn(&Point<2>) -> f64, "is not positive"),
        (|_| -1.0, "is not positive"),
        (|_| NAN, "is not finite"),
        (|_| INFINITY, "is not finite"),
    ] {
        for hoops in [&[] as &[usize], &[2]] {
            let own = Own(measure, hoops);
            let words = ["measure of the kinematics", word, "X = [1.", "Kinematics::measure()"];
            for error in [
                ShapeTable::new(&functions, &points, &own).unwrap_err(),
                ShapeTable::smoothed(&functions, &smoothing, &own).unwrap_err(),
            ] {
                refused!(error, Error::Geometry(GeometryError::Kinematics { .. }), words);
            }
        }
    }
    // Averages over sub-cells take the measure for constant, or with a hoop for a multiple of R.
    type Measure = fn(&Point<2>) -> f64;
    let averaged: [(Measure, bool, &[usize]); 6] = [
        (|_| 3.0, true, &[]),
        (|x| 1.0 + x[0], false, &[]),
        (|x| 5.0 * x[0], true, &[2]),
        (|x| 5.0 * x[0] + 1e-6, false, &[2]),
        (|x| 5.0 * x[0] * x[0], false, &[2]),
        (|_| 1.0, false, &[2]),
    ];
    for (measure, fits, hoops) in averaged {
        let own = Own(measure, hoops);
        match ShapeTable::smoothed(&functions, &smoothing, &own) {
            Ok(table) => {
                let exact = if hoops.is_empty() { 3.0 } else { 7.5 };
                assert!(fits && abs_diff_eq!(table.weights().iter().sum::<f64>(), exact, epsilon = 1e-12));
            }
            Err(error) => {
                assert!(!fits, "{error}");
                let words = ["the measure of the kinematics", "proportional to R", "at X = [1", "Rule::Gauss"];
                refused!(error, Error::Geometry(GeometryError::Kinematics { .. }), words);
            }
        }
        assert!(ShapeTable::new(&functions, &points, &own).is_ok());
    }
    let fading = Own(|x| 1.5 - x[0], &[]);
    let error = ShapeTable::new(&functions, &points, &fading).unwrap_err();
    refused!(error, Error::Geometry(GeometryError::Kinematics { .. }), ["is not positive", "X = [1."]);
    /// The same area at all ends of sub-cells, a larger one between them.
    struct Bulging;
    impl Kinematics<1> for Bulging {
        fn hoop_components(&self) -> &'static [usize] {
            &[]
        }
        fn measure(&self, at: &Point<1>) -> f64 {
            1.0 + (8.0 * std::f64::consts::PI * at[0]).sin().powi(2)
        }
    }
    let bar = Block::new([1.0], [2.0]).lattice([5]).unwrap();
    let line = ReproducingKernel::new(bar.particles(1.0).unwrap(), CubicSpline, Polynomial::linear()).unwrap();
    let error = ShapeTable::smoothed(&line, &bar.smoothing(2, 1, &bar.zones(1)).unwrap(), &Bulging).unwrap_err();
    refused!(error, Error::Geometry(GeometryError::Kinematics { .. }), ["proportional to R", "at X = [1.0625]"]);
    for hoops in [&[2usize, 2] as &[usize], &[1], &[3]] {
        let own = || Own(|_| 1.0, hoops);
        let scene = Scene::new(Block::new([1.0, 0.0], [2.0, 1.0]), own(), rubber()).hold(Side::Min);
        for error in [
            ShapeTable::new(&functions, &points, &own()).unwrap_err(),
            ShapeTable::smoothed(&functions, &smoothing, &own()).unwrap_err(),
            refusal(&scene, &coarse()),
        ] {
            refused!(error, Error::Geometry(GeometryError::Count { .. }), ["hoop of the kinematics", "each once"]);
        }
    }
}

#[test]
fn weights_that_measure_nothing() {
    let lattice = Block::new([0.0, 0.0], [1.0, 1.0]).lattice([5, 5]).unwrap();
    let functions = ReproducingKernel::new(lattice.particles(1.0).unwrap(), CubicSpline, Polynomial::linear()).unwrap();
    let sound = lattice.gauss_in(2, &lattice.zones(2)).unwrap();
    for factor in [0.0, -1.0] {
        let mut points = sound.clone();
        points.weights.iter_mut().for_each(|w| *w *= factor);
        let error = ShapeTable::new(&functions, &points, &PlaneStrain).unwrap_err();
        refused!(error, Error::Invalid(_), ["sum of the integration weights", "more than nothing"]);
    }
    // A single negative weight is legitimate, a zone without a measure can hold no pressure.
    let mut points = sound.clone();
    points.weights[0] *= -0.1;
    let run = |points: &Points<2>, field| {
        let table = ShapeTable::new(&functions, points, &PlaneStrain).unwrap();
        let mut model = Model::new(lattice.positions());
        model.add(Body::new(table, rubber(), field));
        let mut rows = Constraints::default();
        let held = lattice.boundary_nodes(&Part::Whole).unwrap();
        for component in 0..2 {
            rows.at_particles(&functions, &held, component, &|_| 0.0, &Amplitude::Ramp, "held").unwrap();
        }
        Analysis::new(LagrangeMultipliers, Direct::default()).run(&model, &rows, &mut ())
    };
    run(&points, PressureField::Linear).unwrap();
    let zone = sound.groups[0]..sound.groups[1];
    points.weights[zone].iter_mut().for_each(|w| *w = -0.5 * w.abs());
    for field in [PressureField::Linear, PressureField::Constant] {
        let error = run(&points, field).unwrap_err();
        let words = ["square norm of a pressure function", "give positive ones", "PressureField::Pointwise"];
        refused!(error, Error::Invalid(_), words);
    }
    // Zones of no cell are nobody's wish.
    let none = coarse().pressure_field(PressureField::Linear, 0);
    for scheme in [none, Scheme::elements(1).particles([5, 4]).pressure_field(PressureField::Constant, 0)] {
        let error = refusal(&self::sound(), &scheme);
        refused!(error, Error::Geometry(GeometryError::Count { count: 0, .. }), ["pressure zone", "at least 1"]);
    }
}

#[test]
fn pressures_on_points_without_normals() {
    let lattice = Block::new([0.0, 0.0], [1.0, 1.0]).lattice([4, 4]).unwrap();
    let functions = ReproducingKernel::new(lattice.particles(1.0).unwrap(), CubicSpline, Polynomial::linear()).unwrap();
    let table = |points: &Points<2>| ShapeTable::new(&functions, points, &PlaneStrain).unwrap();
    let pressure = || FollowerPressure { pressure: 0.01, amplitude: Amplitude::Ramp };
    let run = |points: &Points<2>| {
        let mut model = Model::new(lattice.positions());
        model.add(Body::new(table(&lattice.gauss(2).unwrap()), rubber(), PressureField::Pointwise));
        model.add(Pointwise::new(table(points), pressure()));
        let mut rows = Constraints::default();
        let held = lattice.boundary_nodes(&Side::Min.into()).unwrap();
        for component in 0..2 {
            rows.at_particles(&functions, &held, component, &|_| 0.0, &Amplitude::Ramp, "held").unwrap();
        }
        Analysis::new(LagrangeMultipliers, Direct::default()).run(&model, &rows, &mut ())
    };
    let face = lattice.boundary(&Side::Max.into(), 1, 2).unwrap().points;
    run(&face).unwrap();
    let mut spoilt = face.clone();
    spoilt.normals[1][0] = NAN;
    let error = ShapeTable::new(&functions, &spoilt, &PlaneStrain).unwrap_err();
    refused!(error, Error::Invalid(_), ["component of a normal", "finite normals"]);
    let bare = Points { normals: Vec::new(), ..face };
    for points in [bare, lattice.gauss(2).unwrap()] {
        let error = run(&points).unwrap_err();
        refused!(error, Error::Solve(SolveError::Empty { .. }), ["normals at the points of a pressure", "a boundary"]);
    }
}

/// What reads the deformation of a sheet needs its law, which a table does not know; what adds a stress is part of the law.
#[test]
fn loads_that_do_not_know_the_thickness_of_a_sheet() {
    let lattice = Block::new([0.0, 0.0], [1.0, 1.0]).lattice([4, 4]).unwrap();
    let functions = ReproducingKernel::new(lattice.particles(1.0).unwrap(), CubicSpline, Polynomial::linear()).unwrap();
    let face = lattice.boundary(&Side::Max.into(), 1, 2).unwrap().points;
    let table = ShapeTable::new(&functions, &face, &PlaneStress { thickness: 1.0 }).unwrap();
    let amplitude = Amplitude::Ramp;
    let pressure = Pointwise::new(table.clone(), FollowerPressure { pressure: 0.01, amplitude: amplitude.clone() });
    refused!(
        pressure.validate().unwrap_err(),
        SolveError::Empty { .. },
        ["stretch across the sheet", "Load::pressure"]
    );
    Pointwise::new(table, DeadLoad { force: Vector3::x(), amplitude }).validate().unwrap();
    struct Skin;
    impl Integrand for Skin {
        fn sparsity(&self) -> rkpm::term::Sparsity {
            rkpm::term::Sparsity { stress: true, ..Default::default() }
        }
        fn evaluate(&self, at: &rkpm::term::PointState, derivatives: &mut rkpm::term::PointDerivatives) {
            derivatives.stress = at.deformation;
        }
    }
    let scene = Scene::new(Block::new([0.0, 0.0], [1.0, 1.0]), PlaneStress { thickness: 1.0 }, rubber())
        .hold(Side::Min)
        .with(Load::integrand(Side::Max, Skin));
    refused!(refusal(&scene, &coarse()), Error::Incompatible(_), ["integrand on face", "a sheet in plane stress"]);
}

#[test]
fn volumes_behind_no_boundary() {
    let lattice = Block::new([0.0, 0.0], [1.0, 1.0]).lattice([4, 4]).unwrap();
    let functions = ReproducingKernel::new(lattice.particles(1.0).unwrap(), CubicSpline, Polynomial::linear()).unwrap();
    let face = lattice.boundary(&Side::Max.into(), 1, 2).unwrap().points;
    let volume = |points: &Points<2>| EnclosedVolume::new(ShapeTable::new(&functions, points, &PlaneStrain).unwrap());
    assert!(volume(&face).is_ok());
    let bare = Points { normals: Vec::new(), ..face };
    for points in [bare, lattice.gauss(2).unwrap()] {
        let error = volume(&points).map(|_| ()).unwrap_err();
        refused!(error, SolveError::Empty { .. }, ["normals at the points of an enclosed volume", "a boundary"]);
    }
}

#[test]
fn selections() {
    let on = |scene: Scene<2>| refusal(&scene, &coarse());
    let unknown = "no boundary part face (2, Min)";
    let known = "faces (axis, Side) with axis below 2";
    for scene in [
        sound().hold((2, Side::Min)),
        sound().pressure((2, Side::Min), 0.1),
        sound().traction((2, Side::Min), [0.1, 0.0]),
    ] {
        refused!(on(scene), Error::Geometry(GeometryError::UnknownPart { .. }), [unknown, known]);
    }
    refused!(
        on(sound().prescribe((1, Side::Max), 2, 0.1)),
        Error::Boundary(BoundaryError::Component { component: 2, dimension: 2, .. }),
        ["u_2 on face (1, Max)", "component 2", "the displacement has 2"]
    );
    // No particle at the point: the nearest one is named.
    refused!(
        on(sound().prescribe(Place::at([0.6, 0.3]), 1, 0.1)),
        Error::Boundary(BoundaryError::Empty { .. }),
        ["u_1 at [0.6, 0.3] selects no particle", "nearest one is at X = [0.5, 0.333"]
    );
    refused!(
        on(sound().prescribe(Place::at([NAN, 0.3]), 1, 0.1)),
        Error::Boundary(BoundaryError::Empty { .. }),
        ["selects no particle"]
    );
    // A point load far from the body, and nowhere.
    for at in [[9.0, 0.5], [NAN, 0.5]] {
        let error = on(sound().with(Load::force(Place::at(at), [0.0, 0.1])));
        assert!(matches!(error, Error::Boundary(_) | Error::Approximation(_)), "{error:?}");
    }
}

#[test]
fn point_loads_just_outside_of_the_body() {
    // Supports reach over the boundary; the body does not.
    let error = refusal(&sound().with(Load::force(Place::at([2.1, 0.5]), [0.0, 0.1])), &coarse());
    assert!(matches!(error, Error::Boundary(_) | Error::Approximation(_)), "{error:?}");
    says(&error, &["2.1"]);
}

#[test]
fn rows_that_conflict() {
    for rows in [ConstraintKind::AtParticles, ConstraintKind::OverBoundary] {
        let scheme = coarse().constraint_kind(rows);
        refused!(
            refusal(&sound().prescribe(Side::Min, 0, 0.3), &scheme),
            Error::Boundary(BoundaryError::Conflict { component: 0, .. }),
            [
                "u_0 on face (0, Min) and u_0 on face (0, Min)",
                "component 0 at X = [0.0, 0.0]",
                "[0.0, 0.3]",
                "remove one or make them equal"
            ]
        );
        refused!(
            refusal(&sound().prescribe(Place::at([2.0, 1.0]), 0, 0.2), &scheme),
            Error::Boundary(BoundaryError::Conflict { .. }),
            ["u_0 at [2.0, 1.0]", "X = [2.0, 1.0]", "[0.1, 0.2]"]
        );
        // Equal values at different rates conflict on the way, and the message says by how much.
        let scene = sound().with(Condition::on(Place::at([2.0, 1.0])).component(0, 0.1).amplitude(Amplitude::Constant));
        refused!(
            refusal(&scene, &scheme),
            Error::Boundary(BoundaryError::Conflict { .. }),
            ["different values [0.0, 0.1]"]
        );
        // Along nearly the same direction as well: it would be left without an equation.
        let slanted = |value| sound().with(Condition::on(Side::Max).along(Direction::Along([1.0, 0.03]), value));
        refused!(
            refusal(&slanted(0.4), &scheme),
            Error::Boundary(BoundaryError::Conflict { component: 0, .. }),
            ["u_0 on face (0, Max)", "u along [1.0, 0.03] on face (0, Max)", "0.4]"]
        );
        slanted(0.1).discretize(&scheme).unwrap();
        // Equal conditions are taken once.
        let twice = sound().prescribe(Side::Max, 0, 0.1).prescribe((1, Side::Min), 1, 0.0);
        twice.discretize(&scheme).unwrap().run().unwrap().completed().unwrap();
    }
}

/// Faces that meet at a corner may not prescribe different values to the particle there: the answer would depend on their order. Over
/// the boundary the face whose normal is nearest to the direction owns the equation, whichever comes first, and the check says so.
#[test]
fn corners_of_two_values() {
    let held = || Scene::new(Block::new([0.0, 0.0], [1.0, 1.0]), PlaneStrain, rubber());
    let between = |scene: Scene<2>| scene.hold((1, Side::Min)).hold((1, Side::Max));
    for rows in [ConstraintKind::AtParticles, ConstraintKind::OverBoundary] {
        let scheme = Scheme::default().particles([7, 7]).constraint_kind(rows);
        for (scene, first, values) in [
            (
                between(held()).prescribe(Side::Min, 0, 0.1),
                "u_0 on face (1, Min) and u_0 on face (0, Min)",
                "[0.0, 0.1]",
            ),
            (
                between(held().prescribe(Side::Min, 0, 0.1)),
                "u_0 on face (0, Min) and u_0 on face (1, Min)",
                "[0.1, 0.0]",
            ),
        ] {
            if rows == ConstraintKind::OverBoundary {
                let overruled = rkpm::check::scene(&scene, &scheme).unwrap().overruled;
                assert!(matches!(overruled[0], BoundaryError::Overruled { component: 0, .. }), "{overruled:?}");
                says(
                    &overruled[0],
                    &["u_0 on face (0, Min) holds at X = [0.0, 0.0]", "u_0 on face (1, Min)", "[0.1, 0.0]"],
                );
                continue;
            }
            refused!(
                refusal(&scene, &scheme),
                Error::Boundary(BoundaryError::Conflict { component: 0, .. }),
                [first, "X = [0.0, 0.0]", values]
            );
        }
        // Other components, and values that come down to the corners, stand beside each other.
        for scene in [
            between(held()).prescribe(Side::Min, 0, Value::field(|x: &Point<2>| 0.4 * x[1] * (1.0 - x[1]))),
            held().prescribe((1, Side::Min), 1, 0.0).prescribe((1, Side::Max), 1, 0.0).prescribe(Side::Min, 0, 0.1),
        ] {
            scene.discretize(&scheme).unwrap();
        }
    }
}

#[test]
fn rows_over_one_face_that_conflict() {
    // One face, one component, two values; the second may not be dropped in silence.
    let over = coarse().constraint_kind(ConstraintKind::OverBoundary);
    let error = refusal(&sound().prescribe(Side::Max, 0, 0.2), &over);
    assert!(
        matches!(error, Error::Boundary(BoundaryError::Conflict { .. } | BoundaryError::Dependent { .. })),
        "{error:?}"
    );
    says(&error, &["u_0 on face (0, Max)", "remove"]);
}

#[test]
fn rows_that_depend_on_each_other() {
    // A row and its double, whichever way rows are enforced.
    for constraint_method in [ConstraintMethod::Transformation, ConstraintMethod::Multipliers] {
        let mut problem = sound().discretize(&coarse().constraint_method(constraint_method)).unwrap();
        let mut row = problem.equations().equations()[3].clone();
        row.entries.iter_mut().for_each(|e| e.1 *= -2.0);
        row.label = "the double of a row".into();
        problem.constrain("double", |rows| Ok(rows.push(row)?)).unwrap();
        let rows = problem.equations().equations().len();
        let error = problem.run().unwrap_err();
        let Error::Boundary(BoundaryError::Dependent { equation: row, .. }) = &error else { panic!("{error:?}") };
        assert!(*row == rows - 1 || *row == 3, "{error}");
        says(&error, &["already implied by other conditions", "remove the repeated condition"]);
        // A sum of rows is found as well.
        let mut problem = sound().discretize(&coarse().constraint_method(constraint_method)).unwrap();
        let (a, b) = (problem.equations().equations()[0].clone(), problem.equations().equations()[1].clone());
        let entries = a.entries.iter().chain(&b.entries).copied().collect();
        let sum = ConstraintEquation { entries, label: "a sum of rows".into(), ..a };
        problem.constrain("sum", |rows| Ok(rows.push(sum)?)).unwrap();
        let error = problem.run().unwrap_err();
        assert!(matches!(error, Error::Boundary(BoundaryError::Dependent { .. })), "{error:?}");
    }
    // A row of nothing is refused on the spot.
    let mut rows = Constraints::default();
    let empty = ConstraintEquation {
        entries: vec![(0, 0.0)],
        dependent: 0,
        target: 0.0,
        amplitude: Amplitude::Ramp,
        label: "nothing".into(),
    };
    refused!(rows.push(empty.clone()).unwrap_err(), BoundaryError::Dependent { .. }, ["nothing", "remove"]);
    let bad = ConstraintEquation { entries: vec![(0, NAN)], label: "bad".into(), ..empty.clone() };
    refused!(rows.push(bad).unwrap_err(), BoundaryError::Value { .. }, ["bad", "finite"]);
    // A row beyond the model names itself.
    let mut problem = sound().discretize(&coarse()).unwrap();
    let far = ConstraintEquation { entries: vec![(1000, 1.0)], label: "far row".into(), ..empty };
    problem.constrain("far", |rows| Ok(rows.push(far)?)).unwrap();
    refused!(
        problem.run().unwrap_err(),
        Error::Boundary(BoundaryError::Unsuitable { .. }),
        ["far row", "beyond the 40 of the model"]
    );
    // Over a boundary and at all of the same particles: more rows than the face can bear apart.
    let held = |rows, constraint_method| {
        sound().discretize(&coarse().constraint_kind(rows).constraint_method(constraint_method)).unwrap()
    };
    for constraint_method in [ConstraintMethod::Transformation, ConstraintMethod::Multipliers] {
        let mut problem = held(ConstraintKind::OverBoundary, constraint_method);
        for row in held(ConstraintKind::AtParticles, constraint_method).equations().equations().iter().take(4) {
            problem.constrain(row.label.clone(), |rows| Ok(rows.push(row.clone())?)).unwrap();
        }
        let error = problem.run().unwrap_err();
        assert!(matches!(error, Error::Boundary(BoundaryError::Dependent { .. })), "{error:?}");
    }
    // Everything prescribed: nothing to solve.
    let mut all = Scene::new(Block::new([6.0], [8.0]), RadialCylinder, rubber());
    for x in [6.0, 7.0, 8.0] {
        all = all.prescribe(Place::at([x]), 0, 0.1 * x);
    }
    refused!(
        refusal(&all, &Scheme::default().particles([3]).constraint_method(ConstraintMethod::Transformation)),
        Error::Solve(SolveError::Empty { what: "free unknowns", .. }),
        ["free unknowns", "every displacement is prescribed"]
    );
    // A transformation beyond its limit names the other way.
    let mut problem = sound().discretize(&coarse()).unwrap();
    problem.analysis_mut().enforcement = Box::new(MixedTransformation { limit: 2 });
    refused!(
        problem.run().unwrap_err(),
        Error::Boundary(BoundaryError::Unsuitable { .. }),
        ["the limit is 2", "Lagrange multipliers"]
    );
}

/// Matrices as they are given.
struct Given(Enforced);

impl Enforcement for Given {
    fn bind(&self, _: &Pattern, _: &Constraints) -> Result<Enforced, BoundaryError> {
        Ok(self.0.clone())
    }
}

#[test]
fn enforcements_that_do_not_fit() {
    let mut problem = sound().discretize(&coarse()).unwrap();
    let mut refused = |enforced: Enforced, words: &[&str]| {
        problem.analysis_mut().enforcement = Box::new(Given(enforced));
        refused!(problem.run().unwrap_err(), Error::Boundary(BoundaryError::Unsuitable { .. }), words);
    };
    let block =
        Eliminated { unknowns: vec![0], free: vec![3], transfer: vec![0.5], equations: vec![0], offsets: vec![1.0] };
    let of = |eliminated: Vec<Eliminated>| Enforced { eliminated, multipliers: true, ..Enforced::default() };
    refused(Enforced::default(), &["u_0 on face (0, Min)", "is not enforced", "take multipliers"]);
    refused(Enforced { penalty: vec![1.0], ..Enforced::default() }, &["a penalty of at least 0 for each"]);
    refused(Enforced { penalty: vec![-1.0; 12], ..Enforced::default() }, &["a penalty of at least 0 for each"]);
    refused(of(vec![Eliminated { transfer: Vec::new(), ..block.clone() }]), &["a row of W and V"]);
    refused(of(vec![Eliminated { free: vec![400], ..block.clone() }]), &["no unknown 400"]);
    refused(of(vec![Eliminated { unknowns: vec![400], ..block.clone() }]), &["unknown 400"]);
    refused(of(vec![Eliminated { equations: vec![400], ..block.clone() }]), &["constraint equation 400"]);
    refused(of(vec![block.clone(), block.clone()]), &["unknown 0", "once"]);
    // The equations over the face share their unknowns.
    refused(of(vec![block]), &["has unknowns that others express", "together"]);
}

#[test]
fn material_constants() {
    for k in [0.0, -1.0, NAN, INFINITY] {
        refused!(
            Rubber::neo_hookean(0.4, k).unwrap_err(),
            MaterialError::Invalid(_),
            ["material constant k = ", "finite number above zero"]
        );
    }
    refused!(Rubber::yeoh(0.4, NAN, 0.0, 1e3).unwrap_err(), MaterialError::Invalid(_), ["A_20 = NaN", "finite number"]);
    refused!(Rubber::mooney_rivlin(0.4, INFINITY, 1e3).unwrap_err(), MaterialError::Invalid(_), ["A_01 = inf"]);
    refused!(Rubber::polynomial([], 1e3).unwrap_err(), MaterialError::Empty, ["give at least one term A_mn"]);
    refused!(Rubber::polynomial([((0, 0), 1.0)], 1e3).unwrap_err(), MaterialError::Invalid(_), ["A_00", "m + n >= 1"]);
    refused!(
        Rubber::polynomial([((400, 0), 1.0)], 1e3).unwrap_err(),
        MaterialError::Invalid(_),
        ["A_4000", "exponents up to 12"]
    );
}

#[test]
fn loads() {
    let on = |scene: Scene<2>| refusal(&scene, &coarse());
    for bad in [NAN, INFINITY] {
        for (scene, label) in [
            (sound().pressure((1, Side::Max), bad), "pressure on face (1, Max)"),
            (sound().traction((1, Side::Max), [0.0, bad]), "traction on face (1, Max)"),
            (sound().with(Load::body_force([bad, 0.0])), "body force"),
            (sound().with(Load::force(Place::at([2.0, 1.0]), [bad, 0.0])), "point load at [2.0, 1.0]"),
            (sound().prescribe((1, Side::Max), 1, bad), "u_1 on face (1, Max)"),
            (sound().prescribe(Place::at([2.0, 1.0]), 1, bad), "u_1 at [2.0, 1.0]"),
            (
                sound().prescribe(
                    (1, Side::Max),
                    1,
                    Value::field(move |x: &Point<2>| if x[0] > 1.0 { bad } else { 0.0 }),
                ),
                "u_1 on face",
            ),
        ] {
            refused!(on(scene), Error::Boundary(BoundaryError::Value { .. }), [label, "give finite numbers"]);
        }
    }
}

#[test]
fn loads_that_vary_and_are_no_numbers_somewhere() {
    let top = (1, Side::Max);
    for bad in [NAN, INFINITY] {
        let right = move |x: &Point<2>| if x[0] > 1.5 { bad } else { 0.1 };
        let late = move |_: &Point<2>, load: f64| if load > 0.9 { bad } else { load };
        for (scene, label, load) in [
            (sound().pressure(top, Value::field(right)), "pressure on face (1, Max) at X = [1.", 0.0),
            (
                sound().traction(top, Value::field(move |x| [0.0, right(x)])),
                "traction on face (1, Max) at X = [1.",
                0.0,
            ),
            (sound().with(Load::body_force(Value::field(move |x| [right(x), 0.0]))), "body force at X = [1.", 0.0),
            (sound().pressure(top, Value::motion(late)), "pressure on face (1, Max) at X = [", 1.0),
        ] {
            let words = [label, &format!("at load factor {load}"), "give finite numbers"];
            refused!(refusal(&scene, &coarse()), Error::Boundary(BoundaryError::Value { .. }), words);
        }
    }
    // A load that is finite at all load factors checked before the run stops the run later, with the place.
    let gap = |x: &Point<2>, load: f64| if x[0] > 1.5 && (0.3..0.4).contains(&load) { NAN } else { 0.01 * load };
    let scene = sound().pressure(top, Value::motion(gap));
    let stops = coarse().stepping(Stepping::equal(20));
    let error = scene.discretize(&stops).unwrap().run().unwrap().completed().unwrap_err();
    says(&error, &["forces or load slopes are not finite, at X = [1."]);
}

#[test]
fn amplitudes() {
    let table = |pairs: &[(f64, f64)]| Amplitude::table(pairs.to_vec()).unwrap_err();
    let remedy = "at least two (load factor, value) pairs with growing, finite load factors";
    refused!(table(&[]), BoundaryError::Amplitude { .. }, ["fewer than two pairs", remedy]);
    refused!(table(&[(0.0, 0.0)]), BoundaryError::Amplitude { .. }, ["fewer than two pairs", remedy]);
    refused!(table(&[(0.0, 0.0), (1.0, NAN)]), BoundaryError::Amplitude { .. }, ["not finite", remedy]);
    refused!(table(&[(0.0, 0.0), (INFINITY, 1.0)]), BoundaryError::Amplitude { .. }, ["not finite", remedy]);
    refused!(table(&[(0.0, 0.0), (0.0, 1.0)]), BoundaryError::Amplitude { .. }, ["do not rise", remedy]);
    refused!(table(&[(0.5, 0.0), (0.2, 1.0)]), BoundaryError::Amplitude { .. }, ["do not rise", remedy]);
}

#[test]
fn amplitudes_put_together_without_the_check() {
    let lattice = Block::new([0.0, 0.0], [2.0, 1.0]).lattice([5, 4]).unwrap();
    let functions = ReproducingKernel::new(lattice.particles(1.0).unwrap(), CubicSpline, Polynomial::linear()).unwrap();
    let face = lattice.boundary(&Side::Max.into(), 1, 2).unwrap().points;
    let table = ShapeTable::new(&functions, &face, &PlaneStrain).unwrap();
    // The scene must look at them again, and so must models put together by hand.
    for bad in [vec![], vec![(0.0, 0.0), (0.5, NAN), (1.0, 1.0)], vec![(1.0, 0.0), (0.0, 1.0)]] {
        let amplitude = Amplitude::Table(bad.clone());
        let dead = Pointwise::new(table.clone(), DeadLoad { force: Vector3::x(), amplitude: amplitude.clone() });
        let pressure = Pointwise::new(table.clone(), FollowerPressure { pressure: 0.1, amplitude: amplitude.clone() });
        for error in [dead.validate().unwrap_err(), pressure.validate().unwrap_err()] {
            refused!(error, SolveError::Invalid(_), ["amplitude table of", "at least two"]);
        }
        let mut equations = Constraints::default();
        let error = equations.at_particles(&functions, &[0], 0, &|_| 0.1, &amplitude, "pulled").unwrap_err();
        refused!(
            error,
            Error::Boundary(BoundaryError::Amplitude { .. }),
            ["amplitude table of pulled", "at least two"]
        );
        for scene in [
            sound().with(Load::pressure((1, Side::Max), 0.1).amplitude(Amplitude::Table(bad.clone()))),
            sound().with(Condition::on((1, Side::Max)).component(1, 0.1).amplitude(Amplitude::Table(bad.clone()))),
        ] {
            let error = refusal(&scene, &coarse());
            assert!(
                matches!(error, Error::Boundary(BoundaryError::Amplitude { .. } | BoundaryError::Value { .. })),
                "{error:?}"
            );
        }
    }
    // So must the clock of a model, which may not fall either.
    for pairs in [vec![], vec![(0.0, 1.0), (1.0, 0.0)]] {
        let clock = Some(Amplitude::Table(pairs));
        let error = Model::new(lattice.positions()).set_clock(clock).map(|_| ()).unwrap_err();
        refused!(error, BoundaryError::Amplitude { .. }, ["amplitude table of the clock"]);
    }
}

#[test]
fn integration() {
    let gauss = |zones: Option<Vec<usize>>, points| refusal(&sound(), &coarse().rule(Rule::Gauss { zones, points }));
    for error in [gauss(None, Some(0)), gauss(Some(vec![2]), Some(0)), gauss(None, Some(65))] {
        refused!(
            error,
            Error::Geometry(GeometryError::Count { .. }),
            ["integration points per direction: ", "1 to 64 are possible"]
        );
    }
    refused!(
        gauss(Some(vec![0]), None),
        Error::Geometry(GeometryError::Count { count: 0, .. }),
        ["integration zones: 0 given", "at least 1"]
    );
    refused!(
        gauss(Some(vec![1, 2, 3]), None),
        Error::Geometry(GeometryError::Count { count: 3, .. }),
        ["integration zones: 3 given", "one number for each axis"]
    );
    refused!(
        refusal(&sound(), &coarse().rule(Rule::Smoothed { parts: 0 })),
        Error::Geometry(GeometryError::Count { count: 0, .. }),
        ["sub-cells per direction: 0 given", "at least 1"]
    );
    refused!(gauss_legendre(0).unwrap_err(), GeometryError::Count { count: 0, .. }, ["0 given"]);
}

/// The state at rest of a problem.
fn rest<const D: usize>(problem: &Problem<D>) -> State {
    State {
        displacement: vec![0.0; problem.model().unknowns()],
        terms: problem.model().start(),
        multipliers: vec![0.0; problem.equations().equations().len()],
        ..State::default()
    }
}

#[test]
fn first_guesses() {
    let problem = sound().discretize(&coarse()).unwrap();
    let run = |start: State| problem.analysis().resume(problem.model(), problem.equations(), start, &mut ());
    run(rest(&problem)).unwrap().completed().unwrap();
    // Mirrored about x = 0: J = −1 everywhere.
    let mut inverted = rest(&problem);
    for (d, x) in inverted.displacement.chunks_exact_mut(2).zip(problem.cells().positions()) {
        d[0] = -2.0 * x[0];
    }
    let error = run(inverted).unwrap_err();
    let Error::Solve(SolveError::InvertedStart { jacobian, at }) = &error else { panic!("{error:?}") };
    assert_abs_diff_eq!(*jacobian, -1.0, epsilon = 1e-12);
    assert_eq!(at.len(), 2);
    says(&error, &["J = -", "at X = [", "zero displacement is one"]);
    // Inverted at one particle alone: the place is near it.
    let mut pinched = rest(&problem);
    let corner = problem.lattice().unwrap().node([4, 3]);
    pinched.displacement[2 * corner] = -3.0;
    let error = run(pinched).unwrap_err();
    let Error::Solve(SolveError::InvertedStart { at, .. }) = &error else { panic!("{error:?}") };
    assert!(at[0] > 1.0 && at[1] > 0.5, "{at:?}");
    let mut nowhere = rest(&problem);
    nowhere.displacement[7] = NAN;
    refused!(run(nowhere).unwrap_err(), Error::Invalid(_), ["first state", "NaN", "give finite numbers"]);
    // Vectors of the wrong length.
    let mut short = rest(&problem);
    short.displacement.pop();
    refused!(
        run(short).unwrap_err(),
        Error::Solve(SolveError::OtherModel { what: "displacement", given: 39, needed: 40 }),
        ["another problem", "displacement has 39 entries, this problem has 40"]
    );
    let mut short = rest(&problem);
    short.multipliers.push(0.0);
    assert!(matches!(run(short).unwrap_err(), Error::Solve(SolveError::OtherModel { what: "multipliers", .. })));
    let mut short = rest(&problem);
    short.terms[0].condensed.pop();
    assert!(matches!(run(short).unwrap_err(), Error::Solve(SolveError::OtherModel { what: "condensed unknowns", .. })));
    // Pressures, multipliers and times that are no numbers.
    for spoil in [
        |s: &mut State| s.terms[0].condensed.fill(NAN),
        |s: &mut State| s.multipliers[0] = INFINITY,
        |s: &mut State| s.time = NAN,
    ] {
        let mut bad = rest(&problem);
        spoil(&mut bad);
        refused!(run(bad).unwrap_err(), Error::Invalid(_), ["first state", "give finite numbers"]);
    }
    // A model without terms.
    let empty = Model::new(problem.cells().positions());
    refused!(
        Analysis::default().run(&empty, &Constraints::default(), &mut ()).unwrap_err(),
        Error::Solve(SolveError::Empty { what: "terms", .. }),
        ["no terms", "add at least a body"]
    );
}

#[test]
fn local_unknowns_of_other_terms() {
    // As many in all as the model has, but not those of its terms.
    let loaded = sound().pressure((1, Side::Max), 0.01).discretize(&coarse()).unwrap();
    let mut swapped = rest(&loaded);
    swapped.terms.reverse();
    let error = loaded.analysis().resume(loaded.model(), loaded.equations(), swapped, &mut ()).unwrap_err();
    assert!(matches!(error, Error::Solve(SolveError::OtherModel { what: "condensed unknowns", .. })), "{error:?}");
    let mut few = rest(&loaded);
    few.terms.pop();
    let error = loaded.analysis().resume(loaded.model(), loaded.equations(), few, &mut ()).unwrap_err();
    assert!(matches!(error, Error::Solve(SolveError::OtherModel { what: "terms", .. })), "{error:?}");
}

#[test]
fn load_factors_that_are_no_numbers() {
    // They must not pass for a complete analysis.
    let problem = sound().discretize(&coarse()).unwrap();
    let start = State { load: NAN, ..rest(&problem) };
    match problem.analysis().resume(problem.model(), problem.equations(), start, &mut ()) {
        Err(error) => assert!(matches!(error, Error::Invalid(_)), "{error:?}"),
        Ok(path) => panic!("accepted, and ended with {:?}", path.ending),
    }
}

#[test]
fn settings() {
    let run = |newton: Newton, stepping: Stepping| {
        let mut problem = sound().discretize(&coarse()).unwrap();
        problem.analysis_mut().newton = newton;
        problem.analysis_mut().stepping = stepping;
        problem.run().unwrap_err()
    };
    let (newton, stepping) = (Newton::default(), Stepping::default());
    for tolerance in [0.0, -1e-8, 1.0, NAN] {
        refused!(
            run(Newton { tolerance, ..newton }, stepping),
            Error::Invalid(_),
            ["Newton tolerance", "between 0 and 1"]
        );
    }
    refused!(run(Newton { iterations: 0, ..newton }, stepping), Error::Invalid(_), ["at least one iteration"]);
    for (bad, what) in [
        (Stepping { first: 0.0, ..stepping }, "first load increment"),
        (Stepping { first: 2.0, ..stepping }, "first load increment"),
        (Stepping { first: NAN, ..stepping }, "first load increment"),
        (Stepping { smallest: 0.0, ..stepping }, "smallest load increment"),
        (Stepping { smallest: 0.5, first: 0.1, ..stepping }, "smallest load increment"),
        (Stepping { largest: 0.1, ..stepping }, "largest load increment"),
        (Stepping { largest: INFINITY, ..stepping }, "largest load increment"),
        (Stepping { growth: 0.9, ..stepping }, "growth of the load increment"),
        (Stepping { growth: NAN, ..stepping }, "growth of the load increment"),
    ] {
        refused!(run(newton, bad), Error::Invalid(_), [what, "increments are above 0", "growth is from 1 to 1000"]);
    }
}

#[test]
fn pins_on_prescribed_faces() {
    for rows in [ConstraintKind::OverBoundary, ConstraintKind::AtParticles] {
        let scheme = coarse().constraint_kind(rows);
        let run = |scene: Scene<2>| {
            let problem = scene.discretize(&scheme).unwrap();
            let path = problem.run().unwrap().completed().unwrap();
            (problem.equations().equations().len(), path.last().displacement.clone())
        };
        // What the face says already is taken once, whether the pin comes before it or behind it.
        let alone = run(sound());
        assert_eq!(run(sound().prescribe(Place::at([2.0, 1.0]), 0, 0.1)), alone);
        assert_eq!(
            run(sound().with(Condition::on(Place::at([0.0, 0.0])).component(1, 0.0).amplitude(Amplitude::Constant))),
            alone
        );
        let before = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber())
            .prescribe(Place::at([2.0, 1.0]), 0, 0.1)
            .hold(Side::Min)
            .prescribe(Side::Max, 0, Value::motion(|_: &Point<2>, load| 0.1 * load));
        let (count, displacement) = run(before);
        assert_eq!(count, alone.0);
        for (d, same) in displacement.iter().zip(&alone.1) {
            assert_abs_diff_eq!(d, same, epsilon = 1e-9);
        }
        // Another component is another matter.
        assert_eq!(run(sound().prescribe(Place::at([2.0, 1.0]), 1, 0.0)).0, alone.0 + 1);
        // What it denies is refused, at the last load and on the way.
        let pin = sound().prescribe(Place::at([2.0, 1.0]), 0, 0.2);
        let late = Amplitude::table(vec![(0.0, 0.0), (0.5, 0.0), (1.0, 1.0)]).unwrap();
        for scene in [pin, sound().with(Condition::on(Place::at([2.0, 1.0])).component(0, 0.1).amplitude(late))] {
            refused!(
                refusal(&scene, &scheme),
                Error::Boundary(BoundaryError::Conflict { component: 0, .. }),
                ["u_0 on face (0, Max) and u_0 at [2.0, 1.0]", "X = [2.0, 1.0]", "remove one"]
            );
        }
    }
}

#[test]
fn conditions_that_say_nothing() {
    refused!(
        refusal(&sound().with(Condition::on((1, Side::Max)).named("guide")), &coarse()),
        Error::Boundary(BoundaryError::Incomplete { .. }),
        ["guide prescribes nothing", "add a component"]
    );
    // Directions that are none: of no length, on the axis of a cylinder, of a normal that a point has not.
    let guide = |place: Place<2>, direction| sound().with(Condition::on(place).along(direction, 0.0).named("guide"));
    let on_top = || Place::on((1, Side::Max));
    for scene in [
        guide(on_top(), Direction::Along([0.0, 0.0])),
        guide(on_top(), Direction::Along([NAN, 0.0])),
        guide(Place::at([2.0, 1.0]), Direction::radial([2.0, 1.0], [0.0, 0.0, 1.0])),
        guide(Place::at([2.0, 1.0]), Direction::Normal),
    ] {
        for rows in [ConstraintKind::AtParticles, ConstraintKind::OverBoundary] {
            refused!(
                refusal(&scene, &coarse().constraint_kind(rows)),
                Error::Boundary(BoundaryError::Direction { .. }),
                ["guide", "direction is undefined at X = ["]
            );
        }
    }
    // Parts of parts that hold nothing.
    let nowhere = || on_top().within(|x: &Point<2>| x[0] > 5.0);
    for rows in [ConstraintKind::AtParticles, ConstraintKind::OverBoundary] {
        let condition = sound().with(Condition::on(nowhere()).component(1, 0.1));
        let error = refusal(&condition, &coarse().constraint_kind(rows));
        refused!(error, Error::Boundary(BoundaryError::Empty { .. }), ["some of face (1, Max)"]);
        for load in [Load::pressure(nowhere(), 0.1), Load::force(nowhere(), [0.0, 0.1])] {
            let error = refusal(&sound().with(load), &coarse().constraint_kind(rows));
            refused!(error, Error::Boundary(BoundaryError::NoFacet { .. }), ["some of face (1, Max)"]);
        }
    }
}

#[test]
fn motions_beyond_the_axis_of_revolution() {
    // Both stretches turn negative on the way: J > 0 in the end, and a bore of negative radius.
    let tube = || Scene::new(Block::new([1.0], [2.0]), RadialCylinder, rubber());
    let scheme = Scheme::default().particles([9]);
    for scene in [tube().prescribe(Side::Min, 0, -1.5), tube().prescribe(Place::at([1.0]), 0, -1.0)] {
        refused!(
            refusal(&scene, &scheme),
            Error::Boundary(BoundaryError::BeyondAxis { .. }),
            ["u_0", "X = [1.0]", "axis of symmetry", "load factor 1"]
        );
    }
    let problem = tube().prescribe(Side::Min, 0, -0.5).discretize(&scheme).unwrap();
    // A state beyond the axis is inverted, though its J is positive everywhere: u = −2.5 X, both stretches −1.5.
    let mut state = problem.at_rest();
    for (d, x) in state.displacement.iter_mut().zip(problem.positions()) {
        *d = -2.5 * x[0];
    }
    assert!(problem.deformation_gradients(&state).unwrap().iter().all(|f| f.determinant() > 0.0));
    let error = problem.analysis().resume(problem.model(), problem.equations(), state, &mut ()).unwrap_err();
    assert!(matches!(error, Error::Solve(SolveError::InvertedStart { .. })), "{error:?}");
}

#[test]
fn amplitudes_that_are_no_numbers() {
    let broken = || Amplitude::Function(std::sync::Arc::new(|load: f64| if load > 0.4 { f64::NAN } else { load }));
    for (scene, label) in [
        (
            sound().with(Load::pressure((1, Side::Max), 0.1).amplitude(broken())),
            "amplitude of pressure on face (1, Max)",
        ),
        (
            sound().with(Condition::on((1, Side::Max)).component(1, 0.1).amplitude(broken())),
            "amplitude of condition on face (1, Max)",
        ),
    ] {
        refused!(
            refusal(&scene, &coarse()),
            Error::Boundary(BoundaryError::Value { .. }),
            [label, "at load factor 0.5", "finite"]
        );
    }
}

#[test]
fn places_that_can_not_take_what_is_put_there() {
    // Some of a point, which has no parts.
    let some = || Place::at([2.0, 1.0]).within(|x: &Point<2>| x[0] > 5.0);
    for scene in [
        sound().prescribe(some(), 1, 0.1),
        sound().with(Load::force(some(), [0.0, 0.1])),
        sound().rigid("pin", some()),
        sound().name("corner", some()).prescribe("corner", 1, 0.1),
    ] {
        refused!(refusal(&scene, &coarse()), Error::Incompatible(_), ["a single point", "leave Place::within out"]);
    }
    // A force per area of an axis, which has none.
    let solid = Scene::new(Block::new([0.0, 0.0], [1.0, 2.0]), Axisymmetric, rubber()).hold((1, Side::Min));
    for scheme in [coarse(), Scheme::elements(1).particles([5, 4])] {
        let force = |place: Place<2>| solid.clone().with(Load::force(place, [0.0, 0.1]));
        let error = refusal(&force(Place::on((0, Side::Min))), &scheme);
        refused!(error, Error::Incompatible(_), ["force on face (0, Min)", "without area", "Place::at"]);
        assert!(force(Place::at([0.0, 2.0])).discretize(&scheme).is_ok());
    }
}
