//! Refined lattices as cells.

use std::collections::BTreeSet;

use nalgebra::Matrix2;

use crate::each::{Each, EachOf, list_of};
use crate::error::{ApproximationError, GeometryError};
use crate::geometry::{Part, Side, Vec2};
use crate::particles::{Particles, Support, check_dilation};
use crate::quadrature::{Points, check_parts, check_point_count, gauss_legendre};

use super::super::brick::determinant;
use super::super::edges::on_chord;
use super::super::lattice::ASKEW;
use super::super::mesh::parabola;
use super::super::pieces::smooth_pieces;
use super::super::smoothing::on_facets;
use super::super::{BoundaryCells, Cells, Connections, EDGE, Smoothing, TraceChoice, Zones};
use super::subcells::{Facets, Rules};
use super::{Cell, Refined};

impl Cells<2> for Refined {
    fn positions(&self) -> &[Vec2] {
        &self.positions
    }

    fn cell_count(&self) -> usize {
        self.cells.len()
    }

    fn corners(&self, cell: usize) -> Vec<usize> {
        // Axis 0 running fastest, as in lattices.
        [0, 1, 3, 2].each(|k| self.cells[cell].corners[k] as usize).to_vec()
    }

    fn connections(&self) -> Option<Connections<2>> {
        // A particle on a side of a coarser cell is a corner of it, which so has two in common with each finer cell there.
        let around = |cell: &Cell| {
            let sides = (0..4).flat_map(|side| {
                let mut own = self.along(cell, side);
                own.pop();
                own
            });
            sides.map(|particle| particle as usize).collect()
        };
        Connections::between(&self.positions, self.cells.mapped(around))
    }

    fn local_spacing(&self, particle: usize) -> f64 {
        self.spacings(particle).norm()
    }

    fn spacings(&self, particle: usize) -> Vec2 {
        self.spacing.get(particle).copied().unwrap_or(Vec2::repeat(f64::NAN))
    }

    fn particles(&self, r: f64) -> Result<Particles<2>, ApproximationError> {
        check_dilation(r)?;
        let support = |(p, axes): (usize, &Matrix2<f64>)| {
            if axes[(0, 1)].abs().max(axes[(1, 0)].abs()) < ASKEW * axes.amax() {
                Support::Box(self.spacing[p] * (2.0 * r))
            } else {
                Support::Parallelepiped(axes * (2.0 * r))
            }
        };
        Particles::new(self.positions.clone(), self.axes.iter().enumerate().map(support).collect())
    }

    fn particles_global(&self, r: f64) -> Result<Particles<2>, ApproximationError> {
        check_dilation(r)?;
        let largest = self.spacing.iter().fold(Vec2::zeros(), |a, b| a.zip_map(b, f64::max));
        self.supports(|_| largest * (2.0 * r))
    }

    /// Macro cells for sizes above 1, whatever the size; else single cells.
    fn zones(&self, size: usize) -> Zones {
        if size < 2 {
            return Zones::single(self.cells.len());
        }
        Zones::new((0..self.cells.len() as u32).collect(), list_of(self.macros.len() + 1, |m| 4 * m))
    }

    fn gauss_in(&self, n: usize, zones: &Zones) -> Result<Points<2>, GeometryError> {
        let (abscissae, weights) = gauss_legendre(n)?;
        zones.points(self.cell_count(), |cell, points| {
            let shape = self.shape(cell);
            for (t, wt) in abscissae.iter().zip(&weights) {
                for (s, ws) in abscissae.iter().zip(&weights) {
                    let (position, columns) = shape.map(&Vec2::new(*s, *t));
                    points.push(position, determinant(&columns) * ws * wt);
                }
            }
        })
    }

    fn smoothing(&self, parts: usize, gauss: usize, zones: &Zones) -> Result<Smoothing<2>, GeometryError> {
        zones.validate(self.cell_count())?;
        check_point_count(self.cell_count().saturating_mul(2), parts.saturating_mul(parts).saturating_mul(gauss))?;
        let gauss = on_facets(gauss, !self.bulges.is_empty());
        let (abscissae, weights) = gauss_legendre(gauss)?;
        check_parts(parts)?;
        let rules = Rules { straight: gauss_legendre(2)?, curved: gauss_legendre(3)? };
        let mut facets = Facets::default();
        let mut out = Smoothing::empty();
        for zone in zones.each() {
            for &cell in zone {
                self.cut_cell(cell as usize, parts, &rules, &mut facets, &mut out);
            }
            out.groups.push(out.cells.len());
        }
        for ([from, to], bulge) in facets.ends.iter().zip(&facets.bulges) {
            for (t, w) in abscissae.iter().zip(&weights) {
                let (position, along) = parabola(from, to, bulge, *t);
                out.facet_points.push(position);
                out.facet_areas.push(Vec2::new(along[1], -along[0]) * *w);
            }
        }
        out.facet_offsets = Smoothing::<2>::even_offsets(facets.ends.len(), gauss);
        Ok(out)
    }

    fn boundary(&self, part: &Part, parts: usize, gauss: usize) -> Result<BoundaryCells<2>, GeometryError> {
        let faces = self.base.faces(part)?.try_mapped(|&face| self.face(face, parts, gauss))?;
        Ok(BoundaryCells::joined(faces))
    }

    fn boundary_pieces(&self, part: &Part, parts: usize, gauss: usize) -> Result<Vec<BoundaryCells<2>>, GeometryError> {
        let (faces, all) = (self.base.faces(part)?, self.base.faces(&Part::Whole)?);
        smooth_pieces(&faces, &all, &|face| self.face(face, parts, gauss))
    }

    fn boundary_pieces_for(
        &self,
        part: &Part,
        parts: usize,
        gauss: usize,
        choice: &TraceChoice<'_, 2>,
    ) -> Result<Vec<BoundaryCells<2>>, GeometryError> {
        Ok(choice.of(self.boundary_pieces(part, parts, gauss)?))
    }

    fn boundary_nodes(&self, part: &Part) -> Result<Vec<usize>, GeometryError> {
        let faces = self.base.faces(part)?;
        let chords = faces.into_iter().flat_map(|face| self.face_chords(face));
        let nodes: BTreeSet<usize> = chords.flat_map(|(a, b)| [a as usize, b as usize]).collect();
        Ok(nodes.into_iter().collect())
    }

    fn contains(&self, at: &Vec2) -> bool {
        self.base.contains(at)
    }

    fn encloses(&self, at: &Vec2) -> bool {
        self.base.within(at, EDGE)
    }
}

impl Refined {
    /// The facets of a face with plain trace functions.
    fn face(&self, face: (usize, Side), parts: usize, gauss: usize) -> Result<BoundaryCells<2>, GeometryError> {
        let gauss = on_facets(gauss, !self.bulges.is_empty());
        let rule = gauss_legendre(gauss)?;
        check_parts(parts)?;
        let mut cells = BoundaryCells::empty();
        for ends in self.face_chords(face) {
            let at = [ends.0, ends.1].each(|p| self.positions[p as usize]);
            on_chord(at, &self.bulge(ends.0, ends.1), parts, &rule, &mut cells, &|t, _| {
                vec![(ends.0, 1.0 - t), (ends.1, t)]
            });
        }
        Ok(cells)
    }
}
