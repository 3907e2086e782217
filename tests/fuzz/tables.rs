use std::sync::Arc;

use rkpm::cells::{BoundaryCells, Smoothing};
use rkpm::nalgebra::Vector3;
use rkpm::prelude::*;
use rkpm::solve::{EnclosedVolume, Functional, State};
use rkpm::term::ElasticFoundation;

use super::harness::Input;

fn spoil<T: Clone>(input: &mut Input, list: &mut Vec<T>) {
    match input.random.usize(0..10) {
        0 => list.clear(),
        1 => drop(list.pop()),
        2 if !list.is_empty() => list.push(list[0].clone()),
        3 if list.len() > 1 => list.swap(0, 1),
        _ => {}
    }
}

fn groups(input: &mut Input, groups: &mut Vec<usize>) {
    spoil(input, groups);
    if input.once_in(6) && !groups.is_empty() {
        let k = input.random.usize(0..groups.len());
        groups[k] = input.index(20);
    }
}

pub fn tables(input: &mut Input) {
    if input.once_in(2) {
        table::<2>(input, PlaneStrain, Axisymmetric);
    } else {
        table::<1>(input, RadialCylinder, RadialSphere);
    }
}

fn table<const D: usize>(input: &mut Input, one: impl Kinematics<D>, other: impl Kinematics<D>) {
    let lattice = Block::new([0.5; D], [2.0; D]).lattice([3; D]).unwrap();
    let kernel = ReproducingKernel::new(lattice.particles(1.0).unwrap(), CubicSpline, Polynomial::linear()).unwrap();
    let kinematics: &dyn Kinematics<D> = if input.once_in(2) { &one } else { &other };
    let made = match input.random.usize(0..3) {
        0 => {
            let mut points = lattice.gauss_in(2, &lattice.zones(2)).unwrap();
            spoilt_points(input, &mut points);
            let _ = input.saw("points", &points);
            ShapeTable::new(&kernel, &points, kinematics)
        }
        1 => {
            let mut smoothing = lattice.smoothing(2, 2, &lattice.zones(2)).unwrap();
            spoilt_smoothing(input, &mut smoothing);
            let _ = input.saw("smoothing", &smoothing);
            let _ = (smoothing.volumes(), smoothing.nodal(lattice.positions()));
            if input.once_in(2) {
                ShapeTable::smoothed(&kernel, &smoothing, kinematics)
            } else {
                ShapeTable::consistent(&kernel, &smoothing, kinematics)
            }
        }
        _ => {
            let mut boundary = lattice.boundary(&Side::Max.into(), 2, 2).unwrap();
            spoilt_points(input, &mut boundary.points);
            spoilt_hats(input, &mut boundary);
            let component = input.index(D);
            let _ = input.saw("boundary, component", (&boundary, component));
            let mut rows = Constraints::default();
            let _ = rows.over_boundary(&kernel, &boundary, kinematics, component, &|_| 0.1, &Amplitude::Ramp, "u");
            ShapeTable::new(&kernel, &boundary.points, kinematics)
        }
    };
    // An approximation that breaks its word.
    let lie = input.random.usize(0..12);
    let points = lattice.gauss(1).unwrap();
    let given = ShapeTable::tabulate(9, &points, kinematics, &|_, _, psi| {
        *psi = kernel.shape_functions(&Point::repeat(1.0))?;
        match lie {
            0 => psi.nodes.push(1_000_000),
            1 => psi.nodes.clear(),
            2 => psi.values.clear(),
            3 => drop(psi.gradients.pop()),
            4 => psi.nodes.reverse(),
            5 => psi.values.fill(f64::NAN),
            _ => {}
        }
        Ok(())
    });
    let _ = input.saw("lie", lie);
    for made in [made, given] {
        let Ok(table) = made else { continue };
        uses(input, table, lattice.positions());
    }
}

/// A model over a table, whatever it is good for.
fn uses<const D: usize>(input: &mut Input, table: ShapeTable<D>, positions: &[Point<D>]) {
    let share = input.number(0.0, 0.5);
    let field = input.pick(&[
        PressureField::Displacement,
        PressureField::Pointwise,
        PressureField::Constant,
        PressureField::Linear,
    ]);
    let rubber = Rubber::neo_hookean(0.5, 1e3).unwrap();
    let kind = input.random.usize(0..5);
    let nodes = if input.once_in(8) { 2 } else { positions.len() };
    let _ = input.saw("share, field, kind, nodes", (share, field, kind, nodes));
    let mut model = Model::new(&positions[..nodes.min(positions.len())]);
    match kind {
        0 => {
            let force = Vector3::from_fn(|_, _| input.number(-1.0, 1.0));
            let force = input.saw("force", force);
            model.add(Pointwise::new(table.clone(), DeadLoad { force, amplitude: Amplitude::Table(vec![]) }));
        }
        1 => {
            let pressure = input.number(-1.0, 1.0);
            model.add(Pointwise::new(table.clone(), FollowerPressure { pressure, amplitude: Amplitude::Ramp }));
        }
        2 => {
            model.add(Pointwise::new(table.clone(), ElasticFoundation { stiffness: input.number(0.0, 1.0) }));
        }
        _ => {}
    }
    let volume = EnclosedVolume::new(table.clone());
    let body = Arc::new(Body::new(table, rubber, field));
    if kind > 1 || input.once_in(2) {
        model.add_shared(body.clone());
    }
    let rows = Constraints::default();
    let analysis =
        Analysis { newton: rkpm::solve::Newton { iterations: 3, ..Default::default() }, ..Analysis::default() };
    input.passed |= analysis.run(&model, &rows, &mut ()).is_ok();
    if nodes < positions.len() {
        return;
    }
    let state = State::at_rest(&model, &rows);
    if let Ok(volume) = volume {
        let _ = analysis.run_controlled(&model, &rows, state.clone(), &volume, &[0.01], &mut ());
        let _ = volume.value(&state.displacement);
    }
}

fn spoilt_points<const D: usize>(input: &mut Input, points: &mut Points<D>) {
    spoil(input, &mut points.positions);
    spoil(input, &mut points.weights);
    spoil(input, &mut points.normals);
    groups(input, &mut points.groups);
    if input.once_in(4) && !points.positions.is_empty() {
        points.positions[0] = input.point(0.0, 3.0);
        if let Some(weight) = points.weights.first_mut() {
            *weight = input.bad();
        }
    }
}

fn spoilt_hats<const D: usize>(input: &mut Input, boundary: &mut BoundaryCells<D>) {
    spoil(input, &mut boundary.traces);
    if input.once_in(3) && !boundary.traces.is_empty() {
        boundary.traces[0] = vec![(input.index(9) as u32, input.number(0.0, 1.0))];
    }
}

fn spoilt_smoothing<const D: usize>(input: &mut Input, smoothing: &mut Smoothing<D>) {
    spoil(input, &mut smoothing.facet_points);
    spoil(input, &mut smoothing.facet_areas);
    spoil(input, &mut smoothing.cells);
    spoil(input, &mut smoothing.interior);
    spoil(input, &mut smoothing.centres);
    groups(input, &mut smoothing.groups);
    if input.once_in(5) {
        let factor = input.index(4);
        smoothing.facet_offsets.iter_mut().for_each(|offset| *offset = *offset * factor / 2);
    }
    if input.once_in(4) && !smoothing.cells.is_empty() {
        smoothing.cells[0] = vec![(input.index(12) as u32, input.number(-1.0, 1.0))];
    }
    if input.once_in(4) && !smoothing.facet_points.is_empty() {
        smoothing.facet_points[0] = input.point(0.0, 3.0);
    }
    if input.once_in(4) && !smoothing.interior.is_empty() {
        smoothing.interior[0] = vec![(input.point(-1.0, 3.0), input.number(-1.0, 1.0))];
    }
}
