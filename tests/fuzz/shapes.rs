use rkpm::nalgebra::SMatrix;
use rkpm::prelude::*;

use super::harness::Input;

pub fn particles(input: &mut Input) {
    match input.random.usize(0..3) {
        0 => cloud::<1>(input),
        1 => cloud::<2>(input),
        _ => cloud::<3>(input),
    }
}

fn cloud<const D: usize>(input: &mut Input) {
    let count = if input.once_in(10) { input.random.usize(0..3) } else { input.random.usize(4..14) };
    let spoilt = input.once_in(3);
    let position =
        |input: &mut Input| if spoilt { input.point::<D>(0.0, 1.0) } else { input.good_point::<D>(0.0, 1.0) };
    let mut positions: Vec<Point<D>> = (0..count).map(|_| position(input)).collect();
    if input.once_in(8) && count > 1 {
        positions[0] = positions[count - 1];
    }
    let scale = if input.once_in(10) { input.bad() } else { 1.0 };
    if input.once_in(6) {
        positions.iter_mut().for_each(|x| *x *= scale);
    }
    let supports: Vec<Support<D>> = (0..input.length(count))
        .map(|_| {
            let a = if spoilt { input.number(0.4, 1.5) } else { input.good(0.4, 1.5) };
            if input.once_in(5) {
                // Now and then with half-axes in one plane.
                let shear = if input.once_in(3) { 1.0 } else { 0.3 };
                return Support::Parallelepiped(SMatrix::from_fn(|i, k| a * if i == k { 1.0 } else { shear }));
            }
            if input.once_in(2) { Support::Ball(a) } else { Support::Box(Point::repeat(a * scale)) }
        })
        .collect();
    let _ = input.saw("positions, supports", (&positions, &supports));
    let Ok(mut particles) = Particles::new(positions, supports) else { return };
    if input.once_in(3) {
        let count = input.length(count);
        let volumes = input.numbers(count, 0.1, 1.0);
        let volumes = input.saw("volumes", volumes);
        match particles.with_volumes(volumes) {
            Ok(with) => particles = with,
            Err(_) => return,
        }
    }
    let order = if input.once_in(20) { input.pick(&[30, 255]) } else { input.random.u8(0..4) };
    let order = if D == 3 { order.min(30) } else { order };
    let limit = input.number(1e-12, 1e-3);
    let width = input.number(0.2, 1.0);
    let _ = input.saw("order, limit, width", (order, limit, width));
    let basis = Polynomial::new(order);
    match input.random.usize(0..3) {
        0 => functions(input, ReproducingKernel::new(particles, Gaussian { width }, basis), limit),
        1 => functions(input, ReproducingKernel::new(particles, WendlandC2, basis), limit),
        _ => functions(input, ReproducingKernel::new(particles, CubicSpline, basis), limit),
    }
}

fn functions<const D: usize, K: Kernel + Clone>(
    input: &mut Input,
    made: Result<ReproducingKernel<D, K, Polynomial<D>>, rkpm::error::ApproximationError>,
    limit: f64,
) {
    let Ok(mut kernel) = made else { return };
    input.passed = true;
    if input.once_in(3) {
        kernel = kernel.with_rcond_limit(limit);
    }
    let count = kernel.nodes().len();
    for _ in 0..3 {
        let at = input.point::<D>(-0.2, 1.2);
        let particle = input.index(count);
        let _ = input.saw("at, particle", (at, particle));
        let _ = (kernel.shape_functions(&at), kernel.cover(&[at]));
        let _ = kernel.kernel_weights(&at);
        let _ = kernel.evaluate_at_node(particle, &mut Default::default(), &mut ShapeFunctions::default());
    }
    let moved = (0..input.length(count)).map(|_| input.point::<D>(0.0, 2.0)).collect();
    let moved = input.saw("moved", moved);
    if let Ok(spatial) = kernel.spatial(moved) {
        let _ = spatial.cover(spatial.nodes());
    }
}
