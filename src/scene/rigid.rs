//! Rigid bodies: faces tied to six degrees of freedom, three in the plane, held, moved or loaded.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{Matrix3, Rotation3, SMatrix};

use crate::assembly::Model;
use crate::boundary::{Constraints, Row};
use crate::error::{BoundaryError, Error, GeometryError};
use crate::geometry::{Part, Point};
use crate::mesh::Mesh;
use crate::quadrature::Points;
use crate::solve::State;
use crate::table::ShapeTable;
use crate::term::{Amplitude, Element, Pointwise, Term, View};

use super::conditions::Placed;
use super::discretize::Unmeasured;
use super::load::{LoadKind, dead};
use super::place::Spot;
use super::{Place, Problem, Scene, Source, Value};

/// Stiffness of the frame that finds its reactions, in terms of the stiffest body beside it: what is left of a strain of
/// the frame falls by about this factor with each iteration.
const FIRM: f64 = 10.0;

impl<const D: usize> Scene<D> {
    /// Ties a part to a rigid body of a name, a bonded plate or insert: all of the part moves as one, by translation and
    /// finite rotation. Several parts may be tied to one body. Where the part is a volume of a mesh (an area in the plane), its
    /// cells are left out, and what they share faces with is tied.
    ///
    /// By its name the body is held (`hold`), moved ([`Condition`](super::Condition)), and loaded by a force
    /// ([`Load::force`](super::Load::force)) or a moment ([`Load::moment`](super::Load::moment)). A condition by the name
    /// prescribes the displacement of all its points, so that it does not turn unless the values say so; one at a point,
    /// `Place::at(x).of("plate")`, leaves it free to turn about that point. What no condition prescribes is free, and follows
    /// from the loads. [`Problem::reaction`] and [`Problem::moment`] by the name are what the body exerts on the parts.
    ///
    /// ```
    /// use rkpm::prelude::*;
    /// // A rubber block under a bonded plate that is pushed aside beneath a dead weight, free to turn.
    /// let block = Scene::new(Block::new([0.0, 0.0], [2.0, 2.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3)?)
    ///     .hold((1, Side::Min))
    ///     .rigid("plate", (1, Side::Max))
    ///     .with(Condition::on(Place::at([1.0, 2.0]).of("plate")).component(0, 0.5).named("push"))
    ///     .with(Load::force("plate", [0.0, -0.1]));
    /// let problem = block.discretize(&Scheme::default().particles([9, 9]))?;
    /// let path = problem.run(&mut ())?.completed()?;
    /// let plate = problem.rigid_motion(path.last(), "plate")?;
    /// assert!(plate.rotation[(0, 1)] > 0.01); // it leans forward
    /// assert!((problem.reaction(path.last(), "plate")?[1] + 0.1).abs() < 1e-9);
    /// # Ok::<(), rkpm::Error>(())
    /// ```
    pub fn rigid(mut self, name: impl Into<String>, place: impl Into<Place<D>>) -> Self {
        self.rigids.push((name.into(), place.into()));
        self
    }

    /// The volumes of a mesh that are rigid bodies: groups of cells that no faces have the name of.
    pub(super) fn rigid_volumes<'a>(&'a self, mesh: &Mesh<D>) -> Vec<&'a str> {
        let named = self.rigids.iter().filter_map(|(_, place)| match &place.spot {
            Spot::Part(Part::Named(name)) if place.within.is_none() => Some(name.as_str()),
            _ => None,
        });
        let mut volumes: Vec<&str> = named.filter(|name| mesh.is_volume(name)).collect();
        volumes.sort_unstable();
        volumes.dedup();
        volumes
    }

    /// The volumes of meshes that a rigid body stands for.
    fn rigid_shapes(&self, name: &str) -> Result<Vec<Arc<Mesh<D>>>, Error> {
        let own =
            Scene { rigids: self.rigids.iter().filter(|rigid| rigid.0 == name).cloned().collect(), ..self.clone() };
        let mut shapes = Vec::new();
        for body in &self.bodies {
            let Source::Mesh(mesh) = &body.source else { continue };
            for volume in own.rigid_volumes(mesh) {
                shapes.push(Arc::new(mesh.body(volume)?));
            }
        }
        Ok(shapes)
    }

    /// The names of the rigid bodies, each once.
    pub(super) fn rigid_names(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        for (name, _) in &self.rigids {
            if !names.contains(&name.as_str()) {
                names.push(name);
            }
        }
        names
    }

    /// The rigid body that a place is, by its number; and the point of it, where it is one.
    pub(super) fn rigid_at(&self, place: &Place<D>) -> Option<(usize, Option<Point<D>>)> {
        let find = |asked: &str| self.rigid_names().iter().position(|name| *name == asked);
        match (&place.spot, &place.of) {
            (Spot::Part(Part::Named(name)), None) => Some((find(name)?, None)),
            (Spot::Point(at), Some(name)) => Some((find(name)?, Some(*at))),
            _ => None,
        }
    }
}

/// A rigid body of a problem: an affine frame of $D + 1$ nodes that keeps its shape.
#[derive(Debug, Clone)]
pub(crate) struct Frame<const D: usize> {
    pub name: String,
    /// Its first node.
    pub first: usize,
    pub centre: Point<D>,
    pub size: f64,
    /// The volumes of a mesh that it stands for, to be drawn.
    pub shapes: Vec<Arc<Mesh<D>>>,
}

impl<const D: usize> Frame<D> {
    /// The frame of rows that tie a face to it, around their middle; rows count the nodes among all.
    pub(super) fn around(name: &str, first: usize, rows: &[&Row], positions: &[Point<D>]) -> Result<Self, Error> {
        let (mut total, mut moment) = (0.0, Point::<D>::zeros());
        for row in rows.iter().filter(|row| row.dependent % D == 0) {
            for &(k, c) in row.entries.iter().filter(|entry| entry.0 % D == 0) {
                total += c;
                moment += positions[k / D] * c;
            }
        }
        if !(total != 0.0) {
            let what = format!("rigid body {name}, all of whose parts other conditions prescribe,");
            return Err(BoundaryError::Incomplete { what }.into());
        }
        let centre = moment / total;
        let nodes = rows.iter().flat_map(|row| row.entries.iter().map(|entry| entry.0 / D));
        let size = nodes.map(|node| (positions[node] - centre).norm()).fold(f64::MIN_POSITIVE, f64::max);
        Ok(Frame { name: name.to_string(), first, centre, size, shapes: Vec::new() })
    }

    pub(super) fn positions(&self) -> impl Iterator<Item = Point<D>> + '_ {
        let corner = |k: usize| Point::<D>::from_fn(|i, _| if i + 1 == k { self.size } else { 0.0 });
        (0..=D).map(move |k| self.centre + corner(k))
    }

    pub(super) fn nodes(&self) -> Range<usize> {
        self.first..self.first + D + 1
    }

    /// The values of the frame's functions at a point.
    pub(super) fn values(&self, at: &Point<D>) -> [f64; 4] {
        let local = (at - self.centre) / self.size;
        std::array::from_fn(|k| match k {
            0 => 1.0 - local.sum(),
            k if k <= D => local[k - 1],
            _ => 0.0,
        })
    }

    /// What rows that weigh displacements of a body have to take off, so that they weigh the difference from the frame's.
    /// Functions of bodies reproduce linear fields: their coefficients and positions tell the sums of the frame's.
    pub(super) fn counterpart(&self, row: &Row, positions: &[Point<D>]) -> Vec<(usize, f64)> {
        let mut sums = [[0.0; 3]; 4];
        for &(k, c) in &row.entries {
            let values = self.values(&positions[k / D]);
            sums.iter_mut().zip(values).for_each(|(sum, value)| sum[k % D] -= c * value);
        }
        let all = (0..=D).flat_map(|k| (0..D).map(move |i| (k, i)));
        let entries = all.map(|(k, i)| ((self.first + k) * D + i, sums[k][i]));
        entries.filter(|entry| entry.1 != 0.0).collect()
    }

    /// $F - 1$ of the frame.
    fn gradient(&self, displacement: &[f64]) -> SMatrix<f64, D, D> {
        let d = |k: usize, i: usize| displacement[(self.first + k) * D + i];
        SMatrix::from_fn(|i, j| (d(j + 1, i) - d(0, i)) / self.size)
    }

    pub(super) fn displacement(&self, at: &Point<D>, displacement: &[f64]) -> Point<D> {
        let values = self.values(at);
        Point::from_fn(|i, _| (0..=D).map(|k| values[k] * displacement[(self.first + k) * D + i]).sum())
    }

    /// Adds the rows of a condition on the body: at a point of it, or at all its nodes.
    pub(super) fn prescribe(
        &self,
        rows: &mut Constraints,
        condition: &super::Condition<D>,
        point: Option<Point<D>>,
    ) -> Result<(), Error> {
        let at: Vec<Point<D>> = point.map_or_else(|| self.positions().collect(), |at| vec![at]);
        for (direction, value) in &condition.prescribed {
            let label = condition.label(direction);
            if let Value::Motion(_) = value {
                rows.add_knots(condition.amplitude.break_points());
            }
            for x in &at {
                let unit = direction.unit(&label, x, &Point::zeros())?;
                let (target, amplitude) = match value {
                    Value::Motion(motion) => {
                        let (motion, amplitude, x) = (motion.clone(), condition.amplitude.clone(), *x);
                        let value = move |load: f64| motion(&x, amplitude.evaluate(load).0);
                        (1.0, Amplitude::Function(Arc::new(value)))
                    }
                    value => (value.at(x, 1.0), condition.amplitude.clone()),
                };
                let values = self.values(x);
                let all = (0..=D).flat_map(|k| (0..D).map(move |i| (k, i)));
                let entries = all.map(|(k, i)| ((self.first + k) * D + i, values[k] * unit[i]));
                let entries: Vec<(usize, f64)> = entries.filter(|entry| entry.1.abs() > 1e-14).collect();
                let largest = entries.iter().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
                let dependent = largest.map_or(self.first * D, |entry| entry.0);
                rows.push(Row { entries, dependent, target, amplitude, label: label.clone() })?;
            }
        }
        Ok(())
    }

    /// Adds a load on the body, at a point of it or at its centre.
    pub(super) fn load(
        &self,
        model: &mut Model<D>,
        load: &super::Load<D>,
        point: Option<Point<D>>,
    ) -> Result<(), Error> {
        let total = model.positions().len();
        match &load.kind {
            LoadKind::Total(force) => {
                let at = point.unwrap_or(self.centre);
                let (values, first) = (self.values(&at), self.first as u32);
                let table = ShapeTable::tabulate::<()>(total, &Points::single(at), &Unmeasured, |_, _, psi| {
                    psi.nodes = (first..=first + D as u32).collect();
                    psi.values = values[..=D].to_vec();
                    psi.gradients = vec![Point::zeros(); D + 1];
                    psi.rcond = 1.0;
                    Ok(())
                })?;
                model.add_whole(Pointwise::new(table, dead(force, &load.amplitude)));
            }
            LoadKind::Moment(moment) => {
                let (moment, amplitude) = (*moment, load.amplitude.clone());
                model.add_whole(Turning { frame: self.clone(), nodes: self.numbers(), moment, amplitude });
            }
            _ => {
                let what = "a load on a rigid body other than a force or a moment";
                let needed = "Load::force or Load::moment; pressures act on the parts that are tied to it";
                return Err(GeometryError::Unsuited { what, needed }.into());
            }
        }
        Ok(())
    }

    fn numbers(&self) -> Vec<u32> {
        self.nodes().map(|node| node as u32).collect()
    }

    /// The term that keeps the frame's shape beside bodies of the given moduli (first of the tangent, shear).
    pub(super) fn stay(&self, modulus: f64, shear: f64) -> impl Term<D> + 'static {
        let measure = self.size.powi(D as i32);
        Rigidity {
            frame: self.clone(),
            nodes: self.numbers(),
            stiffness: FIRM * modulus * measure,
            unit: shear * measure,
        }
    }
}

/// $E = \tfrac12(F^T F - 1) = 0$ for a frame, by multipliers $\pi$ that are found as a stiffness would find them and kept from one
/// iteration to the next: $\delta\pi = c\\,(E + \delta E)$ until $E$ vanishes. The stiffness changes the way, not the state.
struct Rigidity<const D: usize> {
    frame: Frame<D>,
    nodes: Vec<u32>,
    stiffness: f64,
    /// What multipliers are measured in.
    unit: f64,
}

/// Pairs (i, j), i ≤ j, of the components of a symmetric tensor.
fn pairs<const D: usize>() -> impl Iterator<Item = (usize, usize)> {
    (0..D).flat_map(|i| (i..D).map(move |j| (i, j)))
}

impl<const D: usize> Rigidity<D> {
    const COUNT: usize = D * (D + 1) / 2;

    /// $E$ component by component, shear ones doubled.
    fn strains(&self, h: &SMatrix<f64, D, D>) -> Vec<f64> {
        let e = (h + h.transpose() + h.transpose() * h) * 0.5;
        pairs::<D>().map(|(i, j)| if i == j { e[(i, i)] } else { 2.0 * e[(i, j)] }).collect()
    }

    /// Slopes of a strain over the unknowns of the frame.
    fn slopes(&self, h: &SMatrix<f64, D, D>) -> Vec<Vec<f64>> {
        let f = SMatrix::<f64, D, D>::identity() + h;
        // ∂F_mJ/∂d_km: 1/size for k = J + 1, −1/size for k = 0.
        let along = |k: usize, axis: usize| match k {
            0 => -1.0 / self.frame.size,
            k if k == axis + 1 => 1.0 / self.frame.size,
            _ => 0.0,
        };
        let slope = |(i, j): (usize, usize), k: usize, m: usize| {
            let both = along(k, i) * f[(m, j)] + along(k, j) * f[(m, i)];
            if i == j { 0.5 * both } else { both }
        };
        pairs::<D>().map(|pair| (0..=D).flat_map(|k| (0..D).map(move |m| slope(pair, k, m))).collect()).collect()
    }
}

impl<const D: usize> Term<D> for Rigidity<D> {
    fn clusters(&self) -> usize {
        1
    }

    fn nodes(&self, _: usize) -> &[u32] {
        &self.nodes
    }

    fn condensed(&self, _: usize) -> Range<usize> {
        // The first is their measure, one for all time: multipliers that vanish are settled.
        0..1 + Self::COUNT
    }

    fn start(&self, _: usize, condensed: &mut [f64]) {
        condensed.fill(0.0);
        condensed[0] = 1.0;
    }

    fn matrix_follows_load(&self) -> bool {
        false
    }

    fn linearize(&self, _: usize, view: View<'_>, out: &mut Element) {
        let h = self.frame.gradient(view.displacement);
        let (strains, slopes) = (self.strains(&h), self.slopes(&h));
        let size = (D + 1) * D;
        for ((strain, slope), pi) in strains.iter().zip(&slopes).zip(&view.condensed[1..]) {
            let force = self.unit * pi + self.stiffness * strain;
            out.residual.iter_mut().zip(slope).for_each(|(r, s)| *r += force * s);
        }
        if !out.with_matrix {
            return;
        }
        for slope in &slopes {
            for (column, a) in slope.iter().enumerate() {
                for (row, b) in slope.iter().enumerate() {
                    out.matrix[column * size + row] += self.stiffness * a * b;
                }
            }
        }
        // π : ∂²E, with the same component at both ends.
        let square = self.frame.size * self.frame.size;
        for ((i, j), pi) in pairs::<D>().zip(&view.condensed[1..]) {
            let pi = self.unit * pi / square;
            let ends = [(i + 1, 1.0), (0, -1.0)];
            let others = [(j + 1, 1.0), (0, -1.0)];
            for (a, x) in ends {
                for (b, y) in others {
                    for m in 0..D {
                        let value = if i == j { pi * x * y } else { 0.5 * 2.0 * pi * x * y };
                        if i == j {
                            out.matrix[(b * D + m) * size + a * D + m] += value;
                        } else {
                            out.matrix[(b * D + m) * size + a * D + m] += value;
                            out.matrix[(a * D + m) * size + b * D + m] += value;
                        }
                    }
                }
            }
        }
    }

    fn advance(&self, _: usize, view: View<'_>, step: &[f64], condensed_step: &mut [f64]) -> f64 {
        let h = self.frame.gradient(view.displacement);
        condensed_step[0] = 0.0;
        let range = self.frame.first * D..(self.frame.first + D + 1) * D;
        for ((strain, slope), out) in self.strains(&h).iter().zip(self.slopes(&h)).zip(&mut condensed_step[1..]) {
            let change: f64 = slope.iter().zip(&step[range.clone()]).map(|(s, d)| s * d).sum();
            *out = self.stiffness * (strain + change) / self.unit;
        }
        1.0
    }
}

/// A moment on a frame: virtual work $M\cdot\delta\omega$, $\delta\omega$ the axial vector of $\delta F F^{-1}$.
struct Turning<const D: usize> {
    frame: Frame<D>,
    nodes: Vec<u32>,
    moment: [f64; 3],
    amplitude: Amplitude,
}

impl<const D: usize> Turning<D> {
    /// $\tfrac12 M_k\varepsilon_{kij}$, with which $\partial\Pi/\partial F = \hat M F$ for a rotation $F$.
    fn turning(&self) -> SMatrix<f64, D, D> {
        let [x, y, z] = self.moment;
        let all = Matrix3::new(0.0, z, -y, -z, 0.0, x, y, -x, 0.0) * 0.5;
        SMatrix::from_fn(|i, j| all[(i, j)])
    }

    fn slope(&self, k: usize, axis: usize) -> f64 {
        match k {
            0 => -1.0 / self.frame.size,
            k if k == axis + 1 => 1.0 / self.frame.size,
            _ => 0.0,
        }
    }
}

impl<const D: usize> Term<D> for Turning<D> {
    fn clusters(&self) -> usize {
        1
    }

    fn nodes(&self, _: usize) -> &[u32] {
        &self.nodes
    }

    fn is_symmetric(&self) -> bool {
        false
    }

    fn break_points(&self) -> Vec<f64> {
        self.amplitude.break_points()
    }

    fn linearize(&self, _: usize, view: View<'_>, out: &mut Element) {
        let (factor, change) = self.amplitude.evaluate(view.load);
        let f = SMatrix::<f64, D, D>::identity() + self.frame.gradient(view.displacement);
        let turning = self.turning();
        let stress = turning * f;
        let size = (D + 1) * D;
        for k in 0..=D {
            for i in 0..D {
                let force: f64 = (0..D).map(|axis| stress[(i, axis)] * self.slope(k, axis)).sum();
                out.residual[k * D + i] += factor * force;
                out.load_slope[k * D + i] += change * force;
            }
        }
        if !out.with_matrix {
            return;
        }
        for k in 0..=D {
            for l in 0..=D {
                let both: f64 = (0..D).map(|axis| self.slope(k, axis) * self.slope(l, axis)).sum();
                for i in 0..D {
                    for j in 0..D {
                        out.matrix[(l * D + j) * size + k * D + i] += factor * turning[(i, j)] * both;
                    }
                }
            }
        }
    }
}

/// How a rigid body has moved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigidMotion<const D: usize> {
    /// Where its middle was at rest \[length\].
    pub centre: Point<D>,
    /// The displacement of the middle \[length\].
    pub displacement: Point<D>,
    /// The rotation, a proper orthogonal matrix.
    pub rotation: SMatrix<f64, D, D>,
}

/// A volume of a mesh that is rigid, as it is drawn in a state.
pub(super) struct RigidShape<'a, const D: usize> {
    pub mesh: &'a Mesh<D>,
    /// Corners in the order of [`Cells::corners`](crate::cells::Cells::corners).
    pub cells: Vec<Vec<usize>>,
    pub displacements: Vec<Point<D>>,
}

impl<const D: usize> Problem<D> {
    /// The volumes that are rigid bodies in a state.
    pub(super) fn rigid_shapes(&self, state: &State) -> Vec<RigidShape<'_, D>> {
        let all = self.frames.iter().flat_map(|frame| frame.shapes.iter().map(move |mesh| (frame, &**mesh)));
        all.map(|(frame, mesh)| {
            let displacements = mesh.points().iter().map(|x| frame.displacement(x, &state.displacement)).collect();
            let cells = (0..mesh.cell_count()).map(|cell| mesh.lattice_corners(cell)).collect();
            RigidShape { mesh, cells, displacements }
        })
        .collect()
    }
}

impl<const D: usize> RigidMotion<D> {
    /// The rotation vector \[rad\]: along the axis, as long as the angle, which is at most π; in the plane its third component
    /// alone.
    pub fn rotation_vector(&self) -> [f64; 3] {
        let whole = Matrix3::from_fn(|i, j| match i < D && j < D {
            true => self.rotation[(i, j)],
            false => f64::from(u8::from(i == j)),
        });
        Rotation3::from_matrix_unchecked(whole).scaled_axis().into()
    }
}

impl<const D: usize> Problem<D> {
    /// How a rigid body of a name has moved in a state.
    ///
    /// # Errors
    /// Where no rigid body has the name, with those that there are; for a state of another problem.
    pub fn rigid_motion(&self, state: &State, name: &str) -> Result<RigidMotion<D>, Error> {
        self.check_length(state)?;
        let Some(frame) = self.frames.iter().find(|frame| frame.name == name) else {
            let known = self.frames.iter().map(|frame| frame.name.as_str()).collect::<Vec<_>>().join("; ");
            return Err(BoundaryError::UnknownBody { asked: name.to_string(), known }.into());
        };
        let rotation = SMatrix::identity() + frame.gradient(&state.displacement);
        let displacement = frame.displacement(&frame.centre, &state.displacement);
        Ok(RigidMotion { centre: frame.centre, displacement, rotation })
    }

    /// The displacements of the frames of another problem at the nodes of those of this one.
    pub(super) fn transfer_frames(&self, from: &Problem<D>, state: &State, guess: &mut State) {
        for frame in &self.frames {
            let Some(other) = from.frames.iter().find(|other| other.name == frame.name) else { continue };
            for (node, x) in frame.nodes().zip(frame.positions()) {
                let u = other.displacement(&x, &state.displacement);
                guess.displacement[node * D..(node + 1) * D].copy_from_slice(u.as_slice());
            }
        }
    }
}

/// Puts the frames of rigid bodies behind the rows that tie parts to them.
pub(super) fn frames<const D: usize>(
    scene: &Scene<D>,
    ties: &[(usize, Range<usize>)],
    rows: &mut Constraints,
    placed: &mut Vec<Placed<D>>,
    positions: &mut Vec<Point<D>>,
) -> Result<Vec<Frame<D>>, Error> {
    let names = scene.rigid_names();
    if names.is_empty() {
        return Ok(Vec::new());
    }
    if D < 2 || !scene.kinematics.hoop_components().is_empty() {
        let (what, needed) = ("a rigid body where the kinematics has no rotations", "plane strain or a body in space");
        return Err(GeometryError::Unsuited { what, needed }.into());
    }
    let particles = positions.len();
    let mut frames = Vec::with_capacity(names.len());
    for (number, name) in names.into_iter().enumerate() {
        let numbers = || ties.iter().filter(|tie| tie.0 == number).flat_map(|tie| tie.1.clone());
        let own: Vec<&Row> = numbers().filter_map(|k| rows.rows().get(k)).collect();
        let mut frame = Frame::around(name, positions.len(), &own, positions)?;
        frame.shapes = scene.rigid_shapes(name)?;
        for k in numbers() {
            let entries = frame.counterpart(&rows.rows()[k], positions);
            rows.extend_row(k, entries);
        }
        for (_, range) in ties.iter().filter(|tie| tie.0 == number) {
            let (name, place, nodes) = (Some(name.to_string()), Place::body(), 0..particles);
            placed.push(Placed { name, place, rows: range.clone(), nodes });
        }
        positions.extend(frame.positions());
        frames.push(frame);
    }
    for condition in &scene.conditions {
        let place = scene.resolve(&condition.place);
        let Some((number, point)) = scene.rigid_at(&place) else { continue };
        let first = rows.len();
        frames[number].prescribe(rows, condition, point)?;
        let (name, nodes) = (condition.name.clone(), frames[number].nodes());
        placed.push(Placed { name, place, rows: first..rows.len(), nodes });
    }
    Ok(frames)
}

/// Refuses rigid bodies that neither conditions nor springs nor contacts may hold.
pub(super) fn held<const D: usize>(
    scene: &Scene<D>,
    frames: &[Frame<D>],
    rows: &Constraints,
    positions: &[Point<D>],
) -> Result<(), Error> {
    let springs = |load: &super::Load<D>| matches!(load.kind, LoadKind::Integrand(_) | LoadKind::Pressure(_));
    let Some(frame) = frames.first() else { return Ok(()) };
    if !scene.contacts.is_empty()
        || !scene.meetings.is_empty()
        || scene.loads.iter().any(springs)
        || super::contact::holds(rows, positions, false)
    {
        return Ok(());
    }
    Err(BoundaryError::Free { name: frame.name.clone() }.into())
}
