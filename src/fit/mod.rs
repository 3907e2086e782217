//! From test reports to laws: coefficients fitted to uniaxial, equibiaxial, planar and volumetric tests.
//!
//! [`TestData`] holds stretches and nominal stresses, from CSV or by hand; [`Law`] names the families of this crate, and
//! [`Family`] is the trait for one's own; [`Fit`] searches from many random starts (of a fixed seed) by the method of Levenberg
//! and Marquardt and gives a [`Report`]: coefficients with confidence intervals, misfits by test, all optima it met, and the
//! stretches up to which the law is stable. A law that is unstable inside the range of its own data is refused.
//!
//! ```
//! use rkpm::fit::{Fit, Law, TestData};
//! use rkpm::material::Mode;
//! let data = TestData::parse("mode,stretch,nominal_stress [MPa]
//!     uniaxial,   1.2, 0.21
//!     uniaxial,   1.6, 0.49
//!     uniaxial,   2.0, 0.70
//!     equibiaxial,1.2, 0.33
//!     equibiaxial,1.6, 0.61")?;
//! let report = Fit::new(Law::MooneyRivlin).to(&data)?;
//! assert!(report.misfit(Mode::Uniaxial).unwrap() < 0.02);
//! let rubber = report.rubber(1e3)?; // a material for a scene, k in MPa
//! # let _ = rubber;
//! # Ok::<(), rkpm::Error>(())
//! ```
//!
//! # What is minimised
//! $$\sum_t w_t\\,\frac{\sum_i\big(P(\lambda_i) - P_i\big)^2}{\sum_iP_i^2}$$
//! over the tests $t$: each counts by its relative error, whatever its stresses and its number of points.

mod columns;
mod confidence;
mod data;
mod family;
mod report;
mod search;

use std::sync::Arc;

use crate::each::{Each, EachOf};
use crate::material::{Criterion, Material, Mode, SEARCHED, StableRange, stable_ranges, stable_ranges_incompressible};

pub use crate::error::FitError;
pub use data::{Test, TestData};
pub use family::{Coefficient, Family, Law};
pub use report::{Fitted, Misfit, Optimum, Report, Warning};

use search::{End, Residuals};

/// Moduli of two tests that differ by this factor are in different units.
const UNITS: f64 = 100.0;
/// More starts are a mistyped number: each takes a search.
const MOST_STARTS: usize = 100_000;
/// Condition beyond which a warning says so.
const CONDITION: f64 = 1e4;
/// Optima whose residuals differ by less than this part of the stresses are one.
const SAME: f64 = 1e-3;
/// Optima with a misfit up to this many times the best fit as well.
const RIVAL: f64 = 1.1;

/// A law that is unstable inside the range of the data: with its ranges, the one that fails, and the range of the data.
type Unstable = (Arc<dyn Material>, Vec<StableRange>, StableRange, [f64; 2]);

/// A fit of a family of laws: its settings.
#[derive(Clone)]
pub struct Fit {
    family: Arc<dyn Family>,
    starts: usize,
    seed: u64,
    bounds: Vec<(String, [f64; 2])>,
    allow_unstable: bool,
}

impl Fit {
    /// A fit by 40 starts.
    pub fn new(family: impl Family + 'static) -> Self {
        Fit { family: Arc::new(family), starts: 40, seed: 1, bounds: Vec::new(), allow_unstable: false }
    }

    /// The same from another number of random starts.
    pub fn starts(self, starts: usize) -> Self {
        Fit { starts, ..self }
    }

    /// The same with another seed of the random starts.
    pub fn seed(self, seed: u64) -> Self {
        Fit { seed, ..self }
    }

    /// The same with bounds for a coefficient, in the unit of the data. Terms of one law are sorted
    /// ([`Family::arrange`]) where they have the same bounds, and stay where they are where these differ.
    pub fn bound(mut self, coefficient: impl Into<String>, bounds: [f64; 2]) -> Self {
        self.bounds.push((coefficient.into(), bounds));
        self
    }

    /// The same, with a law that is unstable inside the range of the data accepted and warned of.
    pub fn allow_unstable(self) -> Self {
        Fit { allow_unstable: true, ..self }
    }

    /// Fits the law to data.
    ///
    /// # Errors
    /// [`FitError::Empty`], [`FitError::Unseen`] and [`FitError::TooFew`] for data that can't decide the coefficients,
    /// [`FitError::Coefficient`] for unusable bounds, [`FitError::Starts`] for their number, [`FitError::NoOptimum`] where no start came to one,
    /// [`FitError::Unstable`] where all that were found are unstable inside the range of the data.
    pub fn to(&self, data: &TestData) -> Result<Report, FitError> {
        let family = &*self.family;
        let compressible = family.is_compressible();
        let (law, mut warnings) = (family.name(), units(data));
        let modulus = self.look(data)?;
        let coefficients = self.coefficients(modulus)?;
        let residuals = Residuals::new(family, coefficients, data, modulus);
        let mut random = fastrand::Rng::with_seed(self.seed);
        let mut ends: Vec<End> = (0..self.starts).filter_map(|_| residuals.follow(&mut random)).collect();
        ends.retain(|end| end.settled);
        let unsettled = self.starts - ends.len();
        if unsettled > 0 {
            warnings.push(Warning::Unsettled { starts: unsettled, of: self.starts });
        }
        ends.sort_by(|a, b| a.cost().total_cmp(&b.cost()));
        let groups = grouped(ends);
        let weights: f64 =
            data.tests().iter().filter(|t| compressible || t.mode != Mode::Volumetric).map(|t| t.weight).sum();
        let misfit = |end: &End| (end.cost() / weights).sqrt();
        let mut optima = Vec::with_capacity(groups.len());
        let mut found: Option<(usize, Arc<dyn Material>, Vec<StableRange>)> = None;
        let mut unstable: Option<Unstable> = None;
        for (k, (end, starts)) in groups.iter().enumerate() {
            let Ok(material) = family.build(&end.values) else { continue };
            let ranges =
                if compressible { stable_ranges(&*material) } else { stable_ranges_incompressible(&*material) };
            let broken = broken(&ranges, data);
            let values = end.values.clone();
            optima.push(Optimum { values, misfit: misfit(end), starts: *starts, stable: broken.is_none() });
            match broken {
                Some((range, reach)) if k == 0 => unstable = Some((material, ranges, range, reach)),
                None if found.is_none() => found = Some((k, material, ranges)),
                _ => {}
            }
        }
        let (chosen, law_found, ranges) = match (found, unstable) {
            (_, Some((material, ranges, range, _))) if self.allow_unstable => {
                warnings.push(Warning::Unstable(range));
                (0, material, ranges)
            }
            (Some(found), _) => {
                if found.0 > 0 {
                    warnings.push(Warning::BetterButUnstable { misfit: optima[0].misfit });
                }
                found
            }
            (None, Some((_, _, StableRange { mode, low, high, .. }, [from, to]))) => {
                return Err(FitError::Unstable { law, mode: mode.name(), low, high, from, to });
            }
            (None, None) => return Err(FitError::NoOptimum { law, starts: self.starts }),
        };
        for (k, other) in optima.iter().enumerate() {
            if k != chosen && other.stable && other.misfit <= RIVAL * optima[chosen].misfit {
                warnings.push(Warning::Rival { optimum: k, misfit: other.misfit });
            }
        }
        let end = &groups[chosen].0;
        let (condition, half) = confidence::confidence(&residuals.jacobian(&end.values), &end.residuals);
        if !(condition < CONDITION) {
            warnings.push(Warning::Condition(condition));
        }
        let fitted = fitted(&residuals, &end.values, half, &mut warnings);
        let bulk = if compressible { None } else { data.test(Mode::Volumetric).map(bulk_modulus) };
        let mut report = Report {
            name: law,
            law: law_found,
            coefficients: fitted,
            bulk,
            misfits: Vec::new(),
            optima,
            chosen,
            ranges,
            condition,
            warnings,
            compressible,
            #[cfg(feature = "chart")]
            data: data.clone(),
        };
        report.misfits = misfits(&report, data);
        Ok(report)
    }

    /// Looks at the data, and gives the shear modulus that they suggest.
    fn look(&self, data: &TestData) -> Result<f64, FitError> {
        let (law, compressible) = (self.family.name(), self.family.is_compressible());
        let tests = data.tests();
        if tests.is_empty() {
            return Err(FitError::Empty);
        }
        if self.starts == 0 || self.starts > MOST_STARTS {
            return Err(FitError::Starts { starts: self.starts });
        }
        let shapes: Vec<&Test> = tests.iter().filter(|t| t.mode != Mode::Volumetric).collect();
        if shapes.is_empty() {
            return Err(FitError::Unseen { law, mode: Mode::Volumetric.name() });
        }
        let seen = tests.iter().filter(|t| compressible || t.mode != Mode::Volumetric);
        let (points, coefficients) = (seen.map(|t| t.points.len()).sum(), self.family.coefficients().len());
        if points < coefficients {
            return Err(FitError::TooFew { law, points, coefficients });
        }
        let mean = shapes.summed(|t| t.modulus().ln()) / shapes.len() as f64;
        Ok(mean.exp())
    }

    /// The coefficients with the bounds that were requested, in units of the modulus.
    fn coefficients(&self, modulus: f64) -> Result<Vec<Coefficient>, FitError> {
        let mut coefficients = self.family.coefficients();
        let unusable = |what: String| FitError::Coefficient { law: self.family.name(), what };
        for (name, [low, high]) in &self.bounds {
            let names = coefficients.mapped(|c| c.name.as_str()).join(", ");
            let c = coefficients
                .iter_mut()
                .find(|c| c.name == *name)
                .ok_or_else(|| unusable(format!("no coefficient {name}; there are {names}")))?;
            if low.is_nan() || high.is_nan() {
                return Err(unusable(format!(
                    "bounds of {name} are {low} and {high}; give numbers, or infinity for none"
                )));
            }
            let unit = if c.is_stress { modulus } else { 1.0 };
            let (low, high) = ((low / unit).max(c.bounds[0]), (high / unit).min(c.bounds[1]));
            ensure!(low < high, unusable(format!("bounds of {name} leave nothing; give a lower one below the upper")));
            // Starts inside of the new bounds.
            let inside = |x: f64| x.clamp(low, high);
            c.bounds = [low, high];
            c.start = c.start.each(inside);
            if c.start[0] >= c.start[1] {
                let reach = |end: f64, other: f64| if end.is_finite() { end } else { other };
                c.start = [reach(low, high - 1.0), reach(high, low + 1.0)];
            }
        }
        match coefficients.iter().find(|c| !(c.start[0] <= c.start[1] && c.bounds[0] < c.bounds[1])) {
            Some(c) => Err(unusable(format!("coefficient {} has no range: give rising bounds and starts", c.name))),
            None => Ok(coefficients),
        }
    }
}

/// The first test in whose range a law is unstable: the law's range, and that of the data.
fn broken(ranges: &[StableRange], data: &TestData) -> Option<(StableRange, [f64; 2])> {
    let of = |criterion| {
        move |range: &&StableRange| {
            range.criterion == criterion
                && data.test(range.mode).is_some_and(|test| {
                    // Data from stretches on that were not searched ask for nothing there.
                    let [low, high] = test.range().each(|stretch| stretch.clamp(SEARCHED[0], SEARCHED[1]));
                    !(range.contains(low) && range.contains(high))
                })
        }
    };
    let first = ranges.iter().find(of(Criterion::Drucker)).or_else(|| ranges.iter().find(of(Criterion::Ellipticity)));
    first.and_then(|range| Some((*range, data.test(range.mode)?.range())))
}

/// A warning where two tests seem to be in different units.
fn units(data: &TestData) -> Vec<Warning> {
    let mut moduli: Vec<(Mode, f64)> =
        data.tests().iter().filter(|t| t.mode != Mode::Volumetric).map(|t| (t.mode, t.modulus())).collect();
    moduli.sort_by(|a, b| a.1.total_cmp(&b.1));
    match (moduli.first(), moduli.last()) {
        (Some((softer, low)), Some((stiffer, high))) if high / low >= UNITS => {
            vec![Warning::Units { softer: *softer, stiffer: *stiffer, ratio: high / low }]
        }
        _ => Vec::new(),
    }
}

/// Ends at one place, with the number of starts that led there, the best first.
fn grouped(ends: Vec<End>) -> Vec<(End, usize)> {
    let mut groups: Vec<(End, usize)> = Vec::new();
    for end in ends {
        let same = |(other, _): &&mut (End, usize)| {
            let apart = |(a, b): (&f64, &f64)| (a - b) * (a - b);
            end.residuals.iter().zip(&other.residuals).map(apart).sum::<f64>().sqrt() < SAME
        };
        match groups.iter_mut().find(same) {
            Some((_, count)) => *count += 1,
            None => groups.push((end, 1)),
        }
    }
    groups
}

/// The bulk modulus that fits a volumetric test best.
fn bulk_modulus(test: &Test) -> f64 {
    let (product, square) = test
        .points
        .iter()
        .fold((0.0, 0.0), |(product, square), [j, p]| (product + p * (j - 1.0), square + (j - 1.0) * (j - 1.0)));
    product / square
}

/// Coefficients with their intervals, and warnings of those that the data leave open.
fn fitted(residuals: &Residuals<'_>, values: &[f64], half: Vec<f64>, warnings: &mut Vec<Warning>) -> Vec<Fitted> {
    let mut fitted = Vec::new();
    for (((c, unit), &value), half) in residuals.coefficients.iter().zip(&residuals.units).zip(values).zip(half) {
        let at_bound = c.bounds.iter().any(|b| (value - b * unit).abs() <= 1e-4 * value.abs().max(1e-6 * unit));
        if at_bound {
            warnings.push(Warning::AtBound(c.name.clone()));
        }
        if half > value.abs() {
            warnings.push(Warning::Undetermined(c.name.clone()));
        }
        fitted.push(Fitted { name: c.name.clone(), value, interval: [value - half, value + half] });
    }
    fitted
}

/// The misfit of each test.
fn misfits(report: &Report, data: &TestData) -> Vec<Misfit> {
    data.tests().mapped(|test| {
        let error = |[x, p]: &[f64; 2]| (report.stress(test.mode, *x) - p).powi(2);
        let sum: f64 = test.points.summed(error);
        let points = test.points.len();
        Misfit { mode: test.mode, points, relative: (sum / points as f64).sqrt() / test.size() }
    })
}
