//! The dilation that fits a scene: an open question of the paper, answered by the potential.

use crate::each::Each;
use crate::error::{Error, Invalid, SolveError};
use crate::quadrature::gauss_legendre;
use crate::scene::{ApproximationChoice, BodyOf, Dilation, Problem, Scene, Scheme};
use crate::solve::State;
use crate::term::{Element, Term, View, each_force, stored};

/// One dilation that was tried.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// The normalised dilation $r$ (6.1).
    pub r: f64,
    /// The potential $\Pi = U - W$ of the solution; none where the analysis failed.
    pub potential: Option<f64>,
    /// Why the analysis failed, where it did.
    pub failure: Option<String>,
}

/// What [`best_dilation`] found.
#[derive(Debug, Clone, PartialEq)]
pub struct BestDilation {
    /// The normalised dilation with the smallest potential.
    pub r: f64,
    /// All that were tried, in the order given.
    pub trials: Vec<Trial>,
}

/// The normalised dilation $r$ (6.1) whose solution has the smallest potential $\Pi = U - W$.
///
/// All dilations of one set of particles compete for the same minimum: the lower the potential, the nearer the
/// solution. That holds where energies are integrated exactly enough and nothing is projected, so for schemes
/// *without* a cure against locking; with the default's projected pressures the dilation hardly matters. The
/// supports follow the kind of the scheme's own, or of a body's: over the largest spacing for [`Dilation::Global`], else over
/// the local one.
///
/// ```
/// use rkpm::prelude::*;
/// let rubber = Rubber::yeoh(0.373, -0.031, 0.005, 1e5)?; // MPa
/// let tube = Scene::new(Block::new([6.0], [8.0]), RadialCylinder, rubber).pressure(Side::Min, 0.46); // cm, MPa
/// let best = rkpm::study::best_dilation(&tube, &Scheme::paper(1.0).particles([9]), &[1.0, 1.3, 1.6])?;
/// assert!(best.r > 1.0); // narrow supports lock
/// # Ok::<(), rkpm::Error>(())
/// ```
///
/// # Errors
/// Where no dilation could be solved with.
pub fn best_dilation<const D: usize>(
    scene: &Scene<D>,
    scheme: &Scheme,
    dilations: &[f64],
) -> Result<BestDilation, Error> {
    let mut trials = Vec::with_capacity(dilations.len());
    for &r in dilations {
        let with = move |scheme: Scheme| match scheme.dilation {
            Dilation::Global(_) => scheme.dilation(Dilation::Global(r)),
            _ => scheme.dilation(Dilation::Local(r)),
        };
        // Behind changes of the body's own, which may be of its dilation.
        let own = move |own: Scheme| if own.approximation == ApproximationChoice::Particles { with(own) } else { own };
        let all = |scene: Scene<D>, body: &BodyOf<D>| scene.scheme_of(&body.name, own);
        let scene = scene.bodies.iter().fold(scene.clone(), all);
        let solve = || -> Result<f64, Error> {
            let problem = scene.discretize(&with(scheme.clone()))?;
            let path = problem.run()?.completed()?;
            let value = potential(&problem, path.last())?;
            let needed = "energies and loads that are finite in the state reached";
            if value.is_finite() { Ok(value) } else { Err(Invalid::new("potential", value, needed).into()) }
        };
        trials.push(match solve() {
            Ok(potential) => Trial { r, potential: Some(potential), failure: None },
            Err(error) => Trial { r, potential: None, failure: Some(error.to_string()) },
        });
    }
    let solved = trials.iter().filter_map(|trial| Some((trial.potential?, trial.r)));
    match solved.min_by(|a, b| a.0.total_cmp(&b.0)) {
        Some((_, r)) => Ok(BestDilation { r, trials }),
        None => Err(SolveError::Empty {
            what: "dilations that could be solved with",
            remedy: "give at least one; see the failures of single runs",
        }
        .into()),
    }
}

/// The potential $\Pi = U - W$ of a state, $W = \int_0^1 f(s\\,d)\cdot d\\,\mathrm ds$ being the work of the loads
/// along a straight way to it: that of any way where they are conservative, as dead loads are, and pressures on
/// closed or held surfaces. Loads are the terms beside the body that store no energy; of a term that stores some, what
/// changes with the load factor does work.
///
/// # Errors
/// For a state of another problem.
pub fn potential<const D: usize>(problem: &Problem<D>, state: &State) -> Result<f64, Error> {
    let energy = problem.energy(state)?;
    // Follower pressures are polynomials of degree 3 at most in s: the rule is exact.
    let (abscissae, weights) = gauss_legendre(3)?;
    let mut element = Element::default();
    let mut work = 0.0;
    // The body, the first of the terms, has no forces that follow the load factor.
    // Contacts do no work: what pushes a surface is a term of its own.
    let terms = problem.model().terms().iter().zip(&state.condensed).skip(1);
    for (term, condensed) in terms.filter(|(term, _)| !term.layout().unilateral) {
        let stores = stored(&**term, View { displacement: &state.displacement, condensed, load: state.load }) != 0.0;
        for (s, weight) in abscissae.iter().zip(&weights) {
            let d: Vec<f64> = state.displacement.mapped(|d| s * d);
            let mut along = |load| {
                let view = View { displacement: &d, condensed, load };
                work_rate(&**term, view, &state.displacement, &mut element)
            };
            let unloaded = if stores { along(0.0) } else { 0.0 };
            work += weight * (along(state.load) - unloaded);
        }
    }
    Ok(energy - work)
}

/// $f\cdot d$ for the forces of a term, which are the negative of its residual.
fn work_rate(term: &dyn Term, view: View<'_>, d: &[f64], element: &mut Element) -> f64 {
    let mut sum = 0.0;
    each_force(term, 0..term.clusters(), view, element, |node, residual, _| {
        sum -= residual.pair_sum(&d[node * term.dim()..], |force, d| force * d);
    });
    sum
}
