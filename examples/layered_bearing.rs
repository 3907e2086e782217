//! A bearing of rubber and steel sheets: stiffness across and along for shape factors 5 to 20.
//!
//! Two rubber discs between steel sheets, each body with particles of its own, bonded where they touch. The vertical
//! stiffness (a disc, axisymmetric) stands beside that of the theory of thin layers, $E_c = E(1 + 2S^2)$ with the bulk modulus in
//! series, $1/E_c' = 1/E_c + 1/k$, and beside finite elements of the same bodies with four times the unknowns; so does the
//! shear stiffness of a strip, $\mu A/T$.
//!
//! `cargo run --release --example layered_bearing [-- --out DIR]` prints a table and writes `summary.csv`, a ParaView file and a picture
//! of the bearing with the middle shape factor. Lengths in mm, stresses in MPa.

mod support;

use std::error::Error;
use std::f64::consts::PI;

use rkpm::prelude::*;
use rkpm::scene::Field;
use support::Summary;

/// Radius of the discs, half the width of the strip.
const RADIUS: f64 = 100.0;
/// Thickness of the steel sheets.
const STEEL: f64 = 2.0;
const SHEAR: f64 = 0.8;
const BULK: f64 = 2000.0;
const LAYERS: usize = 2;

/// Sheets from below: steel, rubber, steel, …, steel, each by its name and its extent.
fn sheets(thickness: f64) -> Vec<(String, f64, f64)> {
    let mut sheets = Vec::new();
    let mut height = 0.0;
    for number in 0..=2 * LAYERS {
        let (kind, own) = if number % 2 == 0 { ("steel", STEEL) } else { ("rubber", thickness) };
        sheets.push((format!("{kind} {}", number / 2), height, height + own));
        height += own;
    }
    sheets
}

/// The bearing for a thickness of the rubber; `along` and `across` are particles of a rubber sheet.
fn bearing(
    kinematics: impl Kinematics<2> + 'static,
    left: f64,
    thickness: f64,
    elements: bool,
    along: usize,
    across: usize,
) -> Result<Scene<2>, rkpm::Error> {
    let (rubber, steel) = (Rubber::neo_hookean(0.5 * SHEAR, BULK)?, Rubber::neo_hookean(0.5 * 80e3, 170e3)?);
    // Finer towards the free edges, where the pressure falls to nothing within a thickness or two.
    let towards_edges = move |axis: usize, t: f64| match axis {
        0 if left < 0.0 => 0.5 + (PI * (t - 0.5)).sin() * 0.5,
        0 => (0.5 * PI * t).sin(),
        _ => t,
    };
    let layout = Layout::Graded(std::sync::Arc::new(towards_edges));
    let mut scene = Scene::assembly(kinematics);
    for (name, low, high) in sheets(thickness) {
        let block = Block::new([left, low], [RADIUS, high]);
        let is_rubber = name.starts_with("rubber");
        scene = if is_rubber {
            scene.body(&*name, block, rubber.clone())
        } else {
            scene.body(&*name, block, steel.clone())
        };
        let counts = [along, if is_rubber { across } else { 3 }];
        let layout = layout.clone();
        scene = scene.scheme_of(&name, move |scheme| {
            let scheme = if elements { Scheme::elements(2) } else { scheme };
            scheme.particles(counts).layout(layout.clone())
        });
    }
    let (bottom, top) = ("steel 0", format!("steel {LAYERS}"));
    Ok(scene.name("ground", Place::on((1, Side::Min)).of(bottom)).name("top", Place::on((1, Side::Max)).of(top)))
}

/// Force per displacement and the number of unknowns.
fn stiffness(scene: Scene<2>, moved: [f64; 2]) -> Result<(f64, usize, Problem<2>, rkpm::solve::State), rkpm::Error> {
    let axis = usize::from(moved[0] == 0.0);
    let scene = scene.hold("ground").with(Condition::on("top").displacement(moved));
    let problem = scene.discretize(&Scheme::default())?;
    let path = problem.run()?.completed()?;
    support::print_doubts(&problem, &path)?;
    let force = problem.reaction(path.last(), "top")?[axis];
    let (unknowns, state) = (problem.model().unknowns(), path.last().clone());
    Ok((force / moved[axis], unknowns, problem, state))
}

fn main() -> Result<(), Box<dyn Error>> {
    let out = support::out_dir("layered_bearing");
    let mut summary = Summary::new();
    for shape in [5.0, 10.0, 20.0] {
        let thickness = RADIUS / (2.0 * shape);
        let rubber_height = LAYERS as f64 * thickness;
        let press = [0.0, -1e-4 * rubber_height];
        let disc = |elements, along, across| -> Result<Scene<2>, rkpm::Error> {
            let disc = bearing(Axisymmetric, 0.0, thickness, elements, along, across)?;
            let sheets = sheets(thickness);
            Ok(sheets.iter().fold(disc, |scene, (name, ..)| scene.prescribe(Place::on(Side::Min).of(&**name), 0, 0.0)))
        };
        let (found, unknowns, problem, state) = stiffness(disc(false, 25, 5)?, press)?;
        let (reference, finer, ..) = stiffness(disc(true, 65, 11)?, press)?;
        let young = 3.0 * SHEAR;
        let layer = young * (1.0 + 2.0 * shape * shape);
        let theory = PI * RADIUS * RADIUS / rubber_height / (1.0 / layer + 1.0 / BULK);
        summary.record(format!("vertical_S{shape}"), found, reference)?;
        summary.record(format!("vertical_S{shape}_theory"), found, theory)?;
        summary.note(format!("vertical_S{shape}_unknowns"), unknowns as f64)?;
        summary.note(format!("vertical_S{shape}_unknowns_q2p1"), finer as f64)?;
        if shape == 10.0 {
            problem.vtk_grid(&state)?.write(out.join("pressed.vtu"))?;
            let picture =
                problem.picture(&state, Field::MeanStress)?.title("Half a bearing, pressed: mean stress [MPa]");
            picture.write(out.join("pressed.svg"))?;
        }
        let strip = |elements, along, across| bearing(PlaneStrain, -RADIUS, thickness, elements, along, across);
        let slide = [0.01 * rubber_height, 0.0];
        let (found, ..) = stiffness(strip(false, 25, 5)?, slide)?;
        let (reference, ..) = stiffness(strip(true, 65, 11)?, slide)?;
        summary.record(format!("shear_S{shape}"), found, reference)?;
        summary.record(format!("shear_S{shape}_theory"), found, SHEAR * 2.0 * RADIUS / rubber_height)?;
    }
    print!("{summary}");
    summary.write(out.join("summary.csv"))?;
    Ok(())
}
