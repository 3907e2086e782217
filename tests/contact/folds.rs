//! Bodies that fold, or that a rigid surface would pass into, where nothing between particles resists.

use rkpm::prelude::*;

/// A sleeve that tapers, fixed at its base and pressed by a plate on its rounded top by 0.4 of its height, creases at its bore. All models
/// reach the end on the smooth branch, their forces rise and fall together, and no point loses half of its volume.
#[test]
fn a_sleeve_creases_without_folding_between_points() {
    let mut last = Vec::new();
    for spacing in [2.0, 1.6, 1.25, 1.0, 0.8] {
        let outline = Outline::at([6.0, 0.0])
            .line("bottom", [15.0, 0.0])
            .line("outside", [12.0, 18.0])
            .arc("top", [9.0, 18.0], [10.5, 18.0], Turn::Left)
            .close("bore");
        let plate = RigidSurface::plane([0.0, 19.5], [0.0, -1.0]).moving([0.0, -7.8]).named("plate");
        let sleeve = Scene::new(Region::new(outline).unwrap(), Axisymmetric, Rubber::neo_hookean(0.5, 500.0).unwrap())
            .hold("bottom")
            .contact("top", plate);
        let eighths = Stepping { first: 0.125, largest: 0.125, ..Stepping::default() };
        let problem = sleeve.discretize(&Scheme::default().spacing(spacing).stepping(eighths)).unwrap();
        // The coarse models are in doubt about the crease.
        let path = problem.run().unwrap().reached().unwrap();
        let forces: Vec<f64> =
            path.steps.iter().map(|step| -problem.contact(&step.state, "plate").unwrap().force[1]).collect();
        let particles = problem.cells().positions().len();
        let jacobians = problem.deformation_gradients(path.last()).unwrap().into_iter().map(|f| f.determinant());
        let [low, high] = jacobians.fold([f64::INFINITY, 0.0], |[low, high]: [f64; 2], j| [low.min(j), high.max(j)]);
        let fall = forces.windows(2).map(|pair| 1.0 - pair[1] / pair[0]).fold(0.0, f64::max);
        println!(
            "{particles} particles: {:.2} N, J from {low:.2} to {high:.2}, falls by {fall:.3}",
            forces[forces.len() - 1]
        );
        assert!(low > 0.5 && fall < 0.25, "{particles} particles: {low}, {fall}");
        last.push(forces[forces.len() - 1]);
    }
}

/// A shaft pressed by 0.35 into the half-round groove of radius 0.3 that it fits, to surface pressures of 7 shear moduli: it stays outside of the
/// body and the forces balance. Reference: −2.74, outlines at spacings 0.07, 0.06 and 0.05 (example `folds`), known to half a per cent.
/// Where only mean gaps were closed the shaft passed between the particles of the boundary, with forces of −0.2 to −1.
#[test]
fn a_shaft_does_not_leak_into_the_body_between_particles() {
    for name in ["groove_9", "groove_11", "groove_13", "groove_quadrangles_2"] {
        let file = format!("{}/examples/meshes/folds/{name}.msh", env!("CARGO_MANIFEST_DIR"));
        let shaft = RigidSurface::shaft([1.0, 1.0], 0.3).moving([0.0, -0.35]).named("shaft");
        let rubber = Rubber::mooney_rivlin(0.4, 0.1, 1000.0).unwrap();
        let block = Scene::new(Mesh::<2>::read(file).unwrap(), PlaneStrain, rubber).hold("bottom");
        let problem = block.contact("groove", shaft).discretize(&Scheme::default()).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        let contact = problem.contact(path.last(), "shaft").unwrap();
        let (force, depth) = (contact.force[1], contact.depth.unwrap());
        let foot = problem.reaction(path.last(), "bottom").unwrap();
        println!("{name}: {force:.4}, {depth:.4} deep, {} iterations", path.iterations);
        assert!((force / -2.74 - 1.0).abs() < 0.05 && depth < 0.03, "{name}: {force}, {depth} deep");
        assert!((foot + contact.force).norm() < 1e-6 * force.abs(), "{name}: {foot} against {}", contact.force);
    }
}
