//! Error against cost of three parts, with the model recommended for 1 %.

use std::error::Error;
use std::path::Path as FilePath;

use rkpm::output::Chart;
use rkpm::prelude::*;
use rkpm::study::{Budget, Level, Quantity, Tolerance};

use crate::COOK;

/// What is asked for, so that the curves are long, and what models are recommended for.
const ASKED: [f64; 2] = [5e-4, 0.01];

/// A bonded bearing that is sheared, Cook's membrane and half a bonded cylinder between plates, each asked for a force or displacement
/// and the energy: a chart and a table each.
pub fn curves(out: &FilePath) -> Result<(), Box<dyn Error>> {
    let rubber = Rubber::mooney_rivlin(0.4, 0.1, 1500.0)?; // MPa
    let bearing = Scene::new(Block::new([0.0, 0.0], [40.0, 10.0]), PlaneStrain, rubber.clone()) // mm
        .hold((1, Side::Min))
        .with(Condition::on((1, Side::Max)).displacement([5.0, 0.0]));
    let membrane = Scene::new(Quadrilateral { corners: COOK }, PlaneStrain, Rubber::neo_hookean(40.097, 4e5)?)
        .hold((0, Side::Min))
        .traction((0, Side::Max), [0.0, 6.25]);
    let cylinder = Scene::new(Block::new([0.0, 0.0], [20.0, 10.0]), Axisymmetric, rubber)
        .prescribe((0, Side::Min), 0, 0.0)
        .hold((1, Side::Min))
        .with(Condition::on((1, Side::Max)).displacement([0.0, -1.0]));
    let parts = [
        ("a bearing, sheared", bearing, Quantity::reaction((1, Side::Max), 0)),
        ("Cook's membrane", membrane, Quantity::displacement([48.0, 60.0], 1)),
        ("a bonded cylinder, pressed", cylinder, Quantity::reaction((1, Side::Max), 1)),
    ];
    let mut chart = Chart::new("Error against cost").x_log("unknowns").y_log("estimated relative error");
    let mut recommended = Vec::new();
    for (number, (name, scene, quantity)) in parts.into_iter().enumerate() {
        let requested = Tolerance::of(quantity, ASKED[0]).and(Quantity::energy());
        let answer = scene.solve_within(&requested, Budget { unknowns: 6000, ..Budget::default() })?;
        answer.table().write(out.join(format!("curve_{number}.csv")))?;
        // Those of the kind that was chosen, from coarse to fine.
        let point = |level: &Level| Some([level.unknowns as f64, level.estimate.filter(|estimate| *estimate > 0.0)?]);
        let estimated: Vec<[f64; 2]> = answer.levels.iter().filter_map(point).collect();
        chart = chart.marked_line(name, &estimated);
        if let Some(level) = answer.recommended(ASKED[1]) {
            recommended.extend(level.estimate.map(|estimate| [level.unknowns as f64, estimate]));
            println!(
                "{name}: {} of {:?} nodes for {} %, {:.2} ms; {} models in all, {:.2} s",
                level.functions,
                level.counts,
                100.0 * ASKED[1],
                1e3 * level.seconds,
                answer.table().rows.len(),
                answer.seconds()
            );
        }
    }
    chart.markers("recommended for 1 %", &recommended).horizontal("1 %", ASKED[1]).write(out.join("curves.svg"))?;
    Ok(())
}
