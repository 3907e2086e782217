//! Nothing is allocated inside the loops over points.
//!
//! GOAL: allocations do not grow with the number of points: none at all in a second assembly or in the
//! recovery of condensed unknowns, and in tabulation no more than what makes a few long vectors grow.
#![cfg(feature = "solve")]
// Counting allocations needs an allocator, and `GlobalAlloc` is an unsafe trait. This one hands every call
// on to the system's allocator unchanged and adds to a counter, so that it keeps the trait's contract
// exactly where the system's does.
#![allow(unsafe_code)]

use std::alloc::{GlobalAlloc, Layout, System as Heap};
use std::cell::Cell;

use rkpm::assembly::{StateRef, System};
use rkpm::prelude::*;
use rkpm::solve::State;
use rkpm::term::TermStep;

struct Counting;

thread_local! {
    /// Of each thread its own: other tests of this program run beside this one.
    static CALLS: Cell<usize> = const { Cell::new(0) };
}

fn count() {
    // A thread that ends may allocate after its counter has gone; nobody asks for that one any more.
    let _ = CALLS.try_with(|calls| calls.set(calls.get() + 1));
}

unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        unsafe { Heap.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { Heap.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        unsafe { Heap.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Allocations made by `f`.
fn allocations<T>(f: impl FnOnce() -> T) -> (usize, T) {
    let before = CALLS.get();
    let result = f();
    (CALLS.get() - before, result)
}

/// A block with `n` particles along each axis, a pressed face and a pulled one.
fn scene<const D: usize>(kinematics: impl Kinematics<D> + 'static) -> Scene<D> {
    let rubber = Rubber::mooney_rivlin(0.4, 0.1, 1e3).unwrap();
    Scene::new(Block::new([1.0; D], [2.0; D]), kinematics, rubber).hold((0, Side::Min)).pressure((0, Side::Max), 0.01)
}

fn assembles_without_allocation<const D: usize>(problem: &Problem<D>) {
    let model = problem.model();
    let state = State::at_rest(model, problem.equations());
    let d: Vec<f64> = (0..model.unknowns()).map(|i| 1e-4 * (i as f64).sin()).collect();
    let mut assembler = model.assembler();
    let mut system = System::default();
    let (first, ()) =
        allocations(|| assembler.assemble(model, StateRef::new(&d, &state.terms, 0.5), &mut system).unwrap());
    // The counter counts.
    assert!(first > 0);
    let (again, ()) =
        allocations(|| assembler.assemble(model, StateRef::new(&d, &state.terms, 1.0), &mut system).unwrap());
    let mut steps: Vec<Vec<f64>> = state.terms.iter().map(|own| vec![0.0; own.condensed.len()]).collect();
    let (advance, _) = allocations(|| {
        model
            .at(StateRef::new(&d, &state.terms, 1.0))
            .unwrap()
            .advance(TermStep { displacement: &d, load: 0.0 }, &mut steps)
            .unwrap()
    });
    let (energy, _) = allocations(|| model.at(StateRef::new(&d, &state.terms, 1.0)).unwrap().energy());
    assert_eq!((again, advance, energy), (0, 0, 0), "{} unknowns", model.unknowns());
}

/// Allocations and points of a smoothed table and of one at Gauss points.
fn tabulations<const D: usize>(n: usize, kinematics: &impl Kinematics<D>) -> (usize, usize) {
    let lattice = Block::new([1.0; D], [2.0; D]).lattice([n; D]).unwrap();
    let rk = ReproducingKernel::new(lattice.particles(1.0).unwrap(), CubicSpline, Polynomial::linear()).unwrap();
    let smoothing = lattice.smoothing(2, 2, &lattice.zones(2)).unwrap();
    let points = lattice.gauss(2).unwrap();
    let (count, table) = allocations(|| {
        let smoothed = ShapeTable::smoothed(&rk, &smoothing, kinematics).unwrap();
        smoothed.point_count() + ShapeTable::new(&rk, &points, kinematics).unwrap().point_count()
    });
    (count, table)
}

fn tabulates_without_allocation<const D: usize>(sizes: [usize; 2], kinematics: impl Kinematics<D>) {
    let (few, points_few) = tabulations(sizes[0], &kinematics);
    let (many, points_many) = tabulations(sizes[1], &kinematics);
    assert!(points_many >= 4 * points_few);
    // About twenty vectors, which double a few times more for four to eight times the points.
    assert!(many <= few + 60, "{few} allocations for {points_few} points, {many} for {points_many}");
}

/// On one thread, whose allocations are counted: a pool of threads allocates for its own ends.
#[test]
fn loops_over_points_do_not_allocate() {
    let laws = || {
        assembles_without_allocation(&scene(RadialSphere).discretize(&Scheme::default().particles([9])).unwrap());
        assembles_without_allocation(&scene(Axisymmetric).discretize(&Scheme::default().particles([9])).unwrap());
        assembles_without_allocation(&scene(PlaneStrain).discretize(&Scheme::paper(1.2).particles([9])).unwrap());
        assembles_without_allocation(&scene(Solid).discretize(&Scheme::default().particles([5])).unwrap());
        // Sub-cells with the same surroundings share rows, and each kind has a list of its facets: as many kinds in both.
        tabulates_without_allocation([21, 43], PlaneStrain);
        tabulates_without_allocation([9, 21], Axisymmetric);
        tabulates_without_allocation([11, 18], Solid);
    };
    #[cfg(feature = "rayon")]
    rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap().install(laws);
    #[cfg(not(feature = "rayon"))]
    laws();
}
