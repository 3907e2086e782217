//! Scenes drawn at random: bodies, gaps, corners, ways and surfaces as they come.

use rkpm::contact::Profile;
use rkpm::prelude::*;
use rkpm::solve::Ending;

/// Draws of numbers in [0, 1).
struct Draw(u64);

impl Draw {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}

/// A block, a disc, or a half disc on a held or guided base, and one to four surfaces that come at it.
fn scene(seed: u64) -> Scene<2> {
    let mut draw = Draw(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1);
    for _ in 0..10 {
        draw.next();
    }
    let stiff = 10f64.powf(draw.between(1.0, 4.0));
    let rubber = Rubber::mooney_rivlin(0.4, 0.1, stiff).unwrap();
    let (wide, high) = (draw.between(0.6, 2.0), draw.between(0.6, 1.4));
    let outline = match (3.0 * draw.next()) as usize {
        0 => Outline::at([-wide, 0.0])
            .line("base", [wide, 0.0])
            .line("rim", [wide, high])
            .line("rim", [-wide, high])
            .close("rim"),
        1 => {
            // A half disc on its flat side.
            Outline::at([-high, 0.0]).line("base", [high, 0.0]).arc("rim", [-high, 0.0], [0.0, 0.0], Turn::Left)
        }
        _ => {
            // A block with rounded shoulders.
            let r = 0.3 * high.min(wide);
            Outline::at([-wide, 0.0])
                .line("base", [wide, 0.0])
                .line("rim", [wide, high - r])
                .arc("rim", [wide - r, high], [wide - r, high - r], Turn::Left)
                .line("rim", [r - wide, high])
                .arc("rim", [-wide, high - r], [r - wide, high - r], Turn::Left)
                .close("rim")
        }
    };
    let mut scene = Scene::on(Region::new(outline).unwrap(), PlaneStrain, rubber).prescribe("base", 1, 0.0);
    if draw.next() < 0.7 {
        scene = scene.prescribe("base", 0, 0.0);
    }
    let surfaces = 1 + (4.0 * draw.next()) as usize;
    for k in 0..surfaces {
        let name = format!("surface {k}");
        let gap = if draw.next() < 0.5 { 0.0 } else { draw.between(0.0, 0.5) };
        let way = gap + draw.between(0.05, 0.4) * high;
        let at = draw.between(-0.4, 0.4);
        let surface = match (5.0 * draw.next()) as usize {
            0 => RigidSurface::plane([0.0, high + gap], [draw.between(-0.2, 0.2), -1.0]),
            1 => {
                let radius = draw.between(0.2, 1.5);
                RigidSurface::shaft([at, high + gap + radius], radius)
            }
            2 => {
                // A wedge with a sharp corner.
                let (y, run) = (high + gap, draw.between(0.4, 2.0));
                RigidSurface::profile(Profile::at([at - run, y + 1.0]).line([at, y]).line([at + run, y + 1.0]).close())
            }
            3 => {
                // A punch with rounded corners.
                let (y, half, r) = (high + gap, draw.between(0.2, 0.6), 0.05);
                RigidSurface::profile(
                    Profile::at([at - half, y + 2.0])
                        .line([at - half, y + r])
                        .arc([at - half + r, y], [at - half + r, y + r], Turn::Left)
                        .line([at + half - r, y])
                        .arc([at + half, y + r], [at + half - r, y + r], Turn::Left)
                        .line([at + half, y + 2.0])
                        .close(),
                )
            }
            _ => RigidSurface::plane([wide.max(high) + gap, 0.0], [-1.0, 0.0]).moving([-0.4 * way, 0.0]),
        };
        let surface = if surface.is_fixed() { surface.moving([draw.between(-0.2, 0.2) * way, -way]) } else { surface };
        // A plane that leans in may touch a corner at once: it begins further away.
        scene = scene.contact("rim", surface.named(&name));
    }
    scene
}

/// `cargo test --release --all-features --test contact drawn -- --ignored --nocapture`
#[test]
#[ignore = "200 scenes take minutes"]
fn drawn_scenes_complete() {
    let (mut complete, mut all, mut refused) = (0, 0, 0);
    let mut seed = 0;
    while all < 200 {
        seed += 1;
        let problem = match scene(seed).discretize(&Scheme::default().particles([11]).seed(seed)) {
            Ok(problem) => problem,
            // A surface that is drawn into the body is no scene.
            Err(rkpm::Error::Contact(_)) => {
                refused += 1;
                continue;
            }
            Err(error) => panic!("{seed}: {error}"),
        };
        all += 1;
        let path = problem.run(&mut ()).unwrap();
        match &path.ending {
            Ending::Completed => complete += 1,
            other => println!("{seed}: load {:.3}, {} steps: {other:?}", path.last().load, path.steps.len()),
        }
    }
    println!("{complete} of {all} complete, {refused} drawn into the body");
    assert!(complete as f64 >= 0.98 * all as f64, "{complete} of {all}");
}
