//! A rubber bunny between two plates, from an STL file: nobody meshes it.
//!
//! GOAL: from a closed surface to force and picture; what more particles change.
//! GEOMETRY: the Stanford bunny [cm], `geometry/bunny.stl`, 3674 facets.
//! BOUNDARY: what lies within 3 % of its height from the ends is bonded to plates, and the upper one moves down by a quarter of the
//! height; the ears bend.
//! REFERENCE: none; forces with 8, 16 and 24 particles along the height, lattices refined where walls are thinner than a spacing.
//!
//! `cargo run --release --example bunny [-- --out DIR]`.

#[path = "support/mod.rs"]
mod support;

use rkpm::prelude::*;
use rkpm::scene::Field;
use support::Summary;

fn main() -> Result<(), rkpm::Error> {
    let out = support::out_dir("bunny");
    let lying = Solid3::stl(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/geometry/bunny.stl"))?;
    // The file has the height along axis 1.
    let upright = lying.vertices().iter().map(|x| Point::<3>::new(x[0], -x[2], x[1])).collect();
    let bunny = Solid3::new(upright, lying.facets().to_vec())?;
    let Block { min, max } = bunny.bounds();
    let height = max[2] - min[2];
    let [feet, ears] = [min[2] + 0.03 * height, max[2] - 0.03 * height];
    let scene = Scene::new(&bunny, Solid, Rubber::neo_hookean(0.05, 100.0)?) // N/mm² = 100 N/cm²
        .hold(Place::from(Part::Whole).within(move |x| x[2] < feet))
        .with(
            Condition::on(Place::from(Part::Whole).within(move |x| x[2] > ears))
                .displacement([0.0, 0.0, -0.25 * height])
                .named("plate"),
        );
    let mut summary = Summary::new();
    for count in [8, 16, 24] {
        let problem = scene.discretize(&Scheme::default().spacing(height / f64::from(count - 1)).across(1))?;
        let path = problem.run()?.completed()?;
        let force = -100.0 * problem.reaction(path.last(), "plate")?[2];
        let particles = problem.cells().positions().len();
        println!("{count} along the height: {particles} particles, {} iterations, {force:.3} N", path.iterations);
        summary.note(format!("force_{count}"), force)?;
        if count == 16 {
            let picture = problem.picture(path.last(), Field::LargestStretch)?.title("A bunny between plates");
            picture.write(out.join("bunny.svg"))?;
        }
    }
    print!("{summary}");
    summary.write(out.join("summary.csv"))?;
    Ok(())
}
