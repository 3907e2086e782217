//! Scenes of contact drawn at random: bodies, gaps, corners, paths, friction and surfaces as they come.

use rkpm::contact::Profile;
use rkpm::prelude::*;

/// Draws of numbers in [0, 1); and whether surfaces that are drawn into the body resolve the overlap first.
struct Draw(u64, bool);

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

fn draws(seed: u64, fit: bool) -> Draw {
    let mut draw = Draw(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1, fit);
    for _ in 0..10 {
        draw.next();
    }
    draw
}

fn rubber(draw: &mut Draw) -> Rubber {
    Rubber::mooney_rivlin(0.4, 0.1, 10f64.powf(draw.between(1.0, 4.0))).unwrap()
}

/// A gap and a way beyond it, for a body of a height.
fn approach(draw: &mut Draw, high: f64) -> (f64, f64) {
    let gap = if draw.next() < 0.5 { 0.0 } else { draw.between(0.0, 0.5) };
    (gap, gap + draw.between(0.05, 0.4) * high)
}

/// A plane, a shaft, a wedge with a sharp corner or a punch with rounded ones above a body, at a place and no wider than a half width
/// to either side. The plane only where `plane` says that the body has somewhere to go.
fn tool(draw: &mut Draw, y: f64, at: f64, half: f64, plane: bool) -> RigidSurface<2> {
    let kinds = if plane { 4.0 } else { 3.0 };
    match (kinds * draw.next()) as usize {
        0 => {
            let radius = draw.between(0.2, 1.0) * half;
            RigidSurface::shaft([at, y + radius], radius)
        }
        1 => {
            let run = draw.between(0.6, 2.0);
            RigidSurface::profile(Profile::at([at - run, y + 1.0]).line([at, y]).line([at + run, y + 1.0]).close())
        }
        2 => {
            let (half, r) = (draw.between(0.3, 0.8) * half, 0.05);
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
        _ => RigidSurface::plane([0.0, y], [draw.between(-0.1, 0.1), -1.0]),
    }
}

/// Moves a tool down, or pushes it there.
fn driven(draw: &mut Draw, tool: RigidSurface<2>, way: f64, wide: f64) -> RigidSurface<2> {
    if draw.next() < 0.25 {
        tool.pushed([0.0, -draw.between(0.02, 0.2) * wide])
    } else {
        tool.moving([draw.between(-0.2, 0.2) * way, -way])
    }
}

/// A block, a half disc, or a block with rounded shoulders, held at its base or free to slide there between two walls, and one to four
/// surfaces that come at it from above and from the sides. Rigid bodies do not overlap each other, and rubber has somewhere to go.
pub fn in_the_plane(seed: u64, fit: bool) -> Scene<2> {
    let mut draw = draws(seed, fit);
    let rubber = rubber(&mut draw);
    let (wide, high) = (draw.between(0.6, 2.0), draw.between(0.6, 1.4));
    let (outline, half) = match (3.0 * draw.next()) as usize {
        0 => {
            let outline = Outline::at([-wide, 0.0]).line("base", [wide, 0.0]).line("rim", [wide, high]);
            (outline.line("rim", [-wide, high]).close("rim"), wide)
        }
        1 => {
            let outline = Outline::at([-high, 0.0]).line("base", [high, 0.0]);
            (outline.arc("rim", [-high, 0.0], [0.0, 0.0], Turn::Left), high)
        }
        _ => {
            let r = 0.3 * high.min(wide);
            let outline = Outline::at([-wide, 0.0])
                .line("base", [wide, 0.0])
                .line("rim", [wide, high - r])
                .arc("rim", [wide - r, high], [wide - r, high - r], Turn::Left)
                .line("rim", [r - wide, high])
                .arc("rim", [-wide, high - r], [r - wide, high - r], Turn::Left)
                .close("rim");
            (outline, wide)
        }
    };
    let held = draw.next() < 0.7;
    let surfaces = if held { 1 + (4.0 * draw.next()) as usize } else { 3 };
    let mut scene = Scene::new(Region::new(outline).unwrap(), PlaneStrain, rubber).prescribe("base", 1, 0.0);
    if held {
        scene = scene.prescribe("base", 0, 0.0);
    }
    // From above, one or two.
    let tops: &[[f64; 2]] = if surfaces == 4 { &[[-0.5, 0.35], [0.5, 0.35]] } else { &[[0.0, 1.0]] };
    for (k, &[at, size]) in tops.iter().enumerate() {
        let (gap, way) = approach(&mut draw, high);
        let at = (at + draw.between(-0.1, 0.1)) * half;
        let tool = tool(&mut draw, high + gap, at, size * half, surfaces < 3);
        let tool = driven(&mut draw, tool, way, half);
        let tool = rough(&mut draw, tool);
        scene = scene.contact("rim", tool.named(&format!("top {k}")));
    }
    // From the sides.
    for (k, side) in [1.0, -1.0].into_iter().take(surfaces - tops.len()).enumerate() {
        let (gap, way) = approach(&mut draw, half);
        // A body that is not held lies between its walls: under a round tool it would jump across a gap.
        let gap = if held { gap } else { 0.0 };
        // Beside a fixed base a wall leans: it ends at the edge of the base and is pressed in above, where rubber may give way.
        let pressed = if held { 0.3 * (way - gap) } else { 0.0 };
        let lean = pressed / high;
        let wall = RigidSurface::plane([side * (half + gap + pressed), 0.0], [-side, -lean]);
        let wall = if held { wall.moving([-side * (gap + pressed), 0.0]) } else { wall };
        scene = scene.contact("rim", wall.named(&format!("side {k}")));
    }
    scene
}

/// A disc, a ring with a rectangular section or an O-ring, between a floor and one or two surfaces of revolution.
pub fn of_revolution(seed: u64, fit: bool) -> Scene<2> {
    let mut draw = draws(seed, fit);
    let rubber = rubber(&mut draw);
    let bore = if draw.next() < 0.5 { 0.0 } else { draw.between(0.3, 1.0) };
    let (wide, high) = (draw.between(0.6, 1.4), draw.between(0.5, 1.2));
    let round = bore > 0.0 && draw.next() < 0.5;
    let outline = if round {
        Outline::circle("rim", [bore + 0.5 * high, 0.5 * high], 0.5 * high)
    } else {
        let outline = Outline::at([bore, 0.0]).line("rim", [bore + wide, 0.0]).line("rim", [bore + wide, high]);
        outline.line("rim", [bore, high]).close(if bore > 0.0 { "rim" } else { "axis" })
    };
    let outer = bore + if round { high } else { wide };
    let mut scene = Scene::new(Region::new(outline).unwrap(), Axisymmetric, rubber)
        .contact("rim", RigidSurface::plane([0.0, 0.0], [0.0, 1.0]).named("floor"));
    if bore == 0.0 {
        scene = scene.prescribe("axis", 0, 0.0);
    }
    let (gap, mut way) = approach(&mut draw, high);
    // A sleeve around a ring leaves its bore to bulge into, which takes the area that the lid drives out.
    let sleeve = bore > 0.0 && draw.next() < 0.5;
    let inward = draw.between(0.0, 0.1) * bore;
    if sleeve {
        let area = if round { 0.785 * high } else { wide } * (outer + bore) / 2.0;
        let room = (outer - inward).powi(2) - 2.0 * area - 0.5 * bore * bore;
        way = way.min(gap + high * (room / (room + 2.0 * area)).max(0.0));
    }
    let y = high + gap;
    let lid = match (3.0 * draw.next()) as usize {
        0 => RigidSurface::plane([0.0, y], [0.0, -1.0]),
        1 => {
            let radius = draw.between(0.3, 1.2);
            RigidSurface::shaft([bore + draw.between(0.2, 0.8) * (outer - bore), y + radius], radius)
        }
        // A cone about the axis.
        _ => {
            let rise = draw.between(0.1, 0.6);
            let profile = Profile::at([-0.2, y]).line([bore, y]).line([outer + 1.0, y + rise]);
            RigidSurface::profile(profile.line([outer + 1.0, y + 2.0]))
        }
    };
    let lid = if !sleeve && draw.next() < 0.25 {
        lid.pushed([0.0, -draw.between(0.02, 0.2) * std::f64::consts::PI * (outer * outer - bore * bore)])
    } else {
        lid.moving([0.0, -way])
    };
    let lid = rough(&mut draw, lid);
    scene = scene.contact("rim", lid.named("lid"));
    if sleeve {
        let gap = if draw.next() < 0.5 { 0.0 } else { draw.between(0.0, 0.3) };
        let wall = RigidSurface::plane([outer + gap, 0.0], [-1.0, 0.0]);
        scene = scene.contact("rim", wall.moving([-gap - inward, 0.0]).named("sleeve"));
    }
    scene
}

/// A block on a held base under a plane, a sphere, a cylinder or a cone.
pub fn in_space(seed: u64, fit: bool) -> Scene<3> {
    let mut draw = draws(seed, fit);
    let rubber = rubber(&mut draw);
    let size = [draw.between(0.8, 1.6), draw.between(0.8, 1.6), draw.between(0.5, 1.0)];
    let high = size[2];
    let mut scene = Scene::new(Block::new([0.0; 3], size), Solid, rubber).hold((2, Side::Min));
    for k in 0..1 + (2.0 * draw.next()) as usize {
        let (gap, way) = approach(&mut draw, high);
        let at = [draw.between(0.2, 0.8) * size[0], draw.between(0.2, 0.8) * size[1]];
        let z = high + gap;
        let radius = draw.between(0.4, 1.5);
        let tilt = [draw.between(-0.2, 0.2), draw.between(-0.2, 0.2)];
        let tool = match (4.0 * draw.next()) as usize {
            0 => RigidSurface::plane([at[0], at[1], z + 0.3], [tilt[0], tilt[1], -1.0]),
            1 => RigidSurface::sphere([at[0], at[1], z + radius], radius),
            2 => RigidSurface::cylinder([at[0], at[1], z + radius], [1.0, tilt[0], 0.0], radius),
            _ => RigidSurface::cone([at[0], at[1], z], [0.0, 0.0, 1.0], draw.between(0.8, 1.3)),
        };
        let tool = if draw.next() < 0.25 {
            tool.pushed([0.0, 0.0, -draw.between(0.01, 0.1) * size[0] * size[1]])
        } else {
            tool.moving([tilt[0] * way, tilt[1] * way, -0.7 * way])
        };
        let tool = rough(&mut draw, tool);
        scene = scene.contact((2, Side::Max), tool.named(&format!("surface {k}")));
    }
    scene
}

/// Friction from 0 to 1 on every other surface.
fn coefficient(draw: &mut Draw) -> f64 {
    if draw.next() < 0.5 { 0.0 } else { draw.next() }
}

fn rough<const D: usize>(draw: &mut Draw, tool: RigidSurface<D>) -> RigidSurface<D> {
    let coefficient = coefficient(draw);
    let tool = tool.friction(coefficient);
    if draw.1 { tool.interference(0.2) } else { tool }
}

/// Two bodies of a plane: a block, and another one or a disc above, beside its middle, that comes down and aside.
pub fn pair_in_the_plane(seed: u64) -> Scene<2> {
    let mut draw = draws(seed, false);
    let (lower, upper) = (rubber(&mut draw), rubber(&mut draw));
    let (wide, high) = (draw.between(0.8, 1.5), draw.between(0.6, 1.2));
    let (gap, path) = approach(&mut draw, 0.6 * high);
    let (at, half) = (draw.between(-0.3, 0.3) * wide, draw.between(0.3, 0.7) * wide);
    let y = high + gap;
    let floor = Outline::at([-wide, 0.0]).line("base", [wide, 0.0]).line("flank", [wide, high]);
    let floor = floor.line("face", [-wide, high]).close("flank");
    let above = if draw.next() < 0.5 {
        let block = Outline::at([at - half, y]).line("other", [at + half, y]).line("side", [at + half, y + half]);
        block.line("roof", [at - half, y + half]).close("side")
    } else {
        let disc = Outline::at([at - half, y + half]);
        disc.arc("other", [at + half, y + half], [at, y + half], Turn::Left).close("roof")
    };
    let aside = draw.between(-0.3, 0.3) * path;
    let pair = ContactPair::between("face", "other", "joint").friction(coefficient(&mut draw));
    Scene::assembly(PlaneStrain)
        .body("lower", Region::new(floor).unwrap(), lower)
        .body("upper", Region::new(above).unwrap(), upper)
        .hold("base")
        .with(Condition::on("roof").displacement([aside, -path]))
        .with(pair)
}

/// A block with a round groove in one flank, pressed until the groove may close on itself.
pub fn itself_in_the_plane(seed: u64) -> Scene<2> {
    let mut draw = draws(seed, false);
    let rubber = rubber(&mut draw);
    let (wide, high) = (draw.between(0.5, 1.0), draw.between(1.0, 2.0));
    let (radius, middle) = (draw.between(0.1, 0.2) * high, 0.5 * high);
    let outline = Outline::at([0.0, 0.0])
        .line("base", [wide, 0.0])
        .line("flank", [wide, middle - radius])
        .arc("flank", [wide, middle + radius], [wide, middle], Turn::Right)
        .line("flank", [wide, high])
        .line("roof", [0.0, high])
        .close("back");
    let pair = ContactPair::itself("flank", "groove");
    let (down, friction) = (draw.between(0.15, 0.35) * high, coefficient(&mut draw));
    Scene::new(Region::new(outline).unwrap(), PlaneStrain, rubber)
        .hold("base")
        .prescribe("roof", 1, -down)
        .prescribe("roof", 0, 0.0)
        .with(pair.friction(friction))
}

/// Two blocks in space, the upper one beside the middle of the lower one, turned by nothing, moved down and aside.
pub fn pair_in_space(seed: u64) -> Scene<3> {
    let mut draw = draws(seed, false);
    let (lower, upper) = (rubber(&mut draw), rubber(&mut draw));
    let size = [draw.between(0.8, 1.4), draw.between(0.8, 1.4), draw.between(0.4, 0.8)];
    let from = [draw.between(0.0, 0.4) * size[0], draw.between(0.0, 0.4) * size[1]];
    let to = [from[0] + draw.between(0.4, 0.6) * size[0], from[1] + draw.between(0.4, 0.6) * size[1]];
    let (gap, path) = approach(&mut draw, 0.5 * size[2]);
    let z = size[2] + gap;
    let aside = [draw.between(-0.3, 0.3) * path, draw.between(-0.3, 0.3) * path];
    let face = |side: Side, body: &str| -> Place<3> { Place::on((2, side)).of(body) };
    let pair = ContactPair::between(face(Side::Max, "lower"), face(Side::Min, "upper"), "joint")
        .friction(coefficient(&mut draw));
    Scene::assembly(Solid)
        .body("lower", Block::new([0.0; 3], size), lower)
        .body("upper", Block::new([from[0], from[1], z], [to[0], to[1], z + 0.5]), upper)
        .hold(face(Side::Min, "lower"))
        .with(Condition::on(face(Side::Max, "upper")).displacement([aside[0], aside[1], -path]))
        .with(pair)
}
