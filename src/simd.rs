//! Run-time choice of the instruction set; only this file and those beneath it name pulp.
//!
//! A portable build knows only the oldest instructions of its processor family. A [`Task`] is compiled for
//! newer ones too and [`dispatch`] picks the best that the machine has, so that inner loops run at its speed
//! without any build flag. Which one runs depends on the machine alone: results keep their bits from run to run
//! and for any number of threads.

mod panels;

pub(crate) use panels::{LANES, Panel, Sink};

/// How $ab + c$ is computed.
pub(crate) trait Arithmetic: Copy {
    /// $ab + c$, rounded once where the machine has an instruction for it.
    fn multiply_add(a: f64, b: f64, c: f64) -> f64;

    /// The same in single precision.
    fn multiply_add_single(a: f32, b: f32, c: f32) -> f32;
}

/// A product and a sum.
#[derive(Clone, Copy)]
pub(crate) struct Plain;

/// One fused instruction; only where there is one, since without it the call is a slow library function.
#[cfg(any(all(feature = "solve", target_arch = "x86_64"), target_arch = "aarch64"))]
#[derive(Clone, Copy)]
pub(crate) struct Fused;

impl Arithmetic for Plain {
    #[inline(always)]
    fn multiply_add(a: f64, b: f64, c: f64) -> f64 {
        a * b + c
    }

    #[inline(always)]
    fn multiply_add_single(a: f32, b: f32, c: f32) -> f32 {
        a * b + c
    }
}

#[cfg(any(all(feature = "solve", target_arch = "x86_64"), target_arch = "aarch64"))]
impl Arithmetic for Fused {
    #[inline(always)]
    fn multiply_add(a: f64, b: f64, c: f64) -> f64 {
        a.mul_add(b, c)
    }

    #[inline(always)]
    fn multiply_add_single(a: f32, b: f32, c: f32) -> f32 {
        a.mul_add(b, c)
    }
}

/// Inner loops that are compiled for several instruction sets.
///
/// `run` and what it calls must be `#[inline(always)]`: what is not inlined stays at the oldest instructions.
pub(crate) trait Task {
    /// What the loops give back.
    type Output;

    /// The loops.
    fn run<A: Arithmetic>(self) -> Self::Output;
}

/// Runs a task with the best instructions of the machine.
#[inline]
pub(crate) fn dispatch<T: Task>(task: T) -> T::Output {
    #[cfg(all(feature = "solve", target_arch = "x86_64"))]
    {
        struct Widest<T>(T);
        impl<T: Task> pulp::WithSimd for Widest<T> {
            type Output = T::Output;

            #[inline(always)]
            fn with_simd<S: pulp::Simd>(self, _: S) -> T::Output {
                self.0.run::<Fused>()
            }
        }
        match pulp::x86::Arch::new() {
            pulp::x86::Arch::V4(simd) => return pulp::Simd::vectorize(simd, Widest(task)),
            pulp::x86::Arch::V3(simd) => return pulp::Simd::vectorize(simd, Widest(task)),
            _ => {}
        }
    }
    // On 64-bit ARM every processor has fused instructions.
    #[cfg(target_arch = "aarch64")]
    return task.run::<Fused>();
    #[cfg(not(target_arch = "aarch64"))]
    task.run::<Plain>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn every_way_gives_the_same_sum_to_rounding() {
        struct Dot<'a>(&'a [f64], &'a [f64]);
        impl Task for Dot<'_> {
            type Output = f64;

            #[inline(always)]
            fn run<A: Arithmetic>(self) -> f64 {
                self.0.iter().zip(self.1).fold(0.0, |sum, (a, b)| A::multiply_add(*a, *b, sum))
            }
        }
        let a: Vec<f64> = (0..100).map(|i| (i as f64).sin()).collect();
        let b: Vec<f64> = (0..100).map(|i| (i as f64).cos()).collect();
        let plain = Dot(&a, &b).run::<Plain>();
        assert_abs_diff_eq!(dispatch(Dot(&a, &b)), plain, epsilon = 1e-14 * 100.0);
        assert_eq!(dispatch(Dot(&a, &b)), dispatch(Dot(&a, &b)));
    }
}
