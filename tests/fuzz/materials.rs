use rkpm::material::*;
use rkpm::nalgebra::Matrix3;

use super::harness::Input;

pub fn materials(input: &mut Input) {
    input.passed = true;
    let constants: [f64; 4] =
        std::array::from_fn(|_| if input.once_in(4) { input.bad() } else { input.good(-0.1, 2.0) });
    let exponents: Vec<((u32, u32), f64)> = (0..input.random.usize(0..5))
        .map(|_| {
            let e = |input: &mut Input| if input.once_in(10) { input.random.u32(..) } else { input.random.u32(0..4) };
            ((e(input), e(input)), input.number(-0.5, 1.0))
        })
        .collect();
    let pairs: Vec<(f64, f64)> =
        (0..input.random.usize(0..4)).map(|_| (input.number(-1.0, 1.0), input.number(-6.0, 6.0))).collect();
    let mut f = Matrix3::from_fn(|i, j| f64::from(u8::from(i == j)) + 0.3 * input.good(-1.0, 1.0));
    if input.once_in(3) {
        f[(input.random.usize(0..3), input.random.usize(0..3))] = input.bad();
    }
    if input.once_in(10) {
        f = Matrix3::zeros();
    }
    let [a, b, c, k] = constants;
    let k = if input.once_in(3) { k } else { 1e3 };
    let _ = input.saw("constants, exponents, pairs, F", (constants, k, &exponents, &pairs, f));
    for rubber in [
        Rubber::neo_hookean(a, k),
        Rubber::mooney_rivlin(a, b, k),
        Rubber::yeoh(a, b, c, k),
        Rubber::polynomial(exponents.iter().copied(), k),
    ]
    .into_iter()
    .flatten()
    {
        ask(&rubber, &f);
        let _ = rubber.existence().holds();
    }
    if let (Ok(polynomial), Ok(volumetric)) = (RivlinPolynomial::new(exponents), HartmannNeffVolume::new(k)) {
        let law = NearlyIncompressible { distortional: Invariants(polynomial), volumetric };
        let _ = law.existence();
        ask(&law, &f);
    }
    let volumetric = QuadraticVolume { bulk: k };
    // Literals go round the constructors' checks.
    ask(&NearlyIncompressible { distortional: Invariants(Gent { shear: a, limit: b }), volumetric }, &f);
    ask(&NearlyIncompressible { distortional: PrincipalStretches(Hencky { shear: a }), volumetric }, &f);
    if let Ok(gent) = Gent::new(a, b) {
        ask(&NearlyIncompressible { distortional: Invariants(gent), volumetric }, &f);
    }
    if let Ok(ogden) = Ogden::new(pairs) {
        ask(&NearlyIncompressible { distortional: PrincipalStretches(ogden), volumetric }, &f);
    }
}

fn ask(material: &impl Material, f: &Matrix3<f64>) {
    let _ = (material.energy(f), material.response(f));
    let _ = (material.initial_moduli().shear, material.initial_moduli().bulk);
    let _ = (material.energy_from(f, Past::NONE), material.response_from(f, Past::NONE));
    let _ = material.volumetric().map(|volumetric| volumetric.evaluate(f.determinant()));
}
