//! Fits to test data: Treloar's rubber, known coefficients under noise, and data that can't be right.

use approx::{abs_diff_eq, assert_abs_diff_eq, relative_eq};
use rkpm::fit::{Family, Fit, FitError, Law, Report, TestData, Warning};
use rkpm::material::{Criterion, Mode, stable_ranges_incompressible};

const SHAPES: [Mode; 3] = [Mode::Uniaxial, Mode::Equibiaxial, Mode::Planar];

fn treloar() -> TestData {
    TestData::parse(include_str!("../../../tests/reference/treloar_1944.csv")).unwrap()
}

fn percent(report: &Report) -> [f64; 3] {
    SHAPES.map(|mode| 100.0 * report.misfit(mode).unwrap())
}

/// GOAL: one law for all three of Treloar's tests. REFERENCE: plain Levenberg-Marquardt from many starts, the same measure.
#[test]
fn treloars_rubber_is_followed_by_three_laws() {
    for (law, bounds) in
        [(Law::Ogden(3), [3.6, 2.2, 2.7]), (Law::ExtendedTube, [2.9, 2.5, 1.5]), (Law::Carroll, [2.9, 2.4, 2.2])]
    {
        let report = Fit::new(law).to(&treloar()).unwrap();
        let found = percent(&report);
        assert!(found.iter().zip(bounds).all(|(found, bound)| *found <= bound), "{report}");
        // A law that is used must not fail where it was measured.
        for mode in SHAPES {
            let data = treloar();
            let points = data.tests().iter().filter(|test| test.mode == mode).flat_map(|test| &test.points);
            let [low, high] =
                points.fold([f64::INFINITY, 0.0f64], |[low, high], [at, _]| [low.min(*at), high.max(*at)]);
            let range = report.range(mode, Criterion::Drucker).unwrap();
            assert!(range.contains(low) && range.contains(high), "{range}");
        }
        assert_eq!(
            report.optima[report.chosen].values,
            report.coefficients.iter().map(|c| c.value).collect::<Vec<_>>()
        );
    }
}

#[test]
fn random_starts_end_at_optima_that_are_named() {
    for law in [Law::Ogden(3), Law::ExtendedTube, Law::Carroll] {
        let report = Fit::new(law).starts(100).seed(7).to(&treloar()).unwrap();
        let named: usize = report.optima.iter().map(|o| o.starts).sum();
        assert!(named >= 95, "{named} of 100: {report}");
        // Named by hand, not by the hundred.
        assert!(report.optima.len() <= 12, "{} optima: {report}", report.optima.len());
    }
}

/// Normal deviates from a fixed seed.
struct Noise(u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (-2.0 * self.uniform().ln()).sqrt() * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

/// Tests of a known law, every stress off by a normal error of a part of it.
fn synthetic(law: Law, values: &[f64], noise: f64, seed: u64) -> TestData {
    let material = law.build(values).unwrap();
    let mut random = Noise(seed);
    let mut data = TestData::default();
    for (mode, most) in [(Mode::Uniaxial, 4.0f64), (Mode::Equibiaxial, 2.5), (Mode::Planar, 3.5)] {
        let points: Vec<_> = (1..=20)
            .map(|k| {
                let stretch = most.powf(f64::from(k) / 20.0);
                let stress = mode.incompressible_state(&*material, stretch).stress;
                [stretch, stress * (1.0 + noise * random.normal())]
            })
            .collect();
        data = data.with(mode, points).unwrap();
    }
    data
}

#[test]
fn known_coefficients_come_back_from_exact_data() {
    for (law, values) in [
        (Law::Yeoh, vec![0.373, -0.01, 0.002]),
        (Law::Ogden(2), vec![0.01, 5.0, 0.4, 1.3]),
        (Law::GentGent, vec![0.3, 40.0, 0.1]),
        (Law::ExtendedTube, vec![0.2, 0.2, 0.4, 0.12]),
        (Law::ArrudaBoyce, vec![0.3, 3.0]),
        (Law::Carroll, vec![0.15, 1e-5, 0.1]),
        (Law::MooneyRivlin, vec![0.2, 0.05]),
    ] {
        let report = Fit::new(law).to(&synthetic(law, &values, 0.0, 1)).unwrap();
        for (found, exact) in report.coefficients.iter().zip(&values) {
            assert!(
                relative_eq!(found.value, exact, max_relative = 1e-4),
                "{}: {} {exact}\n{report}",
                found.name,
                found.value
            );
        }
    }
}

/// 95 % intervals hold in 95 % of all cases: in 40 draws of 3 and 2 coefficients between 90 and 99 %.
#[test]
fn known_coefficients_stay_within_their_confidence() {
    for (law, values) in [(Law::GentGent, vec![0.3, 40.0, 0.1]), (Law::MooneyRivlin, vec![0.2, 0.05])] {
        let (mut inside, mut all) = (0, 0);
        for seed in 0..40 {
            let report = Fit::new(law).starts(3).to(&synthetic(law, &values, 0.01, 100 + seed)).unwrap();
            for (found, exact) in report.coefficients.iter().zip(&values) {
                let [low, high] = found.interval;
                assert!(high - low < 0.5 * exact.abs(), "{}: a wide interval says nothing: {report}", found.name);
                inside += usize::from((low..=high).contains(exact));
                all += 1;
            }
        }
        let part = inside as f64 / all as f64;
        assert!((0.88..=0.995).contains(&part), "{law:?}: {inside} of {all}");
    }
}

#[test]
fn volumetric_tests_give_the_bulk_modulus() {
    let data = synthetic(Law::NeoHookean, &[0.2], 0.0, 1)
        .with(Mode::Volumetric, [[0.999, -1.5], [0.998, -3.0], [0.996, -6.0]])
        .unwrap();
    let report = Fit::new(Law::NeoHookean).to(&data).unwrap();
    assert_abs_diff_eq!(report.bulk.unwrap(), 1500.0, epsilon = 1e-9);
    assert!(report.misfit(Mode::Volumetric).unwrap() < 1e-12);
    assert!(report.rubber(report.bulk.unwrap()).is_ok());
    assert_abs_diff_eq!(report.stress(Mode::Volumetric, 0.99), -15.0, epsilon = 1e-9);
    let shape_alone = Fit::new(Law::NeoHookean).to(&synthetic(Law::NeoHookean, &[0.2], 0.0, 1)).unwrap();
    assert!(shape_alone.stress(Mode::Volumetric, 0.99).is_nan());
}

#[test]
fn foams_are_fitted_with_their_volume() {
    let values = [0.2, 3.0, 0.15];
    let law = Law::Foam(1).build(&values).unwrap();
    let mut data = TestData::default();
    for (mode, most) in [(Mode::Uniaxial, 0.5f64), (Mode::Planar, 1.6)] {
        let points = (1..=12).map(|k| most.powf(f64::from(k) / 12.0));
        data = data.with(mode, points.map(|x| [x, mode.state(&*law, x).unwrap().stress]).collect::<Vec<_>>()).unwrap();
    }
    let report = Fit::new(Law::Foam(1)).to(&data).unwrap();
    for (found, exact) in report.coefficients.iter().zip(values) {
        assert!(relative_eq!(found.value, exact, max_relative = 1e-5), "{report}");
    }
}

#[test]
fn laws_unstable_inside_their_data_are_refused_unless_asked_for() {
    // Stresses that fall while the stretch grows: a Yeoh law follows them with a negative second constant.
    let points = [[1.1, 0.1], [1.3, 0.24], [1.6, 0.33], [2.0, 0.36], [2.5, 0.25], [2.8, 0.15]];
    let data = TestData::default().with(Mode::Uniaxial, points).unwrap();
    match Fit::new(Law::Yeoh).to(&data) {
        Err(FitError::Unstable { mode: "uniaxial", high, to: 2.8, .. }) => {
            assert!((1.5..2.8).contains(&high), "{high}")
        }
        other => panic!("{other:?}"),
    }
    let report = Fit::new(Law::Yeoh).allow_unstable().to(&data).unwrap();
    assert!(report.warnings.iter().any(|w| matches!(w, Warning::Unstable(_))), "{report}");
    assert!(!report.optima[report.chosen].stable);
}

#[test]
fn bounds_are_kept() {
    let report = Fit::new(Law::Ogden(1)).bound("alpha_1", [2.5, 4.0]).to(&treloar()).unwrap();
    assert!((2.5..=4.0).contains(&report.value("alpha_1").unwrap()));
    let error = Fit::new(Law::Ogden(1)).bound("alpha", [2.5, 4.0]).to(&treloar()).unwrap_err();
    assert!(error.to_string().contains("alpha_1"), "{error}");
    let error = Fit::new(Law::Ogden(1)).bound("alpha_1", [4.0, 2.5]).to(&treloar()).unwrap_err();
    assert!(matches!(error, FitError::Coefficient { .. }), "{error}");
}

/// Bounds hold for the term that they name, whatever the order of terms would be without them; of terms with the same bounds the one with
/// the larger exponent is the first.
#[test]
fn bounds_stay_with_the_term_that_they_name() {
    let data = synthetic(Law::Ogden(2), &[0.3, 3.0, 0.2, -2.0], 0.0, 1);
    let fit = |bounds: &[(&str, [f64; 2])]| {
        let fit = bounds.iter().fold(Fit::new(Law::Ogden(2)), |fit, (name, bounds)| fit.bound(*name, *bounds));
        fit.to(&data).unwrap()
    };
    let exponents = |report: &Report| ["alpha_1", "alpha_2"].map(|name| report.value(name).unwrap());
    let [first, second] = exponents(&fit(&[("alpha_1", [-10.0, -0.1])]));
    assert!(
        relative_eq!(first, -2.0, max_relative = 1e-3) && relative_eq!(second, 3.0, max_relative = 1e-3),
        "{first} {second}"
    );
    for bounds in [&[][..], &[("alpha_1", [-10.0, 10.0]), ("alpha_2", [-10.0, 10.0])]] {
        let [first, second] = exponents(&fit(bounds));
        assert!(first > second && relative_eq!(first, 3.0, max_relative = 1e-3), "{first} {second}");
    }
    // A bound that the data pass is told of by the name that it was given for.
    let report = fit(&[("alpha_1", [-10.0, -4.0])]);
    let at_bound = |name: &str| report.warnings.contains(&Warning::AtBound(name.into()));
    assert!((-10.0..=-4.0).contains(&report.value("alpha_1").unwrap()), "{report}");
    assert!(at_bound("alpha_1") && !at_bound("alpha_2"), "{report}");
}

#[test]
fn bad_data_are_named() {
    let parse = |rows: &str| TestData::parse(&format!("mode,stretch,nominal_stress\n{rows}")).unwrap_err();
    assert_eq!(parse(""), FitError::Empty);
    assert_eq!(parse("uniaxial,0.0,0.1"), FitError::Stretch { mode: "uniaxial", point: 1, value: 0.0 });
    assert_eq!(parse("UT,1.1,0.1\nUT,-2,0.1"), FitError::Stretch { mode: "uniaxial", point: 2, value: -2.0 });
    assert!(matches!(parse("PS,1.1,inf"), FitError::Stress { mode: "planar", point: 1, .. }));
    assert_eq!(parse("torsion,1.1,0.1"), FitError::Mode { row: 1, mode: "torsion".into() });
    assert_eq!(parse("ET,1.1,-0.1"), FitError::Sign { mode: "equibiaxial", point: 1, stretch: 1.1, stress: -0.1 });
    assert!(matches!(parse("ET,1.1,x"), FitError::Row { row: 1, .. }));
    assert!(matches!(parse("ET,1.1"), FitError::Row { row: 1, .. }));
    let error = TestData::parse("mode,strain,stress\n").unwrap_err();
    assert!(matches!(error, FitError::Header { column: "stretch", .. }), "{error}");
    assert_eq!(TestData::parse("mode,time,stress\n").unwrap_err(), FitError::Column { column: "stretch" });
    assert!(matches!(TestData::read("no/such/file.csv").unwrap_err(), FitError::File { .. }));
    assert!(matches!(treloar().weighted(Mode::Planar, 0.0).unwrap_err(), FitError::Weight { .. }));

    assert_eq!(Fit::new(Law::Yeoh).to(&TestData::default()).unwrap_err(), FitError::Empty);
    let volume = TestData::default().with(Mode::Volumetric, [[0.99, -1.0]]).unwrap();
    assert!(matches!(Fit::new(Law::Yeoh).to(&volume).unwrap_err(), FitError::Unseen { mode: "volumetric", .. }));
    let few = TestData::default().with(Mode::Uniaxial, [[1.5, 0.4], [2.0, 0.6]]).unwrap();
    assert!(matches!(Fit::new(Law::Yeoh).to(&few).unwrap_err(), FitError::TooFew { points: 2, coefficients: 3, .. }));
    // Rest says nothing; a stress at rest, or none in a stretched body, is a slip.
    let rest = TestData::default().with(Mode::Uniaxial, [[1.0, 0.0], [1.5, 0.4]]).unwrap();
    assert_eq!(rest.tests()[0].points.len(), 1);
    assert!(matches!(parse("UT,1.0,0.1"), FitError::Sign { .. }));
    assert!(matches!(parse("UT,1.2,0.0"), FitError::Sign { .. }));
}

#[test]
fn units_mixed_between_tests_are_warned_of() {
    let treloar = treloar();
    let mut mixed = TestData::default();
    for test in treloar.tests() {
        let factor = if test.mode == Mode::Planar { 1e3 } else { 1.0 };
        mixed = mixed.with(test.mode, test.points.iter().map(|[x, p]| [*x, factor * p]).collect::<Vec<_>>()).unwrap();
    }
    let report = Fit::new(Law::NeoHookean).to(&mixed).unwrap();
    let found = report
        .warnings
        .iter()
        .any(|w| matches!(w, Warning::Units { stiffer: Mode::Planar, ratio, .. } if (500.0..2000.0).contains(ratio)));
    assert!(found, "{report}");
    let sound = Fit::new(Law::NeoHookean).to(&treloar).unwrap();
    assert!(!sound.warnings.iter().any(|w| matches!(w, Warning::Units { .. })), "{sound}");
}

#[test]
fn stable_ranges_end_where_closed_forms_say() {
    // Mooney-Rivlin with A01 < 0 in uniaxial tension, Drucker at constant volume: the tangent along the pull,
    // with W(λ) = A10 (λ² + 2/λ) + A01 (2λ + 1/λ²), is d²W/d(ln λ)² = A10 (4 λ² + 2/λ) + A01 (2 λ + 4/λ²); across it, in the
    // plane of the equal stretches, 4 (A10/λ + A01 λ).
    let (a, b) = (0.3, -0.05);
    let law = Law::MooneyRivlin.build(&[a, b]).unwrap();
    let ranges = stable_ranges_incompressible(&*law);
    let range = ranges.iter().find(|r| r.mode == Mode::Uniaxial && r.criterion == Criterion::Drucker).unwrap();
    // a/λ + b λ = 0.
    assert!(abs_diff_eq!(range.high, (-a / b).sqrt(), epsilon = 1e-9), "{range}");
    // b's share grows in compression: a (4 λ³ + 2) λ + b (2 λ³ + 4) = 0 at the lower end.
    let low = range.low;
    let residual = a * (4.0 * low.powi(2) + 2.0 / low) + b * (2.0 * low + 4.0 / (low * low));
    assert!(residual.abs() < 1e-8 && low < 1.0, "{range}: {residual:e}");
}

/// A table under a header: stresses of a neo-Hookean law with A_10 = 0.2 where `{P}` stands, true stresses for `{S}`, stretches for
/// `{L}`, strains for `{E}`.
fn table(header: &str, row: &str) -> String {
    let rows = (1..=8).map(|i| {
        let l = 1.0 + 0.15 * f64::from(i);
        let p = 0.4 * (l - 1.0 / (l * l));
        let spelt = [("{L}", l), ("{E}", l - 1.0), ("{P}", p), ("{S}", l * p)];
        spelt.iter().fold(row.to_string(), |row, (mark, x)| row.replace(mark, &x.to_string())) + "\n"
    });
    format!("{header}\n{}", rows.collect::<String>())
}

#[test]
fn each_column_of_a_laboratory_table_is_what_its_header_says() {
    let right = |text: &str| {
        let data = TestData::parse(text).unwrap_or_else(|error| panic!("{text}\n{error}"));
        let found = Fit::new(Law::NeoHookean).to(&data).unwrap().value("A_10").unwrap();
        assert!((found - 0.2).abs() < 1e-9, "{text}\n{found}");
    };
    for header in [
        "mode,stretch,Engineering Strain,Engineering Stress (MPa)",
        "mode,stretch,nominal_strain,nominal_stress [N/mm^2]",
        "mode,stretch,stress rate,stress",
        "mode,lambda [-],stress (true),nominal stress",
        "test,Stretch,true_stress_MPa,engineering_stress_MPa",
        "Mode,Stretch [mm/mm],standard deviation of the stress,NominalStress[MPa]",
        "mode,volume ratio,PK2 stress,First Piola-Kirchhoff stress [N/mm²]",
    ] {
        right(&table(header, "uniaxial,{L},{E},{P}"));
    }
    right(&table("mode,stretch_rate,stretch,stress", "uniaxial,{E},{L},{P}"));
    right(&table("test_id,mode,stretch,nominal_stress", "7,uniaxial,{L},{P}"));
    right(&table("nominal_stress,test,stretch,test_number", "{P},uniaxial,{L},7"));
}

#[test]
fn columns_of_something_else_are_not_read() {
    let refused = |text: &str| TestData::parse(text).unwrap_err();
    for (header, column) in [
        ("mode,strain,stress", "stretch"),
        ("mode,stretch [%],stress", "stretch"),
        ("mode,stretch_rate,stress", "stretch"),
        ("mode,stretch,stress (true)", "nominal_stress"),
        ("mode,stretch,Cauchy stress", "nominal_stress"),
        ("mode,stretch,stress (PK2)", "nominal_stress"),
        ("mode,stretch,Kirchhoff stress", "nominal_stress"),
        ("mode,stretch,engineering strain", "nominal_stress"),
        ("mode,stretch,force [N]", "nominal_stress"),
        ("test_id,stretch,stress", "mode"),
    ] {
        let error = refused(&table(header, "uniaxial,{L},{P}"));
        assert!(matches!(error, FitError::Header { column: found, .. } if found == column), "{header}: {error}");
    }
    let two = refused(&table("mode,stretch,nominal stress [MPa],engineering stress [psi]", "uniaxial,{L},{P},{P}"));
    assert!(
        matches!(&two, FitError::Ambiguous { first, second, .. }
        if first == "nominal stress [MPa]" && second == "engineering stress [psi]"),
        "{two}"
    );
}

#[test]
fn tables_of_spreadsheets_are_read_as_they_come() {
    let commas = |text: String| text.replace('.', ",");
    let plain = table("mode;stretch;stress [MPa]", "uniaxial;{L};{P}");
    let points = TestData::parse(&plain).unwrap();
    let top = "Tensile machine, 23 °C\nSpeed;500 mm/min\n\n";
    for text in [
        commas(plain.clone()),
        commas(plain.replace(';', "\t")),
        plain.replace(';', ","),
        format!("\u{feff}{plain}").replace('\n', "\r\n"),
        format!("{top}{}", commas(plain.clone())),
        format!("{top}{}", plain.replace("[MPa]\n", "\n;-;MPa\n") + ";;\n"),
    ] {
        assert_eq!(TestData::parse(&text).unwrap_or_else(|error| panic!("{text}\n{error}")), points, "{text}");
    }
    // A decimal comma between columns that commas separate, and points beside commas, would be other numbers.
    let error = TestData::parse("mode,stretch,stress\nuniaxial,1,1,0,12\n").unwrap_err();
    assert!(matches!(error, FitError::Row { row: 1, .. }), "{error}");
    let error = TestData::parse("mode;stretch;stress\nuniaxial;1.5;1,234\n").unwrap_err();
    assert!(matches!(error, FitError::Row { row: 1, .. }), "{error}");
    // A first row within the noise is refused with what to do about it.
    let error = TestData::parse("mode,stretch,stress\nuniaxial,1.0,0.003\nuniaxial,1.5,0.4\n").unwrap_err();
    assert!(matches!(error, FitError::Sign { .. }) && error.to_string().contains("leave them out"), "{error}");
}
