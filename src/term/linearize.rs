//! The linearisation of a body over one cluster.

use crate::material::{Material, VolumetricEnergy};
use crate::simd::{Arithmetic, Task, dispatch};
use crate::table::displacement_gradient;
use crate::tensor::{add_hessian_in, cofactor};

use super::body::Body;
use super::contraction::GROUP;
use super::element::{Element, View};
use super::lower::{LowerBlocks, WIDTH};
use super::pressure_field::PressureField;
use super::uncondensed::Tangent;
use super::zone_residuals::ZoneResiduals;

impl<const D: usize, M: Material> Body<D, M> {
    /// Adds forces and, where requested, the matrix of a cluster; see [`Term::linearize`].
    pub(super) fn linearize_cluster(&self, cluster: usize, view: View<'_>, out: &mut Element) {
        let body = self;
        // Compiled for each number of gradient slots.
        match body.table.gradient_components() {
            1 => dispatch(Linearize::<D, 1, M> { body, cluster, view, out }),
            2 => dispatch(Linearize::<D, 2, M> { body, cluster, view, out }),
            _ => dispatch(Linearize::<D, 3, M> { body, cluster, view, out }),
        }
    }
}

struct Linearize<'a, const D: usize, const S: usize, M> {
    body: &'a Body<D, M>,
    cluster: usize,
    view: View<'a>,
    out: &'a mut Element,
}

/// The components $3i + J$ of the deformation gradient that a kinematics moves, and the displacement component
/// and gradient slot each belongs to.
struct Components {
    count: usize,
    of: [usize; 9],
    places: [(usize, usize); 9],
}

impl Components {
    #[inline(always)]
    fn new<const D: usize>(hoops: &[usize]) -> Self {
        let mut components = Components { count: 0, of: [0; 9], places: [(0, 0); 9] };
        let mut push = |component, place| {
            components.of[components.count] = component;
            components.places[components.count] = place;
            components.count += 1;
        };
        for i in 0..D {
            for j in 0..D {
                push(3 * i + j, (i, j));
            }
        }
        for &k in hoops {
            push(4 * k, (0, D));
        }
        components
    }
}

/// What the pressure of a point adds: `force` times $\operatorname{cof}F$ to the stress, `geometric` times
/// $\partial^2J$ and `rank_one` times $\operatorname{cof}F\otimes\operatorname{cof}F$ to the tangent.
struct Pressure {
    force: f64,
    geometric: f64,
    rank_one: f64,
}

impl<const D: usize, const S: usize, M: Material> Task for Linearize<'_, D, S, M> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arithmetic>(self) {
        let Linearize { body, cluster, view, out } = self;
        let Element { residual, matrix, with_matrix, scratch, lower, windows, point_panel, uncondensed, free, .. } =
            out;
        let free = *free;
        let with_matrix = *with_matrix;
        let table = &body.table;
        let clusters = table.clusters();
        let nodes = clusters.nodes(cluster);
        // Vectors by components, with room for the last window.
        let stride = LowerBlocks::stride(nodes.len());
        let n = body.functions;
        scratch.clear();
        scratch.resize((1 + 2 * n) * D * stride, 0.0);
        let (forces, vectors) = scratch.split_at_mut(D * stride);
        let (slopes, products) = vectors.split_at_mut(n * D * stride);
        if with_matrix && !lower.wanted && !free {
            lower.reset::<D>(nodes.len());
        }
        let components = Components::new::<D>(table.hoop_components());
        let count = components.count;
        let (material, volumetric): (&dyn Material, Option<&dyn VolumetricEnergy>) =
            match (body.field, body.material.split()) {
                (PressureField::Displacement, _) | (_, None) => (&body.material, None),
                (_, Some((distortional, volumetric))) => (distortional, Some(volumetric)),
            };
        let recall = body.recall(view);
        let (theta, pi, measure) = body.zone(cluster, view.condensed);
        let mut zone = ZoneResiduals::new(theta, pi, body.stabilisation(cluster), measure);
        // Points in a row that see the same nodes wait for each other, as many as have their products in registers. In space
        // they wait elsewhere, for their products to be summed over all of them.
        let in_space = D == 3 && S == 3;
        let most = match D * S {
            0..=4 => GROUP,
            5..=6 => GROUP / 2,
            _ => 1,
        };
        point_panel.clear();
        let mut group = 0;
        let mut tangents = [[[[[0.0; WIDTH]; D]; S]; D]; GROUP];
        let mut shared: &[u16] = &[];

        for point in clusters.points(cluster) {
            let (local, gradients) = (clusters.local(point), table.gradients(point));
            if group == most || local != shared {
                windows.add_matrices::<A, D, S>(shared, &tangents[..group], lower);
                group = 0;
                if local != shared {
                    shared = local;
                    windows.lay(local);
                }
            }
            windows.pack::<S>(group, gradients);
            let weight = table.weights()[point];
            let h = displacement_gradient::<A, D>(
                table.nodes(point),
                gradients,
                table.hoop_components(),
                view.displacement,
            );
            let f = table.at_rest(point) + h;

            let (mut stress, mut tangent) = ([0.0; 9], [0.0; 81]);
            let wanted = if with_matrix { count * count } else { 0 };
            let (of, p, a) = (&components.of[..count], &mut stress[..count], &mut tangent[..wanted]);
            match &recall {
                None => material.respond(&f, of, p, a),
                Some(recall) => recall.law.respond(&f, recall.at(point), recall.elapsed, of, p, a),
            }
            if let Some(volumetric) = volumetric {
                let cof = cofactor(&f);
                let j = f.m11 * cof.m11 + f.m12 * cof.m12 + f.m13 * cof.m13;
                let pressure = if body.field == PressureField::Pointwise {
                    let theta = view.condensed[2 * point];
                    let u = volumetric.evaluate(theta);
                    let force = u.slope + u.curvature * (j - theta);
                    Pressure { force, geometric: view.condensed[2 * point + 1], rank_one: u.curvature }
                } else {
                    // What the zone's pressure does to the forces is added for all its points at once.
                    let phi = body.phi(point);
                    let measure = zone.add(body, volumetric, point, weight, theta, j);
                    let mut pressure = 0.0;
                    let mut factors = [0.0; 4];
                    for k in 0..n {
                        factors[k] = weight * measure.slope * phi[k];
                        pressure += phi[k] * pi[k];
                    }
                    let mut reduced = [[0.0; WIDTH]; D];
                    for a in 0..count {
                        let (i, s) = components.places[a];
                        reduced[i][s] += cof[(components.of[a] / 3, components.of[a] % 3)];
                    }
                    windows.add_multiples::<A, D, S>(group, &reduced, &factors[..n], stride, slopes);
                    let u = volumetric.evaluate(j);
                    let stabilisation = zone.stabilisation * u.slope;
                    Pressure {
                        force: stabilisation,
                        geometric: pressure * measure.slope + stabilisation,
                        rank_one: pressure * measure.curvature + zone.stabilisation * u.curvature,
                    }
                };
                for a in 0..count {
                    let c = components.of[a];
                    let cof_c = cof[(c / 3, c % 3)];
                    stress[a] += pressure.force * cof_c;
                    if with_matrix {
                        let factor = pressure.rank_one * cof_c;
                        for b in 0..count {
                            let d = components.of[b];
                            tangent[a * count + b] += factor * cof[(d / 3, d % 3)];
                        }
                    }
                }
                if with_matrix {
                    add_hessian_in(&components.of[..count], &mut tangent[..count * count], &f, pressure.geometric);
                }
            }
            let mut reduced = [[0.0; WIDTH]; D];
            for a in 0..count {
                let (i, s) = components.places[a];
                reduced[i][s] += weight * stress[a];
            }
            windows.add_forces::<A, D, S>(group, &reduced, stride, forces);
            if free && let Some(kept) = &mut *uncondensed {
                let mut packed: Tangent = Default::default();
                for a in 0..count {
                    let (i, s) = components.places[a];
                    for b in 0..count {
                        let (j, t) = components.places[b];
                        let value = (weight * tangent[a * count + b]) as f32;
                        match 3 * s + i {
                            row @ 0..8 => packed.0[3 * t + j][row] = value,
                            _ => packed.1 = value,
                        }
                    }
                }
                kept.tangents.push(packed);
            } else if with_matrix && in_space {
                let mut reduced = [[[[0.0; 3]; 3]; 3]; 3];
                for b in 0..count {
                    let (j, t) = components.places[b];
                    for a in 0..count {
                        let (i, s) = components.places[a];
                        reduced[t][s][j][i] = weight * tangent[a * count + b];
                    }
                }
                point_panel.push::<D>(table, point, reduced, lower);
            } else if with_matrix {
                let reduced = &mut tangents[group];
                *reduced = [[[[0.0; WIDTH]; D]; S]; D];
                for b in 0..count {
                    let (j, t) = components.places[b];
                    for a in 0..count {
                        let (i, s) = components.places[a];
                        reduced[j][t][i][s] += weight * tangent[a * count + b];
                    }
                }
                group += 1;
            }
        }
        windows.add_matrices::<A, D, S>(shared, &tangents[..group], lower);
        point_panel.flush::<D>(table, lower);

        // π + r_θ + H r_π: the pressure that enters the condensed forces. Kept apart, the two residuals are on the right-hand
        // side of their own rows: H times what rounding leaves of r_π would be forces.
        for k in 0..n {
            let mut pressure = pi[k];
            if !free {
                pressure += zone.of_theta[k];
                for l in 0..n {
                    pressure += zone.hessian[k][l] * zone.of_pi[l];
                }
            }
            let slopes = &slopes[k * D * stride..(k + 1) * D * stride];
            for (force, slope) in forces.iter_mut().zip(slopes) {
                *force = A::multiply_add(pressure, *slope, *force);
            }
        }
        for (a, target) in residual.chunks_exact_mut(D).enumerate() {
            for i in 0..D {
                target[i] += forces[i * stride + a];
            }
        }
        if !with_matrix {
            return;
        }
        if let Some(kept) = uncondensed {
            for k in 0..n {
                let slopes = &slopes[k * D * stride..];
                kept.slopes.extend((0..nodes.len()).flat_map(|a| (0..D).map(move |i| slopes[i * stride + a])));
            }
            (kept.hessian, kept.shear) = (zone.hessian, body.shear());
            (kept.of_theta, kept.of_pi) = (zone.of_theta, zone.of_pi);
            return;
        }
        for k in 0..n {
            let target = &mut products[k * D * stride..(k + 1) * D * stride];
            for l in 0..n {
                for (product, slope) in target.iter_mut().zip(&slopes[l * D * stride..(l + 1) * D * stride]) {
                    *product = A::multiply_add(zone.hessian[k][l], *slope, *product);
                }
            }
        }
        match n {
            0 => {}
            1 => lower.add_products::<A, D, 1>(stride, slopes, products),
            2 => lower.add_products::<A, D, 2>(stride, slopes, products),
            3 => lower.add_products::<A, D, 3>(stride, slopes, products),
            _ => lower.add_products::<A, D, 4>(stride, slopes, products),
        }
        if !lower.wanted {
            lower.add_to::<D>(matrix);
        }
    }
}
