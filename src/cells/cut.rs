//! A lattice of particles in a closed surface, its bricks cut by the surface.

mod connected;
mod faces;
mod features;
mod frame;
mod grid;
mod parts;
mod placing;
mod polygon;
mod roots;
mod rules;
mod sections;
mod split;
mod traces;
mod tree;
mod zoning;

use std::cell::OnceCell;
use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::SymmetricEigen;

use crate::each::{Each, EachOf, IntoEach, array_of};
use crate::error::{ApproximationError, GeometryError, Invalid};
use crate::geometry::{Cubes, Mat3, Part, Vec3, double_area, mean};
use crate::order;
use crate::particles::{Particles, Support, check_dilation};
use crate::quadrature::{Points, check_halves, check_point_count};
use crate::rows::Rows;
use crate::solid::{OPPOSITE, Solid3};

use super::inertia::Inertia;
use super::zones::{collect, join_by_sides};
use super::{BoundaryCells, Cells, Connections, EDGE, Smoothing, TraceChoice, ZoneParticles, Zones};
use connected::{Divisions, SubCells, Whole};
use faces::Faces;
use features::Features;
use frame::{Frame, dominant_axes};
use grid::Grid;
use parts::{NONE, Parts, each_triangle};
use placing::{Placed, Placing};
use rules::Rules;
use sections::Sections;
use split::{Patch, Split, by_brick};

use traces::{OnPiece, Place, Site, Spread, assign};
use tree::Wanted;
use zoning::{FEWEST, Inner};

/// Bricks between particles along each axis.
const STEP: i32 = 2;
/// Distance within which particles tell whether they follow a wall, in half spacings: as far as supports reach.
const NEAR: f64 = 4.0;
/// Variance of those across a wall below which they stand in one layer: that of two layers a third of a spacing apart.
const LAYER: f64 = 0.1;
/// Walls with fewer spacings across are refined where nothing is said about them: with particles within half a spacing of the surface moved
/// onto it they have one layer inside, and zones with one layer have no pressure that varies across the wall.
const LEAST_ACROSS: f64 = 2.5;
/// Spacings across those at least: averages over sub-cells leave out $1/(2n)^2$ of the energy of bending. Halvings give up to six.
const ACROSS: f64 = 3.0;
/// Halvings for the sake of walls where nothing is said about them: with a fourth one a wall would have 4096 times as many particles per volume.
const HALVINGS: u32 = 3;
/// Rounding of the columns of a rotation.
const ROTATION: f64 = 1e-9;
/// Distance from free particles beyond which those on the surface count as free, in bricks: a body is thin there.
const THIN: f64 = 5.0;

/// A lattice of particles in a closed surface: particles near the surface lie on its corners, sharp edges and faces, and bricks between
/// particles are cut by it exactly.
///
/// Cells are the connected parts of bricks; sub-cells those of bricks of half the spacing, small ones joined to their neighbours. Away
/// from the surface all is as in a [`Lattice`](super::Lattice). Where it is [`refined`](CutLattice::refined) blocks of two cells per
/// direction, the default's zones of pressure, are halved; cells that touch finer ones have sub-cells of a quarter of their spacing.
///
/// ```
/// use rkpm::cells::{Cells, CutLattice};
/// use rkpm::geometry::Point;
/// use rkpm::solid::Solid3;
/// let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(Point::<3>::from);
/// let solid = Solid3::new(corners.to_vec(), vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])?;
/// let cells = CutLattice::new(&solid, 0.2)?;
/// let volume: f64 = cells.smoothing(2, 2, &cells.zones(2))?.volumes().iter().sum();
/// assert!((volume - 1.0 / 6.0).abs() < 1e-14);
/// # Ok::<(), rkpm::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct CutLattice {
    frame: Frame,
    grid: Grid,
    by_brick: Rows,
    /// Parts of bricks of half a spacing, small ones joined to their neighbours.
    sub_cells: Arc<SubCells>,
    /// The sub-cells of each cell.
    cells: Vec<Vec<u32>>,
    features: Features,
    placed: Placed,
    positions: Vec<Vec3>,
    names: Vec<(String, Vec<u32>)>,
    /// Walls that are left with too few spacings across.
    left: Option<GeometryError>,
}

fn check_spacing(spacing: f64) -> Result<(), GeometryError> {
    match spacing > 0.0 && spacing.is_finite() {
        true => Ok(()),
        false => Err(Invalid::new("particle spacing", spacing, "give a finite length above zero").into()),
    }
}

impl CutLattice {
    /// A lattice of a spacing \[length\] in a solid, its axes along the largest plane faces, where there are some.
    ///
    /// # Errors
    /// For a spacing that is not positive or too small, and where it is too wide for the solid.
    pub fn new(solid: &Solid3, spacing: f64) -> Result<Self, GeometryError> {
        Self::of_solid(solid, spacing, dominant_axes(solid.vertices(), solid.facets()), None)
    }

    /// The same refined locally: macro cells of two cells per direction are halved again and again where a wall is thinner than `across`
    /// spacings (none for zero) or the `grading`, the spacing wanted at a place \[length\] over the largest one, asks for it, down to
    /// spacings of 1/16; those that touch differ by one halving at most.
    ///
    /// A wall is where the surface faces away from itself within 10°. The grading is taken at the particles' places.
    ///
    /// ```
    /// use rkpm::cells::{Cells, CutLattice};
    /// use rkpm::prelude::*;
    /// let plate = Shape::block([0.0; 3], [1.0, 1.0, 0.1]).solid(0.1)?;
    /// assert!(CutLattice::new(&plate, 0.25).is_err()); // a wall thinner than half the spacing
    /// let cells = CutLattice::refined(&plate, 0.25, 1, |_| 1.0)?;
    /// assert_eq!(cells.spacings(0)[0], 0.0625);
    /// # Ok::<(), rkpm::Error>(())
    /// ```
    ///
    /// # Errors
    /// As [`new`](CutLattice::new), for a grading below 1/16, and for walls that need a smaller spacing than that.
    pub fn refined(
        solid: &Solid3,
        spacing: f64,
        across: usize,
        grading: impl Fn(&Vec3) -> f64,
    ) -> Result<Self, GeometryError> {
        let across = across as f64;
        let found = OnceCell::new();
        let (thinnest, sampled) = (0.0, false);
        let wanted = Wanted { solid, spacing, fewest: across, across, grading: &grading, thinnest, sampled, found };
        Self::of_solid(solid, spacing, dominant_axes(solid.vertices(), solid.facets()), Some(&wanted))
    }

    /// The same by a grading, if there is one, and where a wall has less than [`LEAST_ACROSS`] spacings, which then has [`ACROSS`],
    /// unless that takes too many particles.
    pub(crate) fn walled(
        solid: &Solid3,
        spacing: f64,
        grading: Option<&dyn Fn(&Vec3) -> f64>,
    ) -> Result<Self, GeometryError> {
        let even = |_: &Vec3| 1.0;
        let (fewest, across) = (LEAST_ACROSS, ACROSS);
        let (thinnest, sampled) = (across / f64::from(1 << HALVINGS), true);
        let grade = grading.unwrap_or(&even);
        let by = |found| Wanted { solid, spacing, fewest, across, grading: grade, thinnest, sampled, found };
        check_spacing(spacing)?;
        let wanted = by(OnceCell::new());
        let axes = dominant_axes(solid.vertices(), solid.facets());
        let bare = by(OnceCell::from(Vec::new()));
        if !wanted.has_walls() {
            return Self::of_solid(solid, spacing, axes, grading.map(|_| &bare));
        }
        let (frame, grid) = Frame::around(solid.vertices(), axes, spacing, 1)?;
        // About a particle a cell.
        let cells = (grid::MACRO / STEP as usize).pow(3);
        let particles = |wanted: &Wanted| {
            let (leaves, _) = wanted.macros(&frame, grid.counts)?;
            Ok::<_, GeometryError>((cells * wanted.inside(&leaves, &frame)) as f64)
        };
        if particles(&wanted)? > particles(&bare)? + super::walls::MOST {
            let mut lattice = Self::of_solid(solid, spacing, axes, grading.map(|_| &bare))?;
            lattice.left = wanted.left();
            return Ok(lattice);
        }
        if grading.is_none() {
            wanted.check_walls()?;
        }
        Self::of_solid(solid, spacing, axes, Some(&wanted))
    }

    /// The same as [`new`](CutLattice::new) with axes of one's own, the columns of a rotation.
    ///
    /// # Errors
    /// As [`new`](CutLattice::new), and for a matrix that is no rotation.
    pub fn with_axes(solid: &Solid3, spacing: f64, axes: Mat3) -> Result<Self, GeometryError> {
        let off = (axes.transpose() * axes - Mat3::identity()).norm().max((axes.determinant() - 1.0).abs());
        ensure!(
            off < ROTATION,
            Invalid::new(
                "distance of the axes of a lattice from a rotation",
                off,
                "give orthogonal unit columns, right-handed"
            )
        );
        Self::of_solid(solid, spacing, Some(axes), None)
    }

    fn of_solid(
        solid: &Solid3,
        spacing: f64,
        axes: Option<Mat3>,
        wanted: Option<&Wanted>,
    ) -> Result<Self, GeometryError> {
        check_spacing(spacing)?;
        let (vertices, facets) = (solid.vertices(), solid.facets());
        let named = |name: &str| Ok((name.to_string(), solid.facets_of(name)?.to_vec()));
        let names = solid.names().map(named).collect::<Result<Vec<(String, Vec<u32>)>, GeometryError>>()?;
        let (mut frame, mut grid) = Frame::around(vertices, axes, spacing, 1)?;
        if let Some(wanted) = wanted {
            let (macros, deepest) = wanted.macros(&frame, grid.counts)?;
            (frame, grid) = Frame::around(vertices, axes, spacing, 1 << deepest)?;
            grid = grid.with_macros(deepest, macros.into_iter());
        }
        let corners: Vec<Vec3> = vertices.mapped(|x| frame.local(x));
        let split = Split::new(&corners, facets);
        let by_brick = by_brick(&split, grid.len(), |place| grid.brick(place));
        let sections = Sections::new(&split, grid.clone());
        let mut parts = Parts::new(&split, &by_brick, &sections).in_leaves(&sections).joined(&sections);
        let (cell_of, count) = parts.connected(|brick| grid.block(brick, STEP as usize));
        let mut cells: Vec<Vec<u32>> = vec![Vec::new(); count];
        cell_of.iter().enumerate().for_each(|(part, cell)| cells[*cell as usize].push(part as u32));
        let features = Features::new(&corners, facets, &marks(facets.len(), &names));
        for part in &mut parts.parts {
            let plane = |patch: u32| plane_of(&grid, &split, &features, patch);
            order::sort(&mut part.patches, &|&a, &b| (plane(a), a).cmp(&(plane(b), b)));
        }
        let mut sub_cells = SubCells::new(split, sections, parts);
        sub_cells.divisions = Divisions::new(&sub_cells, &features.normals);
        let split = &sub_cells.split;
        let placed = Placing { split, by_brick: &by_brick, grid: &grid, features: &features }.place(&sub_cells);
        let positions = placed.positions.mapped(|u| frame.place(u));
        let lattice = CutLattice {
            frame,
            grid,
            by_brick,
            sub_cells: Arc::new(sub_cells),
            cells,
            features,
            placed,
            positions,
            names,
            left: None,
        };
        lattice.check()?;
        Ok(lattice)
    }

    fn check(&self) -> Result<(), GeometryError> {
        ensure!(
            self.positions.len() >= 4 && !self.cells.is_empty(),
            GeometryError::Count {
                what: "particles in a part",
                count: self.positions.len(),
                needed: "give a narrower spacing: four at least are needed"
            }
        );
        if let Some((thickness, size, at)) = self.thinnest() {
            let (spacing, thickness) = (f64::from(STEP) * size * self.frame.size, thickness * size * self.frame.size);
            let at = self.frame.place(&at).as_slice().to_vec();
            return Err(GeometryError::ThinWall { thickness, at, spacing, needed: 2.0 * thickness });
        }
        Ok(())
    }

    /// The thinnest wall below half a spacing, in half spacings, half the spacing there in bricks, and where: between facets that look away
    /// from each other.
    fn thinnest(&self) -> Option<(f64, f64, Vec3)> {
        let normal = |patch: u32| self.features.normals[self.sub_cells.split.patches[patch as usize].facet as usize];
        let area = |patch: u32| double_area(&self.sub_cells.split.corners(patch)).norm();
        let placing = self.placing();
        let in_brick = |brick: usize| self.by_brick.row(brick).iter().map(move |&patch| (brick as u32, patch));
        let mut by_leaf: Vec<(u32, u32)> = (0..self.grid.len()).flat_map(in_brick).collect();
        by_leaf.iter_mut().for_each(|own| own.0 = self.grid.leaf_of(own.0));
        order::sort(&mut by_leaf, &|a, b| a.0.cmp(&b.0));
        let mut thinnest: Option<(f64, f64, Vec3)> = None;
        for own in by_leaf.chunk_by(|a, b| a.0 == b.0) {
            let largest = own.iter().map(|own| own.1).max_by(|a, b| area(*a).total_cmp(&area(*b)).then(b.cmp(a)));
            let Some(patch) = largest else { continue };
            let (from, inward) = (mean(&self.sub_cells.split.corners(patch)), -normal(patch));
            let size = f64::from(self.half_spacing(own[0].0));
            let to = from + inward * size;
            for other in placing.near(&from, size).filter(|other| normal(*other).dot(&inward) > OPPOSITE) {
                let corners = self.sub_cells.split.corners(other);
                let thickness = (corners[0] - from).dot(&normal(other)) / inward.dot(&normal(other)) / size;
                if thickness > 0.0
                    && thickness < thinnest.map_or(1.0, |known| known.0)
                    && crosses(&from, &to, &corners)
                    && !self.is_followed(&from, size)
                {
                    thinnest = Some((thickness, size, from));
                }
            }
        }
        thinnest
    }

    /// Whether particles around a place spread in all directions, as they do where a body tapers off.
    fn is_followed(&self, u: &Vec3, size: f64) -> bool {
        let near = self.placed.positions.iter().map(|x| (x - u) / size).filter(|off| off.norm() < NEAR);
        let (mut count, mut mean, mut squares) = (0.0f64, Vec3::zeros(), Mat3::zeros());
        for off in near {
            (count, mean, squares) = (count + 1.0, mean + off, squares + off * off.transpose());
        }
        let mean = mean / count.max(1.0);
        let variance = squares / count.max(1.0) - mean * mean.transpose();
        SymmetricEigen::new(variance).eigenvalues.min() > LAYER
    }

    fn placing(&self) -> Placing<'_> {
        Placing { split: &self.sub_cells.split, by_brick: &self.by_brick, grid: &self.grid, features: &self.features }
    }

    fn part(&self, number: u32) -> &parts::Part {
        &self.sub_cells.parts.parts[number as usize]
    }

    /// The patches of a sub-cell in runs of one plane and brick.
    fn runs<'a>(&'a self, part: &'a parts::Part) -> impl Iterator<Item = &'a [u32]> {
        let plane = |patch: u32| plane_of(&self.grid, &self.sub_cells.split, &self.features, patch);
        part.patches.chunk_by(move |a, b| plane(*a) == plane(*b))
    }

    /// Points of a run of patches with $n\,\mathrm dA$; each triangle in so many parts along its edges.
    fn on_run(&self, rules: &Rules, run: &[u32], finer: usize, mut with: impl FnMut(Vec3, Vec3)) {
        match finer {
            1 => rules.on_piece(run.iter().map(|&patch| self.sub_cells.split.corners(patch)), with),
            _ => run.iter().for_each(|&patch| {
                pieces_of(&self.sub_cells.split.corners(patch), finer, |corners| {
                    rules.on_triangle(&corners, &mut with)
                });
            }),
        }
    }

    /// Bricks per side of a spacing that a sub-cell has; refuses other numbers of sub-cells.
    fn check_parts(parts: usize) -> Result<(), GeometryError> {
        let needed =
            "cells of a cut lattice are taken whole or in halves, which counts as 2 parts: take a basis of order 1";
        check_halves(parts, needed)
    }

    /// Points of a section with $n\,\mathrm dA$ along its axis.
    fn on_section(&self, rules: &Rules, section: u32, mut with: impl FnMut(Vec3, Vec3)) {
        let own = &self.sub_cells.sections.sections[section as usize];
        if own.triangles.is_empty() {
            let [a, b, _, d] = self.sub_cells.sections.corners(own).each(|corner| self.sub_cells.point(corner));
            rules.on_face(&a, &[b - a, d - a], with);
        } else {
            for corners in &self.sub_cells.sections.triangles[own.triangles.clone()] {
                rules.on_triangle(&corners.each(|corner| self.sub_cells.point(corner)), &mut with);
            }
        }
    }

    /// The same of several sections on one face.
    fn on_sections(&self, rules: &Rules, sections: &[u32], mut with: impl FnMut(Vec3, Vec3)) {
        let mut triangles: Vec<[Vec3; 3]> = Vec::with_capacity(2 * sections.len());
        for &section in sections {
            each_triangle(&self.sub_cells.sections, section, |corners| {
                triangles.push(corners.each(|corner| self.sub_cells.point(corner)));
            });
        }
        let mut any = false;
        rules.on_piece(triangles.into_iter(), |at, n| {
            any = true;
            with(at, n);
        });
        // A face has a point, and be its area rounding.
        if !any {
            sections.iter().take(1).for_each(|&section| self.on_section(rules, section, &mut with));
        }
    }

    /// Particles with box supports of the normalised dilation over the spacing that `scale` makes of the local one, both over the finest.
    fn supports(&self, r: f64, scale: impl Fn(f64) -> f64) -> Result<Particles<3>, ApproximationError> {
        let support = |own: &f64| {
            let half = 2.0 * r * f64::from(STEP) * self.frame.size * scale(*own);
            match self.frame.axes {
                None => Support::Box(Vec3::repeat(half)),
                Some(axes) => Support::Parallelepiped(axes * half),
            }
        };
        Particles::new(self.positions.clone(), self.placed.scales.mapped(support))
    }

    /// Hands out the triangles around a sub-cell, seen from outside.
    fn around(&self, part: &parts::Part, mut with: impl FnMut([Vec3; 3])) {
        for &(section, sign) in &part.sections {
            each_triangle(&self.sub_cells.sections, section, |[a, b, c]| {
                let base = if sign > 0.0 { [a, b, c] } else { [a, c, b] };
                with(base.each(|corner| self.sub_cells.point(corner)));
            });
        }
        part.patches.iter().for_each(|&patch| with(self.sub_cells.split.corners(patch)));
    }

    /// Points inside a sub-cell with their weights, in coordinates of the lattice.
    fn in_part(&self, rules: &Rules, part: u32, mut with: impl FnMut(Vec3, f64)) {
        let part = self.part(part);
        self.around(part, |base| rules.in_tetrahedron(&part.centre, &base, &mut with));
    }

    /// Four points of sub-cells together that have their moments of second order.
    fn by_moments(&self, parts: &[u32], with: impl FnMut(Vec3, f64)) {
        let mut inertia = Inertia::default();
        for &part in parts {
            let part = self.part(part);
            self.around(part, |base| inertia.add_cone(&part.centre, &base));
        }
        inertia.in_body(with);
    }

    /// Whether the surface leaves a cell alone: one whole brick between eight particles' places.
    fn is_whole(&self, cell: usize) -> bool {
        let own = &self.cells[cell];
        let brick = self.part(own[0]).brick;
        let leaves = STEP * self.half_spacing(brick) / self.size(brick);
        own.len() == leaves.pow(3) as usize && own.iter().all(|&part| self.is_whole_part(part))
    }

    fn is_whole_part(&self, part: u32) -> bool {
        let part = self.part(part);
        part.patches.is_empty() && part.volume == f64::from(self.size(part.brick)).powi(3)
    }

    /// Half the spacing around a brick.
    fn half_spacing(&self, brick: u32) -> i32 {
        self.grid.half_spacing(self.grid.place(brick as usize))
    }

    /// The size of the leaf that a brick belongs to.
    fn size(&self, brick: u32) -> i32 {
        self.grid.size(self.grid.place(brick as usize))
    }

    /// The place of the lowest particle of the brick that a cell lies in, and the brick's size.
    fn lowest(&self, cell: usize) -> ([i32; 3], i32) {
        let brick = self.part(self.cells[cell][0]).brick;
        let size = STEP * self.half_spacing(brick);
        (self.grid.place(brick as usize).each(|at| at / size * size), size)
    }

    /// What zones have of the volume, and the zone of each sub-cell; none where that is not one of those given.
    fn inner(&self, zones: &Zones) -> (Vec<Inner>, Vec<u32>) {
        let mut zone_of = vec![NONE; self.sub_cells.parts.parts.len()];
        let mut inner = vec![Inner::default(); zones.offsets.len().saturating_sub(1)];
        for (zone, cells) in zones.each().enumerate() {
            for &part in cells.iter().flat_map(|cell| &self.cells[*cell as usize]) {
                zone_of[part as usize] = zone as u32;
                inner[zone].add_part(self.part(part));
            }
        }
        (inner, zone_of)
    }

    /// The pieces of the surface that a part has, curved ones first: plain ones take back from conditions what they share with them.
    fn pieces(&self, part: &Part) -> Result<Vec<u32>, GeometryError> {
        let mut found: Vec<u32> = match part {
            Part::Whole => (0..self.features.curved.len() as u32).collect(),
            Part::Named(name) => {
                let named = self.names.iter().filter(|known| known.0 == *name).flat_map(|known| &known.1);
                named.map(|&facet| self.features.pieces[facet as usize]).collect()
            }
            Part::Face { .. } => Vec::new(),
        };
        if found.is_empty() {
            let names: Vec<&str> = self.names.mapped(|known| known.0.as_str());
            return Err(part.unknown(&names, "no named parts"));
        }
        let rank = |piece: u32| (!self.features.curved[piece as usize], piece);
        order::sort(&mut found, &|&a, &b| rank(a).cmp(&rank(b)));
        found.dedup();
        Ok(found)
    }

    /// The points of pieces; where a predicate is given, those whose middle it holds for are asked for.
    fn sites(
        &self,
        pieces: &[u32],
        [parts, gauss]: [usize; 2],
        holds: Option<&dyn Fn(&Vec3) -> bool>,
    ) -> Result<Vec<Site>, GeometryError> {
        if parts == 0 {
            Self::check_parts(parts)?;
        }
        let (rules, finer) = (Rules::new(gauss)?, parts.div_ceil(STEP as usize));
        check_point_count(self.sub_cells.split.patches.len(), finer.saturating_mul(gauss).saturating_pow(2))?;
        let place = self.places_of(pieces);
        let mut sites: Vec<Site> = pieces.mapped(|piece| Site::new(self.features.needs[*piece as usize]));
        let area = self.frame.size * self.frame.size;
        let mut number = 0;
        for part in &self.sub_cells.parts.parts {
            for run in self.runs(part) {
                let facet = self.sub_cells.split.patches[run[0] as usize].facet as usize;
                let Some(site) = sites.get_mut(place[self.features.pieces[facet] as usize]) else { continue };
                let (leaf, normal) = (self.leaf_of(run[0]), self.features.normals[facet]);
                site.open((part.brick, leaf));
                self.on_run(&rules, run, finer, |at, own| {
                    site.places.push(Place { at, normal, measure: own.norm() * area, number });
                    number += 1;
                });
            }
        }
        for site in &mut sites {
            site.close(holds.map(|holds| |middle: &Vec3| holds(&self.frame.place(middle))));
        }
        Ok(sites)
    }

    /// The number of each piece among some.
    fn places_of(&self, pieces: &[u32]) -> Vec<usize> {
        let mut place = vec![usize::MAX; self.features.curved.len()];
        pieces.iter().enumerate().for_each(|(at, piece)| place[*piece as usize] = at);
        place
    }

    /// The boundary cells of pieces, each with its trace functions.
    fn traces(
        &self,
        part: &Part,
        rule: [usize; 2],
        positive: bool,
        choice: &TraceChoice<'_, 3>,
    ) -> Result<Vec<BoundaryCells<3>>, GeometryError> {
        let pieces = self.pieces(part)?;
        let (mut sites, place) = (self.sites(&pieces, rule, choice.within)?, self.places_of(&pieces));
        for (particle, on) in self.placed.on.iter().enumerate() {
            if choice.without.iter().any(|without| without.contains(&(particle as u32))) {
                continue;
            }
            for &(piece, normal) in on.iter().filter(|(piece, _)| place[*piece as usize] != usize::MAX) {
                let facing = choice.facing.map_or(0.0, |f| f(&self.positions[particle], &self.frame.turned(&normal)));
                sites[place[piece as usize]].particles.push(OnPiece { particle: particle as u32, normal, facing });
            }
        }
        let beside = self.features.beside.iter().filter_map(|(&[a, b], &length)| {
            let [a, b] = [a, b].each(|piece| place[piece as usize]);
            (a != usize::MAX && b != usize::MAX).then_some(([a, b], length))
        });
        let spread = Spread { positions: &self.placed.positions, scales: &self.placed.scales };
        let found = assign(spread, sites, &beside.collect::<Vec<_>>(), positive);
        Ok(found.into_mapped(|(places, groups, traces)| self.boundary_cells(&places, groups, traces)))
    }

    fn boundary_cells(&self, places: &[Place], groups: Vec<usize>, traces: Vec<Vec<(u32, f64)>>) -> BoundaryCells<3> {
        let mut cells = BoundaryCells { points: Points::empty(), traces };
        for place in places {
            cells.points.push(self.frame.place(&place.at), place.measure);
            cells.points.normals.push(self.frame.turned(&place.normal));
        }
        cells.points.groups.extend(groups);
        cells
    }

    /// The leaf that a patch lies in.
    fn leaf_of(&self, patch: u32) -> [i32; 3] {
        self.grid.leaf(self.sub_cells.split.patches[patch as usize].brick)
    }

    /// Hands out the shares in sub-cells of particles that are free whatever is fixed on the surface: those inside, and where a body is
    /// thin those on its surface.
    fn free(&self, with: impl FnMut(u32, usize, f64)) {
        let inner = self.placed.positions.iter().zip(&self.placed.on).filter(|(_, on)| on.is_empty());
        let mut cubes = Cubes::new(THIN);
        inner.for_each(|(x, _)| cubes.add(x, *x));
        let is_thin = |x: &Vec3| {
            let reach = THIN * self.grid.scale(x);
            cubes.near(x, reach).all(|y| (x - y).norm() > reach)
        };
        let (positions, on) = (&self.placed.positions, &self.placed.on);
        self.shares(|particle| on[particle].is_empty() || is_thin(&positions[particle]), with);
    }

    /// Hands out the shares of some particles in the sub-cells around them.
    fn shares(&self, is_meant: impl Fn(usize) -> bool, mut with: impl FnMut(u32, usize, f64)) {
        let mut by_brick: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for (number, part) in self.sub_cells.parts.parts.iter().enumerate() {
            by_brick.entry(part.brick).or_default().push(number as u32);
        }
        for (particle, x) in self.placed.positions.iter().enumerate() {
            if !is_meant(particle) {
                continue;
            }
            let scale = self.grid.leaf_scale(x);
            let mut leaves: Vec<u32> = Vec::with_capacity(8);
            for k in 0..8 {
                let place = |i: usize| (x[i] / scale - 0.5).floor() as i32 + ((k >> i) & 1);
                let at: [i32; 3] = array_of(|i| place(i).max(0) * scale as i32);
                if (0..3).any(|i| at[i] >= self.grid.counts[i] as i32) {
                    continue;
                }
                let leaf = self.grid.leaf_of(self.grid.brick(at) as u32);
                if !leaves.contains(&leaf) {
                    leaves.push(leaf);
                }
            }
            let near = leaves.iter().filter_map(|leaf| by_brick.get(leaf));
            let near: Vec<u32> = near.flatten().copied().collect();
            let whole: f64 = near.summed(|&part| self.part(part).volume);
            for part in near {
                with(part, particle, self.part(part).volume / whole);
            }
        }
    }
}

/// What tells runs of patches apart: the leaf, the piece of the surface, and the facet where the piece is curved.
fn plane_of(grid: &Grid, split: &Split, features: &Features, patch: u32) -> ([i32; 3], u32, u32) {
    let Patch { brick, facet, .. } = split.patches[patch as usize];
    let piece = features.pieces[facet as usize];
    (grid.leaf(brick), piece, if features.curved[piece as usize] { facet } else { 0 })
}

/// Marks of facets by the names that they have.
fn marks(facets: usize, names: &[(String, Vec<u32>)]) -> Vec<u32> {
    let mut marks = vec![0u32; facets];
    let mut known: BTreeMap<(u32, usize), u32> = BTreeMap::new();
    for (number, (_, own)) in names.iter().enumerate() {
        for &facet in own {
            let next = known.len() as u32 + 1;
            let mark = &mut marks[facet as usize];
            *mark = *known.entry((*mark, number)).or_insert(next);
        }
    }
    marks
}

/// A triangle cut into so many parts along each edge.
fn pieces_of([a, b, c]: &[Vec3; 3], parts: usize, mut with: impl FnMut([Vec3; 3])) {
    if parts == 1 {
        return with([*a, *b, *c]);
    }
    let at = |i: usize, j: usize| a + (b - a) * (i as f64 / parts as f64) + (c - a) * (j as f64 / parts as f64);
    for i in 0..parts {
        for j in 0..parts - i {
            with([at(i, j), at(i + 1, j), at(i, j + 1)]);
            if i + j + 1 < parts {
                with([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
    }
}

impl Cells<3> for CutLattice {
    fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    fn cell_count(&self) -> usize {
        self.cells.len()
    }

    fn corners(&self, cell: usize) -> Vec<usize> {
        let (lowest, size) = self.lowest(cell);
        let around = (0..8).filter_map(|k| {
            let at: [i32; 3] = array_of(|i| lowest[i] + size * ((k >> i) & 1));
            self.placed.at.get(&at).map(|particle| *particle as usize)
        });
        let around: Vec<usize> = around.collect();
        if !around.is_empty() {
            return around;
        }
        let centre = self.part(self.cells[cell][0]).centre;
        let distance = |particle: &usize| (self.placed.positions[*particle] - centre).norm_squared();
        let nearest = (0..self.positions.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
        nearest.into_iter().collect()
    }

    fn drawn(&self) -> Vec<Vec<usize>> {
        Vec::new()
    }

    fn connections(&self) -> Option<Connections<3>> {
        Some(Connections::new(Whole::new(&self.frame, &self.sub_cells, &self.cells, &self.placed.positions)))
    }

    fn drawn_surface(&self) -> Option<(Vec<Vec3>, Vec<Vec<usize>>)> {
        let facets =
            self.sub_cells.split.patches.iter().map(|patch| patch.corners.each(|corner| corner as usize).to_vec());
        Some((self.sub_cells.split.points.mapped(|u| self.frame.place(u)), facets.collect()))
    }

    fn local_spacing(&self, particle: usize) -> f64 {
        self.spacings(particle).norm()
    }

    fn spacings(&self, particle: usize) -> Vec3 {
        let scale = self.placed.scales.get(particle).copied().unwrap_or(f64::NAN);
        Vec3::repeat(f64::from(STEP) * self.frame.size * scale)
    }

    fn particles(&self, r: f64) -> Result<Particles<3>, ApproximationError> {
        check_dilation(r)?;
        self.supports(r, |scale| scale)
    }

    fn particles_global(&self, r: f64) -> Result<Particles<3>, ApproximationError> {
        check_dilation(r)?;
        let largest = self.placed.scales.largest(|x| *x);
        self.supports(r, |_| largest)
    }

    fn zones(&self, size: usize) -> Zones {
        if size <= 1 {
            return Zones::single(self.cells.len());
        }
        let (zone_of, count) = self.sub_cells.parts.connected(|brick| self.grid.block(brick, size * STEP as usize));
        let mut inner = vec![Inner::default(); count];
        for (part, zone) in self.sub_cells.parts.parts.iter().zip(&zone_of) {
            inner[*zone as usize].add_part(part);
        }
        let positions = &self.placed.positions;
        self.free(|part, particle, share| {
            inner[zone_of[part as usize] as usize].free.add_point(&positions[particle], share);
        });
        let mut sides: Vec<BTreeMap<u32, f64>> = vec![BTreeMap::new(); count];
        for (section, beside) in self.sub_cells.sections.sections.iter().zip(&self.sub_cells.parts.beside) {
            if beside.contains(&NONE) {
                continue;
            }
            let [a, b] = beside.each(|part| zone_of[part as usize]);
            if a != b {
                *sides[a as usize].entry(b).or_default() += section.area.abs();
                *sides[b as usize].entry(a).or_default() += section.area.abs();
            }
        }
        let mut of_cell: Vec<u32> = self.cells.mapped(|parts| zone_of[parts[0] as usize]);
        let kept = join_by_sides(&mut of_cell, inner.mapped(Inner::worth), sides, FEWEST);
        collect((of_cell, kept))
    }

    fn left_thin(&self) -> Option<&GeometryError> {
        self.left.as_ref()
    }

    fn free_particles(&self, zones: &Zones, free: &dyn Fn(usize) -> f64) -> Vec<ZoneParticles<3>> {
        let (inner, zone_of) = self.inner(zones);
        let mut seen = vec![(0.0, usize::MAX); inner.len()];
        self.shares(
            |_| true,
            |part, particle, _| {
                if let Some((worth, last)) =
                    seen.get_mut(zone_of[part as usize] as usize).filter(|own| own.1 != particle)
                {
                    (*worth, *last) = (*worth + free(particle), particle);
                }
            },
        );
        let of_zone = |(own, (free, _)): (&Inner, (f64, usize))| {
            let (middle, thickness) = own.extent();
            ZoneParticles { free, middle: self.frame.place(&middle), thickness: thickness * self.frame.size }
        };
        inner.iter().zip(seen).map(of_zone).collect()
    }

    fn pressure_directions(&self, zones: &Zones) -> Option<Vec<Mat3>> {
        let (mut inner, zone_of) = self.inner(zones);
        let positions = &self.placed.positions;
        self.free(|part, particle, share| {
            if let Some(own) = inner.get_mut(zone_of[part as usize] as usize) {
                own.free.add_point(&positions[particle], share);
            }
        });
        let along = inner.iter().map(Inner::directions);
        Some(along.map(|along| self.frame.axes.map_or(along, |axes| axes * along)).collect())
    }

    fn gauss_in(&self, n: usize, zones: &Zones) -> Result<Points<3>, GeometryError> {
        let whole = Rules::new(n)?;
        check_point_count(self.cells.len(), n.saturating_pow(3))?;
        // Cut sub-cells are far smaller than bricks, and made of tetrahedra.
        let part = Rules::new(n.div_ceil(4))?;
        let measure = self.frame.size.powi(3);
        zones.points(self.cells.len(), |cell, points| {
            let mut add = |at: Vec3, weight: f64| points.push(self.frame.place(&at), weight * measure);
            if self.is_whole(cell) {
                let (corner, size) = self.lowest(cell);
                whole.in_brick(&Vec3::from(corner.each(f64::from)), f64::from(size), &mut add);
                return;
            }
            for &own in &self.cells[cell] {
                let own_part = self.part(own);
                match self.is_whole_part(own) {
                    true => {
                        let (centre, size) = (own_part.centre, f64::from(self.size(own_part.brick)));
                        part.in_brick(&(centre - Vec3::repeat(0.5 * size)), size, &mut add);
                    }
                    false if n <= 8 => self.by_moments(&[own], &mut add),
                    false => self.in_part(&part, own, &mut add),
                }
            }
        })
    }

    fn smoothing(&self, parts: usize, gauss: usize, zones: &Zones) -> Result<Smoothing<3>, GeometryError> {
        zones.validate(self.cells.len())?;
        Self::check_parts(parts)?;
        let rules = Rules::new(gauss)?;
        check_point_count(self.sub_cells.sections.sections.len(), gauss.saturating_pow(2))?;
        let area = self.frame.size * self.frame.size;
        let mut out = Smoothing::empty();
        // Facets are sections and then the surfaces of sub-cells; those that nobody asks for are not made.
        let mut of_section: Vec<u32> = vec![NONE; self.sub_cells.sections.sections.len()];
        let (volume_rule, faces) = (Rules::new(2)?, Faces::new(&self.sub_cells.sections, &self.sub_cells.parts));
        for zone in zones.each() {
            for &cell in zone {
                let own = &self.cells[cell as usize];
                let runs: Vec<&[u32]> = if parts == 1 { vec![&own[..]] } else { own.chunks(1).collect() };
                for run in runs {
                    let mut facets: Vec<(u32, f64)> = Vec::with_capacity(7);
                    for &part in run {
                        let own = self.part(part);
                        for &(section, sign) in &own.sections {
                            if self.sub_cells.parts.across(section, sign).is_some_and(|other| run.contains(&other)) {
                                continue;
                            }
                            let first = faces.first(section);
                            if of_section[first as usize] == NONE {
                                of_section[first as usize] = out.facet_count() as u32;
                                let add = |at, n: Vec3| self.add_point(&mut out, at, n * area);
                                match faces.all(first) {
                                    Some(all) => self.on_sections(&rules, all, add),
                                    None => self.on_section(&rules, first, add),
                                }
                                out.facet_offsets.push(out.facet_points.len());
                            }
                            if first == section {
                                facets.push((of_section[first as usize], sign));
                            }
                        }
                        if own.patches.is_empty() {
                            continue;
                        }
                        facets.push((out.facet_count() as u32, 1.0));
                        for run in self.runs(own) {
                            self.on_run(&rules, run, 1, |at, n| self.add_point(&mut out, at, n * area));
                        }
                        out.facet_offsets.push(out.facet_points.len());
                    }
                    let mut interior = Vec::new();
                    if parts == 1 {
                        let measure = self.frame.size.powi(3);
                        let mut add = |at: Vec3, weight: f64| interior.push((self.frame.place(&at), weight * measure));
                        if self.is_whole(cell as usize) {
                            let (corner, size) = self.lowest(cell as usize);
                            volume_rule.in_brick(&Vec3::from(corner.each(f64::from)), f64::from(size), &mut add);
                        } else {
                            self.by_moments(run, &mut add);
                        }
                    }
                    let volume: f64 = run.summed(|&part| self.part(part).volume);
                    let moment = run.iter().map(|&part| self.part(part));
                    let moment = moment.map(|part| part.centre * part.volume).sum::<Vec3>();
                    out.centres.push(self.frame.place(&(moment / volume)));
                    out.cells.push(facets);
                    out.interior.push(interior);
                }
            }
            out.groups.push(out.cells.len());
        }
        Ok(out)
    }

    fn boundary(&self, part: &Part, parts: usize, gauss: usize) -> Result<BoundaryCells<3>, GeometryError> {
        Ok(BoundaryCells::joined(self.boundary_pieces(part, parts, gauss)?))
    }

    fn boundary_points(&self, part: &Part, parts: usize, gauss: usize) -> Result<Points<3>, GeometryError> {
        let sites = self.sites(&self.pieces(part)?, [parts, gauss], None)?;
        let without = sites.into_iter().map(|site| self.boundary_cells(&site.places, site.groups, Vec::new()));
        Ok(BoundaryCells::joined(without.collect()).points)
    }

    fn boundary_pieces(&self, part: &Part, parts: usize, gauss: usize) -> Result<Vec<BoundaryCells<3>>, GeometryError> {
        self.traces(part, [parts, gauss], false, &TraceChoice::default())
    }

    fn boundary_pieces_for(
        &self,
        part: &Part,
        parts: usize,
        gauss: usize,
        choice: &TraceChoice<'_, 3>,
    ) -> Result<Vec<BoundaryCells<3>>, GeometryError> {
        self.traces(part, [parts, gauss], false, choice)
    }

    fn rebuilds_traces(&self) -> bool {
        true
    }

    fn contact_boundary(&self, part: &Part, parts: usize, gauss: usize) -> Result<BoundaryCells<3>, GeometryError> {
        Ok(BoundaryCells::joined(self.traces(part, [parts, gauss], true, &TraceChoice::default())?))
    }

    fn boundary_nodes(&self, part: &Part) -> Result<Vec<usize>, GeometryError> {
        let mut pieces = self.pieces(part)?;
        pieces.sort_unstable();
        let on = |particle: &usize| self.placed.on[*particle].iter().any(|own| pieces.binary_search(&own.0).is_ok());
        Ok((0..self.positions.len()).filter(on).collect())
    }

    fn contains(&self, at: &Vec3) -> bool {
        self.holds(&self.frame.local(at), SLACK)
    }

    fn encloses(&self, at: &Vec3) -> bool {
        self.holds(&self.frame.local(at), EDGE)
    }
}

/// How far from the surface a place counts as in the solid, in bricks: a tenth of a spacing.
const SLACK: f64 = 0.2;

impl CutLattice {
    fn add_point(&self, out: &mut Smoothing<3>, at: Vec3, area: Vec3) {
        out.facet_points.push(self.frame.place(&at));
        out.facet_areas.push(self.frame.turned(&area));
    }

    /// Whether a place lies in the solid, or within a part of a brick of its surface.
    fn holds(&self, u: &Vec3, slack: f64) -> bool {
        let slack = slack * self.grid.scale(u);
        if !(0..3).all(|i| u[i] >= 0.0 && u[i] < self.grid.counts[i] as f64 - 1.0) {
            return false;
        }
        let placing = self.placing();
        if placing
            .near(u, slack)
            .any(|patch| (placing::nearest(u, &self.sub_cells.split.corners(patch)) - u).norm() <= slack)
        {
            return true;
        }
        let place: [i32; 3] = array_of(|i| u[i].floor() as i32);
        // The surface between the place and a corner of its brick; lines through edges of facets are outvoted.
        let votes = (0..8).map(|k| {
            let node: [i32; 3] = array_of(|i| place[i] + ((k >> i) & 1));
            let end = Vec3::from(node.each(f64::from));
            let patches = self.by_brick.row(self.grid.brick(place)).iter();
            let crossed = patches.filter(|&&patch| crosses(u, &end, &self.sub_cells.split.corners(patch))).count();
            self.sub_cells.sections.is_inside(self.grid.node(node)) != (crossed % 2 == 1)
        });
        votes.filter(|inside| *inside).count() > 4
    }
}

/// Whether a line between two points goes through a triangle.
fn crosses(from: &Vec3, to: &Vec3, [a, b, c]: &[Vec3; 3]) -> bool {
    let volume = |p: &Vec3, q: &Vec3, r: &Vec3, s: &Vec3| (q - p).dot(&double_area(&[*p, *r, *s]));
    let sides = [(a, b), (b, c), (c, a)].each(|(p, q)| volume(from, to, p, q) > 0.0);
    sides[0] == sides[1] && sides[1] == sides[2] && (volume(from, a, b, c) > 0.0) != (volume(to, a, b, c) > 0.0)
}
