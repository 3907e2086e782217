//! Bad input, by class: whatever is given to a public constructor or reader comes back as a value or a typed error —
//! no panic, no hang, no allocation out of proportion.
//!
//! Each case takes sound input and spoils some of it: NaN, infinities, zeros, signs, huge and tiny numbers, absurd
//! counts, arrays too short, too long or empty. Seeds are fixed; a failure names its class, case and input, and
//! `FUZZ_CASES=n` multiplies the number of cases.
#![cfg(feature = "solve")]

mod harness;

mod assemblies;
mod geometry;
#[cfg(feature = "serde")]
mod journals;
mod linear;
mod materials;
mod outputs;
mod regions;
mod scenes;
mod shapes;
mod states;
mod surfaces;
mod tables;

/// One after the other: the guard of allocations watches the whole process.
#[test]
fn bad_input_is_refused_by_class() {
    let mut fuzz = harness::Fuzz::new();
    fuzz.class("rules, kernels, bases", 30_000, geometry::rules);
    fuzz.class("lattices and elements", 8_000, geometry::lattices);
    fuzz.class("particles and shape functions", 15_000, shapes::particles);
    fuzz.class("points, sub-cells, tables, bodies", 4_000, tables::tables);
    fuzz.class("materials", 20_000, materials::materials);
    fuzz.class("amplitudes, rows, enforcement", 12_000, linear::rows);
    fuzz.class("sparse matrices", 8_000, linear::matrices);
    fuzz.class("states and paths", 3_000, states::states);
    fuzz.class("scenes of one dimension", 4_000, scenes::lines);
    fuzz.class("scenes of two dimensions", 1_500, scenes::planes);
    fuzz.class("scenes of three dimensions", 150, scenes::solids);
    fuzz.class("assemblies in the plane", 3000, assemblies::planes);
    fuzz.class("assemblies in space", 400, assemblies::solids);
    fuzz.class("planar regions", 1_500, regions::shapes);
    fuzz.class("refined lattices and sizing", 400, regions::sizing);
    fuzz.class("closed surfaces", 2_000, surfaces::arrays);
    fuzz.class("tables and summaries", 8_000, outputs::tables);
    fuzz.class("grids", 5_000, outputs::grids);
    #[cfg(feature = "chart")]
    fuzz.class("charts", 4_000, outputs::charts);
    #[cfg(feature = "serde")]
    fuzz.class("records", 10_000, journals::records);
    #[cfg(feature = "serde")]
    fuzz.class("journals", 1_000, journals::journals);
    fuzz.finish(100_000);
}
