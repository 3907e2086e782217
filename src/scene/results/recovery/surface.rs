//! What is known of the tractions on the surface, and of body forces.

use std::collections::HashMap;

use crate::each::{Each, EachOf, array_of, point_of};
use crate::error::Error;
use crate::geometry::Vec3;
use crate::solve::State;
use crate::tensor::cofactor;
use crate::term::{Element, ForceDensities, Term, View, each_force};

use crate::neighbours::BoxTree;

use super::{Facet, Recovery, moved_in};
use crate::scene::results::view::SurfaceRule;

/// The nodes that a term exerts forces on.
fn acting(term: &dyn Term, view: View<'_>) -> Vec<u32> {
    let mut nodes = Vec::new();
    each_force(term, 0..term.clusters(), view, &mut Element::default(), |node, residual, _| {
        if residual.iter().any(|force| *force != 0.0) {
            nodes.push(node as u32);
        }
    });
    nodes
}

impl Recovery<'_> {
    /// Collects the loads, and the facets with what is known of their tractions.
    pub(super) fn look_at_surface(&mut self, state: &State) -> Result<(), Error> {
        let (model, dim) = (self.model, self.body.dim());
        let points = self.body.surface(1)?;
        let key = |x: &Vec3, n: &Vec3| -> Vec<u64> {
            // Rounded: facets of a part and of the whole may differ in their last bits. Normals tell faces apart at corners.
            [x, n]
                .iter()
                .flat_map(|v| &v.as_slice()[..dim])
                .map(|v| ((v * 1e3).round() as i64 as u64).wrapping_mul(31))
                .collect()
        };
        let exact = |a: &Vec3, b: &Vec3, size: f64| (a - b).norm() <= 1e-9 * size;
        let size = self.body.size();
        let mut at: HashMap<Vec<u64>, Vec<usize>> = Default::default();
        for (facet, (x, n)) in points.positions.iter().zip(&points.normals).enumerate() {
            at.entry(key(&(x / size), n)).or_default().push(facet);
        }
        let find = |x: &Vec3, n: &Vec3| {
            let [x, n] = [x, n].each(|v| point_of(|i| if i < dim { v[i] } else { 0.0 }));
            let near = at.get(&key(&(x / size), &n))?;
            near.iter().copied().find(|&facet| exact(&points.positions[facet], &x, size))
        };
        // Loads act per volume of the body as it was given.
        let given = |(point, weight): (usize, &f64)| weight * self.body.at_rest(point).determinant();
        let mut volume = [self.body.weights().iter().enumerate().map(given).sum::<f64>()];
        self.total(&mut volume);
        let mut tractions = vec![Vec3::zeros(); points.positions.len()];
        let mut body_force: Option<Vec<Vec3>> = None;
        let mut obscure = vec![0.0; self.obscure.len()];
        // The bodies come first.
        for (number, term) in model.terms().iter().enumerate().take(state.terms.len()).skip(self.bodies) {
            let sums = model.sums(number);
            let view = model.at_own(state).view(number);
            let nodes = acting(&**term, view);
            let mut acts = [f64::from(u8::from(nodes.iter().any(|&node| self.own(node as usize).is_some())))];
            self.total(&mut acts);
            if acts[0] == 0.0 {
                continue;
            }
            let (mut given, densities) = ([0.0; 4], term.force_densities(view));
            let [unknown, weight, count, surface] = &mut given;
            match &densities {
                Some(densities) => {
                    *weight = densities.weights.iter().filter(|_| sums).sum::<f64>();
                    *count = densities.weights.iter().filter(|_| sums).count() as f64;
                    let on_surface =
                        densities.normals.len() == densities.positions.len() && !densities.normals.is_empty();
                    if on_surface {
                        let found: Vec<_> = densities.positions.paired(&densities.normals, find);
                        *unknown = f64::from(u8::from(found.contains(&None)));
                        *surface = 1.0 - *unknown;
                        let known = found.into_iter().flatten().zip(&densities.forces);
                        for (facet, force) in known.filter(|_| sums && *surface > 0.0) {
                            tractions[facet] += force;
                        }
                    }
                }
                None => *unknown = 1.0,
            }
            self.total(&mut given);
            let [unknown, weight, count, surface] = given;
            // A force over all of the body has a density. Anything less has none, and a point load is one of measure 1.
            let whole = unknown + surface == 0.0 && count > 1.0 && (weight / volume[0] - 1.0).abs() < 1e-3;
            if let Some(densities) = densities.filter(|_| whole) {
                self.add_body_force(&mut body_force, &densities);
            } else if unknown > 0.0 || surface == 0.0 {
                nodes.iter().filter_map(|&node| self.own(node as usize)).for_each(|node| obscure[node] = 1.0);
            }
        }
        self.total(&mut obscure);
        self.obscure.iter_mut().zip(obscure).for_each(|(own, any)| *own = any > 0.0);
        self.total_tractions(&mut tractions);
        self.body_force = body_force;
        let current = moved_in(self.body, state, &points.positions)?;
        self.add_facets(&points, &tractions, &current)
    }

    /// Sums tractions over all ranks.
    fn total_tractions(&self, tractions: &mut [Vec3]) {
        if self.ranks.is_none() {
            return;
        }
        let mut all: Vec<f64> = Vec::with_capacity(3 * tractions.len());
        for traction in &*tractions {
            all.extend_from_slice(traction.as_slice());
        }
        self.total(&mut all);
        tractions.iter_mut().zip(all.chunks_exact(3)).for_each(|(t, sum)| *t = Vec3::from_column_slice(sum));
    }

    /// Adds a force over all of the body at its points, those of the nearest points where it is known.
    fn add_body_force(&self, body_force: &mut Option<Vec<Vec3>>, densities: &ForceDensities) {
        if densities.positions.is_empty() {
            return;
        }
        let nearest = BoxTree::of(&densities.positions);
        let sums = body_force.get_or_insert_with(|| vec![Vec3::zeros(); self.current.len()]);
        for (point, (sum, j)) in sums.iter_mut().zip(&self.jacobians).enumerate() {
            *sum += densities.forces[nearest.nearest(&self.body.point(point)).unwrap_or(0)] / *j;
        }
    }

    /// The facets on which at least one component of the traction is known.
    fn add_facets(&mut self, points: &SurfaceRule, tractions: &[Vec3], current: &[Vec3]) -> Result<(), Error> {
        let dim = self.body.dim();
        let mut held = vec![false; self.displacement.len()];
        let mut tied = vec![false; self.obscure.len()];
        for row in self.equations.equations() {
            let elsewhere = row.entries.iter().any(|&(k, c)| self.own(k / dim).is_none() && c != 0.0);
            let component = row.dependent % dim;
            if elsewhere {
                // Of a bond, or a rigid body.
                row.entries.iter().filter_map(|&(k, _)| self.own(k / dim)).for_each(|node| tied[node] = true);
            } else if let Some(node) = self.own(row.dependent / dim) {
                held[node * dim + component] = true;
                tied[node] |= row.entries.iter().any(|&(k, c)| k % dim != component && c != 0.0);
            }
        }
        let hoops = self.body.hoops();
        let size = self.body.size();
        for (point, x) in points.positions.iter().enumerate() {
            // The axis of revolution is no surface.
            if !hoops.is_empty() && x[0].abs() < 1e-12 * size {
                continue;
            }
            let psi = self.body.functions(x)?;
            let owners = points.owners(point, &psi);
            // What acts within contacts, and other terms that do not tell their densities, is not known.
            if owners.iter().any(|&node| tied[node]) || owners.iter().all(|&node| self.obscure[node]) {
                continue;
            }
            let known = array_of(|i| i < dim && !owners.iter().all(|&node| held[node * dim + i]));
            if !known.contains(&true) {
                continue;
            }
            let (_, f) = self.body.moved(x, &psi, self.displacement);
            let area = cofactor(&f) * points.normals[point];
            let length = area.norm();
            if !(length > 0.0) {
                continue;
            }
            let facet = self.facets.len() as u32;
            for &node in &psi.nodes {
                self.facets_of[node as usize].push(facet);
            }
            let distance = |node: &&u32| (self.body.particle(**node as usize) - x).norm_squared();
            let nearest = psi.nodes.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
            self.facets.push(Facet {
                reference: *x,
                owner: nearest.copied().unwrap_or(0),
                current: current[point],
                weight: points.weights[point],
                area: area / length,
                traction: tractions[point] / length,
                known,
                psi,
            });
        }
        Ok(())
    }
}
