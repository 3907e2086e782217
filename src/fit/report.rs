//! What a fit found.

use std::fmt;
use std::sync::Arc;

#[cfg(feature = "chart")]
use super::data::TestData;
use super::search::predict;
use crate::each::EachOf;
use crate::error::{Invalid, MaterialError};
use crate::material::{Criterion, Material, Mode, NearlyIncompressible, QuadraticVolume, StableRange};

/// A coefficient as it was fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct Fitted {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// Its 95 % confidence interval, of errors that may differ from point to point; infinite where the data leave it open.
    pub interval: [f64; 2],
}

/// How well a test is met.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Misfit {
    /// The test.
    pub mode: Mode,
    /// Its points.
    pub points: usize,
    /// Root mean square of the errors of the stress over that of the stress.
    pub relative: f64,
}

/// An optimum that starts ended at.
#[derive(Debug, Clone, PartialEq)]
pub struct Optimum {
    /// Values of the coefficients.
    pub values: Vec<f64>,
    /// Root mean square of the relative misfits of the tests, by their weights.
    pub misfit: f64,
    /// Starts that ended here.
    pub starts: usize,
    /// Whether the law is stable in the range of the data.
    pub stable: bool,
}

/// Something to know about a fit.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Warning {
    /// Two tests suggest shear moduli that differ by a factor of 100 or more: their units may differ.
    Units {
        /// The softer test.
        softer: Mode,
        /// The stiffer test.
        stiffer: Mode,
        /// The ratio of the moduli.
        ratio: f64,
    },
    /// The data hardly tell some combination of coefficients: the condition number of the problem.
    Condition(f64),
    /// A coefficient's interval is wider than its value.
    Undetermined(String),
    /// A coefficient came to its bound.
    AtBound(String),
    /// The law is unstable inside the range of the data, as was allowed.
    Unstable(StableRange),
    /// Another optimum fits better but is unstable inside the range of the data.
    BetterButUnstable {
        /// Its misfit.
        misfit: f64,
    },
    /// Another optimum fits nearly as well and is another law: they differ outside of the data.
    Rival {
        /// Its place among the optima.
        optimum: usize,
        /// Its misfit.
        misfit: f64,
    },
    /// Starts that came to no optimum.
    Unsettled {
        /// How many.
        starts: usize,
        /// Of how many.
        of: usize,
    },
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Warning::Units { softer, stiffer, ratio } => write!(
                f,
                "the {stiffer} test is {ratio:.0} times as stiff as the {softer} one: are their stresses in one unit?"
            ),
            Warning::Condition(c) => write!(f, "condition {c:.1e}: combinations of coefficients are hardly determined"),
            Warning::Undetermined(name) => write!(f, "{name} is known to no more than its size: fewer terms would do"),
            Warning::AtBound(name) => write!(f, "{name} came to its bound"),
            Warning::Unstable(range) => write!(f, "unstable inside the data: {range}"),
            Warning::BetterButUnstable { misfit } => {
                write!(f, "an unstable optimum fits better, with {:.2} %", 100.0 * misfit)
            }
            Warning::Rival { optimum, misfit } => write!(
                f,
                "optimum {} fits as well, with {:.2} %, and differs outside of the data",
                optimum + 1,
                100.0 * misfit
            ),
            Warning::Unsettled { starts, of } => write!(f, "{starts} of {of} starts came to no optimum"),
        }
    }
}

/// What a fit found.
#[derive(Clone)]
pub struct Report {
    /// The law's name.
    pub name: String,
    /// The law: its distortional energy, or the whole where it is compressible.
    pub law: Arc<dyn Material>,
    /// Its coefficients.
    pub coefficients: Vec<Fitted>,
    /// The bulk modulus of $\frac k2(J-1)^2$ that volumetric tests give a law without volume \[stress\].
    pub bulk: Option<f64>,
    /// How well each test is met.
    pub misfits: Vec<Misfit>,
    /// All optima that starts ended at, best first.
    pub optima: Vec<Optimum>,
    /// The place of the reported one among them.
    pub chosen: usize,
    /// Stretches in which the law is stable.
    pub ranges: Vec<StableRange>,
    /// Condition number of the Jacobian with columns of length one.
    pub condition: f64,
    /// Things to know.
    pub warnings: Vec<Warning>,
    /// Whether the law is the whole, with a volumetric energy of its own.
    pub compressible: bool,
    /// For the chart alone.
    #[cfg(feature = "chart")]
    pub(super) data: TestData,
}

impl Report {
    /// The value of a coefficient.
    pub fn value(&self, name: &str) -> Option<f64> {
        self.coefficients.iter().find(|c| c.name == name).map(|c| c.value)
    }

    /// The relative misfit of a test.
    pub fn misfit(&self, mode: Mode) -> Option<f64> {
        self.misfits.iter().find(|m| m.mode == mode).map(|m| m.relative)
    }

    /// The range of stretch in which the law keeps a criterion.
    pub fn range(&self, mode: Mode, criterion: Criterion) -> Option<StableRange> {
        self.ranges.iter().copied().find(|r| r.mode == mode && r.criterion == criterion)
    }

    /// The law with $\frac k2(J-1)^2$, ready for a scene.
    ///
    /// # Errors
    /// Those of [`QuadraticVolume::new`], and for a compressible law: [`law`](Report::law) itself is ready for a scene.
    pub fn rubber(&self, bulk: f64) -> Result<NearlyIncompressible<Arc<dyn Material>, QuadraticVolume>, MaterialError> {
        let needed =
            "leave it out: a compressible law has a volumetric energy of its own, and Report::law is the whole";
        ensure!(!self.compressible, Invalid::new("bulk modulus", bulk, needed));
        Ok(NearlyIncompressible { distortional: self.law.clone(), volumetric: QuadraticVolume::new(bulk)? })
    }

    /// The nominal stress of the law at a stretch \[stress\]; the mean Cauchy stress at a volume ratio in volumetric tests of
    /// compressible laws and of those whose bulk modulus was fitted. NaN outside of the law's domain, and where no volumetric test was given.
    pub fn stress(&self, mode: Mode, stretch: f64) -> f64 {
        match (mode, self.bulk) {
            (Mode::Volumetric, Some(bulk)) => bulk * (stretch - 1.0),
            _ => predict(&self.law, self.compressible, mode, stretch),
        }
    }

    /// Data against the law, stress over stretch.
    #[cfg(feature = "chart")]
    pub fn chart(&self) -> crate::output::Chart {
        use crate::output::Series;
        use crate::output::chart::{Colour, Marker, Stroke};
        let title = format!("{} fitted to {} tests", self.name, self.data.tests().len());
        let mut chart = crate::output::Chart::new(title).x("stretch λ [–]").y("nominal stress P [unit of the data]");
        let colours = [Colour::Blue, Colour::Vermilion, Colour::Green, Colour::Purple];
        let markers = [Marker::Circle, Marker::Square, Marker::Triangle, Marker::Diamond];
        let shapes = self.data.tests().iter().filter(|test| test.mode != Mode::Volumetric);
        for ((test, colour), marker) in shapes.zip(colours).zip(markers) {
            const CURVE: usize = 120;
            let [low, high] = test.range().each(|end| end.ln());
            let (low, high) = (low.min(0.0), high.max(0.0));
            let stretches = (0..=CURVE).map(|k| (low + (high - low) * k as f64 / CURVE as f64).exp());
            let curve: Vec<[f64; 2]> =
                stretches.map(|x| [x, self.stress(test.mode, x)]).filter(|p| p[1].is_finite()).collect();
            let points = Series::markers(format!("{}, measured", test.mode), &test.points);
            chart = chart
                .with(points.stroke(Stroke::None).marker(marker).colour(colour))
                .with(Series::line(format!("{}, law", test.mode), &curve).colour(colour));
        }
        chart
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.name)?;
        for Fitted { name, value, interval: [low, high] } in &self.coefficients {
            writeln!(f, "  {name} = {value:.6e}   95 %: {low:.3e} to {high:.3e}")?;
        }
        if let Some(bulk) = self.bulk {
            writeln!(f, "  k = {bulk:.6e} of the volumetric tests")?;
        }
        for Misfit { mode, points, relative } in &self.misfits {
            writeln!(f, "  {mode}: {:.2} % RMS over {points} points", 100.0 * relative)?;
        }
        for range in &self.ranges {
            writeln!(f, "  stable, {range}")?;
        }
        writeln!(f, "  condition {:.1e}", self.condition)?;
        for (k, Optimum { values, misfit, starts, stable }) in self.optima.iter().enumerate() {
            let mark = if k == self.chosen { "*" } else { " " };
            let stable = if *stable { "" } else { ", unstable inside the data" };
            writeln!(f, " {mark}optimum {}: {:.3} %, {starts} starts{stable}: {values:.4?}", k + 1, 100.0 * misfit)?;
        }
        for warning in &self.warnings {
            writeln!(f, "  warning: {warning}")?;
        }
        Ok(())
    }
}

impl fmt::Debug for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{self}")
    }
}
