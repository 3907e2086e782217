//! Homogeneous states of every named law in every kinematics, against closed forms of their energies in principal stretches.

use approx::{abs_diff_eq, relative_eq};
use num_dual::{Dual64, DualNum};
use rkpm::kinematics::Kinematics;
use rkpm::material::{FoamTerm, Material, Mode};
use rkpm::prelude::*;
use std::sync::Arc;

const BULK: f64 = 40.0;

/// Energies as functions of the principal stretches, written down as the papers have them.
#[derive(Clone, Copy, Debug)]
enum Closed {
    Polynomial([f64; 3]),
    Ogden([(f64, f64); 2]),
    Hencky(f64),
    Gent(f64, f64, f64),
    ArrudaBoyce(f64, f64),
    Carroll([f64; 3]),
    Tube([f64; 4]),
    BlatzKo(f64),
    Foam(f64, f64, f64),
}

const LAWS: [Closed; 10] = [
    Closed::Polynomial([0.373, -0.031, 0.005]),
    Closed::Ogden([(0.618, 1.3), (-0.00981, -2.0)]),
    Closed::Hencky(0.4),
    Closed::Gent(0.4, 30.0, 0.0),
    Closed::Gent(0.3, 30.0, 0.1),
    Closed::ArrudaBoyce(0.3, 3.0),
    Closed::Carroll([0.15, 3.1e-7, 0.095]),
    Closed::Tube([0.19, 0.2, 0.3, 0.1]),
    Closed::BlatzKo(0.4),
    Closed::Foam(0.3, 3.5, 0.2),
];

impl Closed {
    fn material(self) -> Arc<dyn Material> {
        match self {
            Closed::Polynomial([a, b, c]) => Arc::new(Rubber::yeoh(a, b, c, BULK).unwrap()),
            Closed::Ogden(terms) => Arc::new(Rubber::ogden(terms, BULK).unwrap()),
            Closed::Hencky(mu) => Arc::new(Rubber::hencky(mu, BULK).unwrap()),
            Closed::Gent(mu, limit, 0.0) => Arc::new(Rubber::gent(mu, limit, BULK).unwrap()),
            Closed::Gent(mu, limit, second) => Arc::new(Rubber::gent_gent(mu, limit, second, BULK).unwrap()),
            Closed::ArrudaBoyce(mu, locking) => Arc::new(Rubber::arruda_boyce(mu, locking, BULK).unwrap()),
            Closed::Carroll([a, b, c]) => Arc::new(Rubber::carroll(a, b, c, BULK).unwrap()),
            Closed::Tube([c, e, beta, delta]) => Arc::new(Rubber::extended_tube(c, e, beta, delta, BULK).unwrap()),
            Closed::BlatzKo(mu) => Arc::new(Rubber::blatz_ko(mu, 0.25, 0.0).unwrap()),
            Closed::Foam(shear, exponent, poisson) => {
                Arc::new(Rubber::foam([FoamTerm { shear, exponent, poisson }]).unwrap())
            }
        }
    }

    fn energy(self, l: [Dual64; 3]) -> Dual64 {
        let j = l[0] * l[1] * l[2];
        let bar = l.map(|x| x * j.powf(-1.0 / 3.0));
        let powers = |x: [Dual64; 3], a: f64| x[0].powf(a) + x[1].powf(a) + x[2].powf(a);
        let (i1, i2) = (powers(bar, 2.0), powers(bar, -2.0));
        let volume = (j - 1.0) * (j - 1.0) * (0.5 * BULK);
        match self {
            Closed::Polynomial([a, b, c]) => {
                let x = i1 - 3.0;
                volume + x * a + x * x * b + x * x * x * c
            }
            Closed::Ogden(terms) => {
                terms.iter().fold(volume, |sum, &(mu, alpha)| sum + (powers(bar, alpha) - 3.0) * (mu / alpha))
            }
            Closed::Hencky(mu) => bar.iter().fold(volume, |sum, x| sum + x.ln() * x.ln() * mu),
            Closed::Gent(mu, limit, second) => {
                volume - ((i1 - 3.0) / -limit + 1.0).ln() * (0.5 * mu * limit) + (i2 / 3.0).ln() * second
            }
            Closed::ArrudaBoyce(mu, locking) => [0.5, 1.0 / 20.0, 11.0 / 1050.0, 19.0 / 7000.0, 519.0 / 673_750.0]
                .iter()
                .zip(1..)
                .fold(volume, |sum, (c, i)| sum + (i1.powi(i) - 3f64.powi(i)) * (mu * c / locking.powi(2 * i - 2))),
            Closed::Carroll([a, b, c]) => {
                volume + (i1 - 3.0) * a + (i1.powi(4) - 81.0) * b + (i2.sqrt() - 3f64.sqrt()) * c
            }
            Closed::Tube([c, e, beta, delta]) => {
                let (d, limit) = (i1 - 3.0, delta * delta);
                let left = d * -limit + 1.0;
                volume
                    + (d * (1.0 - limit) / left + left.ln()) * (0.5 * c)
                    + (powers(bar, -beta) - 3.0) * (2.0 * e / (beta * beta))
            }
            // µ/2 (I2/I3 + 2 √I3 - 5).
            Closed::BlatzKo(mu) => (powers(l, -2.0) + j * 2.0 - 5.0) * (0.5 * mu),
            Closed::Foam(mu, alpha, nu) => {
                let beta = nu / (1.0 - 2.0 * nu);
                (powers(l, alpha) - 3.0 + (j.powf(-alpha * beta) - 1.0) / beta) * (2.0 * mu / (alpha * alpha))
            }
        }
    }

    /// Nominal principal stresses.
    fn stresses(self, l: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|a| {
            let mut x = l.map(Dual64::from);
            x[a].eps = 1.0;
            self.energy(x).eps
        })
    }

    /// The lateral stretch without stress on its side, by bisection: `of` puts it among the three.
    fn free(self, side: usize, of: impl Fn(f64) -> [f64; 3]) -> [f64; 3] {
        let (mut low, mut high) = (0.3, 3.0);
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if self.stresses(of(middle))[side] < 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        of(0.5 * (low + high))
    }
}

/// A bar of unit area whose sides are held.
struct HeldBar;

impl Kinematics<1> for HeldBar {
    fn hoop_components(&self) -> &'static [usize] {
        &[]
    }
    fn measure(&self, _: &Point<1>) -> f64 {
        1.0
    }
}

/// The force on the end that is pulled, and the largest error of the stretches at any point.
fn pulled<const D: usize>(scene: Scene<D>, axis: usize, particles: [usize; D], l: [f64; 3]) -> (f64, f64) {
    // In one dimension particles are integrated by Gauss points, which leave 1e-6 of their rational functions.
    let scheme = if D == 1 { Scheme::elements(2) } else { Scheme::default() };
    let problem = scene.discretize(&scheme.particles(particles)).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    let force = problem.reaction(path.last(), (axis, Side::Max)).unwrap()[axis];
    let expected = nalgebra::Matrix3::from_diagonal(&l.into());
    let gradients = problem.deformation_gradients(path.last()).unwrap();
    (force, gradients.iter().map(|f| (f - expected).norm()).fold(0.0, f64::max))
}

use rkpm::nalgebra;

const STRETCH: f64 = 1.4;

fn agrees(law: Closed, kinematics: &str, (force, error): (f64, f64), exact: f64) {
    assert!(relative_eq!(force, exact, max_relative = 1e-8), "{law:?}, {kinematics}: {force} {exact}");
    assert!(error < 1e-8, "{law:?}, {kinematics}: stretches off by {error:e}");
}

#[test]
fn every_law_in_one_dimension() {
    for law in LAWS {
        let l = [0.95, 1.0, 1.0];
        let scene = Scene::new(Block::new([0.0], [2.0]), HeldBar, law.material())
            .prescribe((0, Side::Min), 0, 0.0)
            .prescribe((0, Side::Max), 0, 2.0 * (l[0] - 1.0));
        agrees(law, "a held bar", pulled(scene, 0, [5], l), law.stresses(l)[0]);
    }
}

/// A strip of length 2 and width 1 between smooth ends, pulled along its first axis.
fn strip(kinematics: impl Kinematics<2> + 'static, law: Closed) -> Scene<2> {
    Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), kinematics, law.material())
        .prescribe((0, Side::Min), 0, 0.0)
        .prescribe((1, Side::Min), 1, 0.0)
        .prescribe((0, Side::Max), 0, 2.0 * (STRETCH - 1.0))
}

#[test]
fn every_law_in_plane_strain() {
    for law in LAWS {
        let l = law.free(1, |x| [STRETCH, x, 1.0]);
        agrees(law, "plane strain", pulled(strip(PlaneStrain, law), 0, [5, 3], l), law.stresses(l)[0]);
    }
}

#[test]
fn every_law_in_plane_stress() {
    for law in LAWS {
        let l = law.free(1, |x| [STRETCH, x, x]);
        let sheet = PlaneStress { thickness: 0.25 };
        agrees(law, "plane stress", pulled(strip(sheet, law), 0, [5, 3], l), 0.25 * law.stresses(l)[0]);
        // Pulled in both directions alike.
        let l = law.free(2, |x| [STRETCH, STRETCH, x]);
        let scene = strip(sheet, law).prescribe((1, Side::Max), 1, STRETCH - 1.0);
        agrees(law, "plane stress, equibiaxial", pulled(scene, 0, [5, 3], l), 0.25 * law.stresses(l)[0]);
    }
}

#[test]
fn every_law_in_revolution() {
    for law in LAWS {
        let l = law.free(0, |x| [x, STRETCH, x]);
        let scene = Scene::new(Block::new([0.0, 0.0], [1.0, 2.0]), Axisymmetric, law.material())
            .prescribe((0, Side::Min), 0, 0.0)
            .prescribe((1, Side::Min), 1, 0.0)
            .prescribe((1, Side::Max), 1, 2.0 * (STRETCH - 1.0));
        let exact = std::f64::consts::PI * law.stresses(l)[1];
        agrees(law, "revolution", pulled(scene, 1, [3, 5], l), exact);
    }
}

#[test]
fn every_law_in_space() {
    for law in LAWS {
        let l = law.free(1, |x| [STRETCH, x, x]);
        let scene = Scene::new(Block::new([0.0; 3], [1.0; 3]), Solid, law.material())
            .prescribe((0, Side::Min), 0, 0.0)
            .prescribe((1, Side::Min), 1, 0.0)
            .prescribe((2, Side::Min), 2, 0.0)
            .prescribe((0, Side::Max), 0, STRETCH - 1.0);
        agrees(law, "space", pulled(scene, 0, [3, 3, 3], l), law.stresses(l)[0]);
    }
}

#[test]
fn homogeneous_tests_of_a_law_meet_closed_forms() {
    for law in LAWS {
        let material = law.material();
        for stretch in [0.5, 0.9, 1.3, 2.0] {
            let state = Mode::Planar.state(&material, stretch).unwrap();
            let l = law.free(2, |x| [stretch, 1.0, x]);
            assert!(abs_diff_eq!(state.stretches[2], l[2], epsilon = 1e-12), "{law:?} {stretch}");
            let (ours, exact) = (state.stress, law.stresses(l)[0]);
            assert!(
                abs_diff_eq!(ours, exact, epsilon = 1e-10 * (1.0 + exact.abs())),
                "{law:?} {stretch}: {ours} {exact}"
            );
        }
        assert!(Mode::Uniaxial.state(&material, 0.0).is_none() && Mode::Uniaxial.state(&material, f64::NAN).is_none());
    }
}

/// A sheet of rubber a thousand million times as stiff against changes of volume as of shape, sheared and pulled at
/// once: no digits are lost in the condensed tangent, and Newton's method converges with the square.
#[test]
fn incompressible_sheets_converge_with_the_square() {
    for bulk in [1e2, 1e5, 1e9] {
        let rubber = Rubber::ogden([(0.618, 1.3), (0.001245, 5.0), (-0.00981, -2.0)], bulk).unwrap();
        let scene = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStress { thickness: 0.1 }, rubber)
            .hold((0, Side::Min))
            .prescribe((0, Side::Max), 0, 1.0)
            .prescribe((0, Side::Max), 1, 0.5);
        let problem = scene.discretize(&Scheme::default().particles([9, 5])).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        assert!(path.iterations <= 9, "{bulk:e}: {} iterations", path.iterations);
        for f in problem.deformation_gradients(path.last()).unwrap() {
            assert!(abs_diff_eq!(f.determinant(), 1.0, epsilon = 2.0 / bulk), "{bulk:e}: J = {}", f.determinant());
        }
        for stress in problem.stresses(path.last()).unwrap() {
            assert!(abs_diff_eq!(stress[(2, 2)], 0.0, epsilon = 1e-9), "{bulk:e}: {stress}");
        }
    }
}

/// The pressure on the end of a strip is its Cauchy stress there: the area is that of the thickness that is left.
#[test]
fn following_pressures_on_sheets_are_stresses_of_the_thickness_that_is_left() {
    for law in LAWS {
        let scene = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStress { thickness: 0.25 }, law.material())
            .prescribe((0, Side::Min), 0, 0.0)
            .prescribe((1, Side::Min), 1, 0.0)
            .pressure((0, Side::Max), -0.2);
        let problem = scene.discretize(&Scheme::default().particles([5, 3])).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        assert!(path.iterations < 12, "{law:?}: {}", path.iterations);
        for stress in problem.stresses(path.last()).unwrap() {
            assert!(
                abs_diff_eq!(stress[(0, 0)], 0.2, epsilon = 1e-7) && abs_diff_eq!(stress[(1, 1)], 0.0, epsilon = 1e-7),
                "{law:?}: {stress}"
            );
        }
        let middle = problem.stress(path.last(), &[1.0, 0.5].into()).unwrap();
        assert!(
            abs_diff_eq!(middle[(0, 0)], 0.2, epsilon = 1e-6) && abs_diff_eq!(middle[(1, 1)], 0.0, epsilon = 1e-6),
            "{law:?}: {middle}"
        );
    }
}

#[test]
fn sheets_without_a_thickness_are_refused() {
    let scene = strip(PlaneStress { thickness: 0.0 }, LAWS[0]);
    assert!(scene.discretize(&Scheme::default().particles([5, 3])).is_err());
}
