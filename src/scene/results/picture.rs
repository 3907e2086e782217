//! Pictures of states: the outer surface of the body, coloured by a field.

use std::collections::{HashMap, HashSet};
use std::f64::consts::PI;

use crate::each::{Each, EachOf, IntoEach, list_of};
use crate::error::Error;
use crate::geometry::{Vec2, Vec3};
use crate::output::{Page, Picture};
use crate::shape::ShapeFunctions;
use crate::solve::{EquilibriumPath, State};
use crate::tensor::{mean, von_mises};

use super::fields::{shape_of, vtk_cell};
use super::view::ProblemView;
use crate::scene::Problem;
use crate::scene::discretisation::frame::RigidShape;

/// A field of a state that a picture shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Field {
    /// The length of the displacement \[length\].
    Displacement,
    /// The largest principal stretch.
    LargestStretch,
    /// Von Mises' equivalent of the Cauchy stress, averaged at the particles \[stress\].
    MisesStress,
    /// The mean of the Cauchy stress, positive in tension, averaged at the particles \[stress\].
    MeanStress,
}

impl Field {
    /// What a bar of colours is labelled with.
    fn label(self) -> &'static str {
        match self {
            Field::Displacement => "displacement",
            Field::LargestStretch => "largest stretch",
            Field::MisesStress => "von Mises stress",
            Field::MeanStress => "mean stress",
        }
    }
}

impl<const D: usize> Problem<D> {
    /// A picture of a state: the body from outside in its current position, coloured by a field. Faces are divided, and their
    /// points move by the shape functions; volumes of a mesh that are rigid bodies are grey.
    ///
    /// ```
    /// use rkpm::prelude::*;
    /// use rkpm::scene::Field;
    /// # let scene = Scene::new(Block::new([0.0; 3], [2.0, 1.0, 1.0]), Solid, Rubber::neo_hookean(0.5, 1e3)?).hold((0, Side::Min));
    /// let problem = scene.discretize(&Scheme::default().particles([5, 3, 3]))?;
    /// let path = problem.run()?.completed()?;
    /// # let directory = std::env::temp_dir().join("rkpm-pictures");
    /// problem.picture(path.last(), Field::LargestStretch)?.title("A bar").write(directory.join("bar.svg"))?;
    /// # Ok::<(), rkpm::Error>(())
    /// ```
    ///
    /// # Errors
    /// For a state of another problem.
    pub fn picture(&self, state: &State, field: Field) -> Result<Picture, Error> {
        self.check_length(state)?;
        self.view().picture(state, field)
    }

    /// A web page on which the body is turned and its steps are run through, from the first to the last state of a path.
    ///
    /// ```
    /// use rkpm::prelude::*;
    /// use rkpm::scene::Field;
    /// # let scene = Scene::new(Block::new([0.0; 3], [2.0, 1.0, 1.0]), Solid, Rubber::neo_hookean(0.5, 1e3)?).hold((0, Side::Min));
    /// let problem = scene.discretize(&Scheme::default().particles([5, 3, 3]))?;
    /// let path = problem.run()?.completed()?;
    /// # let directory = std::env::temp_dir().join("rkpm-pictures");
    /// problem.page(&path, Field::Displacement, "A bar")?.write(directory.join("bar.html"))?;
    /// # Ok::<(), rkpm::Error>(())
    /// ```
    ///
    /// # Errors
    /// For a path of another problem.
    pub fn page(&self, path: &EquilibriumPath, field: Field, title: &str) -> Result<Page, Error> {
        path.states().try_fold(Page::new(title), |page, state| {
            Ok(page.frame(format!("load factor {:.3}", state.load), self.picture(state, field)?))
        })
    }
}

impl ProblemView<'_> {
    fn picture(&self, state: &State, field: Field) -> Result<Picture, Error> {
        let displacements = self.particle_displacements(state)?;
        let stresses = || Ok::<_, Error>(self.at_particles(&self.stresses(state)?));
        let at_particles: Vec<f64> = match field {
            Field::Displacement => Vec::new(),
            Field::LargestStretch => {
                let gradients = self.at_particles(&self.deformation_gradients(state));
                gradients.mapped(|f| f.singular_values().max())
            }
            Field::MisesStress => stresses()?.mapped(von_mises),
            Field::MeanStress => stresses()?.mapped(mean),
        };
        let positions = &self.positions()[..displacements.len()];
        let mut drawn = Drawn::default();
        let mut faces = contact_surface(self.dim, &self.drawn_cells(), positions);
        let (mut bonded, mut rigid): (HashSet<[usize; 2]>, HashMap<[u64; 3], Vec3>) = Default::default();
        for (shape, moved) in self.rigid_shapes(state) {
            let own = faces_beside(self.dim, shape, &mut faces, &mut bonded, positions);
            let points = &shape.points;
            rigid.extend(points.iter().map(bits).zip(moved.iter().copied()));
            let current = points.paired(&moved, |x, u| x + u);
            drawn.add(Divided::new(points, &own, 1), current, &|_| f64::NAN);
        }
        let value = |psi: &ShapeFunctions<3>, u: &Vec3| match field {
            Field::Displacement => u.norm(),
            _ => psi.nodes.pair_sum(&psi.values, |node, part| part * at_particles[*node as usize]),
        };
        for surface in self.drawn_surfaces(state)? {
            let current = surface.points.paired(&surface.displacements, |x, u| x + u);
            let values = surface.functions.paired(&surface.displacements, value);
            let mut divided = Divided::new(&surface.points, &surface.facets, 1);
            divided.lines.clear();
            drawn.add(divided, current, &|k| values[k]);
        }
        if self.dim == 1 {
            return self.ring(field, state, &value);
        }
        let parts = divisions(faces.len());
        for own in &self.bodies {
            let first = own.nodes().start;
            let of_body = faces.iter().filter(|face| own.nodes().contains(&face[0]));
            let of_body: Vec<Vec<usize>> = of_body.map(|face| face.mapped(|corner| corner - first)).collect();
            let divided = Divided::new(&positions[own.nodes()], &of_body, parts);
            let functions = own.values_on(&divided.points, &divided.weights)?;
            let mut moved: Vec<Vec3> = functions.mapped(|psi| own.weighted(psi, state));
            // The rim of a face that is bonded to a rigid body moves with it.
            let rim = |ends: &[usize; 2]| bonded.contains(&ends.each(|corner| first + corner));
            for (line, _) in divided.lines.iter().zip(&divided.ends).filter(|(_, ends)| rim(ends)) {
                let ends = [line[0], line[line.len() - 1]];
                let [from, to] = ends.each(|end| rigid.get(&bits(&divided.points[end])).copied().unwrap_or(moved[end]));
                let part = |k: usize| k as f64 / (line.len() - 1) as f64;
                line.iter().enumerate().for_each(|(k, &point)| moved[point] = from + (to - from) * part(k));
            }
            let functions = functions.into_iter().map(|psi| psi.shifted(first));
            let values: Vec<f64> = functions.zip(&moved).map(|(psi, u)| value(&psi, u)).collect();
            let current = divided.points.paired(&moved, |x, u| x + u);
            drawn.add(divided, current, &|k| values[k]);
        }
        let picture = Picture::of(drawn.points, self.dim < 3, drawn.faces).coloured(field.label(), drawn.values);
        let picture = picture.lines(drawn.lines).at_rest(drawn.rest);
        Ok(if self.dim == 3 { picture.closed() } else { picture })
    }

    /// A quarter of the cut through a cylinder or a sphere whose radial line is the body.
    fn ring(
        &self,
        field: Field,
        state: &State,
        value: &dyn Fn(&ShapeFunctions<3>, &Vec3) -> f64,
    ) -> Result<Picture, Error> {
        let (mut points, mut faces, mut lines, mut values) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for own in &self.bodies {
            for cell in own.drawn() {
                let ends: Vec<Vec3> = cell.mapped(|&end| own.particle(end));
                let functions = own.values_at(&ends)?;
                let moved: Vec<Vec3> = functions.mapped(|psi| own.weighted(psi, state));
                let functions: Vec<_> = functions.into_mapped(|psi| psi.shifted(own.nodes().start));
                let start = points.len();
                for part in 0..=AROUND {
                    let (sine, cosine) = (0.5 * PI * part as f64 / AROUND as f64).sin_cos();
                    for ((x, u), psi) in ends.iter().zip(&moved).zip(&functions) {
                        points.push(Vec2::new(cosine, sine) * (x[0] + u[0]));
                        values.push(value(psi, u));
                    }
                }
                let along = |end: usize| (0..=AROUND).map(move |part| start + 2 * part + end);
                faces.extend((0..AROUND).map(|part| {
                    let corner = start + 2 * part;
                    vec![corner, corner + 1, corner + 3, corner + 2]
                }));
                lines.extend([along(0).collect(), along(1).collect::<Vec<usize>>()]);
                lines.extend([vec![start, start + 1], vec![start + 2 * AROUND, start + 2 * AROUND + 1]]);
            }
        }
        Ok(Picture::new(&points, faces).coloured(field.label(), values).lines(lines))
    }

    /// The cells of all bodies that are drawn, by their particles among all.
    fn drawn_cells(&self) -> Vec<Vec<usize>> {
        let mut all = Vec::new();
        for body in &self.bodies {
            let first = body.nodes().start;
            all.extend(body.drawn().into_iter().map(|corners| corners.into_mapped(|corner| first + corner)));
        }
        all
    }
}

/// The faces of a rigid volume that are seen; faces that it shares with the bodies are inside and taken out of both, their
/// edges are noted.
fn faces_beside(
    dim: usize,
    shape: &RigidShape,
    faces: &mut Vec<Vec<usize>>,
    bonded_edges: &mut HashSet<[usize; 2]>,
    positions: &[Vec3],
) -> Vec<Vec<usize>> {
    let points = &shape.points[..];
    let mut own = contact_surface(dim, &shape.cells, points);
    let place = |corners: &[usize], x: &[Vec3]| {
        let mut place: Vec<[u64; 3]> = corners.mapped(|&c| bits(&x[c]));
        place.sort_unstable();
        place
    };
    let [bonded, rigid]: [HashSet<_>; 2] =
        [(&*faces, positions), (&own, points)].map(|(all, x)| all.iter().map(|face| place(face, x)).collect());
    faces.retain(|face| {
        let seen = !rigid.contains(&place(face, positions));
        if !seen {
            let edges = (0..face.len()).map(|k| sorted([face[k], face[(k + 1) % face.len()]]));
            bonded_edges.extend(edges);
        }
        seen
    });
    own.retain(|face| !bonded.contains(&place(face, points)));
    own
}

/// What a picture is made of, body by body.
#[derive(Default)]
struct Drawn {
    /// Where points are at rest and in the state.
    rest: Vec<Vec3>,
    points: Vec<Vec3>,
    faces: Vec<Vec<usize>>,
    lines: Vec<Vec<usize>>,
    values: Vec<f64>,
}

impl Drawn {
    fn add(&mut self, divided: Divided, current: Vec<Vec3>, value: &dyn Fn(usize) -> f64) {
        let first = self.points.len();
        let shifted = |all: Vec<Vec<usize>>| all.into_iter().map(move |one| one.into_mapped(|p| first + p));
        self.faces.extend(shifted(divided.faces));
        self.lines.extend(shifted(divided.lines));
        self.values.extend((0..current.len()).map(value));
        self.rest.extend(divided.points);
        self.points.extend(current);
    }
}

/// Parts of a quarter turn in pictures of radial lines.
const AROUND: usize = 32;

/// Into how many parts each edge is divided, so that curved faces look smooth: fewer where faces are many.
fn divisions(faces: usize) -> usize {
    (FINE / faces.max(1)).isqrt().clamp(1, 6)
}

/// Small faces of one surface, about as many at most; files stay small and curved edges smooth.
const FINE: usize = 20_000;

/// Faces cut into smaller ones by shared points, with the lines along the edges of the faces that were.
struct Divided {
    points: Vec<Vec3>,
    /// What makes each point of the corners of its face.
    weights: Vec<Vec<(usize, f64)>>,
    faces: Vec<Vec<usize>>,
    lines: Vec<Vec<usize>>,
    /// The corners that a line joins, where edges are divided.
    ends: Vec<[usize; 2]>,
}

impl Divided {
    fn new(points: &[Vec3], faces: &[Vec<usize>], parts: usize) -> Self {
        if parts < 2 {
            let around = |face: &Vec<usize>| face.iter().chain(face.first()).copied().collect();
            return Divided {
                points: points.to_vec(),
                weights: list_of(points.len(), |point| vec![(point, 1.0)]),
                faces: faces.to_vec(),
                lines: faces.mapped(around),
                ends: Vec::new(),
            };
        }
        let (own, weights) = (Vec::new(), Vec::new());
        let mut divided = Divided { points: own, weights, faces: Vec::new(), lines: Vec::new(), ends: Vec::new() };
        let mut corners: HashMap<usize, usize> = HashMap::new();
        let mut edges: HashMap<[usize; 2], Vec<usize>> = HashMap::new();
        for face in faces {
            // From each corner to the next, both ends among the points.
            let sides: Vec<Vec<usize>> = list_of(face.len(), |k| {
                divided.side(points, [face[k], face[(k + 1) % face.len()]], parts, &mut corners, &mut edges)
            });
            match face.len() {
                3 => divided.triangle(&sides, parts),
                4 => divided.quadrilateral(&sides, parts),
                _ => divided.faces.push(sides.iter().flat_map(|side| side[..parts].to_vec()).collect()),
            }
        }
        divided
    }

    fn side(
        &mut self,
        points: &[Vec3],
        ends: [usize; 2],
        parts: usize,
        corners: &mut HashMap<usize, usize>,
        edges: &mut HashMap<[usize; 2], Vec<usize>>,
    ) -> Vec<usize> {
        let edge = sorted(ends);
        let side = edges.entry(edge).or_insert_with(|| {
            let mut corner = |number: usize| {
                *corners.entry(number).or_insert_with(|| {
                    self.points.push(points[number]);
                    self.weights.push(vec![(number, 1.0)]);
                    self.points.len() - 1
                })
            };
            let [from, to] = edge.each(&mut corner);
            let side = self.between(from, to, parts);
            self.lines.push(side.clone());
            self.ends.push(edge);
            side
        });
        if ends == edge { side.clone() } else { side.iter().rev().copied().collect() }
    }

    fn triangle(&mut self, sides: &[Vec<usize>], n: usize) {
        // Rows from the first corner on: row r has r + 1 points, from the third side to the first.
        let mut rows: Vec<Vec<usize>> = vec![vec![sides[0][0]]];
        for r in 1..=n {
            let [left, right] = [sides[2][n - r], sides[0][r]];
            let row = match r == n {
                true => sides[1].iter().rev().copied().collect(),
                false => self.between(left, right, r),
            };
            rows.push(row);
        }
        for r in 0..n {
            for k in 0..=r {
                self.faces.push(vec![rows[r][k], rows[r + 1][k + 1], rows[r + 1][k]]);
                if k < r {
                    self.faces.push(vec![rows[r][k], rows[r][k + 1], rows[r + 1][k + 1]]);
                }
            }
        }
    }

    fn quadrilateral(&mut self, sides: &[Vec<usize>], n: usize) {
        let mut rows: Vec<Vec<usize>> = vec![sides[0].clone()];
        for r in 1..n {
            let row = self.between(sides[3][n - r], sides[1][r], n);
            rows.push(row);
        }
        rows.push(sides[2].iter().rev().copied().collect());
        for (low, high) in rows.iter().zip(&rows[1..]) {
            self.faces.extend((0..n).map(|k| vec![low[k], low[k + 1], high[k + 1], high[k]]));
        }
    }

    /// A row of points from one to another, both with it.
    fn between(&mut self, from: usize, to: usize, n: usize) -> Vec<usize> {
        let [a, b] = [self.points[from], self.points[to]];
        let first = self.points.len();
        for k in 1..n {
            let part = k as f64 / n as f64;
            let of = |end: usize, share: f64| self.weights[end].iter().map(move |&(corner, w)| (corner, share * w));
            let weights = of(from, 1.0 - part).chain(of(to, part)).collect();
            self.points.push(a + (b - a) * part);
            self.weights.push(weights);
        }
        [from].into_iter().chain(first..first + n - 1).chain([to]).collect()
    }
}

fn sorted(ends: [usize; 2]) -> [usize; 2] {
    [ends[0].min(ends[1]), ends[0].max(ends[1])]
}

/// Coordinates as they are stored.
fn bits(x: &Vec3) -> [u64; 3] {
    [x[0].to_bits(), x[1].to_bits(), x[2].to_bits()]
}

/// Faces that one cell alone has, outward; in the plane the cells themselves.
fn contact_surface(dim: usize, cells: &[Vec<usize>], positions: &[Vec3]) -> Vec<Vec<usize>> {
    let cells = cells.iter().map(|corners| vtk_cell(dim, corners, positions));
    if dim < 3 {
        return cells.map(|cell| cell.corners().to_vec()).filter(|corners| corners.len() > 2).collect();
    }
    let mut found: HashMap<Vec<usize>, (Vec<usize>, bool)> = HashMap::new();
    let mut order = Vec::new();
    for cell in cells {
        let Some(shape) = shape_of(&cell).filter(|shape| shape.dimension() == dim) else { continue };
        let corners = cell.corners();
        let centre = corners.iter().map(|&c| positions[c]).sum::<Vec3>() / corners.len() as f64;
        for face in shape.faces() {
            let mut face: Vec<usize> = face.mapped(|&k| corners[k]);
            let mut key = face.clone();
            key.sort_unstable();
            let [a, b, c] = [0, 1, face.len() - 1].each(|k| positions[face[k]]);
            if crate::mesh::spanned(&[b - a, c - a, a - centre]) < 0.0 {
                face.reverse();
            }
            found.entry(key.clone()).and_modify(|(_, alone)| *alone = false).or_insert_with(|| {
                order.push(key);
                (face, true)
            });
        }
    }
    order.iter().filter_map(|key| found.get(key)).filter(|(_, alone)| *alone).map(|(face, _)| face.clone()).collect()
}
