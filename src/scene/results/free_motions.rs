//! Rigid motions that nothing resists.

use std::fmt;
use std::ops::Range;

use nalgebra::DMatrix;

use super::view::{BodyView, ProblemView};
use crate::assembly::StateRef;
use crate::each::{Each, IntoEach, list_of};
use crate::geometry::{Disjoint, Point, RigidMode};
use crate::linear::vector::dot;
use crate::order;
use crate::scene::Problem;
use crate::scene::definition::contact_definition::{Barred, Law};
use crate::term::Form;

/// Parts of translations and rotations in a motion.
type Parts<'a> = nalgebra::MatrixView<'a, f64, nalgebra::U1, nalgebra::Dyn, nalgebra::U1, nalgebra::Dyn>;

/// Energy of a motion and what rows see of it, squares relative to stiffness and size, below which it is free.
/// Rounding leaves 1e-15; a radial motion of a far, thin ring has 1e-6.
const FREE: f64 = 1e-12;

/// A rigid motion that neither conditions nor energy nor contact resist: $u = t + \Omega\\,(X - X_0)$.
#[derive(Debug, Clone, PartialEq)]
pub struct FreeMotion {
    /// The translation $t$, components relative to the largest displacement of the motion.
    pub translation: Vec<f64>,
    /// $\Omega_{ij} = -\Omega_{ji}$, $i > j$, as (i, j, part of the largest displacement that it gives).
    pub rotations: Vec<(usize, usize, f64)>,
    /// The centre $X_0$ of the rotations: the mean position of the particles \[length\].
    pub centre: Vec<f64>,
    /// The body that can move so alone, where there are several, or the piece of a body that consists of several.
    pub body: Option<String>,
}

impl fmt::Display for FreeMotion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Parts below a hundredth say nothing to a reader.
        let along =
            self.translation.iter().enumerate().map(|(axis, part)| (*part, format!("translation along axis {axis}")));
        let about =
            self.rotations.iter().map(|(i, j, part)| (*part, format!("rotation in the plane of axes {j} and {i}")));
        let parts: Vec<(f64, String)> = along.chain(about).filter(|part| part.0.abs() > 0.01).collect();
        match &parts[..] {
            [(_, motion)] => write!(f, "a {motion}")?,
            parts => write!(f, "{}", parts.mapped(|(part, motion)| format!("{part:.2} of a {motion}")).join(" and "))?,
        }
        match &self.body {
            Some(body) => write!(f, " of {body}"),
            None => Ok(()),
        }
    }
}

/// Combinations of translations and infinitesimal rotations that cost no energy at rest, that no row sees and that no contact
/// bars: of single bodies, where there are several, and of all together. A surface without friction bars the direction of its
/// normal alone, one that is pushed not its own; so does one with friction where `friction` is not to count. A surface that turns freely
/// counts as one that does not.
pub(crate) fn free_motions<const D: usize>(problem: &Problem<D>, friction: bool) -> Vec<FreeMotion> {
    let rest = vec![0.0; problem.model.unknowns()];
    let laws = || problem.contacts.iter().map(|contact| &contact.law);
    let travels: Vec<usize> = laws().filter_map(Law::rigid_dof).collect();
    let barred: Vec<Barred> = laws().flat_map(|law| law.bars(&rest, friction)).collect();
    free_of(&problem.view(), &travels, &barred)
}

/// The nodes that rigid motions move which neither conditions nor energy resist: what nothing but contact can hold. `travels` are the nodes
/// of the travels of surfaces that are pushed, which are among them.
pub(crate) fn unheld(problem: &ProblemView<'_>, travels: Range<u32>) -> Vec<u32> {
    let motions = Motions::of(problem, &travels.clone().map(|node| node as usize).collect::<Vec<_>>());
    let resistance = motions.resistance(problem, &[]);
    let mut free: Vec<u32> = travels.collect();
    if !resistance.iter().all(|r| r.is_finite()) {
        return free;
    }
    let motionless = null_space(resistance);
    for (group, nodes) in motions.groups.iter().enumerate() {
        let parts = motionless.columns(group * motions.modes.len(), motions.modes.len());
        if parts.amax() > FREE.sqrt() {
            free.extend(nodes.iter().map(|&node| node as u32));
        }
    }
    free.sort_unstable();
    free
}

/// As [`free_motions`], with the nodes of the travels of surfaces that are pushed, which are no places, and what contacts bar.
fn free_of(problem: &ProblemView<'_>, travels: &[usize], barred: &[Barred]) -> Vec<FreeMotion> {
    let motions = Motions::of(problem, travels);
    let resistance = motions.resistance(problem, barred);
    if !resistance.iter().all(|r| r.is_finite()) {
        return Vec::new();
    }
    let (m, groups) = (motions.modes.len(), motions.groups.len());
    let mut free = Vec::new();
    let alone = |group: usize| resistance.view((group * m, group * m), (m, m)).into_owned();
    if groups > 1 {
        for (group, name) in motions.names.iter().enumerate() {
            let of_group = null_space(alone(group));
            free.extend(of_group.row_iter().map(|row| motions.named(row, Some(name.clone()))));
        }
    }
    let all = DMatrix::<f64>::from_fn(groups * m, m, |row, k| f64::from(u8::from(row % m == k)));
    for row in null_space(all.transpose() * &resistance * all).row_iter() {
        // What each body may do alone is named already.
        let each = |group: usize| (row * alone(group) * row.transpose())[(0, 0)] <= FREE * row.norm_squared();
        if groups == 1 || !(0..motions.names.len()).all(each) {
            free.push(motions.named(row, None));
        }
    }
    free
}

/// The rigid motions of each group of nodes: the connected pieces of bodies, and the frames of rigid bodies together.
struct Motions {
    dim: usize,
    modes: Vec<RigidMode>,
    groups: Vec<Vec<usize>>,
    /// The names of the pieces, which are the first groups.
    names: Vec<String>,
    centre: Point<3>,
    size: f64,
}

impl Motions {
    fn of(problem: &ProblemView<'_>, travels: &[usize]) -> Self {
        let (positions, dim, bodies) = (problem.positions(), problem.dim, &problem.bodies);
        let (mut groups, mut names) = (Vec::with_capacity(bodies.len()), Vec::with_capacity(bodies.len()));
        for body in bodies {
            let pieces = pieces(problem, *body);
            let several = pieces.len() > 1;
            for piece in pieces {
                names.push(if several { piece_name(body.name(), &piece, problem) } else { body.name().to_string() });
                groups.push(piece);
            }
        }
        let last = bodies.iter().map(|body| body.nodes().end).max().unwrap_or(0);
        let others: Vec<usize> = (last..positions.len()).filter(|node| !travels.contains(node)).collect();
        groups.extend((!others.is_empty()).then_some(others));
        let nodes = || groups.iter().flatten().map(|&node| &positions[node]);
        let centre = nodes().sum::<Point<3>>() / nodes().count() as f64;
        let size = nodes().map(|x| (x - centre).norm()).fold(0.0, f64::max);
        Motions { dim, modes: RigidMode::all(dim), groups, names, centre, size }
    }

    /// A motion at a place, of the size 1 over the body.
    fn at(&self, mode: usize, x: &Point<3>) -> Point<3> {
        self.modes[mode].at(&((x - self.centre) / self.size))
    }

    /// What energy, rows and contact see of all motions of all groups, as squares: relative to stiffness and size.
    fn resistance(&self, problem: &ProblemView<'_>, barred: &[Barred]) -> DMatrix<f64> {
        let (positions, m, dim) = (problem.positions(), self.modes.len(), self.dim);
        let count = self.groups.len() * m;
        // Shape functions reproduce linear fields: their values at the particles are the coefficients.
        let motion = |number: usize| -> Vec<f64> {
            let mut all = vec![0.0; positions.len() * dim];
            for &node in &self.groups[number / m] {
                let moved = self.at(number % m, &positions[node]);
                all[node * dim..][..dim].copy_from_slice(&moved.as_slice()[..dim]);
            }
            all
        };
        let motions: Vec<Vec<f64>> = list_of(count, motion);
        let mut resistance = energies(problem, &motions, self.size);
        let mut see = |seen: &[f64]| {
            for a in 0..count {
                (0..count).for_each(|b| resistance[(a, b)] += seen[a] * seen[b]);
            }
        };
        for row in problem.equations.equations() {
            let scale = row.measure();
            let of = |r: &Vec<f64>| row.value(r) / scale;
            see(&motions.mapped(of));
        }
        let mut group_of = vec![None; positions.len()];
        for (group, nodes) in self.groups.iter().enumerate() {
            nodes.iter().for_each(|&node| group_of[node] = Some(group));
        }
        for barred in barred {
            let (own, other) = (group_of[barred.particle], barred.other.and_then(|other| group_of[other]));
            let seen = |number: usize| {
                let along = self.at(number % m, &barred.at).dot(&barred.direction);
                let counts = |group: Option<usize>| f64::from(u8::from(group == Some(number / m)));
                along * (counts(own) - counts(other))
            };
            see(&list_of(count, seen));
        }
        (&resistance + resistance.transpose()) * 0.5
    }

    fn named(&self, parts: Parts<'_>, body: Option<String>) -> FreeMotion {
        let largest = parts.iter().copied().max_by(|v, w| v.abs().total_cmp(&w.abs())).unwrap_or(1.0);
        let part = |k: usize| parts[k] / largest;
        FreeMotion {
            translation: list_of(self.dim, part),
            rotations: (self.dim..parts.len())
                .map(|k| (self.modes[k].axis, self.modes[k].lower.unwrap_or(0), part(k)))
                .collect(),
            centre: self.centre.as_slice()[..self.dim].to_vec(),
            body,
        }
    }
}

/// The nodes of the connected pieces of a body: those that its clusters couple. One piece where several ranks share the clusters.
fn pieces(problem: &ProblemView<'_>, body: &dyn BodyView) -> Vec<Vec<usize>> {
    let (nodes, clusters) = (body.nodes(), body.clusters());
    if problem.model.ranks().is_some() {
        return vec![nodes.collect()];
    }
    let mut sets = Disjoint::new(nodes.len());
    for cluster in 0..clusters.count() {
        let mut own = clusters.nodes(cluster).iter().filter_map(|&node| (node as usize).checked_sub(nodes.start));
        let Some(first) = own.next() else { continue };
        for node in own.filter(|&node| node < nodes.len()) {
            sets.join(first, node);
        }
    }
    let leaders = list_of(nodes.len(), |node| sets.leader(node));
    let mut pieces = order::grouped(&leaders).into_mapped(|piece| piece.mapped(|node| nodes.start + node));
    // Nodes beyond all clusters have no stiffness and are no piece.
    pieces.retain(|piece| piece.len() > 1);
    pieces
}

/// What a piece of a body is called: by the middle of its particles.
fn piece_name(body: &str, piece: &[usize], problem: &ProblemView<'_>) -> String {
    let middle = piece.iter().map(|&node| problem.position(node)).sum::<Point<3>>() / piece.len() as f64;
    let coordinates: Vec<String> = problem.cut(&middle).mapped(|x| format!("{x:.4}"));
    format!("the separate piece of {body} around X = ({})", coordinates.join(", "))
}

/// Energies of motions of the undeformed bodies, relative to that of the strain 1/size and to the stiffness of other terms; without artificial
/// springs. A rigid motion strains axisymmetric and radial bodies alone, by their hoops, so that no matrix of a body is needed.
fn energies(problem: &ProblemView<'_>, motions: &[Vec<f64>], size: f64) -> DMatrix<f64> {
    let whole = problem.model;
    let model = whole.retained(|term| !term.layout().artificial && !matches!(term.form(), Form::Blocks { .. }));
    let mut assembler = model.assembler();
    let mut system = Default::default();
    assembler.assemble_own(&model, StateRef::new(&vec![0.0; model.unknowns()], &model.start(), 0.0), &mut system);
    let pattern = assembler.pattern();
    let forces = |motion: &Vec<f64>| {
        let mut force = vec![0.0; motion.len()];
        pattern.multiply_add(&system.values, motion, &mut force);
        force
    };
    let forces: Vec<Vec<f64>> = motions.mapped(forces);
    let mut energies = DMatrix::from_fn(motions.len(), motions.len(), |a, b| dot(&motions[a], &forces[b]));
    let stiffest = system.values.iter().fold(0.0, |largest: f64, entry| largest.max(entry.abs()));
    let mut scale = [stiffest * whole.node_count() as f64];
    for body in &problem.bodies {
        let shear = body.material().initial_moduli().shear;
        for (point, weight) in body.weights().iter().enumerate() {
            scale[0] += weight * shear / (size * size);
            if body.hoops().is_empty() {
                continue;
            }
            let gradient = |motion: &Vec<f64>| body.displacement_gradient(point, motion);
            let strains: Vec<_> = motions.iter().map(gradient).map(|h| (h + h.transpose()) * 0.5).collect();
            for (a, strain) in strains.iter().enumerate() {
                strains
                    .iter()
                    .enumerate()
                    .for_each(|(b, other)| energies[(a, b)] += weight * shear * strain.dot(other));
            }
        }
    }
    whole.total(energies.as_mut_slice());
    whole.total(&mut scale);
    energies / scale[0]
}

/// A basis of what a symmetric matrix takes to nothing, in rows: any serves, the reduced one has a translation or rotation of its own
/// in each motion.
fn null_space(matrix: DMatrix<f64>) -> DMatrix<f64> {
    let m = matrix.nrows();
    let spectrum = matrix.symmetric_eigen();
    let free: Vec<usize> = (0..m).filter(|&k| spectrum.eigenvalues[k] <= FREE).collect();
    let mut basis = DMatrix::<f64>::from_fn(free.len(), m, |a, k| spectrum.eigenvectors[(k, free[a])]);
    reduce(&mut basis);
    basis
}

/// Gauss–Jordan elimination with row and column pivots: the rows span the same space.
fn reduce(basis: &mut DMatrix<f64>) {
    let mut used = Vec::new();
    for row in 0..basis.nrows() {
        let column = (0..basis.ncols())
            .filter(|c| !used.contains(c))
            .max_by(|&a, &b| basis[(row, a)].abs().total_cmp(&basis[(row, b)].abs()));
        let Some(column) = column else { return };
        used.push(column);
        let pivot = basis[(row, column)];
        for other in (0..basis.nrows()).filter(|&other| other != row) {
            let factor = basis[(other, column)] / pivot;
            for c in 0..basis.ncols() {
                let change = factor * basis[(row, c)];
                basis[(other, c)] -= change;
            }
        }
    }
}
