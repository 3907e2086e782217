//! Axisymmetric and radial: a hollow bumper, a clamped disc under pressure, spherical shells on graded lattices.

use std::f64::consts::PI;

use rkpm::prelude::*;

use crate::case::{Family, Model, Reference, Target, model, stops};

type Result<T> = std::result::Result<T, rkpm::Error>;

// The bumper: mm, MPa, N.

/// A bumper of radius 15 and height 30 on a bonded foot with a cavity that a plate closes from above.
fn hollow(part: f64, parts: usize) -> Result<Scene<2>> {
    let outline = Outline::at([8.0, 0.0])
        .line("foot", [15.0, 0.0])
        .line("outside", [15.0, 30.0])
        .line("top", [0.0, 30.0])
        .line("axis", [0.0, 18.0])
        .line("cavity", [5.0, 18.0])
        .line("cavity", [8.0, 15.0])
        .close("cavity");
    let plate =
        RigidSurface::plane([0.0, 30.0], [0.0, -1.0]).moving_along([0.0, -30.0 * part], stops(parts)).named("plate");
    Ok(Scene::new(Region::new(outline)?, Axisymmetric, Rubber::mooney_rivlin(0.4, 0.1, 500.0)?)
        .hold("foot")
        .prescribe("axis", 0, 0.0)
        .contact("top", plate))
}

pub fn bumper() -> Family {
    let force = |problem: &Problem<2>, state: &State| Ok(-problem.contact(state, "plate")?.force[1]);
    let value = |value| Reference::Value { value, uncertainty: 2e-3 };
    // Outlines at spacings 0.6 and 0.5; the uncertainty is their difference. At 40 % the cavity's surface is stretched beyond Biot's
    // limit: there is no smooth state.
    let answers = [(0.15, value(318.7)), (0.2, value(450.3)), (0.4, Reference::Ends)];
    let target = |(part, reference): (f64, Reference)| {
        let mut models = Vec::new();
        for parts in [1, 4] {
            for spacing in [1.8, 1.5, 1.2, 1.0, 0.8] {
                let label = format!("outline {spacing}, {parts} stops");
                models.push(model(label, move || hollow(part, parts), Scheme::default().spacing(spacing), force));
            }
        }
        let refined = [0.6, 0.5].map(|spacing| {
            let scheme = Scheme::default().spacing(spacing);
            model(format!("outline {spacing}"), move || hollow(part, 4), scheme, force)
        });
        Target { label: format!("bumper pressed by {part}"), reference, models, refined: refined.into() }
    };
    Family { name: "bumper", targets: answers.into_iter().map(target).collect() }
}

// The clamped disc of the paper: in, psi.

fn clamped(parts: usize) -> Result<Scene<2>> {
    let rubber = Rubber::mooney_rivlin(80.0, 20.0, 1e5)?;
    let amplitude = if parts == 1 { Amplitude::Ramp } else { stops(parts) };
    Ok(Scene::new(Block::new([0.0, 0.0], [7.5, 0.5]), Axisymmetric, rubber)
        .prescribe((0, Side::Min), 0, 0.0)
        .hold((0, Side::Max))
        .with(Load::pressure((1, Side::Min), 45.0).amplitude(amplitude)))
}

pub fn disk() -> Family {
    // The deflection hardly feels a fold, the energy does.
    let energy = |problem: &Problem<2>, state: &State| problem.energy(state);
    let mut models = Vec::new();
    for parts in [1, 9, 90] {
        for n in [[41, 3], [61, 5], [81, 3], [81, 5], [97, 5], [121, 9]] {
            let label = format!("block {} × {}, {parts} stops", n[0], n[1]);
            models.push(model(label, move || clamped(parts), Scheme::default().particles(n), energy));
        }
        let n = [61, 5];
        let label = format!("elements {} × {}, {parts} stops", n[0], n[1]);
        models.push(model(label, move || clamped(parts), Scheme::elements(2).particles(n), energy));
    }
    // Q2/P1 with 241 by 13 nodes; the uncertainty is the difference to 161 by 9.
    let refined = [[161, 9], [241, 13]].map(|n| {
        model(format!("elements {} × {}", n[0], n[1]), || clamped(1), Scheme::elements(2).particles(n), energy)
    });
    let reference = Reference::Value { value: 113_860.0, uncertainty: 0.001 };
    let target = Target { label: "energy of a disc under 45 psi".into(), reference, models, refined: refined.into() };
    Family { name: "disk", targets: vec![target] }
}

// A thick spherical shell, its bore opened: µ = 1, the outer radius is 1.

/// Radii whose ratios are equal from particle to particle.
fn shell(bore: f64, stretch: f64) -> Result<Scene<1>> {
    let geometric = Mapped(move |x: &Point<1>| Point::<1>::new(bore * (1.0 / bore).powf(x[0])));
    let scene = Scene::new(geometric, RadialSphere, Rubber::neo_hookean(0.5, 1e5)?);
    Ok(scene.prescribe(Side::Min, 0, (stretch - 1.0) * bore))
}

/// The pressure that opens the bore of an incompressible neo-Hookean shell by a stretch, as a force on the opened bore.
fn opening_force(bore: f64, stretch: f64) -> f64 {
    let outer = (1.0 + (stretch.powi(3) - 1.0) * bore.powi(3)).cbrt();
    let g = |l: f64| 2.0 / l + 0.5 / l.powi(4);
    (g(outer) - g(stretch)) * 4.0 * PI * (bore * stretch).powi(2)
}

pub fn sphere() -> Family {
    let force = |problem: &Problem<1>, state: &State| Ok(problem.reaction(state, Side::Min)?[0]);
    let target = |(bore, stretch): (f64, f64)| {
        let scene = move || shell(bore, stretch);
        let mut models: Vec<Model> = [9, 13, 17, 25, 33, 49]
            .map(|n| model(format!("graded {n}"), scene, Scheme::default().particles([n]), force))
            .into();
        models.extend(
            [9, 17, 33].map(|n| model(format!("elements {n}"), scene, Scheme::elements(2).particles([n]), force)),
        );
        // The bulk modulus is 1e5 times the shear modulus.
        let reference = Reference::Value { value: opening_force(bore, stretch), uncertainty: 1e-4 };
        let refined = vec![model("elements 257", scene, Scheme::elements(2).particles([257]), force)];
        Target { label: format!("shell with bore {bore} opened {stretch} times"), reference, models, refined }
    };
    let targets = [(1e-3, 2.0), (1e-3, 3.0), (1e-3, 5.0), (1e-2, 3.0)].map(target);
    Family { name: "sphere", targets: targets.into() }
}
