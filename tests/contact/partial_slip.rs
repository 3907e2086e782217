//! Partial slip beside closed forms: Cattaneo and Mindlin in the plane, a sleeve that is drawn along a shaft, a turned roller.

use std::f64::consts::{FRAC_PI_2, PI};

use approx::{abs_diff_eq, assert_abs_diff_eq};
use rkpm::prelude::*;
use rkpm::scene::ContactState;
use rkpm::solve::EquilibriumPath;

use crate::{SHEAR, soft};

/// A cylinder of radius 1 on a half-plane, incompressible: pressed until they touch within `half`, then drawn along until they stick within
/// `stick` alone.
#[derive(Clone, Copy)]
struct Cattaneo {
    half: f64,
    stick: f64,
    friction: f64,
}

impl Cattaneo {
    /// Per unit length.
    fn force(&self) -> f64 {
        PI * SHEAR * self.half.powi(2)
    }

    fn tangential(&self) -> f64 {
        self.friction * self.force() * (1.0 - (self.stick / self.half).powi(2))
    }

    /// The displacement by a force whose density is that of an ellipse over a half-width, at a place of the half-plane: twice the flow of
    /// point forces in the whole plane, $\tfrac1{2\pi\mu}(-F\ln r + (F\cdot\hat r)\,\hat r)$.
    fn ellipse(force: Point<2>, half: f64, x: &Point<2>) -> Point<2> {
        const POINTS: usize = 48;
        let mut found = Point::<2>::zeros();
        for k in 1..=POINTS {
            let angle = PI * k as f64 / (POINTS + 1) as f64;
            let part = 2.0 / (POINTS + 1) as f64 * angle.sin().powi(2);
            let away = Point::<2>::new(x[0] - half * angle.cos(), x[1]);
            let r = away.norm();
            found += (force * -r.ln() + away * (force.dot(&away) / (r * r))) * part;
        }
        found / (2.0 * PI * SHEAR)
    }

    /// How far the surface in the middle of such an ellipse goes along the force; along the surface by as much more as `along` says.
    fn middle(force: f64, half: f64, along: f64) -> f64 {
        force * (0.5 - (0.5 * half).ln() + along) / (2.0 * PI * SHEAR)
    }

    fn approach(&self) -> f64 {
        Cattaneo::middle(self.force(), self.half, 0.0)
    }

    /// The forces of the two ellipses whose difference is the friction.
    fn sheared(&self) -> [f64; 2] {
        let whole = self.friction * self.force();
        [whole, whole * (self.stick / self.half).powi(2)]
    }

    fn drawn(&self) -> f64 {
        let [whole, less] = self.sheared();
        Cattaneo::middle(whole, self.half, 1.0) - Cattaneo::middle(less, self.stick, 1.0)
    }

    /// The displacement of the half-plane beside a cylinder that does not move along, at parts of both loads.
    fn displacement(&self, x: &Point<2>, [pressed, drawn]: [f64; 2]) -> Point<2> {
        let [whole, less] = self.sheared();
        let along = Cattaneo::ellipse([whole, 0.0].into(), self.half, x)
            - Cattaneo::ellipse([less, 0.0].into(), self.stick, x)
            - Point::<2>::new(self.drawn(), 0.0);
        Cattaneo::ellipse([0.0, -self.force()].into(), self.half, x) * pressed + along * drawn
    }

    fn scene(&self, bulk: f64, reach: f64, rate: f64) -> Scene<2> {
        let (case, size) = (*self, reach * self.half);
        let growing = move |t: f64| size * (rate * t).sinh() / rate.sinh();
        let block = Mapped(move |unit: &Point<2>| [growing(2.0 * unit[0] - 1.0), -growing(1.0 - unit[1])].into());
        let pressed = Amplitude::table(vec![(0.0, 0.0), (PRESSED, 1.0), (1.0, 1.0)]).unwrap();
        let tool = RigidSurface::shaft([0.0, 1.0], 1.0).moving_along([0.0, -self.approach()], pressed);
        let mut scene = Scene::new(block, PlaneStrain, soft(bulk))
            .contact((1, Side::Max), tool.friction(self.friction).named("cylinder"));
        for far in [(0, Side::Min), (0, Side::Max), (1, Side::Min)] {
            let moved = move |x: &Point<2>, load: f64| {
                case.displacement(x, [(load / PRESSED).min(1.0), ((load - PRESSED) / (1.0 - PRESSED)).max(0.0)]).into()
            };
            scene = scene.with(Condition::on(far).displacement(Value::motion(moved)));
        }
        scene
    }

    /// How far a contact is off: its force and half-width, the force along it and the half-width where it sticks, both widths by the second
    /// moments of what is spread as an ellipse.
    fn off(&self, contact: &ContactState<2>) -> [f64; 4] {
        let by_moment = |density: &dyn Fn(&rkpm::scene::ContactPoint<2>) -> f64| {
            let sums = contact.points.iter().map(|point| [density(point), density(point) * point.position[0].powi(2)]);
            let [all, square] = sums.fold([0.0; 2], |[a, b], [c, d]| [a + c, b + d]);
            2.0 * (square / all).sqrt()
        };
        let stick = by_moment(&|point| -self.friction * point.force[1] - point.force[0]);
        [
            -contact.force[1] / self.force(),
            by_moment(&|point| -point.force[1]) / self.half,
            contact.force[0] / self.tangential(),
            stick / self.stick,
        ]
        .map(|ratio| ratio - 1.0)
    }
}

/// The part of the load by which the cylinder is pressed in.
const PRESSED: f64 = 0.3;

/// Cattaneo and Mindlin: the contact sticks in its middle and slides at its ends.
#[test]
fn a_cylinder_drawn_along_sticks_in_its_middle() {
    for stick in [0.8, 0.6] {
        let case = Cattaneo { half: 0.02, stick: stick * 0.02, friction: 0.3 };
        let problem = case.scene(1e3, 8.0, 3.0).discretize(&Scheme::default().particles([81, 31])).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        let contact = problem.contact(path.last(), "cylinder").unwrap();
        let [force, half, tangential, stick] = case.off(&contact);
        println!(
            "force {force:.2e}, half-width {half:.2e}, along {tangential:.2e}, stick {stick:.2e}, {} its in {} steps",
            path.iterations,
            path.steps.len()
        );
        assert!(force.abs() < 0.01 && half.abs() < 0.02, "{force:e} {half:e}");
        assert!(tangential.abs() < 0.01 && stick.abs() < 0.03, "{tangential:e} {stick:e}");
    }
}

/// A thin sleeve on a shaft that is thicker than its bore, drawn off along it: friction of revolution. While it slides, tension makes it
/// grip harder: with the hoop strain e, σ_z = E e/ν (exp(ν f z/R) − 1) from the free end on.
#[test]
fn a_sleeve_drawn_along_a_shaft_grips_by_its_tension() {
    let (radius, thick, length, strain, friction) = (1.0, 0.02, 1.5, 0.002, 0.5);
    let young = 3.0 * SHEAR;
    let middle = radius + 0.5 * thick;
    let expected = {
        let poisson = 0.5;
        let grip = poisson * friction * length / middle;
        2.0 * PI * middle * thick * young * strain / poisson * (grip.exp() - 1.0)
    };
    let fitted = Amplitude::table(vec![(0.0, 0.0), (PRESSED, 1.0), (1.0, 1.0)]).unwrap();
    let drawn = Amplitude::table(vec![(0.0, 0.0), (PRESSED, 0.0), (1.0, 1.0)]).unwrap();
    let shaft = RigidSurface::plane([radius, 0.0], [1.0, 0.0]).moving_along([middle * strain, 0.0], fitted);
    let scene = Scene::new(Block::new([radius, 0.0], [radius + thick, length]), Axisymmetric, soft(1e3))
        .with(Condition::on((1, Side::Max)).component(1, 0.01).amplitude(drawn))
        .contact((0, Side::Min), shaft.friction(friction).named("shaft"));
    let problem = scene.discretize(&Scheme::default().particles([3, 61])).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    let contact = problem.contact(path.last(), "shaft").unwrap();
    let slips = contact.points.iter().filter(|point| point.is_active && point.slips).count();
    let force = problem.reaction(path.last(), (1, Side::Max)).unwrap()[1];
    println!(
        "force {:.2e} off, {slips} of {} slide, {} its",
        force / expected - 1.0,
        contact.points.len(),
        path.iterations
    );
    assert_abs_diff_eq!(force / expected, 1.0, epsilon = 0.02);
    assert_eq!(slips, contact.points.len());
}

/// The torque of a roller that is pressed into a layer and turned by some angles.
fn torques(scheme: &Scheme, angle: f64) -> Vec<[f64; 2]> {
    let (radius, down, friction) = (0.5, 0.1, 0.5);
    let growing = |t: f64| 2.0 * (2.0 * (2.0 * t - 1.0)).sinh() / 2f64.sinh();
    let layer = Mapped(move |unit: &Point<2>| [growing(unit[0]), (FRAC_PI_2 * unit[1]).sin()].into());
    let table = |points: [(f64, f64); 3]| Amplitude::table(points.to_vec()).unwrap();
    let roller = RigidSurface::shaft([0.0, 1.0 + radius], radius)
        .moving_along([0.0, -down], table([(0.0, 0.0), (PRESSED, 1.0), (1.0, 1.0)]))
        .turning([0.0, 1.0 + radius], angle)
        .turning_along(table([(0.0, 0.0), (PRESSED, 0.0), (1.0, 1.0)]))
        .friction(friction)
        .named("roller");
    let scene = Scene::new(layer, PlaneStrain, soft(100.0)).hold((1, Side::Min)).contact((1, Side::Max), roller);
    let problem = scene.discretize(scheme).unwrap();
    let path: EquilibriumPath = problem.run().unwrap().completed().unwrap();
    let torque = |step: &rkpm::solve::Step| {
        let contact = problem.contact(&step.state, "roller").unwrap();
        let centre = [0.0, 1.0 + radius - down];
        [contact.angle, contact.moment[2] - (centre[0] * contact.force[1] - centre[1] * contact.force[0])]
    };
    let turned = path.steps.iter().filter(|step| step.state.load > PRESSED + 1e-9).map(torque).collect();
    println!("{} its in {} steps", path.iterations, path.steps.len());
    turned
}

/// The torque of a turned roller against its turn, from where it sticks to where it slides, beside a finer model.
#[test]
fn a_roller_has_its_torque() {
    let [found, finer] = [[65, 17], [97, 25]].map(|counts| torques(&Scheme::default().particles(counts), 0.25));
    assert!(!found.is_empty() && found.len() == finer.len());
    for ([angle, torque], [at, expected]) in found.into_iter().zip(finer) {
        assert_abs_diff_eq!(angle, at, epsilon = 1e-9);
        println!("{angle:.4} rad: {torque:.5}, {:.2e} off", torque / expected - 1.0);
        assert!(abs_diff_eq!(torque / expected, 1.0, epsilon = 0.01), "{angle}: {torque} {expected}");
    }
}
