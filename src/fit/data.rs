//! Test data: stretches and nominal stresses by mode.

use std::path::Path;

use super::FitError;
use super::columns::Rows;
use crate::each::Each;
use crate::material::Mode;

/// One test: its points and its weight among the others.
#[derive(Debug, Clone, PartialEq)]
pub struct Test {
    /// How the body was stretched.
    pub mode: Mode,
    /// Pairs of stretch $\lambda$ and nominal stress $P$ \[stress\], force over first area; of volume ratio $J$ and mean
    /// Cauchy stress, negative in compression, in volumetric tests.
    pub points: Vec<[f64; 2]>,
    /// Weight of the test; 1 counts its relative error as much as that of the others, whatever their stresses and numbers of points.
    pub weight: f64,
}

/// The tests that a law is fitted to.
///
/// ```
/// use rkpm::fit::TestData;
/// use rkpm::material::Mode;
/// let data = TestData::parse("mode,stretch,nominal_stress\nuniaxial,1.1,0.12\nuniaxial,1.5,0.42\nPS,1.2,0.24\n")?;
/// assert_eq!(data.tests().len(), 2);
/// assert_eq!(data.tests()[0].points, [[1.1, 0.12], [1.5, 0.42]]);
/// # Ok::<(), rkpm::fit::FitError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TestData {
    tests: Vec<Test>,
}

impl TestData {
    /// Adds a test with weight 1; points of a mode that is there already join it.
    ///
    /// # Errors
    /// [`FitError::Stretch`], [`FitError::Stress`] and [`FitError::Sign`] for points that can't be right.
    pub fn with(mut self, mode: Mode, points: impl IntoIterator<Item = [f64; 2]>) -> Result<Self, FitError> {
        for point in points {
            self.push(mode, point)?;
        }
        Ok(self)
    }

    /// The same with another weight for the tests of a mode; see [`Test::weight`].
    ///
    /// # Errors
    /// [`FitError::Weight`] unless it is finite and above zero, [`FitError::Unweighted`] where there is no test of the mode yet.
    pub fn weighted(mut self, mode: Mode, weight: f64) -> Result<Self, FitError> {
        ensure!(weight > 0.0 && weight.is_finite(), FitError::Weight { mode: mode.name(), value: weight });
        let mut tests = self.tests.iter_mut().filter(|test| test.mode == mode).peekable();
        ensure!(tests.peek().is_some(), FitError::Unweighted { mode: mode.name() });
        tests.for_each(|test| test.weight = weight);
        Ok(self)
    }

    /// Reads a CSV file; see [`parse`](Self::parse).
    ///
    /// # Errors
    /// As [`parse`](Self::parse), and [`FitError::File`] where it can't be read.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, FitError> {
        let path = path.as_ref();
        let refused = |e: std::io::Error| FitError::File { path: path.display().to_string(), what: e.to_string() };
        Self::parse(&std::fs::read_to_string(path).map_err(refused)?)
    }

    /// Reads CSV text with a header: columns `mode` (or `test`), `stretch` (or `volume_ratio`) and `nominal_stress` (or
    /// `engineering_stress`, `stress`), units may follow their names. Modes are `uniaxial` (`UT`, `UA`), `equibiaxial` (`ET`, `EB`),
    /// `planar` (`PS`, `PT`) and `volumetric` (`VT`). Rows of no strain and no stress say nothing and are left out.
    ///
    /// Columns are separated by commas, semicolons or tabs; numbers may have decimal commas where commas do not separate columns.
    /// Other columns, what stands above the header, a row of units under it and lines that begin with `#` are passed over. A column
    /// is taken for another only where each word of its header is understood: strains, rates and true stresses are not.
    ///
    /// ```
    /// use rkpm::fit::TestData;
    /// let text = "Specimen 7\n\nTest;Stretch;True Stress [MPa];Engineering Stress [MPa]\nuniaxial;1,5;0,63;0,42\n";
    /// assert_eq!(TestData::parse(text)?.tests()[0].points, [[1.5, 0.42]]);
    /// # Ok::<(), rkpm::fit::FitError>(())
    /// ```
    ///
    /// # Errors
    /// [`FitError::Column`], [`FitError::Header`] and [`FitError::Ambiguous`] where no header names each column once;
    /// [`FitError::Row`] and [`FitError::Mode`] for rows that can't be read; those of [`with`](Self::with);
    /// [`FitError::Empty`] without rows.
    pub fn parse(text: &str) -> Result<Self, FitError> {
        let mut data = Self::default();
        Rows::new(text)?.each(|row, mode, point| {
            let mode = mode_of(mode).ok_or_else(|| FitError::Mode { row, mode: mode.to_string() })?;
            data.push(mode, point)
        })?;
        if data.tests.is_empty() { Err(FitError::Empty) } else { Ok(data) }
    }

    /// The tests, one for each mode, in the order in which they came.
    pub fn tests(&self) -> &[Test] {
        &self.tests
    }

    /// The test of a mode.
    pub(crate) fn test(&self, mode: Mode) -> Option<&Test> {
        self.tests.iter().find(|test| test.mode == mode)
    }

    fn push(&mut self, mode: Mode, [stretch, stress]: [f64; 2]) -> Result<(), FitError> {
        let point = 1 + self.test(mode).map_or(0, |test| test.points.len());
        ensure!(stretch > 0.0 && stretch.is_finite(), FitError::Stretch { mode: mode.name(), point, value: stretch });
        ensure!(stress.is_finite(), FitError::Stress { mode: mode.name(), point, value: stress });
        if stress * (stretch - 1.0) < 0.0 || (stretch == 1.0) != (stress == 0.0) {
            return Err(FitError::Sign { mode: mode.name(), point, stretch, stress });
        }
        if stress == 0.0 {
            return Ok(());
        }
        match self.tests.iter_mut().find(|test| test.mode == mode) {
            Some(test) => test.points.push([stretch, stress]),
            None => self.tests.push(Test { mode, points: vec![[stretch, stress]], weight: 1.0 }),
        }
        Ok(())
    }
}

impl Test {
    /// The root of the mean square of the stresses \[stress\].
    pub(crate) fn size(&self) -> f64 {
        (self.points.summed(|[_, stress]| stress * stress) / self.points.len() as f64).sqrt()
    }

    /// Smallest and largest stretch.
    pub(crate) fn range(&self) -> [f64; 2] {
        let join = |[low, high]: [f64; 2], [x, _]: &[f64; 2]| [low.min(*x), high.max(*x)];
        self.points.iter().fold([f64::INFINITY, f64::NEG_INFINITY], join)
    }

    /// The shear modulus of the neo-Hookean law that follows the smaller half of the strains: the scale of the law's moduli.
    pub(super) fn modulus(&self) -> f64 {
        let mut points = self.points.clone();
        points.sort_by(|a, b| a[0].ln().abs().total_cmp(&b[0].ln().abs()));
        let (mut product, mut square) = (0.0, 0.0);
        for [stretch, stress] in &points[..points.len().div_ceil(2)] {
            let [first, _, third] = self.mode.incompressible(*stretch);
            let unit = first - third * third / first;
            (product, square) = (product + unit * stress, square + unit * unit);
        }
        if self.mode == Mode::Volumetric { 0.0 } else { product / square }
    }
}

fn mode_of(name: &str) -> Option<Mode> {
    match name.to_ascii_lowercase().replace([' ', '-', '_'], "").as_str() {
        "uniaxial" | "ut" | "ua" | "tension" | "uniaxialtension" | "uniaxialcompression" => Some(Mode::Uniaxial),
        "equibiaxial" | "biaxial" | "et" | "eb" | "bt" | "equibiaxialtension" => Some(Mode::Equibiaxial),
        "planar" | "ps" | "pt" | "pureshear" | "planartension" => Some(Mode::Planar),
        "volumetric" | "vt" | "vol" => Some(Mode::Volumetric),
        _ => None,
    }
}
