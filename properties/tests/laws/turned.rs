//! Bodies that stand askew to the axes: what is turned answers as before, turned.

use std::sync::Arc;

use approx::{abs_diff_eq, assert_abs_diff_eq};
use rkpm::cells::{Cells, Lattice, Layout, Refined};
use rkpm::geometry::Mapped;
use rkpm::nalgebra::{Matrix2, Rotation3, SMatrix, Vector3};
use rkpm::particles::Support;
use rkpm::prelude::*;
use rkpm::scene::Rule;
use rkpm::shape::ReproducingKernel;

type ApproximationChoice<const D: usize> = ReproducingKernel<D, CubicSpline, Polynomial<D>>;

fn functions<const D: usize>(particles: Particles<D>, order: u8) -> ApproximationChoice<D> {
    ReproducingKernel::new(particles, CubicSpline, Polynomial::new(order)).unwrap()
}

fn plane_rotation(degrees: f64) -> Matrix2<f64> {
    let (sin, cos) = degrees.to_radians().sin_cos();
    Matrix2::new(cos, -sin, sin, cos)
}

/// A unit box whose lines bend and fan out.
fn fan<const D: usize>(unit: &Point<D>) -> Point<D> {
    Point::from_fn(
        |i, _| if i == 0 { 3.0 * unit[0] } else { unit[i] * (1.0 + 0.4 * unit[0]) + 0.3 * unit[0] * unit[0] },
    )
}

/// Values and gradients of both at points and their images: the same nodes, gradients turned.
fn same_functions<const D: usize>(
    here: &ApproximationChoice<D>,
    there: &ApproximationChoice<D>,
    map: &SMatrix<f64, D, D>,
    at: &[Point<D>],
) {
    for x in at {
        let psi = here.shape_functions(x).unwrap();
        let image = there.shape_functions(&(map * x)).unwrap();
        assert_eq!(psi.nodes, image.nodes, "{x:?}");
        for (a, _) in psi.nodes.iter().enumerate() {
            assert!(abs_diff_eq!(psi.values[a], image.values[a], epsilon = 1e-10), "{x:?}");
            // ∇ψ = Fᵀ ∇'ψ' for x' = F x.
            assert!(abs_diff_eq!(psi.gradients[a], map.tr_mul(&image.gradients[a]), epsilon = 1e-8), "{x:?}");
        }
    }
}

#[test]
fn turned_lattices_have_turned_functions() {
    let mut random = fastrand::Rng::with_seed(11);
    let jitter = Layout::Jittered { amount: 0.2, seed: 3 };
    for (degrees, order, layout) in [(5.0, 1, &Layout::Regular), (45.0, 2, &Layout::Regular), (-70.0, 1, &jitter)] {
        let turn = plane_rotation(degrees);
        let here = Lattice::new(&Mapped(fan::<2>), [9, 7], layout).unwrap();
        let there = Lattice::new(&Mapped(move |unit: &Point<2>| turn * fan(unit)), [9, 7], layout).unwrap();
        let at: Vec<Point<2>> = (0..40).map(|_| fan(&Point::from_fn(|_, _| random.f64()))).collect();
        let r = if order == 1 { 1.0 } else { 1.3 };
        same_functions(
            &functions(here.particles(r).unwrap(), order),
            &functions(there.particles(r).unwrap(), order),
            &turn,
            &at,
        );
        // What is kept of a lattice keeps its directions, and what is made of it has them too.
        let pair = [&here, &there].map(|lattice| functions(lattice.coarsened(2).particles(1.0).unwrap(), 1));
        same_functions(&pair[0], &pair[1], &turn, &at[..8]);
        let pair = [&here, &there].map(|lattice| functions(lattice.refined(2).unwrap().particles(1.0).unwrap(), 1));
        same_functions(&pair[0], &pair[1], &turn, &at[..8]);
    }
    let turn = *Rotation3::new(Vector3::new(0.4, -0.7, 0.2)).matrix();
    let here = Lattice::new(&Mapped(fan::<3>), [5, 4, 4], &Layout::Regular).unwrap();
    let there = Lattice::new(&Mapped(move |unit: &Point<3>| turn * fan(unit)), [5, 4, 4], &Layout::Regular).unwrap();
    let at: Vec<Point<3>> = (0..20).map(|_| fan(&Point::from_fn(|_, _| random.f64()))).collect();
    same_functions(
        &functions(here.particles(0.9).unwrap(), 1),
        &functions(there.particles(0.9).unwrap(), 1),
        &turn,
        &at,
    );
}

#[test]
fn lattices_along_the_axes_keep_boxes() {
    let boxes = |particles: &Particles<2>| particles.supports().iter().all(|s| matches!(s, Support::Box(_)));
    let block = Block::new([1.0, 2.0], [3.0, 9.0]);
    assert!(boxes(&block.particles([5, 9], 1.0).unwrap()));
    // Moved particles do not turn the lattice, nor does a quarter turn, which boxes do not see.
    let layout = Layout::Jittered { amount: 0.4, seed: 1 };
    assert!(boxes(&Lattice::new(&block, [5, 9], &layout).unwrap().particles(1.0).unwrap()));
    let quarter = Mapped(|unit: &Point<2>| Point::<2>::new(-unit[1], 2.0 * unit[0]));
    assert!(boxes(&Lattice::new(&quarter, [5, 9], &Layout::Regular).unwrap().particles(1.0).unwrap()));
    assert!(boxes(&Refined::new(Arc::new(block), [2, 2]).unwrap().refined(&[0]).unwrap().particles(1.0).unwrap()));
    // The paper's boxes run along the axes whatever the lattice does.
    let askew = Lattice::new(&Mapped(fan::<2>), [5, 5], &Layout::Regular).unwrap();
    assert!(boxes(&askew.particles_global(1.0).unwrap()) && !boxes(&askew.particles(1.0).unwrap()));
}

#[test]
fn refined_lattices_follow_affine_maps() {
    let mut random = fastrand::Rng::with_seed(5);
    let map = Matrix2::new(2.0, 0.7, -0.4, 0.6);
    let refined = |map: Matrix2<f64>| {
        let domain = Arc::new(Mapped(move |unit: &Point<2>| map * unit));
        let cells = Refined::new(domain, [4, 4]).unwrap().refined(&[0]).unwrap().refined(&[1, 4]).unwrap();
        functions(cells.particles(1.0).unwrap(), 1)
    };
    let at: Vec<Point<2>> = (0..60).map(|_| Point::from_fn(|_, _| random.f64())).collect();
    same_functions(&refined(Matrix2::identity()), &refined(map), &map, &at);
}

#[test]
fn half_axes_on_one_line_are_refused() {
    let positions = vec![Point::<2>::new(0.0, 0.0), Point::<2>::new(1.0, 0.0), Point::<2>::new(0.0, 1.0)];
    let flat = Support::Parallelepiped(Matrix2::new(1.0, 2.0, 1.0, 2.0));
    let error = Particles::new(positions.clone(), vec![Support::Ball(2.0), flat, Support::Ball(2.0)]).unwrap_err();
    assert!(error.to_string().contains("particle 1") && error.to_string().contains("half-axes"), "{error}");
    // However small, what encloses something is taken.
    let small = Support::Parallelepiped(Matrix2::new(1e-200, 0.0, 1e-200, 1e-200));
    assert!(Particles::new(positions, vec![Support::Ball(2.0), small, Support::Ball(2.0)]).is_ok());
}

#[test]
fn volumes_are_divided_by_those_of_supports() {
    // With equal supports and volumes densities cancel; with one volume of twice the size they don't.
    let lattice = Lattice::new(&Mapped(fan::<2>), [6, 5], &Layout::Regular).unwrap();
    let particles = lattice.particles(1.1).unwrap();
    let measure = |support: &Support<2>| match support {
        Support::Parallelepiped(axes) => axes.determinant().abs(),
        _ => panic!("askew"),
    };
    let volumes: Vec<f64> = particles.supports().iter().map(measure).collect();
    let plain = functions(particles.clone(), 1);
    let dense = functions(particles.with_volumes(volumes).unwrap(), 1);
    let at = fan(&Point::<2>::new(0.31, 0.62));
    let (a, b) = (plain.shape_functions(&at).unwrap(), dense.shape_functions(&at).unwrap());
    assert_eq!(a.nodes, b.nodes);
    assert_abs_diff_eq!(a.values[..], b.values[..], epsilon = 1e-13);
    assert_abs_diff_eq!(a.gradients[..], b.gradients[..], epsilon = 1e-12);
}

/// A cantilever of 20 × 1 with cells of 2 × 1/8, bent by its end, turned by an angle.
fn turned_beam(degrees: f64, scheme: &Scheme) -> (f64, f64) {
    let turn = plane_rotation(degrees);
    let place = move |x: f64, y: f64| turn * Point::<2>::new(x, y);
    let beam = Mapped(move |unit: &Point<2>| place(20.0 * unit[0], unit[1]));
    let force = place(0.0, 3e-4);
    let scene = Scene::new(beam, PlaneStrain, Rubber::neo_hookean(0.5, 1e3).unwrap())
        .hold((0, Side::Min))
        .traction((0, Side::Max), [force[0], force[1]]);
    let problem = scene.discretize(scheme).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    (problem.displacement(path.last(), &place(20.0, 0.0)).unwrap().norm(), problem.energy(path.last()).unwrap())
}

#[test]
fn a_turned_beam_bends_as_before() {
    // With boxes along the axes, which see too far across, the beam turned by 5° came out at 0.6 of its deflection.
    for scheme in [
        Scheme::default(),
        Scheme::default().order(2),
        Scheme::default().rule(Rule::Scni),
        Scheme::default().layout(Layout::Jittered { amount: 0.2, seed: 2 }),
    ] {
        let scheme = scheme.particles([11, 9]);
        let (deflection, energy) = turned_beam(0.0, &scheme);
        for degrees in [5.0, 20.0, 45.0, 90.0] {
            let turned = turned_beam(degrees, &scheme);
            assert!(abs_diff_eq!(turned.0 / deflection, 1.0, epsilon = 1e-7), "{degrees}: {turned:?} {deflection}");
            assert!(abs_diff_eq!(turned.1 / energy, 1.0, epsilon = 1e-7), "{degrees}: {turned:?} {energy}");
        }
    }
}
