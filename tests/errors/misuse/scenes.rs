//! Valid scenes: each argument of their calls is taken from `Args`.

use rkpm::error::Error;
use rkpm::fit::{Fit, Law, TestData};
use rkpm::material::{FoamTerm, Mode, Mullins, Prony, Viscoelastic};
use rkpm::mesh::CellShape;
use rkpm::prelude::*;
use rkpm::scene::{Field, Stages};
use rkpm::solve::Newton;
use rkpm::study::{Budget, Quantity, Tolerance};

use super::args::{Args, Heard, hear, heard, states};

type Build = fn(&mut Args) -> Result<Heard, Error>;

pub const ALL: &[(&str, Build)] = &[
    ("block in plane strain", block),
    ("scheme of a block", scheme),
    ("stepping of a block", stepping),
    ("results of a block", results),
    ("axisymmetric tube", tube),
    ("region in plane stress", region),
    ("mesh in 2D", mesh_2d),
    ("block in 3D on a rigid body", block_3d),
    ("mesh in 3D", mesh_3d),
    ("part of an STL file", stl),
    ("part of shapes", shapes),
    ("voxels", voxels),
    ("contact with a plane", plane),
    ("contact with shafts", shafts),
    ("contact with surfaces in 3D", surfaces_3d),
    ("contact of two bodies", two_bodies),
    ("press fit", press_fit),
    ("stages", stages),
    ("time", time),
    ("materials", materials),
    ("fit", fit),
    ("search for a model", search),
];

const BOTTOM: (usize, Side) = (1, Side::Min);
const TOP: (usize, Side) = (1, Side::Max);

fn rubber() -> Rubber {
    Rubber::neo_hookean(0.5, 100.0).unwrap()
}

fn coarse() -> Scheme {
    Scheme::default().particles([5, 5])
}

fn slab() -> Scene<2> {
    Scene::new(Block::new([1.0, 0.0], [3.0, 1.0]), PlaneStrain, rubber()).hold(BOTTOM)
}

fn sheared() -> Scene<2> {
    slab().with(Condition::on(TOP).displacement([0.1, -0.02]))
}

fn nothing<const D: usize>(_: &Problem<D>, _: &EquilibriumPath) -> Result<Vec<f64>, Error> {
    Ok(Vec::new())
}

fn block(a: &mut Args) -> Result<Heard, Error> {
    let min = a.point("axis|X =|corner", [1.0, 0.0]);
    let max = a.point("axis|X =|corner", [3.0, 1.0]);
    let law = Rubber::neo_hookean(a.number("A_10", 0.5), a.number("bulk", 100.0))?;
    let table = Amplitude::table(a.pairs("table", &[(0.0, 0.0), (0.5, 0.3), (1.0, 1.0)]))?;
    let scene = Scene::new(Block::new(min, max), PlaneStrain, law)
        .name(a.given("empty name", "foot"), a.place("nobody|face (1, Min)|empty name|foot", BOTTOM))
        .hold(a.place("nobody|foot|empty name", "foot"))
        .with(
            Condition::on(a.place("nobody|face (1, Max)|empty name|push", TOP))
                .displacement(a.vector("push|face (1, Max)|displacement", [0.1, -0.02]))
                .amplitude(a.amplitude("amplitude|push"))
                .named(a.given("empty name", "push")),
        )
        .with(
            Load::traction(
                a.place("nobody|face (0, Max)|empty name|X = [1000|wind", Side::Max),
                a.vector("wind|traction", [0.01, 0.0]),
            )
            .amplitude(table)
            .named(a.given("empty name", "wind")),
        )
        .pressure(a.place("nobody|face (0, Min)|empty name|pressure on", Side::Min), a.number("pressure", 0.01))
        .prescribe(
            a.place("nobody|face (0, Max)|empty name", Place::on(Side::Max).within(|x: &Point<2>| x[1] > 0.6)),
            a.index("component", 0),
            a.field("face (0, Max)|u_0", 0.1),
        );
    hear(&scene, &coarse(), nothing)
}

fn scheme(a: &mut Args) -> Result<Heard, Error> {
    let scheme = Scheme::default()
        .particles(a.counts("particle|nodes along an axis|lattice", &[6, 5]))
        .dilation(a.number("r =|dilation|support", 1.3))
        .order(a.count("order|basis", 1) as u8)
        .rcond_limit(a.number("reciprocal condition", 1e-8))
        .layout(Layout::Jittered { amount: a.number("jitter", 0.1), seed: 1 })
        .pressure_field(PressureField::Linear, a.count("pressure zone", 2))
        .rule(Rule::Gauss { zones: None, points: Some(a.count("Gauss points|points", 2)) })
        .memory(a.count("memory|limit", 1 << 30) as u64);
    hear(&sheared(), &scheme, nothing)?;
    let gauss = coarse().integration_zones(a.counts("zone|number for each axis|lattice", &[2, 2]));
    hear(&sheared(), &gauss, nothing)?;
    let smoothed = coarse().rule(Rule::Smoothed { parts: a.count("sub-cells", 2) });
    hear(&sheared(), &smoothed, nothing)?;
    let neighbours = coarse().dilation(Dilation::Neighbour {
        rank: a.count("neighbour", 4),
        factor: a.number("r =|dilation|support|factor", 1.5),
    });
    hear(&sheared(), &neighbours, nothing)?;
    let spaced = Scheme::default().spacing(a.number("spacing", 0.4));
    hear(&sheared(), &spaced, nothing)?;
    let elements = Scheme::elements(a.count("order", 2) as u8).particles(a.counts("particle|elements|nodes", &[5, 5]));
    hear(&sheared(), &elements, nothing)
}

fn stepping(a: &mut Args) -> Result<Heard, Error> {
    let newton =
        Newton { iterations: a.count("iterations", 30), tolerance: a.number("tolerance", 1e-8), ..Newton::default() };
    let stepping = Stepping {
        first: a.number("first", 0.5),
        smallest: a.number("smallest", 1e-3),
        largest: a.number("largest", 0.5),
        growth: a.number("growth", 1.5),
        quick: a.count("quick", 6),
        steps: a.count("steps", 50),
        time_tolerance: a.number("time", 0.01),
        ..Stepping::default()
    };
    hear(&sheared(), &coarse().newton(newton).stepping(stepping), nothing)?;
    hear(&sheared(), &coarse().stepping(Stepping::equal(a.count("steps|increment", 3))), nothing)
}

fn results(a: &mut Args) -> Result<Heard, Error> {
    let longer = Scene::new(Block::new([1.0, 0.0], [4.0, 1.5]), PlaneStrain, rubber())
        .hold(BOTTOM)
        .with(Condition::on(TOP).displacement([0.1, -0.02]));
    hear(&sheared(), &coarse(), |problem, path| {
        let states = states(path, &longer, &coarse(), &Scheme::default().particles([3, 3]))?;
        const STATE: &str = "another problem";
        let at = a.point("outside|X =", [2.0, 0.5]);
        let mut numbers = problem.displacement(a.state(STATE, &states), &at.into())?.as_slice().to_vec();
        let at = a.point("outside|X =", [2.0, 0.5]);
        numbers.push(problem.stress(a.state(STATE, &states), &at.into())?[(0, 0)]);
        let place = a.place("nobody|\"\"|face (1, Max)|no condition|X =", TOP);
        numbers.push(problem.reaction(a.state(STATE, &states), place)?[0]);
        let place = a.place("nobody|\"\"|face (1, Max)|no condition|X =", TOP);
        let about = a.vector("moment|about", [2.0, 0.5]);
        numbers.push(problem.moment(a.state(STATE, &states), place, about)?[2]);
        numbers.push(problem.energy(a.state(STATE, &states))?);
        numbers.push(problem.stresses(a.state(STATE, &states))?[0][(0, 0)]);
        numbers.push(problem.deformation_gradients(a.state(STATE, &states))?[0][(0, 0)]);
        numbers.push(problem.pressures(a.state(STATE, &states))?.map_or(0.0, |p| p[0]));
        numbers.push(problem.particle_displacements(a.state(STATE, &states))?[0][0]);
        problem.picture(a.state(STATE, &states), Field::LargestStretch)?;
        problem.vtk_grid(a.state(STATE, &states))?;
        problem.neutral_motions(a.state(STATE, &states))?;
        problem.stress_field(a.state(STATE, &states))?.at_particles()?;
        problem.transfer(problem, a.state(STATE, &states))?;
        problem.states_at(path, &a.numbers("load factor", &[0.5]))?;
        let deflection = problem.deflection(&a.point("outside|X =", [2.0, 0.5]).into(), a.index("component", 1))?;
        problem.run_controlled(&deflection, &a.numbers("target", &[-0.005]), &mut ())?;
        let quantities = [
            Quantity::displacement(a.point("outside|X =", [2.0, 0.5]), a.index("component", 1)),
            Quantity::reaction(a.place("nobody|\"\"|face (1, Max)|no condition|X =", TOP), a.index("component", 0)),
            Quantity::moment(
                a.place("nobody|\"\"|face (1, Max)|no condition|X =", TOP),
                a.vector("moment|about", [2.0, 0.5]),
                a.index("component", 2),
            ),
            Quantity::volume(),
            Quantity::energy(),
        ];
        for quantity in quantities {
            numbers.push(quantity.evaluate(problem, a.state(STATE, &states))?);
        }
        // A path of another problem.
        let mut resumed = path.clone();
        if let Some(step) = resumed.steps.last_mut() {
            step.state = a.state(STATE, &states).clone();
        }
        problem.resume(resumed, &mut ())?;
        Ok(numbers)
    })
}

fn tube(a: &mut Args) -> Result<Heard, Error> {
    let inner = a.number("radius|axis 0", 1.0);
    let law = Rubber::mooney_rivlin(a.number("A_10", 0.4), a.number("A_01", 0.1), a.number("bulk", 100.0))?;
    let scene = Scene::new(Block::new([inner, 0.0], [2.0, 1.0]), Axisymmetric, law)
        .prescribe(Side::Min, 0, a.number("u_0|face (0, Min)", 0.05))
        .prescribe(a.place("nobody|face (1, Min)|empty name", BOTTOM), a.index("component", 1), a.number("u_1", 0.0))
        .with(Load::normal_elastic_foundation(
            a.place("nobody|face (0, Max)|empty name", Side::Max),
            a.number("foundation", 0.3),
        ))
        .with(Load::elastic_foundation(a.place("nobody|face (1, Max)|empty name", TOP), a.number("foundation", 0.3)))
        .with(Load::force(
            a.place("nobody|face (1, Max)|empty name|X =|force", TOP),
            a.vector("force|face (1, Max)", [0.0, 0.01]),
        ))
        .with(Load::body_force(a.vector("body force", [0.0, -0.01])))
        .with_expansion(a.number("expansion", 1.01));
    hear(&scene, &coarse(), nothing)?;
    let varied = slab().with_expansion(a.field("expansion", 1.01));
    hear(&varied, &coarse(), nothing)
}

fn region(a: &mut Args) -> Result<Heard, Error> {
    let outline = Outline::at(a.point("outline|[", [0.0, 0.0]))
        .line(a.given("empty name", "bottom"), a.point("outline|[", [2.0, 0.0]))
        .arc(
            a.given("empty name", "right"),
            a.point("outline|[", [2.0, 1.0]),
            a.point("outline|[", [2.0, 0.5]),
            Turn::Left,
        )
        .line("top", [0.0, 1.0])
        .close(a.given("empty name", "left"));
    let centre = a.point("hole|outline|[", [1.0, 0.5]);
    let hole = Outline::circle(a.given("empty name", "hole"), centre, a.number("radius", 0.2));
    let region = Region::with_holes(outline, [hole])?.with_tolerance(a.number("tolerance", 0.02))?;
    let sheet = PlaneStress { thickness: a.number("thickness|measure", 0.5) };
    let law = Rubber::yeoh(a.number("A_10", 0.5), a.number("A_20", -0.02), a.number("A_30", 0.002), 100.0)?;
    let around = Direction::tangential(a.vector("direction|centre", [1.0, 0.5]), [0.0, 0.0, 1.0]);
    let away = Direction::radial(a.vector("direction|centre", [1.0, 0.5]), [0.0, 0.0, 1.0]);
    let scene = Scene::new(region, sheet, law).hold(a.place("nobody|left|empty name", "left")).with(
        Condition::on(a.place("nobody|hole|empty name", "hole"))
            .along(around, a.number("hole", 0.002))
            .along(away, a.field("hole", 0.001)),
    );
    let fine = a.number("spacing|grading", 0.8);
    let scheme =
        Scheme::default().spacing(a.number("spacing", 0.4)).graded(move |x| if x[0] > 1.5 { 1.0 } else { fine });
    let scheme = scheme.seed(a.count("seed", 3) as u64);
    hear(&scene, &scheme, nothing)?;
    let counted = Scheme::default().particles(a.counts("particle", &[6]));
    hear(&scene, &counted, nothing)
}

fn squares() -> (Vec<Point<2>>, Vec<usize>) {
    let points = (0..9).map(|k| Point::<2>::new((k % 3) as f64, (k / 3) as f64)).collect();
    (points, [0, 1, 3, 4].iter().flat_map(|&k| [k, k + 1, k + 4, k + 3]).collect())
}

fn mesh_2d(a: &mut Args) -> Result<Heard, Error> {
    let (points, corners) = squares();
    let mut points = a.list("node|point|X =|used", &points, Point::<2>::new(9.0, 9.0));
    let moved = a.point("node|inverted|finite|cell", [1.1, 1.1]);
    if points.len() > 4 {
        points[4] = moved.into();
    }
    let blocks = [
        (CellShape::Quadrangle, a.list("corners|cell|element", &corners, 0)),
        (CellShape::Line, a.list("corners|group|element", &[0, 1, 1, 2], 0)),
    ];
    let sides = a.list("group|element|foot", &[4, 5], 77);
    let mesh = Mesh::new(points, &blocks, &[(a.given("empty name", "foot").into(), sides)])?;
    let scene = Scene::new(mesh, PlaneStrain, rubber())
        .hold(a.place("nobody|foot|empty name", "foot"))
        .with(Load::force(Place::at(a.point("outside|finite|X =", [1.0, 2.0])), a.vector("force|load", [0.0, -0.02])))
        .with(Load::elastic_foundation(a.place("nobody|body|empty name", Place::body()), a.number("foundation", 0.1)));
    hear(&scene, &Scheme::default().order(a.count("order|terms", 1) as u8), nothing)
}

fn block_3d(a: &mut Args) -> Result<Heard, Error> {
    let block = Block::new([0.0; 3], a.point("axis|X =|unstable", [1.0, 1.0, 1.0]));
    let law = Rubber::ogden(a.list("terms|pair|constant", &[(0.4, 2.0), (0.1, 1.5)], (-5.0, 2.0)), 50.0)?;
    let slide = Direction::Along(a.vector("direction", [0.0, 1.0, 0.0]));
    let scene = Scene::new(block, Solid, law)
        .hold(a.place("nobody|face (2, Min)|empty name", (2, Side::Min)))
        .rigid(a.given("empty name", "plate"), a.place("nobody|face (2, Max)|empty name|plate", (2, Side::Max)))
        .with(Condition::on(a.name("nobody|empty name", "plate")).component(a.index("component", 2), -0.02))
        .with(Condition::on(Side::Min).along(slide, a.number("face (0, Min)", 0.0)))
        .with(Load::moment(a.name("nobody|empty name", "plate"), a.vector("moment|plate", [0.0, 0.0, 0.01])))
        .with(Load::force(
            a.place("nobody|empty name|X =|plate|force", "plate"),
            a.vector("force|plate", [0.01, 0.0, 0.0]),
        ))
        .with(Load::body_force(a.vector("body force", [0.0, 0.0, -0.01])));
    hear(&scene, &Scheme::default().particles([3, 3, 3]), |problem, path| {
        let motion = problem.rigid_motion(path.last(), a.name("nobody|\"\"", "plate"))?;
        Ok(motion.displacement.as_slice().to_vec())
    })
}

fn mesh_3d(a: &mut Args) -> Result<Heard, Error> {
    let points: Vec<Point<3>> =
        (0..27).map(|k| Point::<3>::new((k % 3) as f64, (k / 3 % 3) as f64, (k / 9) as f64)).collect();
    let hexahedron = |k: usize| [k, k + 1, k + 4, k + 3, k + 9, k + 10, k + 13, k + 12];
    let corners: Vec<usize> = [0, 1, 3, 4, 9, 10, 12, 13].into_iter().flat_map(hexahedron).collect();
    let below: Vec<usize> = [0, 1, 3, 4].iter().flat_map(|&k| [k, k + 1, k + 4, k + 3]).collect();
    let blocks = [
        (CellShape::Hexahedron, a.list("corners|cell|node|element", &corners, 0)),
        (CellShape::Quadrangle, a.list("corners|group|element", &below, 0)),
    ];
    let mesh = Mesh::new(
        a.list("node|point|used", &points, Point::<3>::repeat(9.0)),
        &blocks,
        &[
            ("foot".into(), a.list("group|element|foot", &[8, 9, 10, 11], 77)),
            ("rubber".into(), a.list("group|element|rubber|pressures", &[0, 1, 2, 3, 4, 5, 6, 7], 8)),
        ],
    )?;
    let turn = Direction::tangential(
        a.vector("direction|centre", [3.0, 3.0, 0.0]),
        a.vector("axis|direction", [0.0, 0.0, 1.0]),
    );
    let scene = Scene::new(mesh.body(a.name("nobody|\"\"", "rubber"))?, Solid, rubber())
        .hold(a.place("nobody|foot|empty name", "foot"))
        .with(
            Condition::on(Place::on(Part::Whole).within(|x: &Point<3>| x[2] > 1.6 && x[0] < 0.6))
                .along(turn, a.number("u along|whole", 0.02)),
        );
    hear(&scene, &Scheme::default(), nothing)
}

/// The facets of a box, as an STL file has them.
fn box_of(size: [f64; 3]) -> Vec<u8> {
    let corner = |k: usize| [(k & 1) as f64 * size[0], (k >> 1 & 1) as f64 * size[1], (k >> 2) as f64 * size[2]];
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let mut text = String::from("solid box\n");
    for [p, q, r, s] in quads {
        for [x, y, z] in [[p, q, r], [p, r, s]] {
            text += "facet normal 0 0 0\nouter loop\n";
            for [u, v, w] in [x, y, z].map(corner) {
                text += &format!("vertex {u} {v} {w}\n");
            }
            text += "endloop\nendfacet\n";
        }
    }
    (text + "endsolid box\n").into_bytes()
}

fn stl(a: &mut Args) -> Result<Heard, Error> {
    let bytes = a.list("STL|byte|facet|file", &box_of([2.0, 1.0, 1.0]), b'!');
    let part = Solid3::parse_stl(&bytes)?
        .name(
            a.given("empty name", "foot"),
            Select::plane(a.point("foot|plane", [0.0, 0.0, 0.0]), a.vector("foot|normal", [-1.0, 0.0, 0.0]))
                .within(a.number("foot|distance", 1e-3))
                .angle(a.number("foot|angle", 0.1)),
        )?
        .name("head", Select::nearest(a.point("head|point|nearest", [2.0, 0.5, 0.5])))?
        .name("side", Select::block(a.point("side|block", [0.0, 0.0, 0.0]), a.vector("side|block", [2.0, 0.0, 1.0])))?
        .name("patch", Select::patch(a.index("patch", 2)))?;
    let scene = Scene::new(part, Solid, rubber()).hold(a.place("nobody|foot|empty name", "foot")).prescribe(
        a.place("nobody|head|empty name", "head"),
        0,
        a.number("head", 0.05),
    );
    hear(&scene, &Scheme::default().spacing(a.number("spacing", 0.5)), nothing)
}

fn shapes(a: &mut Args) -> Result<Heard, Error> {
    let drum = Shape::cylinder(
        a.point("cylinder|cone|spacing|too large", [0.0, 0.0, 0.0]),
        a.point("cylinder|cone|spacing|too large", [0.0, 0.0, 1.0]),
        a.number("radius", 1.0),
    )
    .named(a.given("empty name", "drum"));
    let bore = Shape::cylinder([0.0, 0.0, -1.0], [0.0, 0.0, 2.0], a.number("radius", 0.5))
        .rotated(a.vector("axis", [0.0, 0.0, 1.0]), a.number("angle", 0.3))
        .translated(a.vector("translation|shift|shape", [0.0, 0.0, 0.0]));
    let ball = Shape::sphere(a.point("sphere", [0.0, 0.0, 0.5]), a.number("radius", 0.6));
    let ring = Shape::torus(
        a.point("torus", [0.0, 0.0, 0.5]),
        a.vector("axis", [0.0, 0.0, 1.0]),
        a.number("torus", 0.4),
        a.number("torus", 0.1),
    );
    let cut = Shape::half_space(a.point("half space|nothing", [0.0, 0.0, 0.9]), a.vector("normal", [0.0, 0.0, 1.0]));
    drum.clone().minus(bore).minus(ball).minus(ring).intersect(cut).solid(a.number("spacing", 0.4))?;
    let scene = Scene::new(drum.solid(0.5)?, Solid, rubber()).hold(a.place("nobody|drum|empty name", "drum"));
    scene.with(Load::body_force([0.0, 0.0, -0.01])).discretize(&Scheme::default().spacing(1.0))?.run()?.completed()?;
    let level = {
        let radius = a.number("nothing is inside", 0.8);
        Shape::level_set(a.point("block|extent|grid", [-1.0; 3]), a.point("block|extent|grid", [1.0; 3]), move |x| {
            x.norm() - radius
        })
    };
    level.solid(a.number("spacing", 0.4))?;
    Ok(heard())
}

fn voxels(a: &mut Args) -> Result<Heard, Error> {
    let counts = [a.count("voxel", 3), a.count("voxel", 3), a.count("voxel", 3)];
    let values: Vec<f64> = (0..27).map(|k| if k == 13 { 1.0 } else { 0.0 }).collect();
    let mut values = a.list("voxel", &values, 0.0);
    if values.len() > 5 {
        values[5] = a.number("value of a voxel|voxel", 0.1);
    }
    let shape = Shape::voxels(counts, a.vector("voxel", [1.0, 1.0, 1.0]), values, a.number("threshold", 0.5))?;
    shape.solid(a.number("spacing", 0.3))?;
    Ok(heard())
}

fn plane(a: &mut Args) -> Result<Heard, Error> {
    let plate = RigidSurface::plane(a.point("plate", [2.0, 1.05]), a.vector("plate|normal", [0.0, -1.0]))
        .moving_along(a.vector("plate|motion", [0.0, -0.1]), a.amplitude("plate|amplitude"))
        .friction(a.number("friction", 0.3))
        .named(a.given("empty name", "plate"));
    let scene = slab().contact(a.place("nobody|empty name|plate|contact", TOP), plate);
    let asked = |problem: &Problem<2>, path: &EquilibriumPath| {
        let state = problem.contact(path.last(), a.name("nobody|\"\"", "plate"))?;
        let work = problem.friction_work(path, a.name("nobody|\"\"", "plate"))?;
        Ok(vec![state.force[0], state.force[1], state.depth.unwrap_or(0.0), work])
    };
    hear(&scene, &coarse(), asked)?;
    let pushed =
        RigidSurface::plane([2.0, 1.0], [0.0, -1.0]).pushed(a.vector("force|pushed|plane|move freely", [0.0, -0.05]));
    hear(&slab().contact(TOP, pushed), &coarse(), nothing)?;
    let inside = RigidSurface::plane([2.0, 0.97], [0.0, -1.0]).interference(a.number("interference", 0.5));
    hear(&slab().contact(TOP, inside), &coarse(), nothing)
}

fn shafts(a: &mut Args) -> Result<Heard, Error> {
    let shaft = RigidSurface::shaft(a.point("shaft", [2.0, 4.01]), a.number("radius", 3.0))
        .moving(a.vector("shaft|motion", [0.0, -0.06]))
        .turning(a.point("shaft|turn", [2.0, 4.01]), a.number("turn|angle", 0.02));
    hear(&slab().contact(TOP, shaft.friction(0.2)), &coarse(), nothing)?;
    let driven = RigidSurface::plane([2.0, 1.0], [0.0, -1.0])
        .moving([0.0, -0.05])
        .driven(a.point("plane|turn", [2.0, 1.0]), a.number("moment|plane", 0.001));
    hear(&slab().contact(TOP, driven), &coarse(), nothing)?;
    let corner = Profile::at(a.point("profile", [1.8, 3.0]))
        .line(a.point("profile", [1.8, 1.22]))
        .arc(a.point("profile", [2.0, 1.02]), a.point("profile", [2.0, 1.22]), Turn::Left)
        .line(a.point("profile", [3.5, 1.02]));
    let profile = RigidSurface::profile(corner).moving(a.vector("profile|motion", [0.0, -0.05]));
    hear(&slab().contact(TOP, profile), &coarse(), nothing)
}

fn surfaces_3d(a: &mut Args) -> Result<Heard, Error> {
    let cube = || Scene::new(Block::new([0.0; 3], [1.0; 3]), Solid, rubber()).hold((2, Side::Min));
    let scheme = Scheme::default().particles([3, 3, 3]);
    let surfaces = [
        RigidSurface::sphere(a.point("sphere", [0.5, 0.5, 2.0]), a.number("radius", 0.95)),
        RigidSurface::cylinder(
            a.point("cylinder", [0.5, 0.5, 2.0]),
            a.vector("cylinder|axis", [0.0, 1.0, 0.0]),
            a.number("radius", 0.95),
        ),
        RigidSurface::cone(
            a.point("cone", [0.5, 0.5, 1.05]),
            a.vector("cone|axis", [0.0, 0.0, 1.0]),
            a.number("angle", 1.4),
        ),
        RigidSurface::plane([0.5, 0.5, 1.0], [0.0, 0.0, -1.0]).turning(
            a.point("plane|turn", [0.5, 0.5, 1.0]),
            a.vector("axis", [0.0, 1.0, 0.0]),
            a.number("turn|angle", 0.05),
        ),
    ];
    for surface in surfaces {
        let surface = surface.moving(a.vector("motion|sphere|cylinder|cone|plane", [0.0, 0.0, -0.25]));
        hear(&cube().contact((2, Side::Max), surface), &scheme, nothing)?;
    }
    Ok(heard())
}

fn two_bodies(a: &mut Args) -> Result<Heard, Error> {
    let pair = ContactPair::between(
        a.place("nobody|empty name|fit|face (1, Max)", Place::on(TOP).of("lower")),
        a.place("nobody|empty name|fit|face (1, Min)", Place::on(BOTTOM).of("upper")),
        a.given("empty name", "fit"),
    )
    .friction(a.number("friction", 0.2));
    let fine = a.counts("particle|nodes along an axis|lattice", &[5, 3]);
    let scene = Scene::assembly(PlaneStrain)
        .body(a.given("empty name|\"lower\"", "lower"), Block::new([0.0, 0.0], [2.0, 1.0]), rubber())
        .body("upper", Block::new([0.5, 1.0], a.point("axis|X =|outside|bodies", [1.5, 1.5])), rubber())
        .body("cap", Block::new([0.5, 1.5], [1.5, 1.8]), rubber())
        .unbonded(a.name("nobody|\"\"", "lower"), a.name("nobody|\"\"", "upper"))
        .scheme_of(a.name("nobody|\"\"", "lower"), move |scheme| scheme.particles(fine.clone()))
        .hold(a.place("nobody|empty name|lower", Place::on(BOTTOM).of("lower")))
        .with(Condition::on(Place::on(TOP).of("cap")).displacement(a.vector("face (1, Max)", [0.05, -0.05])))
        .with(pair);
    hear(&scene, &Scheme::default().particles([3, 3]), |problem, path| {
        Ok(vec![problem.contact(path.last(), a.name("nobody|\"\"", "fit"))?.force[1]])
    })
}

fn press_fit(a: &mut Args) -> Result<Heard, Error> {
    let scene = Scene::assembly(PlaneStrain)
        .body("lower", Block::new([0.0, 0.0], [1.0, 1.0]), rubber())
        .body("upper", Block::new([0.0, 0.95], [1.0, 1.95]), rubber())
        .hold(Place::on(BOTTOM).of("lower"))
        .hold(Place::on(TOP).of("upper"));
    let fit = ContactPair::between(Place::on(TOP).of("lower"), Place::on(BOTTOM).of("upper"), "fit");
    let pressed = scene.clone().with(fit.interference(a.number("interference", 0.5)));
    hear(&pressed, &Scheme::default().particles([3, 3]), nothing)?;
    let named = scene.press_fit(
        a.place("nobody|empty name|fit|face (1, Max)", Place::on(TOP).of("lower")),
        a.place("nobody|empty name|fit|face (1, Min)", Place::on(BOTTOM).of("upper")),
        a.given("empty name", "fit"),
    );
    hear(&named, &Scheme::default().particles([3, 3]), nothing)?;
    let fold = sheared()
        .contact_itself(a.place("nobody|empty name|fold|face (0, Max)", Side::Max), a.given("empty name", "fold"));
    hear(&fold, &coarse(), nothing)
}

fn stages(a: &mut Args) -> Result<Heard, Error> {
    let plate = RigidSurface::plane([2.0, 1.0], [0.0, -1.0]).moving([0.0, -0.05]).named("plate");
    let pressed = slab().contact(TOP, plate).with(Load::traction(Side::Max, [0.01, 0.0]).named("wind"));
    let (wind, moved, by) =
        (a.name("nobody|\"\"", "wind"), a.name("nobody|\"\"", "plate"), a.vector("motion|plate", [0.0, -0.03]));
    let stages = Stages::new(a.given("empty name", "press"), pressed)
        .then(a.given("empty name", "further"), move |scene| scene.without(wind).move_on(moved, by))
        .stepping(Stepping { first: a.number("first", 0.5), ..Stepping::default() });
    let done = stages.run(&coarse())?;
    for stage in &done {
        stage.path.clone().completed()?;
    }
    // Paths of another history.
    let other = Scene::new(Block::new([1.0, 0.0], [4.0, 1.5]), PlaneStrain, rubber()).hold(BOTTOM);
    let first = states(&done[0].path, &other, &coarse(), &Scheme::default().particles([3, 3]))?;
    let mut path = done[0].path.clone();
    if let Some(step) = path.steps.last_mut() {
        step.state = a.state("another problem|does not belong", &first).clone();
    }
    stages.resume(&coarse(), vec![path], &mut ())?;
    Ok(heard())
}

fn time(a: &mut Args) -> Result<Heard, Error> {
    let prony = Prony::of_instantaneous(a.pairs("tau|g_|pair", &[(0.3, 1.0), (0.1, 5.0)]))?;
    let relaxing = |law| Scene::new(Block::new([1.0, 0.0], [3.0, 1.0]), PlaneStrain, Viscoelastic::new(rubber(), law));
    let hold = Amplitude::table(vec![(0.0, 0.0), (0.2, 1.0), (1.0, 1.0)])?;
    let scene = relaxing(prony)
        .hold(BOTTOM)
        .with(Condition::on(TOP).displacement([0.1, 0.0]).amplitude(hold))
        .over_time(a.number("clock|time", 10.0));
    let steps = Stepping { time_tolerance: a.number("time", 0.02), ..Stepping::default() };
    hear(&scene, &coarse().stepping(steps), nothing)?;
    let clocked = relaxing(Prony::of_relaxed(a.pairs("tau|gamma_|pair", &[(0.3, 1.0), (0.1, 5.0)]))?)
        .hold(BOTTOM)
        .traction(TOP, [0.01, 0.0])
        .with_clock(a.amplitude("clock|amplitude|time"));
    hear(&clocked, &coarse().stepping(steps), nothing)?;
    let softening = Mullins::new(rubber(), a.number("constant r", 1.5), a.number("m", 0.5), a.number("beta", 0.1))?;
    let softened = Scene::new(Block::new([1.0, 0.0], [3.0, 1.0]), PlaneStrain, softening).hold(BOTTOM);
    hear(&softened.traction(TOP, [0.01, 0.0]), &coarse(), nothing)
}

fn materials(a: &mut Args) -> Result<Heard, Error> {
    let bulk = a.number("bulk", 100.0);
    Rubber::gent(a.number("mu", 0.4), a.number("J_m", 80.0), bulk)?;
    Rubber::gent_gent(a.number("mu", 0.4), a.number("J_m", 80.0), a.number("C_2", 0.1), bulk)?;
    Rubber::arruda_boyce(a.number("mu", 0.4), a.number("lambda", 5.0), bulk)?;
    Rubber::carroll(
        a.number("constant A|A +", 0.15),
        a.number("constant B|B +", 3e-7),
        a.number("constant C|C/", 0.1),
        bulk,
    )?;
    Rubber::extended_tube(
        a.number("G_c", 0.19),
        a.number("G_e", 0.2),
        a.number("beta", 0.3),
        a.number("delta", 0.1),
        bulk,
    )?;
    Rubber::hencky(a.number("mu", 0.4), bulk)?;
    Rubber::blatz_ko(a.number("mu", 0.4), a.number("nu", 0.3), a.number("f", 0.5))?;
    Rubber::foam([FoamTerm {
        shear: a.number("mu", 0.3),
        exponent: a.number("alpha", 3.0),
        poisson: a.number("nu", 0.2),
    }])?;
    Rubber::polynomial(
        [((1, 0), a.number("A_10", 0.5)), ((a.count("exponent|power|order|A_", 1) as u32, 1), 0.01)],
        bulk,
    )?;
    Ok(heard())
}

fn fit(a: &mut Args) -> Result<Heard, Error> {
    let points = [[1.2, 0.25], [1.5, 0.53], [2.0, 0.88], [3.0, 1.4]];
    let mut points = a.list("test|point|data", &points, [-1.0, 1.0]);
    if let Some(first) = points.first_mut() {
        *first = [a.number("stretch", 1.2), a.number("stress", 0.25)];
    }
    let data = TestData::default().with(Mode::Uniaxial, points)?.weighted(Mode::Uniaxial, a.number("weight", 2.0))?;
    let report = Fit::new(Law::MooneyRivlin)
        .starts(a.count("start", 5))
        .seed(a.count("seed", 2) as u64)
        .bound(a.name("nobody|coefficient", "A_10"), a.vector("bound|A_10", [1e-3, 10.0]))
        .to(&data)?;
    report.rubber(a.number("bulk", 100.0))?;
    let text = a.list("column|row|header|data", b"mode,stretch,nominal_stress\nuniaxial,1.5,0.5\n", b'!');
    TestData::parse(&String::from_utf8_lossy(&text))?;
    Ok(heard())
}

fn search(a: &mut Args) -> Result<Heard, Error> {
    let quantity = Quantity::reaction(TOP, 0).relative_to(a.number("size", 0.01));
    let tolerance = Tolerance {
        error: a.number("tolerance", 0.2),
        quantities: a.list("quantities|nobody", &[quantity], Quantity::reaction("nobody", 0)),
    };
    let budget =
        Budget { unknowns: a.count("unknowns", 200), levels: a.count("levels|models", 3), ..Budget::default() };
    let answer = sheared().solve_within(&tolerance, budget)?;
    if !answer.reached() {
        return Ok(Heard { findings: vec![format!("{:?}", answer.verdict)] });
    }
    Ok(heard())
}
