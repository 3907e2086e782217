//! A program that wants shape functions and nothing else.
use rkpm::prelude::*;

fn main() -> Result<(), rkpm::Error> {
    let particles = Block::new([0.0, 0.0], [2.0, 1.0]).particles([9, 5], 1.0)?;
    let functions = ReproducingKernel::new(particles, CubicSpline, Polynomial::linear())?;
    let psi = functions.shape_functions(&[0.7, 0.4].into())?;
    let x: Point<2> = psi.nodes.iter().zip(&psi.values).map(|(&i, v)| functions.nodes()[i as usize] * *v).sum();
    assert!((x - Point::<2>::new(0.7, 0.4)).norm() < 1e-14);
    println!("{} particles reproduce {:?}", psi.nodes.len(), x.as_slice());
    Ok(())
}
