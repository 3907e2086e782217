use std::sync::Arc;

use rkpm::cells::{Cells, Zones};
use rkpm::geometry::*;
use rkpm::kernel::Kernel;
use rkpm::prelude::*;
use rkpm::quadrature::gauss_legendre;
use rkpm::shape::FiniteElements;

use super::harness::Input;

pub fn rules(input: &mut Input) {
    input.passed = true;
    match input.random.usize(0..4) {
        0 => {
            let n = input.count(1, 70);
            let n = input.saw("n", n);
            let _ = gauss_legendre(n);
        }
        1 => {
            let z = input.number(-0.5, 1.5);
            let width = input.number(0.1, 2.0);
            let (z, width) = input.saw("z, width", (z, width));
            let _ = (CubicSpline.value_and_slope(z), QuinticSpline.value_and_slope(z), WendlandC2.value_and_slope(z));
            let _ = Gaussian { width }.value_and_slope(z);
        }
        2 => {
            let order = if input.once_in(200) { 255 } else { input.random.u8(0..8) };
            let at = input.point::<3>(-1.0, 1.0);
            let (order, at) = input.saw("order, at", (order, at));
            let basis = Polynomial::<2>::new(order);
            let (mut h, mut dh) = (vec![0.0; basis.len()], vec![Point::<2>::zeros(); basis.len()]);
            basis.fill(&at.xy(), &mut h, &mut dh);
            if order < 8 {
                let basis = Polynomial::<3>::new(order);
                let (mut h, mut dh) = (vec![0.0; basis.len()], vec![Point::<3>::zeros(); basis.len()]);
                basis.fill(&at, &mut h, &mut dh);
            }
        }
        _ => {
            let corners = std::array::from_fn(|_| [input.number(0.0, 1.0), input.number(0.0, 1.0)]);
            let at = input.point::<2>(0.0, 1.0);
            let _ = input.saw("corners, at", (corners, at));
            let quadrilateral = Quadrilateral { corners };
            let _ = (quadrilateral.position(&at), quadrilateral.validate());
            let block = Block { min: input.point::<2>(0.0, 1.0), max: input.point::<2>(1.0, 2.0) };
            let _ = (block.position(&at), block.validate());
        }
    }
}

pub fn layout(input: &mut Input) -> Layout {
    match input.random.usize(0..6) {
        0 => Layout::Jittered { amount: input.number(0.0, 0.45), seed: input.random.u64(..) },
        1 => {
            let (a, b) = (input.number(-0.5, 0.5), input.number(-0.2, 0.2));
            let b = if input.once_in(4) { b } else { 0.0 };
            let _ = input.saw("grading", (a, b));
            Layout::Graded(Arc::new(move |_, t| t + a * t * (1.0 - t) + b))
        }
        _ => Layout::Regular,
    }
}

fn zones(input: &mut Input, cells: usize) -> Zones {
    match input.random.usize(0..4) {
        0 => Zones::single(input.length(cells)),
        1 => {
            let count = input.length(cells).min(50);
            let offsets = (0..input.random.usize(0..6)).map(|_| input.index(count)).collect();
            Zones::new((0..count).map(|_| input.index(cells) as u32).collect(), offsets)
        }
        _ => Zones::new((0..cells as u32).collect(), vec![0, cells / 2, cells]),
    }
}

pub fn lattices(input: &mut Input) {
    match input.random.usize(0..3) {
        0 => lattice::<1>(input),
        1 => lattice::<2>(input),
        _ => lattice::<3>(input),
    }
}

fn lattice<const D: usize>(input: &mut Input) {
    let block = Block { min: input.point::<D>(0.0, 1.0), max: input.point::<D>(1.5, 2.0) };
    let counts: [usize; D] = std::array::from_fn(|_| input.count(2, 5));
    let layout = layout(input);
    let _ = input.saw("block, counts, layout", (&block, counts, &layout));
    let lattice = if input.once_in(6) {
        let total = counts.iter().fold(1usize, |t, &c| t.saturating_mul(c)).min(200);
        let positions = (0..input.length(total)).map(|_| input.point::<D>(0.0, 1.0)).collect();
        Lattice::from_positions(counts, positions)
    } else {
        Lattice::new(&block, counts, &layout)
    };
    let Ok(lattice) = lattice else { return };
    let parts = input.count(1, 3);
    let n = input.count(1, 4);
    let size = input.count(1, 3);
    let zones = zones(input, lattice.cell_count());
    let part = match input.random.usize(0..4) {
        0 => Part::Whole,
        1 => Part::Named("hole".into()),
        _ => Part::Face { axis: input.index(D), side: Side::Max },
    };
    let at = input.point::<D>(-0.5, 2.5);
    let r = input.number(0.51, 2.0);
    let _ = input.saw("parts, n, size, zones, part, at, r", (parts, n, size, &zones, &part, at, r));
    let _ = (lattice.contains(&at), lattice.zones(size), lattice.coarsened(size), lattice.refined(parts));
    let _ = (lattice.particles(r), lattice.particles_global(r));
    let _ = lattice.gauss_in(n, &zones);
    let _ = lattice.gauss(n);
    if let Ok(smoothing) = lattice.smoothing(parts, n, &zones) {
        let _ = (smoothing.volumes(), smoothing.nodal(lattice.positions()));
    }
    let _ = lattice.nodal_cells(n);
    let _ = (lattice.boundary(&part, parts, n), lattice.boundary_nodes(&part));
    let cells: &dyn Cells<D> = &lattice;
    let _ = (cells.is_thin(), cells.gauss(n));
    input.passed = true;
    let order = input.count(1, 2);
    let order = input.saw("order", order);
    if let Ok(elements) = FiniteElements::new(lattice.clone(), order) {
        let _ = elements.shape_functions(&at);
    }
}
