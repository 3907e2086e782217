//! `Problem::equilibrium`: its solutions compared with laws of linear algebra, closed forms and the run of the crate. Loops of one's own
//! are in the book (`docs/book/loops.md`).

use std::f64::consts::PI;

use approx::{abs_diff_eq, assert_relative_eq, relative_eq};
use rkpm::assembly::Pattern;
use rkpm::boundary::{ConstraintEquation, Eliminated, Enforced, Enforcement};
use rkpm::error::{BoundaryError, Cause};
use rkpm::prelude::*;

fn rubber(bulk: f64) -> Rubber {
    Rubber::neo_hookean(0.5, bulk).unwrap()
}

/// A block under a shaft that is pressed in and slides with friction.
fn under_a_shaft() -> Problem<2> {
    let shaft = RigidSurface::shaft([10.0, 18.0], 8.0).moving([5.0, -1.5]).friction(0.3);
    let block = Scene::new(Block::new([0.0, 0.0], [20.0, 10.0]), PlaneStrain, rubber(1e3));
    let block = block.hold((1, Side::Min)).contact((1, Side::Max), shaft);
    block.discretize(&Scheme::default().particles([13, 7]).stepping(Stepping::equal(4))).unwrap()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn random(count: usize, seed: u64) -> Vec<f64> {
    let mut random = fastrand::Rng::with_seed(seed);
    (0..count).map(|_| random.f64() - 0.5).collect()
}

/// $f\cdot K^{-1}b = b\cdot K^{-T}f$ where sliding friction makes the matrix unsymmetric, by any enforcement.
#[test]
fn dual_solutions_are_those_of_the_transpose() -> Result<(), rkpm::Error> {
    for multipliers in [false, true] {
        let mut problem = under_a_shaft();
        if multipliers {
            problem.analysis_mut().enforcement = Box::new(LagrangeMultipliers);
        }
        let path = problem.run()?.completed()?;
        let mut equilibrium = problem.equilibrium()?;
        equilibrium.linearize(path.last())?;
        let count = problem.model().unknowns();
        let (f, b, none) = (random(count, 1), random(count, 2), vec![0.0; problem.equations().equations().len()]);
        let answer = equilibrium.solve(Rhs::Force(&b))?;
        let dual = equilibrium.solve(Rhs::Dual { force: &f, prescribed: &none })?;
        let other = equilibrium.solve(Rhs::Force(&f))?;
        let ([forth, back], size) =
            ([dot(&f, &answer.displacement), dot(&b, &dual.displacement)], dot(&f, &other.displacement));
        assert!(abs_diff_eq!(forth, back, epsilon = 1e-5 * size.abs()), "{multipliers}: {forth} and {back}");
        // The matrix is not symmetric.
        assert!(
            (forth - dot(&b, &other.displacement)).abs() > 1e-3 * size.abs(),
            "{multipliers}: friction slides nowhere"
        );
    }
    Ok(())
}

/// Eliminates one group of constraint equations, and gives the others multipliers.
struct Partly;

impl Enforcement for Partly {
    fn bind(&self, pattern: &Pattern, equations: &Constraints) -> Result<Enforced, BoundaryError> {
        let mut enforced = MixedTransformation::default().bind(pattern, equations)?;
        assert!(enforced.eliminated.len() > 1);
        enforced.eliminated.truncate(1);
        Ok(Enforced { multipliers: true, penalty: vec![1.0; equations.equations().len()], ..enforced })
    }
}

/// Increments and changes of reactions do not depend on how conditions are enforced; sweeps over the skew part of the pressure leave 1e-6.
#[test]
fn enforcements_have_the_same_increments() -> Result<(), rkpm::Error> {
    let block = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber(1e2))
        .hold(Side::Min)
        .with(Condition::on(Side::Max).displacement([0.3, -0.2]))
        .pressure((1, Side::Max), 0.1);
    let solved = |enforcement: Box<dyn Enforcement>| -> Result<Vec<Increment>, rkpm::Error> {
        let mut problem = block.discretize(&Scheme::default().particles([9, 5]))?;
        problem.analysis_mut().enforcement = enforcement;
        let path = problem.run()?.completed()?;
        let (force, values) = (random(problem.model().unknowns(), 3), random(problem.equations().equations().len(), 4));
        let mut equilibrium = problem.equilibrium()?;
        equilibrium.linearize(path.last())?;
        let sides = [Rhs::Load, Rhs::Force(&force), Rhs::Prescribed(&values)];
        sides.into_iter().map(|side| Ok(equilibrium.solve(side)?)).collect()
    };
    let eliminated = solved(Box::<MixedTransformation>::default())?;
    let others = [solved(Box::new(LagrangeMultipliers))?, solved(Box::new(Partly))?];
    for (a, b) in others.iter().flat_map(|other| eliminated.iter().zip(other)) {
        for (a, b) in [(&a.displacement, &b.displacement), (&a.multipliers, &b.multipliers)] {
            let size = dot(a, a).sqrt();
            assert!(
                size > 0.0 && a.iter().zip(b).all(|(a, b)| abs_diff_eq!(a, b, epsilon = 1e-5 * size)),
                "{a:?}, {b:?}"
            );
        }
    }
    Ok(())
}

/// Eliminates all equations by W and V that are off by factors.
struct Scaled(f64, f64);

impl Enforcement for Scaled {
    fn bind(&self, pattern: &Pattern, equations: &Constraints) -> Result<Enforced, BoundaryError> {
        let enforced = MixedTransformation::default().bind(pattern, equations)?;
        let scaled = |of: Eliminated| Eliminated {
            transfer: of.transfer.iter().map(|w| w * self.0).collect(),
            offsets: of.offsets.iter().map(|v| v * self.1).collect(),
            ..of
        };
        Ok(Enforced { eliminated: enforced.eliminated.into_iter().map(scaled).collect(), ..enforced })
    }
}

/// What does not satisfy the equations that it eliminates would converge to a state that does not meet its conditions.
#[test]
fn enforcements_satisfy_what_they_eliminate() -> Result<(), rkpm::Error> {
    for (transfer, offset) in [(1.0, 1.0), (1.0, 0.0), (1.0, 1.0 + 1e-4), (0.9, 1.0), (0.0, 1.0)] {
        // Over a boundary, whose equations are lengths times areas, and small.
        let mut problem = Scene::new(Block::new([0.0, 0.0], [2e-3, 1e-3]), PlaneStrain, rubber(1e2))
            .hold(Side::Min)
            .with(Condition::on(Side::Max).displacement([3e-4, -2e-4]))
            .discretize(&Scheme::default().particles([5, 3]))?;
        problem.analysis_mut().enforcement = Box::new(Scaled(transfer, offset));
        match problem.run() {
            Ok(_) if (transfer, offset) == (1.0, 1.0) => {}
            Err(error) if error.to_string().contains("do not satisfy it") && (transfer, offset) != (1.0, 1.0) => {}
            other => panic!("{transfer}, {offset}: {:?}", other.map(|path| path.ending)),
        }
    }
    Ok(())
}

/// The answer to a unit of the load is the derivative of the path.
#[test]
fn answers_to_the_load_are_the_slope_of_the_path() -> Result<(), rkpm::Error> {
    let column = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber(1e2));
    let column =
        column.hold(Side::Min).with(Condition::on(Side::Max).displacement([0.5, 0.2])).pressure((1, Side::Max), 0.1);
    let problem = column.discretize(&Scheme::default().particles([9, 5]))?;
    let path = problem.run()?.completed()?;
    let states = problem.states_at(&path, &[0.499, 0.5, 0.501])?;
    let mut equilibrium = problem.equilibrium()?;
    equilibrium.linearize(&states[1])?;
    let slope = equilibrium.solve(Rhs::Load)?;
    assert_eq!(slope.load, 1.0);
    let [before, behind] = [&states[0], &states[2]];
    let size = slope.norm();
    for (k, s) in slope.displacement.iter().enumerate() {
        let difference = (behind.displacement[k] - before.displacement[k]) / 0.002;
        assert!(abs_diff_eq!(*s, difference, epsilon = 1e-5 * size), "{k}: {s} and {difference}");
    }
    Ok(())
}

/// A long bush of a neo-Hookean rubber in plane strain, radii 10 and 20 mm, µ = 1 MPa.
fn bush(bulk: f64, inner: impl Fn(Condition<2>) -> Condition<2>) -> Result<Problem<2>, rkpm::Error> {
    let [outer, hole] =
        [("outer", 20.0), ("inner", 10.0)].map(|(name, radius)| Outline::circle(name, [0.0, 0.0], radius));
    let bush = Scene::new(Region::with_holes(outer, [hole])?, PlaneStrain, rubber(bulk));
    bush.hold("outer").with(inner(Condition::on("inner"))).discretize(&Scheme::default().spacing(1.25))
}

/// Forces and moment of the inner sleeve against its translations and rotation: of the state that `run` ends with, by one factorisation.
fn stiffness(problem: &Problem<2>, about: [f64; 2]) -> Result<[[f64; 3]; 3], rkpm::Error> {
    let path = problem.run()?.completed()?;
    let mut equilibrium = problem.equilibrium()?;
    let loaded = path.last();
    equilibrium.linearize(loaded)?;
    let mut stiffness = [[0.0; 3]; 3];
    for (column, motion) in problem.rigid_changes(loaded, "inner", about)?.iter().enumerate() {
        let step = equilibrium.solve(Rhs::Prescribed(motion))?;
        for sign in [1e-3, -1e-3] {
            let (mut state, mut centre) = (loaded.clone(), about);
            equilibrium.apply(&(step.clone() * sign), 1.0, &mut state)?;
            if column < 2 {
                centre[column] += sign;
            }
            let force = problem.reaction(&state, "inner")?;
            let all = [force[0], force[1], problem.moment(&state, "inner", centre)?[2]];
            all.iter().enumerate().for_each(|(row, value)| stiffness[row][column] += value / (2.0 * sign));
        }
    }
    Ok(stiffness)
}

/// Radially $4\pi\mu / (\ln(b/a) - (b^2 - a^2)/(b^2 + a^2))$ at rest (Adkins and Gent 1954), against torsion $4\pi\mu / (a^{-2} - b^{-2})$
/// at any angle: azimuthal shear of an incompressible neo-Hookean tube is linear. With 1.25 mm between particles both are met to 2 %.
#[test]
fn the_stiffness_of_a_bush_is_that_of_closed_forms() -> Result<(), rkpm::Error> {
    let radial = 4.0 * PI / (2.0f64.ln() - 300.0 / 500.0);
    let torsional = 4.0 * PI / (1.0 / 100.0 - 1.0 / 400.0);
    let rest = stiffness(&bush(1e4, |inner| inner.displacement([0.0, -1e-6]))?, [0.0, 0.0])?;
    for axis in 0..2 {
        assert_relative_eq!(rest[axis][axis], radial, max_relative = 0.02);
    }
    assert_relative_eq!(rest[2][2], torsional, max_relative = 0.02);
    // Turned by 0.4 rad.
    let turned = |x: &Point<2>, load: f64| {
        let (sine, cosine) = (0.4 * load).sin_cos();
        [x[0] * cosine - x[1] * sine - x[0], x[0] * sine + x[1] * cosine - x[1]]
    };
    let twisted = bush(1e4, |inner| {
        inner
            .component(0, Value::motion(move |x: &Point<2>, load| turned(x, load)[0]))
            .component(1, Value::motion(move |x: &Point<2>, load| turned(x, load)[1]))
    })?;
    let twisted = stiffness(&twisted, [0.0, 0.0])?;
    assert_relative_eq!(twisted[2][2], torsional, max_relative = 0.02);
    Ok(())
}

/// About a loaded state columns are the differences of equilibria a little further.
#[test]
fn the_stiffness_of_a_loaded_bush_is_the_difference_of_forces() -> Result<(), rkpm::Error> {
    let pushed = |x: f64, y: f64| bush(1e2, move |inner| inner.displacement([x, y]));
    let loaded = pushed(0.5, -4.0)?;
    let all = stiffness(&loaded, [0.5, -4.0])?;
    let guess = loaded.run()?.completed()?.last().clone();
    let wrench = |x: f64, y: f64| -> Result<[f64; 3], rkpm::Error> {
        let problem = pushed(x, y)?;
        let (model, equations) = (problem.model(), problem.equations());
        let path = problem.analysis().correct(model, equations, guess.clone(), &mut ())?.completed()?;
        let force = problem.reaction(path.last(), "inner")?;
        Ok([force[0], force[1], problem.moment(path.last(), "inner", [x, y])?[2]])
    };
    for column in 0..2 {
        let h = |part: f64| if column == 0 { [0.5 + part, -4.0] } else { [0.5, -4.0 + part] };
        let [ahead, behind] = [h(1e-3), h(-1e-3)].map(|[x, y]| wrench(x, y));
        let (ahead, behind) = (ahead?, behind?);
        for row in 0..3 {
            let difference = (ahead[row] - behind[row]) / 2e-3;
            assert!(
                relative_eq!(all[row][column], difference, epsilon = 1e-3, max_relative = 1e-4),
                "{row}, {column}: {difference}, {all:?}"
            );
        }
    }
    // Forces that have a potential: about a point of the sleeve the part between translations is symmetric.
    assert_relative_eq!(all[0][1], all[1][0], max_relative = 1e-6, epsilon = 1e-6);
    Ok(())
}

/// With the factors of the first state alone the forces of each state lead to the same equilibrium.
#[test]
fn factors_of_an_earlier_state_lead_to_the_same_equilibrium() -> Result<(), rkpm::Error> {
    let block = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber(10.0));
    let block = block.hold(Side::Min).prescribe(Side::Max, 0, 0.2).prescribe(Side::Max, 1, 0.0);
    let problem = block.discretize(&Scheme::default().particles([9, 5]))?;
    let path = problem.run()?.completed()?;
    let (mut equilibrium, mut state) = (problem.equilibrium()?, problem.at_rest());
    state.load = 1.0;
    assert_eq!(equilibrium.linearize(&state)?.unstable, Some(0));
    let mut linear = equilibrium.update_residual(&state)?;
    assert!(linear.violation > 0.1, "{linear:?}");
    for _ in 0..200 {
        let step = equilibrium.solve(Rhs::Residual)?;
        equilibrium.apply(&step, 1.0, &mut state)?;
        linear = equilibrium.update_residual(&state)?;
        assert_eq!(linear.violation, 0.0);
        if linear.residual < 1e-12 {
            break;
        }
    }
    equilibrium.commit(&problem.at_rest(), &mut state)?;
    for (a, b) in state.displacement.iter().zip(&path.last().displacement) {
        assert!(abs_diff_eq!(a, b, epsilon = 1e-9), "{a} and {b} after {linear:?}");
    }
    assert_relative_eq!(
        problem.reaction(&state, Side::Max)?,
        problem.reaction(path.last(), Side::Max)?,
        max_relative = 1e-8
    );
    Ok(())
}

#[test]
fn lists_of_other_problems_are_refused() -> Result<(), rkpm::Error> {
    let problem = under_a_shaft();
    let (mut equilibrium, rest) = (problem.equilibrium()?, problem.at_rest());
    // Nothing was linearised.
    assert!(matches!(equilibrium.solve(Rhs::Residual), Err(Cause::Refused(why)) if why.contains("linearised")));
    equilibrium.linearize(&rest)?;
    let equations = problem.equations().equations().len();
    for side in [Rhs::Force(&[1.0]), Rhs::Prescribed(&[]), Rhs::Dual { force: &[], prescribed: &vec![0.0; equations] }]
    {
        assert!(matches!(equilibrium.solve(side), Err(Cause::Refused(why)) if why.contains("entries")), "{side:?}");
    }
    let short = State { displacement: vec![0.0; 4], ..rest.clone() };
    let step = equilibrium.solve(Rhs::Load)?;
    assert!(equilibrium.apply(&step, 1.0, &mut short.clone()).is_err());
    assert!(equilibrium.apply(&Increment::default(), 1.0, &mut rest.clone()).is_err());
    assert!(equilibrium.linearize(&short).is_err() && equilibrium.update_residual(&short).is_err());
    assert!(equilibrium.commit(&short, &mut rest.clone()).is_err());
    assert!(problem.rigid_changes(&rest, "nowhere", [0.0; 2]).is_err());
    Ok(())
}

/// A state never takes over what is no number, and stays as it is where a step is refused.
#[test]
fn steps_that_are_no_numbers_are_refused() -> Result<(), rkpm::Error> {
    let problem = under_a_shaft();
    let (mut equilibrium, mut state) = (problem.equilibrium()?, problem.at_rest());
    equilibrium.linearize(&state)?;
    let (step, rest) = (equilibrium.solve(Rhs::Load)?, state.clone());
    let spoilt = |spoil: &dyn Fn(&mut Increment)| {
        let mut step = step.clone();
        spoil(&mut step);
        step
    };
    let steps = [
        spoilt(&|step| step.displacement[3] = f64::NAN),
        spoilt(&|step| step.displacement[3] = f64::INFINITY),
        spoilt(&|step| step.displacement[3] = f64::MAX),
        spoilt(&|step| step.multipliers[0] = f64::NAN),
        spoilt(&|step| step.load = f64::NAN),
    ];
    for (part, step) in steps.iter().map(|step| (1.0, step)).chain([(f64::NAN, &step), (f64::INFINITY, &step)]) {
        let applied = equilibrium.apply(step, part, &mut state);
        assert!(matches!(applied, Err(Cause::NotFinite)), "{applied:?}");
        assert_eq!(state, rest);
    }
    equilibrium.apply(&step, 1.0, &mut state)?;
    assert!(state.load > 0.0 && state != rest);
    Ok(())
}

/// Equations of one's own stand beside those of the scene: a reaction is that of its part, and what is refused leaves nothing behind.
#[test]
fn own_equations_leave_those_of_the_scene_as_they_are() -> Result<(), rkpm::Error> {
    let scene = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber(1e2));
    let scene = scene.name("left", (0, Side::Min)).hold("left").traction((0, Side::Max), [0.1, 0.0]);
    let mut problem = scene.discretize(&Scheme::default().particles([5, 3]))?;
    let equation = |target| ConstraintEquation {
        entries: vec![(29, 1.0)],
        dependent: 29,
        target,
        amplitude: Amplitude::Ramp,
        label: "own".into(),
    };
    let before = problem.equations().clone();
    let failed = problem.constrain("own", |equations| {
        equations.push(equation(0.1))?;
        Ok(equations.push(equation(f64::NAN))?)
    });
    assert!(failed.is_err());
    let named = problem.constrain("left", |equations| Ok(equations.push(equation(0.01))?)).map(|_| ());
    assert!(named.unwrap_err().to_string().contains("name of the part left"));
    assert_eq!(problem.equations(), &before);
    problem.constrain("own", |equations| Ok(equations.push(equation(0.01))?))?;
    let path = problem.run()?.completed()?;
    let [left, own] = ["left", "own"].map(|name| problem.reaction(path.last(), name));
    // With the traction on the other end, and what moves a corner.
    let sum = left? + own? + Point::<2>::new(0.1, 0.0);
    assert!(abs_diff_eq!(sum, Point::zeros(), epsilon = 1e-9), "{sum}");
    Ok(())
}

/// Cells and shape functions over the same particles in another order draw and average fields at other places.
#[test]
fn composed_problems_number_particles_alike() -> Result<(), rkpm::Error> {
    let lattice = Block::new([0.0, 0.0], [2.0, 1.0]).lattice([5, 3])?;
    let own = lattice.particles(1.2)?;
    for backwards in [false, true] {
        let order = |k: usize| if backwards { own.positions().len() - 1 - k } else { k };
        let (positions, supports) =
            (0..own.positions().len()).map(|k| (own.positions()[order(k)], own.supports()[order(k)])).unzip();
        let rk = ReproducingKernel::new(Particles::new(positions, supports)?, CubicSpline, Polynomial::linear())?;
        let table = ShapeTable::new(&rk, &lattice.gauss(3)?, &PlaneStrain)?;
        let body = Body::new(table, rubber(1e2), PressureField::Displacement);
        let composed = Problem::compose(lattice.clone(), rk, body).map(|_| ());
        match composed {
            Ok(()) if !backwards => {}
            Err(error) if backwards && error.to_string().contains("distance of particle 0") => {}
            other => panic!("{backwards}: {other:?}"),
        }
    }
    Ok(())
}

/// What prescribed displacements ask for is as large as the bulk modulus: beside a pressure that follows, whose matrix is not symmetric, a
/// stiffness by one solution is still that of two runs.
#[test]
fn stiffnesses_beside_a_pressure_are_those_of_runs() {
    let (by, length) = (1e-4, 0.3);
    let block = |length: f64| {
        Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber(1e5))
            .hold(Side::Min)
            .prescribe(Side::Max, 0, length)
            .pressure((1, Side::Max), 0.3)
    };
    for order in [1, 2] {
        for multipliers in [false, true] {
            let mut scheme = Scheme::default().order(order).particles([9, 5]);
            if multipliers {
                scheme = scheme.constraint_method(rkpm::scene::ConstraintMethod::Multipliers);
            }
            let solved = |length: f64| {
                let problem = block(length).discretize(&scheme).unwrap();
                let path = problem.run().unwrap().completed().unwrap();
                let force = problem.reaction(path.last(), Side::Max).unwrap()[0];
                (problem, path, force)
            };
            let expected = (solved(length + by).2 - solved(length - by).2) / (2.0 * by);
            let (problem, path, _) = solved(length);
            let along = &problem.rigid_changes(path.last(), Side::Max, [0.0, 0.0]).unwrap()[0];
            let mut equilibrium = problem.equilibrium().unwrap();
            equilibrium.linearize(path.last()).unwrap();
            let change = equilibrium.solve(Rhs::Prescribed(along)).unwrap();
            let found = -dot(along, &change.multipliers);
            assert!(relative_eq!(found.abs(), expected.abs(), max_relative = 1e-5), "{order}: {found} {expected}");
        }
    }
}
