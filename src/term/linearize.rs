//! The linearisation of a body over one cluster.

use crate::geometry::Mat3;
use crate::material::{Material, VolumetricEnergy, respond_to_volume};
use crate::simd::{Arithmetic, LANES, Task, dispatch};
use crate::table::displacement_gradient;
use crate::tensor::{add_hessian_in, cofactor};

use super::Term;
use super::body::Body;
use super::contraction::{GROUP, PointTangent, Windows};
use super::element::{Element, View};
use super::internal_variables::Recall;
use super::lower::{LowerBlocks, WIDTH};
use super::pressure_field::PressureField;
use super::uncondensed::{ENTRIES, Tangents, Zone, entry};
use super::zone_residuals::ZoneResiduals;

impl<const D: usize> Body<D> {
    /// Adds forces and, where requested, the matrix of a cluster; see [`Term::linearize`].
    pub(super) fn linearize_cluster(&self, cluster: usize, view: View<'_>, out: &mut Element) {
        let (body, has_hoop) = (self, self.table.gradient_components() > D);
        // Compiled for the numbers of gradient slots that there are: of each axis, and in a body of revolution of the hoop.
        if const { D == 1 } {
            match has_hoop {
                false => dispatch(Linearize::<D, 1> { body, cluster, view, out }),
                true => dispatch(Linearize::<D, 2> { body, cluster, view, out }),
            }
        } else if const { D == 2 } {
            match has_hoop {
                false => dispatch(Linearize::<D, 2> { body, cluster, view, out }),
                true => dispatch(Linearize::<D, 3> { body, cluster, view, out }),
            }
        } else {
            dispatch(Linearize::<D, 3> { body, cluster, view, out });
        }
    }
}

struct Linearize<'a, const D: usize, const S: usize> {
    body: &'a Body<D>,
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

    /// A stress by displacement component and gradient slot.
    #[inline(always)]
    fn reduce<const D: usize>(&self, weight: f64, stress: &[f64]) -> [[f64; WIDTH]; D] {
        let mut reduced = [[0.0; WIDTH]; D];
        for a in 0..self.count {
            let (i, s) = self.places[a];
            reduced[i][s] += weight * stress[a];
        }
        reduced
    }

    /// Writes a tangent into a lane of those that are kept uncondensed.
    #[inline(always)]
    fn pack(&self, weight: f64, tangent: &[f64], lane: usize, packed: &mut Tangents) {
        for a in 0..self.count {
            let (i, s) = self.places[a];
            for b in 0..self.count {
                let (j, t) = self.places[b];
                if 3 * s + i >= 3 * t + j {
                    packed[entry(3 * s + i, 3 * t + j)][lane] = (weight * tangent[a * self.count + b]) as f32;
                }
            }
        }
    }

    /// A tangent in space by slots, `[t][s][j][i]`.
    #[inline(always)]
    fn by_slots(&self, weight: f64, tangent: &[f64]) -> [[[[f64; 3]; 3]; 3]; 3] {
        let mut reduced = [[[[0.0; 3]; 3]; 3]; 3];
        for b in 0..self.count {
            let (j, t) = self.places[b];
            for a in 0..self.count {
                let (i, s) = self.places[a];
                reduced[t][s][j][i] = weight * tangent[a * self.count + b];
            }
        }
        reduced
    }

    /// A tangent by components, `[j][t][i][s]`.
    #[inline(always)]
    fn by_components<const D: usize, const S: usize>(
        &self,
        weight: f64,
        tangent: &[f64],
        reduced: &mut PointTangent<D, S>,
    ) {
        *reduced = [[[[0.0; WIDTH]; D]; S]; D];
        for b in 0..self.count {
            let (j, t) = self.places[b];
            for a in 0..self.count {
                let (i, s) = self.places[a];
                reduced[j][t][i][s] += weight * tangent[a * self.count + b];
            }
        }
    }
}

/// What the pressure of a point adds: `force` times $\operatorname{cof}F$ to the stress, `geometric` times
/// $\partial^2J$ and `rank_one` times $\operatorname{cof}F\otimes\operatorname{cof}F$ to the tangent.
struct Pressure {
    force: f64,
    geometric: f64,
    rank_one: f64,
}

impl Pressure {
    /// Adds to a stress and, where there is one, a tangent.
    #[inline(always)]
    fn add_to(&self, components: &Components, f: &Mat3, cof: &Mat3, stress: &mut [f64], tangent: Option<&mut [f64]>) {
        let of = &components.of[..components.count];
        for (stress, &c) in stress.iter_mut().zip(of) {
            *stress += self.force * cof[(c / 3, c % 3)];
        }
        let Some(tangent) = tangent else { return };
        for (a, &c) in of.iter().enumerate() {
            let factor = self.rank_one * cof[(c / 3, c % 3)];
            for (b, &d) in of.iter().enumerate() {
                tangent[a * of.len() + b] += factor * cof[(d / 3, d % 3)];
            }
        }
        add_hessian_in(of, tangent, f, self.geometric);
    }
}

/// The law of a body as its points see it: without the part of the energy that is projected.
struct Law<'a> {
    material: &'a dyn Material,
    /// The volumetric energy of each point, where it is not projected.
    own: Option<&'a dyn VolumetricEnergy>,
    projected: Option<&'a dyn VolumetricEnergy>,
    recall: Recall<'a>,
}

impl<'a> Law<'a> {
    #[inline(always)]
    fn new<const D: usize>(body: &'a Body<D>, view: View<'a>) -> Self {
        let (material, volumetric) = (&*body.material, body.material.volumetric());
        let (own, projected) = match body.field {
            PressureField::Displacement => (volumetric, None),
            _ => (None, volumetric),
        };
        Law { material, own, projected, recall: body.recall(view) }
    }

    #[inline(always)]
    fn respond(&self, point: usize, f: &Mat3, of: &[usize], stress: &mut [f64], tangent: &mut [f64]) {
        self.material.respond(f, self.recall.at(point), of, stress, tangent);
        if let Some(own) = self.own {
            respond_to_volume(own, f, of, stress, tangent);
        }
    }
}

/// Vectors over the nodes of a cluster, by components of a padded length.
struct Vectors<'a> {
    stride: usize,
    forces: &'a mut [f64],
    /// What a unit of each zone function adds to the forces, and these times $H$.
    slopes: &'a mut [f64],
    products: &'a mut [f64],
}

impl<'a> Vectors<'a> {
    #[inline(always)]
    fn new<const D: usize>(scratch: &'a mut Vec<f64>, nodes: usize, functions: usize) -> Self {
        // Room for the last window.
        let stride = LowerBlocks::stride(nodes);
        scratch.clear();
        scratch.resize((1 + 2 * functions) * D * stride, 0.0);
        let (forces, vectors) = scratch.split_at_mut(D * stride);
        let (slopes, products) = vectors.split_at_mut(functions * D * stride);
        Vectors { stride, forces, slopes, products }
    }

    /// Adds the forces of the zone's pressures: $\pi$, condensed with $r_\theta + H r_\pi$. Kept apart, the two residuals are on the
    /// right-hand side of their own rows: $H$ times what rounding leaves of $r_\pi$ would be forces.
    #[inline(always)]
    fn add_pressures<A: Arithmetic, const D: usize>(&mut self, zone: &ZoneResiduals, pi: &[f64], free: bool) {
        let size = D * self.stride;
        for k in 0..pi.len() {
            let mut pressure = pi[k];
            if !free {
                pressure += zone.of_theta[k];
                for l in 0..pi.len() {
                    pressure += zone.hessian[k][l] * zone.of_pi[l];
                }
            }
            for (force, slope) in self.forces.iter_mut().zip(&self.slopes[k * size..(k + 1) * size]) {
                *force = A::multiply_add(pressure, *slope, *force);
            }
        }
    }

    #[inline(always)]
    fn add_forces_to<const D: usize>(&self, residual: &mut [f64]) {
        for (a, target) in residual.chunks_exact_mut(D).enumerate() {
            for i in 0..D {
                target[i] += self.forces[i * self.stride + a];
            }
        }
    }

    /// Keeps what the condensed pressures would add to the matrix.
    #[inline(always)]
    fn keep<const D: usize>(&self, zone: &ZoneResiduals, functions: usize, nodes: usize, kept: &mut Zone) {
        kept.slopes.reserve_exact(functions * nodes * D);
        for k in 0..functions {
            let slopes = &self.slopes[k * D * self.stride..];
            kept.slopes.extend((0..nodes * D).map(|k| slopes[k % D * self.stride + k / D] as f32));
        }
        kept.hessian = zone.hessian;
        (kept.of_theta, kept.of_pi) = (zone.of_theta, zone.of_pi);
    }

    /// Adds what the condensed pressures add to the matrix.
    #[inline(always)]
    fn add_products<A: Arithmetic, const D: usize>(
        &mut self,
        zone: &ZoneResiduals,
        functions: usize,
        lower: &mut LowerBlocks,
    ) {
        let Vectors { stride, slopes, products, .. } = self;
        let size = D * *stride;
        for k in 0..functions {
            let target = &mut products[k * size..(k + 1) * size];
            for l in 0..functions {
                for (product, slope) in target.iter_mut().zip(&slopes[l * size..(l + 1) * size]) {
                    *product = A::multiply_add(zone.hessian[k][l], *slope, *product);
                }
            }
        }
        match functions {
            0 => {}
            1 => lower.add_products::<A, D, 1>(*stride, slopes, products),
            2 => lower.add_products::<A, D, 2>(*stride, slopes, products),
            3 => lower.add_products::<A, D, 3>(*stride, slopes, products),
            _ => lower.add_products::<A, D, 4>(*stride, slopes, products),
        }
    }
}

/// A zone while its points are summed.
struct Summed<'a, const D: usize> {
    body: &'a Body<D>,
    components: Components,
    condensed: &'a [f64],
    /// $J$ and the pressure of what stays pointwise, point by point, and the first point.
    points: (&'a [f64], usize),
    theta: &'a [f64],
    pi: &'a [f64],
    /// The share of the pointwise energy.
    share: f64,
    residuals: ZoneResiduals,
}

impl<const D: usize> Summed<'_, D> {
    /// The pressure of a point with the deformation gradient `f`; what the zone's does to the forces is added for all its points at
    /// once, and stands in `slopes` until then.
    #[inline(always)]
    fn pressure<A: Arithmetic, const S: usize>(
        &mut self,
        (volumetric, recall): (&dyn VolumetricEnergy, &Recall<'_>),
        (point, group): (usize, usize),
        (f, cof): (&Mat3, &Mat3),
        windows: &Windows,
        vectors: &mut Vectors<'_>,
    ) -> Pressure {
        let (body, n) = (self.body, self.pi.len());
        let j = f.m11 * cof.m11 + f.m12 * cof.m12 + f.m13 * cof.m13;
        if body.field == PressureField::Pointwise {
            let theta = self.condensed[2 * point];
            let u = volumetric.evaluate(theta);
            let force = u.slope + u.curvature * (j - theta);
            return Pressure { force, geometric: self.condensed[2 * point + 1], rank_one: u.curvature };
        }
        let (phi, weight) = (body.zone_functions(point), body.table.weights()[point]);
        let kept = body.kept(self.share, recall, point);
        let measure = self.residuals.add(body, (volumetric, kept), point, weight, self.theta, j);
        let mut pressure = 0.0;
        let mut factors = [0.0; 4];
        for k in 0..n {
            factors[k] = weight * measure.slope * phi[k];
            pressure += phi[k] * self.pi[k];
        }
        let mut reduced = [[0.0; WIDTH]; D];
        for a in 0..self.components.count {
            let ((i, s), c) = (self.components.places[a], self.components.of[a]);
            reduced[i][s] += cof[(c / 3, c % 3)];
        }
        windows.add_multiples::<A, D, S>(group, &reduced, &factors[..n], vectors.stride, vectors.slopes);
        let mut of_point =
            Pressure { force: 0.0, geometric: pressure * measure.slope, rank_one: pressure * measure.curvature };
        let (iterates, first) = self.points;
        if let Some(&[theta, pi]) = iterates.get(2 * (point - first)..2 * (point - first) + 2) {
            let u = body.pointwise_energy(volumetric, theta);
            of_point.force = kept.share * (u.slope + u.curvature * (j - theta)) + kept.held[0];
            of_point.geometric += pi;
            of_point.rank_one += kept.share * u.curvature;
        }
        of_point
    }
}

/// Points in a row that see the same nodes wait for each other, as many as have their products in registers. In space they wait
/// elsewhere, for their products to be summed over all of them.
const fn most_waiting(unknowns: usize) -> usize {
    match unknowns {
        0..=4 => GROUP,
        5..=6 => GROUP / 2,
        _ => 1,
    }
}

impl<const D: usize, const S: usize> Task for Linearize<'_, D, S> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arithmetic>(self) {
        let Linearize { body, cluster, view, out } = self;
        let Element { residual, matrix, with_matrix, scratch, lower, windows, point_panel, uncondensed, .. } = out;
        let mut kept = uncondensed.as_mut().filter(|_| body.separates());
        let (free, with_matrix, table) = (kept.is_some(), *with_matrix, &body.table);
        let (clusters, n) = (table.clusters(), body.functions);
        let nodes = clusters.nodes(cluster).len();
        let mut vectors = Vectors::new::<D>(scratch, nodes, n);
        if with_matrix && !free {
            lower.reset(nodes, D);
        }
        let law = Law::new(body, view);
        let (theta, pi, measure) = body.zone(cluster, view.condensed);
        let (share, residuals) = (body.stabilisation(cluster), ZoneResiduals::new(theta, pi, measure));
        let components = Components::new::<D>(table.hoop_components());
        let count = components.count;
        let points = (body.point_iterates(cluster, view.condensed), clusters.points(cluster).start);
        let mut zone = Summed { body, components, condensed: view.condensed, points, theta, pi, share, residuals };
        let wanted = if with_matrix { count * count } else { 0 };
        if let Some(kept) = &mut kept {
            kept.tangents = vec![[[0.0; LANES]; ENTRIES]; clusters.points(cluster).len().div_ceil(LANES)];
        }
        point_panel.clear();
        let mut group = 0;
        let mut tangents = [[[[[0.0; WIDTH]; D]; S]; D]; GROUP];
        let mut shared: &[u16] = &[];

        for point in clusters.points(cluster) {
            let (local, gradients) = (clusters.local(point), table.gradients(point));
            if group == most_waiting(D * S) || local != shared {
                windows.add_matrices::<A, D, S>(shared, &tangents[..group], lower);
                group = 0;
                if local != shared {
                    shared = local;
                    windows.lay(local);
                }
            }
            windows.pack::<S>(group, gradients);
            let weight = table.weights()[point];
            let (seen, hoops) = (table.nodes(point), table.hoop_components());
            let h = displacement_gradient::<A, D>(seen, gradients, hoops, view.displacement);
            let f = table.at_rest(point) + h;
            let (mut stress, mut tangent) = ([0.0; 9], [0.0; 81]);
            let (stress, tangent) = (&mut stress[..count], &mut tangent[..wanted]);
            law.respond(point, &f, &zone.components.of[..count], stress, tangent);
            if let Some(volumetric) = law.projected {
                let cof = cofactor(&f);
                let seen = (volumetric, &law.recall);
                let pressure = zone.pressure::<A, S>(seen, (point, group), (&f, &cof), windows, &mut vectors);
                pressure.add_to(&zone.components, &f, &cof, stress, with_matrix.then_some(&mut *tangent));
            }
            let (components, reduced) = (&zone.components, zone.components.reduce::<D>(weight, stress));
            windows.add_forces::<A, D, S>(group, &reduced, vectors.stride, vectors.forces);
            if let Some(kept) = &mut kept {
                let place = point - clusters.points(cluster).start;
                components.pack(weight, tangent, place % LANES, &mut kept.tangents[place / LANES]);
            } else if with_matrix && D == 3 && S == 3 {
                point_panel.push::<D>(table, point, components.by_slots(weight, tangent), lower);
            } else if with_matrix {
                components.by_components(weight, tangent, &mut tangents[group]);
                group += 1;
            }
        }
        windows.add_matrices::<A, D, S>(shared, &tangents[..group], lower);
        point_panel.flush::<D>(table, lower);
        vectors.add_pressures::<A, D>(&zone.residuals, pi, free);
        vectors.add_forces_to::<D>(residual);
        if !with_matrix {
            return;
        }
        if let Some(kept) = kept {
            vectors.keep::<D>(&zone.residuals, n, nodes, kept);
            (kept.shear, kept.place) = (body.shear(), body.unknowns(cluster).start + n);
            return;
        }
        if !body.apart {
            vectors.add_products::<A, D>(&zone.residuals, n, lower);
        }
        if !matrix.is_empty() {
            lower.add_to::<D>(matrix);
        }
    }
}
