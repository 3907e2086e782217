//! The examples of §6, row by row: each computation runs as the example runs it, and each row of its summary is held against
//! what it must be. A row without an expectation fails, so that none is added unasked.

use approx::abs_diff_eq;

#[path = "../../examples/bushing_assembly.rs"]
#[allow(dead_code)]
mod bushing_assembly;
#[path = "../../examples/disk_inflation.rs"]
#[allow(dead_code)]
mod disk_inflation;
#[path = "../../examples/kernels.rs"]
#[allow(dead_code)]
mod kernels;
#[path = "../../examples/simple_shear.rs"]
#[allow(dead_code)]
mod simple_shear;
#[path = "../../examples/tube_inflation.rs"]
#[allow(dead_code)]
mod tube_inflation;
#[path = "../../examples/uniaxial.rs"]
#[allow(dead_code)]
mod uniaxial;

/// What a row must be.
#[derive(Debug, Clone, Copy)]
enum Ought {
    /// Within this relative error of its reference.
    Near(f64),
    /// Off its reference by a relative error between these: a known fault of a scheme, no less and no more.
    Off(f64, f64),
    /// An error of at most this.
    Below(f64),
    /// A number between these.
    Between(f64, f64),
}

use Ought::{Below, Between, Near, Off};

impl Ought {
    fn holds(self, value: f64, error: Option<f64>) -> bool {
        let error = error.unwrap_or(f64::NAN);
        match self {
            Near(most) => error.abs() <= most,
            Off(low, high) => (low..=high).contains(&error),
            Below(most) => (0.0..=most).contains(&value),
            Between(low, high) => (low..=high).contains(&value),
        }
    }
}

/// Each example has a summary of its own type.
macro_rules! check {
    ($summary:expr, $expected:expr) => {{
        let summary = $summary;
        print!("{summary}");
        let rows = summary.rows.iter().map(|row| (row.name.clone(), row.value, row.relative_error()));
        hold(rows.collect(), $expected);
    }};
}

/// Each row, a name, a value and a relative error, must meet the first expectation whose name begins as its own does, and each
/// expectation must be used.
fn hold(rows: Vec<(String, f64, Option<f64>)>, expected: &[(&str, Ought)]) {
    let mut used = vec![false; expected.len()];
    let mut wrong = Vec::new();
    for (name, value, error) in rows {
        let Some(place) = expected.iter().position(|(begin, _)| name.starts_with(begin)) else {
            wrong.push(format!("{name} = {value}: nothing is expected of it"));
            continue;
        };
        used[place] = true;
        if !expected[place].1.holds(value, error) {
            wrong.push(format!("{name} = {value} (off by {error:?}): {:?}", expected[place].1));
        }
    }
    wrong.extend(expected.iter().zip(used).filter(|(_, used)| !used).map(|((name, _), _)| format!("no row {name}")));
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn material_and_spatial_kernels() {
    let expected = [
        // Three supports cover the point of Fig. 4, as few as a linear basis can do with.
        ("covering_particles", Between(3.0, 3.0)),
        // Supports end 1e-12 of their width before their edge.
        ("lost_r", Near(1e-9)),
        ("warned_r0.75", Between(1.38, 1.40)),
        ("warned_r1.25", Between(2.31, 2.33)),
        ("warned_r1.5", Between(2.77, 2.79)),
        ("warned_r1", Between(1.84, 1.86)),
        ("warned_r2", Between(3.70, 3.72)),
        // Functions of the stretch λ exist up to λ = 2r; with steps of 0.15 they carry the sheet to the first stretch beyond.
        ("spatial_reached_r0.75", Between(1.599, 1.601)),
        ("spatial_reached_r1.5", Between(3.099, 3.101)),
        ("spatial_reached_r1", Between(2.049, 2.051)),
        ("spatial_lost_its_cover", Between(1.0, 1.0)),
        ("material_reached", Between(3.999, 4.001)),
        // The reference is incompressible: a stress of 78 MPa over the bulk modulus at a stretch of 4.
        ("spatial_force_error", Below(1e-3)),
        ("material_force_error", Below(1e-3)),
    ];
    check!(&kernels::summary(&kernels::analyses().unwrap()).unwrap(), &expected);
}

#[test]
fn uniaxial_tension_and_compression() {
    let expected = [
        // A homogeneous stretch is in the space and all rules pass the patch test: rounding of ten iterations remains.
        ("error_", Below(1e-11)),
        ("reduced_stress_", Near(1e-10)),
        // One step; Newton's method on a homogeneous state takes what it takes for one point.
        ("steps_", Between(1.0, 1.0)),
        ("iterations_", Between(3.0, 12.0)),
        // The paper's scheme on regular particles at r = 0.5 has supports that end at the next particle: linear finite
        // elements, which Gauss points integrate exactly.
        ("paper_error_regular_10_r0.50001", Below(1e-9)),
        ("paper_error_regular_0.1_r0.50001", Below(1e-9)),
        ("paper_reduced_stress_regular_10_r0.50001", Near(1e-9)),
        ("paper_reduced_stress_regular_0.1_r0.50001", Near(1e-9)),
        // Elsewhere it fails the patch test, by so much.
        ("paper_error_regular_", Between(5e-5, 4e-3)),
        ("paper_error_irregular_10_r0.50001", Between(3e-3, 3e-2)),
        ("paper_error_irregular_0.1_r0.50001", Between(0.1, 0.4)),
        ("paper_error_irregular_10_", Between(1e-4, 1e-3)),
        ("paper_error_irregular_0.1_", Between(5e-3, 4e-2)),
        ("paper_reduced_stress_irregular_10_r0.50001", Off(-0.08, -0.03)),
        ("paper_reduced_stress_irregular_0.1_r0.50001", Off(-0.04, -0.01)),
        // The reduced stress, what Fig. 5 shows, hides most of that.
        ("paper_reduced_stress_", Near(4e-3)),
        // Circular supports change nothing where the rule passes the patch test, and no more than boxes of r = 1 where it does not.
        ("ball_default_error_", Below(1e-11)),
        ("ball_default_reduced_stress_", Near(1e-10)),
        ("ball_paper_error_regular_", Below(4e-3)),
        // Balls follow the nearest particle: in irregular sets some are hardly wider than boxes of r = 0.5.
        ("ball_paper_error_irregular_0.1", Between(0.1, 0.4)),
        ("ball_paper_error_irregular_", Below(4e-2)),
        ("ball_paper_reduced_stress_", Near(1e-2)),
    ];
    check!(&uniaxial::summary().unwrap(), &expected);
}

#[test]
fn simple_shear_to_two_hundred_per_cent() {
    let expected = [
        // All of the boundary follows a linear field.
        ("sigma12_", Near(1e-12)),
        ("paper_sigma12_2_regular_r0.50001_", Near(1e-9)),
        // Conditions at particles leave the field between them free, and Gauss points do not integrate it: Fig. 7 at its worst point.
        ("paper_sigma12_2_irregular_r0.50001_", Near(3e-4)),
        ("paper_sigma12_2_", Near(2e-5)),
        // The same with circular supports.
        ("ball_sigma12_2_", Near(2e-5)),
    ];
    let summary = simple_shear::summary().unwrap();
    check!(&summary, &expected);
    // Multipliers and the transformation are two ways to one solution.
    for row in summary.rows.iter().filter(|row| row.name.ends_with("_multipliers")) {
        let name = row.name.replace("_multipliers", "_transformation");
        let other = summary.rows.iter().find(|other| other.name == name).unwrap();
        assert!(abs_diff_eq!(row.value / other.value, 1.0, epsilon = 1e-10), "{name}");
    }
}

#[test]
fn tube_inflated_to_three_and_a_half_bores() {
    let expected = [
        // Linear functions with nine particles: the square of the spacing by the smoothness of 1/R², measured by refinement.
        ("u_inner_default", Near(5e-6)),
        ("energy_default", Near(1e-5)),
        ("steps_default", Between(1.0, 1.0)),
        ("iterations_default", Between(5.0, 12.0)),
        ("energy_quadratic", Near(5e-7)),
        // The paper's claim: less than 0.2 % for r = 1.6 on regular particles; it locks at r = 1.
        ("energy_paper_r1.6", Near(2e-3)),
        ("energy_paper_r1.0", Off(0.03, 0.06)),
        ("u_inner_paper_", Near(1e-3)),
        ("energy_paper_random", Off(2e-3, 2e-2)),
        ("energy_paper_", Near(2e-3)),
        // The known traction is imposed on the recovered stress; its tangential part is off by the field's own error.
        ("stress_bore_9", Near(2e-2)),
        ("stress_bore_17", Near(5e-3)),
        ("hoop_stress_bore_9", Near(4e-2)),
        ("hoop_stress_bore_17", Near(1.5e-2)),
        // The cured scheme over r = 0.8 … 3 and all sets but the alternating one.
        ("energy_worst_equal_zones", Below(5e-4)),
        ("energy_worst_own_zones", Below(5e-3)),
        ("energy_worst_local_supports", Below(2e-2)),
    ];
    check!(&tube_inflation::summary().unwrap().0, &expected);
}

#[test]
fn disk_blown_up_to_a_bubble() {
    let expected = [
        // 22 particles: with ten spacings over the radius the bend at the rim is a kink; twice as fine quarters the error.
        ("w_0.0207_22", Near(1e-2)),
        ("w_0.1035_22_r1.5", Near(2.5e-2)),
        ("w_0.1035_22", Off(-4.5e-2, -2.5e-2)),
        ("w_0.1035_41x2", Near(8e-3)),
        ("w_0.1449_41x2", Near(2.5e-2)),
        // 22 and 115 while steps were predicted by a line.
        ("steps_22", Between(10.0, 20.0)),
        ("iterations_22", Between(60.0, 150.0)),
        ("steps_paper", Between(207.0, 207.0)),
        // The paper's scheme locks in bending, the more the less the membrane carries.
        ("w_0.0207_paper", Off(-0.36, -0.26)),
        ("w_0.1035_paper", Off(-6e-2, -3e-2)),
        ("w_0.0207_q1p0_10x1", Near(7e-3)),
        ("w_0.1035_q1p0_10x1", Off(-5e-2, -3e-2)),
        // 80 × 4 Q2/P1 elements; no closed form.
        ("w_q2p1_0.005", Between(3.82, 3.85)),
        ("w_default_0.005", Near(1e-2)),
        ("w_paper_0.005", Off(-0.75, -0.63)),
        // 22 nodes beside 100 × 3 elements, as Fig. 9 has it. The paper's scheme locks while the disk bends, and all 22 nodes are too stiff
        // for the bubble, elements most. With r = 1.5 there is a limit point at 0.2045 MPa.
        ("beside_100x3_reached_paper_r1.5", Between(0.196, 0.2045)),
        ("beside_100x3_reached_", Between(0.206999, 0.207001)),
        ("beside_100x3_0.01035_paper_", Off(-0.57, -0.47)),
        ("beside_100x3_0.0207_paper_", Off(-0.36, -0.26)),
        ("beside_100x3_0.05175_paper_", Off(-0.09, -0.04)),
        ("beside_100x3_0.1035_paper_", Off(-0.06, -0.02)),
        ("beside_100x3_0.15525_paper_", Off(-0.17, -0.06)),
        ("beside_100x3_0.207_paper_r1", Off(-0.33, -0.24)),
        ("beside_100x3_0.207_paper_r2", Off(-0.2, -0.1)),
        ("beside_100x3_0.207_default_22", Off(-0.27, -0.17)),
        ("beside_100x3_0.207_q1p0_10x1", Off(-0.39, -0.29)),
        ("beside_100x3_0.15525_default_22", Off(-0.13, -0.07)),
        ("beside_100x3_0.15525_q1p0_10x1", Off(-0.19, -0.11)),
        ("beside_100x3_0.1035_", Off(-0.05, -0.02)),
        // Below, as with the whole reference.
        ("beside_100x3_", Near(1.2e-2)),
        // The same elements by another code: its digits.
        ("q1p0_", Below(5e-6)),
        // Of 207 steps; one step is 0.005 of the last pressure.
        ("pinned_", Near(1e-9)),
    ];
    check!(&disk_inflation::Inflations::run().unwrap().summary().unwrap(), &expected);
}

#[test]
fn bushing_between_sleeves() {
    let expected = [
        // The benchmark has no closed form; its free edge makes it uncertain to 1e-3.
        ("uz_outer_q2p1", Between(1.7395, 1.7445)),
        ("uz_outer_56_paper_r0.8", Off(1.5e-2, 3e-2)),
        ("uz_outer_56_paper_r0.9", Off(8e-3, 1.7e-2)),
        ("uz_outer_56_paper_r1.0", Off(5e-3, 1.2e-2)),
        // Sleeves that touch everywhere prescribe the same end: the rows of contact and those of the condition are one.
        ("uz_outer_56_contact", Near(1e-9)),
        ("uz_outer_195_contact", Near(1e-9)),
        ("uz_outer_725_contact", Near(1e-9)),
        ("uz_outer_56", Near(2.5e-3)),
        ("uz_outer_725", Near(1.5e-3)),
        ("uz_outer_q1p0_", Near(3e-3)),
        ("steps_56", Between(1.0, 1.0)),
        ("iterations_56_contact", Between(2.0, 10.0)),
        ("iterations_56", Between(2.0, 10.0)),
        ("iterations_", Between(2.0, 10.0)),
        ("inner_sleeve_kN_", Near(1e-8)),
        ("outer_sleeve_kN_", Near(1e-8)),
        // Closed everywhere, and pressed: a pressure in MPa, positive inwards.
        ("open_", Between(0.0, 0.0)),
        ("least_pressure_", Between(8.0, 9.5)),
    ];
    check!(&bushing_assembly::summary(&bushing_assembly::assemblies().unwrap()).unwrap(), &expected);
}
