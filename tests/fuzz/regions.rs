//! Drawn regions, clouds in them, refined lattices and sizing.

use std::sync::Arc;

use rkpm::cells::{Cells, Refined, Triangulation};
use rkpm::geometry::Turn;
use rkpm::prelude::*;
use rkpm::scene::Partition;
use rkpm::solve::Newton;
use rkpm::study::{Budget, Quantity, Tolerance};

use super::harness::Input;

/// Corners about the origin, spoilt once in a while, some edges bowed.
fn outline(input: &mut Input) -> Outline {
    let corners = input.random.usize(3..8);
    let spoilt = input.once_in(5);
    let at = |input: &mut Input, k: usize| -> [f64; 2] {
        let radius = input.good(0.6, 1.4);
        let angle = std::f64::consts::TAU * k as f64 / corners as f64;
        let place = [radius * angle.cos(), radius * angle.sin()];
        if spoilt && input.once_in(4) { place.map(|x| if input.once_in(2) { input.bad() } else { x }) } else { place }
    };
    let start = at(input, 0);
    let (mut drawn, mut last) = (Outline::at(start), start);
    for k in 1..=corners {
        let to = if k == corners && !input.once_in(12) { start } else { at(input, k) };
        let name = ["a", "b", "c"][k % 3];
        drawn = if input.once_in(5) {
            let turn = if input.once_in(2) { Turn::Left } else { Turn::Right };
            // A centre on the bisector, or anywhere.
            let bow = input.number(-2.0, 2.0);
            let middle = [0.5 * (last[0] + to[0]), 0.5 * (last[1] + to[1])];
            let mut centre = [middle[0] - bow * (to[1] - last[1]), middle[1] + bow * (to[0] - last[0])];
            if input.once_in(8) {
                centre = [input.number(-1.0, 1.0), input.number(-1.0, 1.0)];
            }
            drawn.arc(name, to, centre, turn)
        } else {
            drawn.line(name, to)
        };
        last = to;
    }
    drawn
}

fn region(input: &mut Input) -> Result<Region, rkpm::error::GeometryError> {
    let outline = outline(input);
    let holes: Vec<Outline> = (0..input.random.usize(0..3))
        .map(|_| Outline::circle("hole", [input.number(-0.5, 0.5), input.number(-0.5, 0.5)], input.number(0.05, 0.3)))
        .collect();
    let _ = input.saw("outline, holes", (&outline, &holes));
    let region = if holes.is_empty() { Region::new(outline) } else { Region::with_holes(outline, holes) }?;
    let _ = (region.area(), region.parts().len(), region.contains(&[input.number(-1.0, 1.0), 0.0].into()));
    if input.once_in(6) {
        let tolerance = input.number(1e-3, 1e-1);
        let tolerance = input.saw("tolerance", tolerance);
        return region.with_tolerance(tolerance);
    }
    Ok(region)
}

pub fn shapes(input: &mut Input) {
    let Ok(region) = region(input) else { return };
    if input.once_in(3) {
        let count = input.random.usize(0..40);
        let mut cloud: Vec<Point<2>> = (0..count).map(|_| input.point(-1.2, 1.2)).collect();
        if count > 2 && input.once_in(4) {
            cloud[0] = cloud[1];
        }
        let cloud = input.saw("cloud", cloud);
        if let Ok(triangles) = Triangulation::of_particles(&region, &cloud) {
            let _ = triangles.gauss(2);
            let _ = triangles.particles(1.0);
        }
        return;
    }
    let rubber = Rubber::neo_hookean(0.5, 10.0).expect("sound constants");
    let mut scene = Scene::new(region, PlaneStrain, rubber);
    if !input.once_in(4) {
        scene = scene.hold("a");
    }
    let part = input.pick(&["b", "c", "hole", "nothing"]);
    let (component, value) = (input.index(2), input.number(-0.1, 0.1));
    scene = match input.random.usize(0..4) {
        0 => scene.prescribe(part, component, value),
        1 => scene.traction(part, [value, 0.1]),
        2 => scene.pressure(part, value),
        _ => scene.with(Load::body_force([value, 0.0])),
    };
    let partition = if input.once_in(4) { Partition::Voronoi } else { Partition::Triangles };
    let mut scheme = Scheme::default().partition(partition).seed(input.random.u64(..));
    scheme = match input.random.usize(0..3) {
        0 => scheme.spacing(input.number(0.25, 1.0)),
        _ => scheme.particles([input.count(3, 7)]),
    };
    if input.once_in(4) {
        let (slope, floor) = (input.number(0.0, 1.0), input.number(0.2, 0.5));
        let _ = input.saw("grading", (slope, floor));
        scheme = scheme.graded(move |x| floor + slope * x[0].abs());
    }
    scheme = scheme.order(if input.once_in(8) { input.pick(&[0, 2, 3]) } else { 1 });
    scheme = scheme.newton(Newton { iterations: 6, ..Newton::default() });
    scheme = scheme.stepping(Stepping { smallest: 0.4, steps: 2, ..Stepping::default() });
    let _ = input.saw("part, component, value, scheme", (part, component, value, &scheme));
    let Ok(problem) = scene.discretize(&scheme) else { return };
    let Ok(path) = problem.run() else { return };
    let _ = problem.vtk_grid(path.last()).map(|grid| grid.to_xml().is_ok());
    input.passed = path.completed().is_ok();
}

pub fn sizing(input: &mut Input) {
    let domain: Arc<dyn Domain<2>> = if input.once_in(2) {
        Arc::new(Block { min: input.point::<2>(0.0, 0.5), max: input.point::<2>(1.0, 3.0) })
    } else {
        let corners = [[0.0, 0.0], [2.0, 0.5], [2.0, 1.5], [0.0, 1.0]].map(|[x, y]| {
            let moved = input.number(-0.1, 0.1);
            [x + moved, y]
        });
        let corners = input.saw("corners", corners);
        Arc::new(Quadrilateral { corners })
    };
    let cells = [input.count(1, 3).saturating_mul(2), input.count(1, 6)];
    let cells = input.saw("cells", cells);
    if let Ok(mut refined) = Refined::new(domain.clone(), cells) {
        for _ in 0..input.random.usize(0..4) {
            let zone = input.index(refined.refinable().count());
            let Ok(finer) = refined.refined(&[zone]) else { break };
            refined = finer;
        }
        let _ = (refined.smoothing(2, 2, &refined.zones(2)), refined.particles(1.0).is_ok());
    }
    let rubber = Rubber::neo_hookean(0.5, 10.0).expect("sound constants");
    let block = Block { min: input.point::<2>(0.0, 0.5), max: input.point::<2>(1.0, 3.0) };
    let value = input.number(-0.1, 0.1);
    let scene = Scene::new(block, PlaneStrain, rubber).hold((0, Side::Min)).traction((0, Side::Max), [0.0, value]);
    let quantity = match input.random.usize(0..4) {
        0 => Quantity::displacement([input.number(0.0, 2.0), input.number(0.0, 2.0)], input.index(2)),
        1 => Quantity::reaction(input.pick(&[Place::on(Side::Min), Place::on("u"), Place::body()]), input.index(2)),
        2 => Quantity::volume(),
        _ => Quantity::energy(),
    };
    let requested = Tolerance::of(quantity, input.number(0.01, 0.2));
    let budget = Budget {
        unknowns: input.random.usize(0..300),
        levels: input.random.usize(0..5),
        bytes: input.random.bool().then(|| input.random.usize(0..1_000_000)),
        ..Budget::default()
    };
    let _ = input.saw("block, value, tolerance, budget", (block.min, block.max, value, requested.error, budget.levels));
    let scheme = Scheme::default().newton(Newton { iterations: 6, ..Newton::default() });
    let answer = if input.once_in(2) {
        scene.solve_within_locally(&scheme, &requested, budget)
    } else {
        scene.solve_within_by(&[scheme], &requested, budget, &mut ())
    };
    if let Ok(answer) = answer {
        let _ = (answer.table(), answer.values().len());
        input.passed = true;
    }
}
