//! Fields of a state are those that the solver balances.
#![cfg(feature = "solve")]

use std::sync::Arc;

use approx::{abs_diff_eq, assert_abs_diff_eq, assert_relative_eq};
use rkpm::cells::{Cells, Refined};
use rkpm::output::{VtkCell, VtkValues};
use rkpm::prelude::*;
use rkpm::scene::{Partition, Rule};

const CORNERS: [[f64; 2]; 4] = [[0.0, 0.0], [48.0, 44.0], [48.0, 60.0], [0.0, 44.0]];
const TRACTION: f64 = 6.25;

fn membrane() -> Scene<2> {
    Scene::new(Quadrilateral { corners: CORNERS }, PlaneStrain, Rubber::neo_hookean(40.097, 4e5).unwrap())
        .hold((0, Side::Min))
        .traction((0, Side::Max), [0.0, TRACTION])
}

/// Virtual work of the displacement x₁ eᵢ, which is nothing where the membrane is held: ∫ σ_{i1} dv is what the traction does
/// on it. Holds for the discrete state up to Newton's tolerance, whatever the scheme, if the stresses are the solver's own.
#[test]
fn stresses_balance_the_loads() {
    let refined = Refined::new(Arc::new(Quadrilateral { corners: CORNERS }), [4, 4]).unwrap().refined(&[2]).unwrap();
    let lattice = Scheme::default().particles([9]);
    let uncured = Scheme::default().particles([9]).pressure_field(PressureField::Displacement, 1);
    let cases = [
        ("default", membrane(), lattice.clone()),
        ("jittered", membrane(), lattice.clone().layout(Layout::Jittered { amount: 0.3, seed: 3 })),
        ("quadratic", membrane(), lattice.clone().order(2)),
        ("Gauss", membrane(), lattice.clone().rule(Rule::Gauss { zones: None, points: Some(4) })),
        ("no pressures", membrane(), uncured),
        ("elements", membrane(), Scheme::elements(2).particles([9])),
        ("refined", membrane().with_cells(Arc::new(refined) as Arc<dyn Cells<2>>), Scheme::default()),
    ];
    for (name, scene, scheme) in cases {
        let problem = scene.discretize(&scheme).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        let state = path.last();
        let mut sum = rkpm::nalgebra::Matrix3::zeros();
        let gradients = problem.deformation_gradients(state).unwrap();
        for ((stress, f), w) in
            problem.stresses(state).unwrap().iter().zip(&gradients).zip(problem.body().table().weights())
        {
            sum += stress * (f.determinant() * w);
        }
        // Simpson's rule along the loaded edge: displacements are smooth there.
        let moved = |t: f64| problem.displacement(state, &[48.0, 44.0 + 16.0 * t].into()).unwrap()[0];
        let strips = 64;
        let at = |k: usize| {
            moved(k as f64 / strips as f64) * [1.0, 4.0, 2.0][if k.is_multiple_of(strips) { 0 } else { 2 - k % 2 }]
        };
        let lever = 48.0 + (0..=strips).map(at).sum::<f64>() / (3 * strips) as f64;
        let work = TRACTION * 16.0 * lever;
        assert!(abs_diff_eq!(sum[(0, 0)], 0.0, epsilon = 1e-5 * work), "{name}: {:e}", sum[(0, 0)] / work);
        assert!(abs_diff_eq!(sum[(1, 0)] / work, 1.0, epsilon = 1e-3), "{name}: {:e}", sum[(1, 0)] / work - 1.0);
    }
}

/// A bar that is pulled: σ₁₁ is the force over the current section, exactly, at each point and at each particle.
#[test]
fn homogeneous_stresses_are_exact_at_points_and_particles() {
    let rubber = Rubber::neo_hookean(0.5, 1e3).unwrap();
    let bar = Scene::new(Block::new([0.0; 3], [2.0, 1.0, 1.0]), Solid, rubber)
        .prescribe((0, Side::Min), 0, 0.0)
        .prescribe((1, Side::Min), 1, 0.0)
        .prescribe((2, Side::Min), 2, 0.0)
        .prescribe((0, Side::Max), 0, 1.0);
    let jittered = Layout::Jittered { amount: 0.2, seed: 1 };
    let problem = bar.discretize(&Scheme::default().particles([5, 3, 3]).layout(jittered)).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    let state = path.last();
    let section = {
        let corner = problem.displacement(state, &[2.0, 1.0, 1.0].into()).unwrap();
        (1.0 + corner[1]) * (1.0 + corner[2])
    };
    let exact = problem.reaction(state, Side::Max).unwrap()[0] / section;
    let points = problem.stresses(state).unwrap();
    for stress in points.iter().chain(&problem.at_particles(&points)) {
        assert_relative_eq!(stress[(0, 0)], exact, max_relative = 1e-9);
        assert_abs_diff_eq!(stress[(1, 1)], 0.0, epsilon = 1e-8 * exact);
    }
    let other = bar.discretize(&Scheme::default().particles([3, 3, 3])).unwrap();
    assert!(other.stresses(state).is_err() && other.vtk_grid(state).is_err());
}

#[test]
fn grids_have_cells_around_and_fields_of_all_particles() {
    let square = Outline::at([0.0, 0.0]).line("a", [1.0, 0.0]).line("b", [1.0, 1.0]).line("c", [0.0, 1.0]).close("d");
    let rubber = || Rubber::neo_hookean(0.5, 1e3).unwrap();
    let region = |partition| {
        Scene::new(Region::new(square.clone()).unwrap(), PlaneStrain, rubber())
            .hold("a")
            .prescribe("c", 0, 0.1)
            .prescribe("c", 1, 0.0)
            .discretize(&Scheme::default().spacing(0.2).partition(partition))
            .unwrap()
    };
    let block = Scene::new(Block::new([0.0, 0.0], [1.0, 1.0]), PlaneStrain, rubber())
        .hold((1, Side::Min))
        .prescribe((1, Side::Max), 0, 0.1)
        .prescribe((1, Side::Max), 1, 0.0);
    let base = Refined::new(Arc::new(Block::new([0.0, 0.0], [1.0, 1.0])), [4, 4]).unwrap().refined(&[1]).unwrap();
    let problems = [
        block.discretize(&Scheme::default().particles([5])).unwrap(),
        block.with_cells(Arc::new(base) as Arc<dyn Cells<2>>).discretize(&Scheme::default()).unwrap(),
        region(Partition::Triangles),
        region(Partition::Voronoi),
    ];
    for problem in &problems {
        let path = problem.run().unwrap().completed().unwrap();
        let grid = problem.vtk_grid(path.last()).unwrap();
        assert!(grid.to_xml().is_ok() && grid.cells.len() == problem.cells().drawn().len());
        assert_eq!(grid.points.len(), problem.cells().positions().len());
        // Nothing crosses itself: areas of the cells, with signs all alike, sum to that of the sheared square.
        let area = |cell: &VtkCell| {
            let x = |k: usize| grid.points[cell.corners()[k % cell.corners().len()]];
            (0..cell.corners().len()).map(|k| x(k)[0] * x(k + 1)[1] - x(k + 1)[0] * x(k)[1]).sum::<f64>() / 2.0
        };
        let areas: Vec<f64> = grid.cells.iter().map(area).collect();
        assert!(areas.iter().all(|a| *a > 0.0), "{areas:?}");
        assert_abs_diff_eq!(areas.iter().sum::<f64>(), 1.0, epsilon = 1e-2);
        // Sheared by a tenth, µ = 1: σ₁₂ is below 0.1, because the sides are free, and most of it inside; there is none on
        // the sides themselves.
        let stresses = grid.point_data.iter().find(|field| field.name == "Cauchy stress").unwrap();
        let VtkValues::Tensors(tensors) = &stresses.values else { panic!("tensors") };
        let on_side = |x: &Point<2>| x[0] < 1e-9 || x[0] > 1.0 - 1e-9;
        let free = |x: &Point<2>| on_side(x) && x[1] > 0.15 && x[1] < 0.85;
        let (mut sum, mut count) = (0.0, 0);
        for (x, stress) in problem.cells().positions().iter().zip(tensors) {
            if !on_side(x) {
                (sum, count) = (sum + stress[1], count + 1);
            }
            assert!(!free(x) || stress[1].abs() < 0.03, "{x} {stress:?}");
        }
        let mean = sum / f64::from(count);
        assert!(0.06 < mean && mean < 0.1, "{mean}");
    }
}

/// Reactions balance a load at a point: their force and, about each axis, their moment, arms being those of the deformed body.
#[test]
fn reactions_and_their_moments_balance_a_load() {
    let rubber = Rubber::neo_hookean(0.5, 1e3).unwrap();
    let (corner, force) = ([1.0, 1.0, 2.0], [0.02, -0.03, 0.05]);
    let block = Scene::new(Block::new([0.0; 3], [1.0, 1.0, 2.0]), Solid, rubber)
        .hold((2, Side::Min))
        .with(Load::force(Place::at(corner), force));
    let problem = block.discretize(&Scheme::default().particles([3, 3, 5])).unwrap();
    // A force at a point is singular: the state is an equilibrium and no answer.
    let path = problem.run().unwrap().reached().unwrap();
    let state = path.last();
    let at = problem.displacement(state, &corner.into()).unwrap() + Point::<3>::from(corner);
    assert!((at - Point::<3>::from(corner)).norm() > 0.1);
    for axis in 0..3 {
        let reaction = problem.reaction(state, (2, Side::Min)).unwrap()[axis];
        assert!(abs_diff_eq!(reaction, -force[axis], epsilon = 1e-7), "{axis}: {reaction}");
        let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
        let applied = at[i] * force[j] - at[j] * force[i];
        let moment = problem.moment(state, (2, Side::Min), [0.0; 3]).unwrap()[axis];
        assert!(abs_diff_eq!(moment, -applied, epsilon = 1e-6), "{axis}: {moment} {applied}");
    }
}

/// Averages at particles do not reach across flat cells: the bending stress at the faces of a thin beam stays there.
#[test]
fn stresses_of_thin_beams_are_not_smeared_across() {
    let length = 20.0;
    let scene = Scene::new(Block::new([0.0, 0.0], [length, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3).unwrap())
        .hold((0, Side::Min))
        .traction((0, Side::Max), [0.0, 0.02 / length]);
    let problem = scene.discretize(&Scheme::default().particles([21, 5])).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    let stresses = problem.stresses(path.last()).unwrap();
    let at_particles = problem.at_particles(&stresses);
    let at = Point::<2>::new(0.5 * length, 1.0);
    let particle = problem.cells().positions().iter().position(|x| (x - at).norm() < 1e-9).unwrap();
    // Points in the row of sub-cells next to the face, half a spacing to both sides.
    let positions = problem.body().table().positions();
    let near = |x: &Point<2>| (x[0] - at[0]).abs() < 0.5 && x[1] > 0.875;
    let rows: Vec<f64> =
        positions.iter().zip(&stresses).filter(|(x, _)| near(x)).map(|(_, stress)| stress[(0, 0)]).collect();
    let points = rows.iter().sum::<f64>() / rows.len() as f64;
    // Half of the points of a cell lie further inside, where the stress is five sevenths of that of the others.
    let ratio = at_particles[particle][(0, 0)] / points;
    assert!(rows.len() == 2 && (0.88..1.05).contains(&ratio), "{ratio} {points} {}", rows.len());
}

/// Rubber keeps its volume: so do the cells of a tube that is blown up, whatever its kinematics, and those of a sheet that is pulled.
#[test]
fn cells_tell_their_volume_with_hoops_and_thickness() {
    fn ratios<const D: usize>(scene: &Scene<D>, scheme: &Scheme) -> Vec<f64> {
        let problem = scene.discretize(scheme).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        let grid = problem.vtk_grid(path.last()).unwrap();
        let field = grid.cell_data.iter().find(|field| field.name == "volume ratio").unwrap();
        let VtkValues::Scalars(ratios) = &field.values else { panic!("scalars") };
        ratios.clone()
    }
    let rubber = || Rubber::neo_hookean(0.5, 1e4).unwrap();
    let line = |kinematics: Scene<1>| kinematics.prescribe(Side::Min, 0, 3.0);
    let lines = Scheme::default().particles([17]);
    let tube = Scene::new(Block::new([5.0, 0.0], [9.0, 2.0]), Axisymmetric, rubber())
        .prescribe((0, Side::Min), 0, 3.0)
        .prescribe((1, Side::Min), 1, 0.0)
        .prescribe((1, Side::Max), 1, 0.0);
    let sheet = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStress { thickness: 0.1 }, rubber())
        .prescribe((0, Side::Min), 0, 0.0)
        .prescribe((1, Side::Min), 1, 0.0)
        .prescribe((0, Side::Max), 0, 2.0);
    for (what, found) in [
        ("cylinder", ratios(&line(Scene::new(Block::new([5.0], [9.0]), RadialCylinder, rubber())), &lines)),
        ("sphere", ratios(&line(Scene::new(Block::new([5.0], [9.0]), RadialSphere, rubber())), &lines)),
        ("tube", ratios(&tube, &Scheme::default().particles([9, 5]))),
        ("sheet", ratios(&sheet, &Scheme::default().particles([5, 5]))),
    ] {
        assert!(found.iter().all(|ratio| (ratio - 1.0).abs() < 0.02), "{what}: {found:?}");
    }
}
