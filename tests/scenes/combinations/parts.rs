//! The scenes of cases: sources, kinematics, laws and actions.

use std::f64::consts::PI;
use std::sync::Arc;

use rkpm::error::Error;
use rkpm::material::{Material, Mullins, OgdenFoam, Prony, TotalStretches, Viscoelastic};
use rkpm::mesh::CellShape;
use rkpm::prelude::*;
use rkpm::solid::{Select, Shape};
use rkpm::study::{Answer, Budget, Tolerance};

use super::{ACTION, APPROXIMATION, Case, KINEMATICS, LAW, RESULT, RUN, SOURCE};

/// Dead traction on the right face \[stress\].
pub const TRACTION: f64 = 0.02;
/// Pressure on it where it follows.
pub const PRESSURE: f64 = 0.05;
/// How far the upper face comes down, and how far it goes aside.
const PRESSED: f64 = 0.1;
const ASIDE: f64 = 0.03;
/// Thickness of sheets.
const THICKNESS: f64 = 2.0;

/// What differs between lines, planes and space.
pub trait Dimension<const D: usize> {
    fn geometry(case: Case) -> Geometry<D>;
    fn kinematics(case: Case) -> Arc<dyn Kinematics<D>>;
    fn locally(scene: &Scene<D>, scheme: &Scheme, tolerance: &Tolerance<D>, budget: Budget)
    -> Result<Answer<D>, Error>;
}

pub struct Line;
pub struct Plane;
pub struct Space;

fn block<const D: usize>(low: f64, high: f64) -> Block<D> {
    let (mut min, mut max) = ([0.0; D], [1.0; D]);
    (min[0], max[0]) = (1.0, 2.0);
    (min[D - 1], max[D - 1]) = match D {
        1 => (1.0 + low, 1.0 + high),
        _ => (low, high),
    };
    Block::new(min, max)
}

impl Dimension<1> for Line {
    fn geometry(_: Case) -> Geometry<1> {
        block::<1>(0.0, 1.0).into()
    }

    fn kinematics(case: Case) -> Arc<dyn Kinematics<1>> {
        match case.option(KINEMATICS) {
            "axisymmetric" => Arc::new(RadialSphere),
            _ => Arc::new(RadialCylinder),
        }
    }

    fn locally(_: &Scene<1>, _: &Scheme, _: &Tolerance<1>, _: Budget) -> Result<Answer<1>, Error> {
        unreachable!("refused by types")
    }
}

impl Dimension<2> for Plane {
    fn geometry(case: Case) -> Geometry<2> {
        match case.option(SOURCE) {
            "mapped block" => {
                // Nothing but the inside is moved.
                let bulge = |x: &Point<2>| 0.05 * (PI * x[0]).sin() * (PI * x[1]).sin();
                Mapped(move |x: &Point<2>| Point::<2>::new(1.0 + x[0] + bulge(x), x[1] - bulge(x))).into()
            }
            "region" => {
                let outline = Outline::at([1.0, 0.0]).line("bottom", [2.0, 0.0]).line("right", [2.0, 1.0]);
                Region::new(outline.line("top", [1.0, 1.0]).close("left")).unwrap().into()
            }
            "planar mesh" => mesh::<2>(4, CellShape::Quadrangle, CellShape::Line).into(),
            _ => block::<2>(0.0, 1.0).into(),
        }
    }

    fn kinematics(case: Case) -> Arc<dyn Kinematics<2>> {
        match case.option(KINEMATICS) {
            "axisymmetric" => Arc::new(Axisymmetric),
            "plane stress" => Arc::new(PlaneStress { thickness: THICKNESS }),
            _ => Arc::new(PlaneStrain),
        }
    }

    fn locally(
        scene: &Scene<2>,
        scheme: &Scheme,
        tolerance: &Tolerance<2>,
        budget: Budget,
    ) -> Result<Answer<2>, Error> {
        scene.solve_within_locally(scheme, tolerance, budget)
    }
}

impl Dimension<3> for Space {
    fn geometry(case: Case) -> Geometry<3> {
        if case.option(SOURCE) == "solid mesh" {
            return mesh::<3>(2, CellShape::Hexahedron, CellShape::Quadrangle).into();
        }
        let solid = Shape::block([1.0, 0.0, 0.0], [2.0, 1.0, 1.0]).solid(0.5).unwrap();
        let named = [
            ("bottom", [1.5, 0.5, 0.0], [0.0, 0.0, -1.0]),
            ("top", [1.5, 0.5, 1.0], [0.0, 0.0, 1.0]),
            ("right", [2.0, 0.5, 0.5], [1.0, 0.0, 0.0]),
        ];
        let name = |solid: Solid3, (name, at, normal)| solid.name(name, Select::plane(at, normal)).unwrap();
        named.into_iter().fold(solid, name).into()
    }

    fn kinematics(_: Case) -> Arc<dyn Kinematics<3>> {
        Arc::new(Solid)
    }

    fn locally(_: &Scene<3>, _: &Scheme, _: &Tolerance<3>, _: Budget) -> Result<Answer<3>, Error> {
        unreachable!("refused by types")
    }
}

/// Even cells of a unit block with named faces.
fn mesh<const D: usize>(cells: usize, shape: CellShape, face: CellShape) -> Mesh<D> {
    let n = cells + 1;
    let nodes = n.pow(D as u32);
    let digit = |k: usize, axis: usize| k / n.pow(axis as u32) % n;
    let at = |k: usize| {
        let x = |axis: usize| digit(k, axis) as f64 / cells as f64 + f64::from(u8::from(axis == 0));
        Point::<D>::from_fn(|axis, _| x(axis))
    };
    let corner = |axes: &[usize], around: &[usize]| -> usize {
        axes.iter().zip(around).map(|(a, b)| n.pow(*a as u32) * b).sum()
    };
    let square: [&[usize]; 4] = [&[0, 0], &[1, 0], &[1, 1], &[0, 1]];
    let mut volumes = Vec::new();
    let inside = |k: &usize| (0..D).all(|axis| digit(*k, axis) < cells);
    for k in (0..nodes).filter(inside) {
        for layer in 0..D - 1 {
            volumes.extend(square.iter().map(|s| k + corner(&[0, 1], s) + layer * n * n));
        }
    }
    let count = volumes.len() / (4 * (D - 1));
    let (mut faces, mut groups) = (Vec::new(), Vec::new());
    for (name, axis, side) in [("bottom", D - 1, 0), ("top", D - 1, cells), ("left", 0, 0), ("right", 0, cells)] {
        let others: Vec<usize> = (0..D).filter(|other| *other != axis).collect();
        let on = |k: &usize| digit(*k, axis) == side && others.iter().all(|other| digit(*k, *other) < cells);
        let first = faces.len() / (2 * (D - 1));
        for k in (0..nodes).filter(on) {
            let around: &[&[usize]] = if D == 2 { &[&[0], &[1]] } else { &square };
            faces.extend(around.iter().map(|s| k + corner(&others, s)));
        }
        groups.push((name.to_string(), (count + first..count + faces.len() / (2 * (D - 1))).collect()));
    }
    Mesh::new((0..nodes).map(at).collect(), &[(shape, volumes), (face, faces)], &groups).unwrap()
}

fn law(case: Case) -> Arc<dyn Material> {
    let rubber = Rubber::neo_hookean(0.5, 1e2).unwrap();
    match case.option(LAW) {
        "viscoelastic" => Arc::new(Viscoelastic::new(rubber, Prony::of_instantaneous([(0.4, 2.0)]).unwrap())),
        "Mullins" => Arc::new(Mullins::new(rubber, 1.5, 0.01, 0.1).unwrap()),
        "foam" => Arc::new(TotalStretches(OgdenFoam::blatz_ko(0.5, 0.25, 0.5).unwrap())),
        _ => Arc::new(rubber),
    }
}

/// A part of the first body.
pub fn place<const D: usize>(case: Case, name: &str) -> Place<D> {
    let drawn = ["region", "planar mesh", "solid mesh", "cut surface"].contains(&case.option(SOURCE));
    let part: Part = match (drawn, name) {
        (true, name) => name.into(),
        (false, "bottom") => (D - 1, Side::Min).into(),
        (false, "top") => (D - 1, Side::Max).into(),
        (false, "left") => (0, Side::Min).into(),
        (false, _) => (0, Side::Max).into(),
    };
    Place::on(part).of("part")
}

/// Whether two bodies lie on each other.
fn is_stacked(case: Case) -> bool {
    ["several bodies", "contact of two bodies"].contains(&case.option(ACTION))
}

/// Where the scene is driven: the face that conditions move.
pub fn driven<const D: usize>(case: Case) -> Place<D> {
    match is_stacked(case) {
        true => Place::on((D - 1, Side::Max)).of("cap"),
        false => place(case, "top"),
    }
}

/// What the contact of a case is called, if it has one.
pub fn contact(case: Case) -> Option<&'static str> {
    let touches = ["rigid contact", "contact of two bodies", "contact with itself", "friction"];
    let own = touches.contains(&case.option(ACTION));
    match (own, case.option(RESULT)) {
        (true, _) => Some("contact"),
        (false, "contact pressure") => Some("wall"),
        _ => None,
    }
}

/// The scene of a case, its driven face moved by `size` times what it is.
pub fn scene<const D: usize, S: Dimension<D>>(case: Case, size: f64) -> Scene<D> {
    let up = D - 1;
    let mut scene = Scene::assembly(S::kinematics(case)).body("part", S::geometry(case), law(case));
    if is_stacked(case) {
        scene = scene.body("cap", block::<D>(1.0, 1.4), law(case));
    }
    if case.option(LAW) == "viscoelastic" {
        scene = scene.over_time(4.0);
    }
    scene = scene.with(Condition::on(place(case, "bottom")).displacement([0.0; D]).named("bottom"));
    let revolved = case.option(KINEMATICS) == "axisymmetric";
    let mut motion = [0.0; D];
    motion[up] = -PRESSED * size;
    if D > 1 && !revolved {
        motion[0] = ASIDE * size;
    }
    let mut normal = [0.0; D];
    normal[up] = -1.0;
    let mut at = [1.0; D];
    at[up] = if D == 1 { 2.0 } else { 1.0 };
    let plate = || RigidSurface::plane(at, normal).moving(motion).named("contact");
    let top = || place::<D>(case, "top");
    let drive = Condition::on(driven(case)).displacement(motion).named("driven");
    scene = match case.option(ACTION) {
        // A line has two ends: the driven one is pressed by the wall.
        _ if D == 1 && contact(case) == Some("wall") => scene.contact(driven(case), wall_of_line(case, size)),
        "rigid contact" => scene.contact(top(), plate()),
        "friction" => scene.contact(top(), plate().friction(0.3)),
        "rigid body" => scene.rigid("plate", top()).with(Condition::on("plate").displacement(motion).named("driven")),
        "contact of two bodies" => {
            let under = Place::on((up, Side::Min)).of("cap");
            scene.with(drive).contact_between(top(), under, "contact")
        }
        "contact with itself" => scene.with(drive).contact_itself(place(case, "right"), "contact"),
        _ => scene.with(drive),
    };
    if case.option(ACTION) == "follower pressure" {
        scene = scene.pressure(place(case, if D == 1 { "bottom" } else { "right" }), PRESSURE);
    }
    if D > 1 {
        let mut traction = [0.0; D];
        traction[up] = TRACTION;
        scene = scene.traction(place(case, "right"), traction);
        if contact(case) == Some("wall") {
            let (mut at, mut normal, mut by) = ([0.5; D], [0.0; D], [0.0; D]);
            (at[0], normal[0], by[0]) = (2.0, -1.0, -0.02 * size);
            scene = scene.contact(place(case, "right"), RigidSurface::plane(at, normal).moving(by).named("wall"));
        }
    }
    scene
}

/// What presses the end of a line.
fn wall_of_line<const D: usize>(case: Case, size: f64) -> RigidSurface<D> {
    let end = if is_stacked(case) { 2.4 } else { 2.0 };
    RigidSurface::plane([end; D], [-1.0; D]).moving([-PRESSED * size; D]).named("wall")
}

/// Whether the scene's bodies take their particles from the scheme.
fn is_resolved(case: Case) -> bool {
    is_stacked(case) || !["planar mesh", "solid mesh"].contains(&case.option(SOURCE))
}

pub fn scheme<const D: usize>(case: Case) -> Scheme {
    let scheme = match case.option(APPROXIMATION) {
        "order 2" => Scheme::default().order(2),
        "order 3" => Scheme::default().order(3),
        "elements 1" => Scheme::elements(1),
        "elements 2" => Scheme::elements(2),
        _ => Scheme::default(),
    };
    let sized = ["solve_within", "locally"].contains(&case.option(RUN));
    match D {
        _ if sized || !is_resolved(case) => scheme,
        1 => scheme.particles([7]),
        2 => scheme.particles([5, 5]),
        _ => scheme.particles([3, 3, 3]),
    }
}

/// What the dead traction weighs \[force\]: along the last axis.
pub fn weight(case: Case) -> f64 {
    TRACTION
        * match case.option(KINEMATICS) {
            "axisymmetric" => 2.0 * PI * 2.0,
            "plane stress" => THICKNESS,
            _ => 1.0,
        }
}
