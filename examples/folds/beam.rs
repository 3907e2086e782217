//! In 3D: a quarter of an arch, its foot bonded, pressed at its crown by a bar that is flat to its axis. µ = 1.

use rkpm::prelude::*;

use crate::case::{Family, Model, Reference, Target, model};

/// Radii of the arch, its half width, and the half angle that it spans.
const ARCH: [f64; 4] = [8.0, 10.0, 1.5, 0.9];

fn arch(way: f64) -> Result<Scene<3>, rkpm::Error> {
    let [inner, outer, width, span] = ARCH;
    let domain = Mapped(move |unit: &Point<3>| {
        let (angle, radius) = (span * unit[0], inner + (outer - inner) * unit[1]);
        Point::<3>::new(radius * angle.sin(), radius * angle.cos(), width * unit[2])
    });
    let bar =
        RigidSurface::cylinder([0.0, outer + 1.5, 0.0], [0.0, 0.0, 1.0], 1.5).moving([0.0, -way, 0.0]).named("bar");
    Ok(Scene::new(domain, Solid, Rubber::neo_hookean(0.5, 1e3)?)
        .prescribe((0, Side::Min), 0, 0.0)
        .hold((0, Side::Max))
        .prescribe((2, Side::Min), 2, 0.0)
        .contact((1, Side::Max), bar))
}

pub fn beam() -> Family {
    let force = |problem: &Problem<3>, state: &State| Ok(-problem.contact(state, "bar")?.force[1]);
    // Q2/P1 with 17 by 5 by 5 and 25 by 7 by 5 nodes; the uncertainty is their difference.
    let answers = [(0.5, 0.0907), (1.0, 0.1577), (2.0, 0.2191)];
    let target = |(way, value): (f64, f64)| {
        let scene = move || arch(way);
        let name = |n: [usize; 3]| format!("{} × {} × {}", n[0], n[1], n[2]);
        let mut models: Vec<Model> = [[9, 3, 3], [13, 3, 3], [13, 5, 3], [17, 5, 3]]
            .map(|n| model(format!("mapped {}", name(n)), scene, Scheme::default().particles(n), force))
            .into();
        models.extend(
            [[9, 3, 3], [13, 5, 3]]
                .map(|n| model(format!("elements {}", name(n)), scene, Scheme::elements(2).particles(n), force)),
        );
        let refined = [[17, 5, 5], [25, 7, 5]]
            .map(|n| model(format!("elements {}", name(n)), scene, Scheme::elements(2).particles(n), force));
        let reference = Reference::Value { value, uncertainty: 0.02 };
        Target { label: format!("arch pressed by {way}"), reference, models, refined: refined.into() }
    };
    Family { name: "beam", targets: answers.into_iter().map(target).collect() }
}
