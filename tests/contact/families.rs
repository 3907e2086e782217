//! Families of models that may fold between points or let contact leak: what completes without a doubt is right, what is not ends and says why.

use crate::case::{Family, Verdict};

/// Models of a family that are run, every eleventh one: the example `folds` runs them all.
const RUNS: usize = 6;

/// Of runs spread over a family none is completed, without a doubt and more than 5 % from the refined model, but for models that are known
/// to be so, by parts of their labels, because they are too coarse; whether most are right.
fn holds(family: &Family, coarse: &[&str], right: usize) {
    let all: Vec<_> = family.targets.iter().flat_map(|t| t.models.iter().map(move |model| (t, model))).collect();
    let taken = all.len().min(RUNS);
    let mut count = 0;
    for (target, model) in (0..taken).map(|k| all[11 * k % all.len()]) {
        let found = (model.run)().unwrap();
        let verdict = target.reference.judge(&found);
        let label = format!("{}, {}", target.label, model.label);
        println!("{label}: {:?} {} at {} {:?}", verdict == Verdict::Right, found.value, found.load, found.ending);
        count += usize::from(verdict == Verdict::Right);
        let known = coarse.iter().any(|part| label.contains(part));
        assert!(verdict != Verdict::WrongCompleted || known, "{label}: {}", found.value);
    }
    assert!(count >= right, "{}: {count} of {taken} are right", family.name);
}

#[test]
fn shafts_in_grooves() {
    holds(&crate::plane::shaft(), &[], RUNS);
}

#[test]
fn rings_between_plates() {
    holds(&crate::plane::ring("ring_12", 0.12), &[], 5);
    // The refined model ends at its crease, which a coarse one has within a single trace function.
    holds(&crate::plane::ring("ring_08", 0.08), &["closed by 0.16"], 4);
}

#[test]
fn seals() {
    holds(&crate::plane::seal(), &[], 5);
}

#[test]
fn bonded_pads() {
    holds(&crate::plane::pad(), &[], 5);
}

#[test]
fn columns_that_touch_themselves() {
    holds(&crate::plane::column(), &[], 5);
}

#[test]
fn hollow_bumpers() {
    holds(&crate::axisymmetric::bumper(), &[], 5);
}

#[test]
fn discs_under_pressure() {
    // Three particles through the thickness: 3 % of the deflection, 6 % of the energy.
    holds(&crate::axisymmetric::disk(), &["block 41 × 3"], 5);
}

#[test]
fn graded_spheres() {
    holds(&crate::axisymmetric::sphere(), &["elements 17"], 2);
}

#[test]
fn arches_in_3d() {
    holds(&crate::beam::beam(), &[], 4);
}
