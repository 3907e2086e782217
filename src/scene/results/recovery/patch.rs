//! The polynomials of a particle: least squares over the zones that see it.

use nalgebra::{Cholesky, DMatrix, DVector};

use crate::each::{Each, add};
use crate::geometry::{Mat3, Vec3};

use super::{EQUILIBRIUM, Facet, Fit, RIDGE, Recovery, length, terms};
use crate::scene::discretisation::facet_rule::Facets;

impl Recovery<'_> {
    /// The clusters that see a particle, and those beside them where they are no more than the cells around it: those of low
    /// finite elements say too little.
    fn patch(&self, node: usize) -> Vec<u32> {
        let (clusters_of, first) = (self.body.clusters(), self.body.nodes().start);
        let near = &self.clusters[node];
        let cells = matches!(self.body.facets(), Facets::OfElements { order: 1, .. });
        if !cells {
            return near.clone();
        }
        let mut seen = vec![0.0; self.clusters.len()];
        for &cluster in near {
            let nodes = clusters_of.nodes(cluster as usize);
            nodes.iter().for_each(|&node| seen[node as usize - first] = 1.0);
        }
        self.total(&mut seen);
        let mut all: Vec<u32> = Vec::new();
        for (clusters, seen) in self.clusters.iter().zip(&seen) {
            if *seen > 0.0 {
                all.extend_from_slice(clusters);
            }
        }
        all.sort_unstable();
        all.dedup();
        all
    }

    /// Where the polynomials of a particle are centred and what they are scaled by, and the volume of its patch.
    fn frame(&self, node: usize, clusters: &[u32]) -> Option<(Vec3, Vec3, f64)> {
        let (clusters_of, weights) = (self.body.clusters(), self.body.weights());
        let (dim, mut total) = (self.body.dim(), [0.0]);
        for &cluster in clusters {
            for p in clusters_of.points(cluster as usize) {
                total[0] += weights[p];
            }
        }
        self.total(&mut total);
        let psi = self.body.values_at_node(node).ok()?;
        let centre = self.moved(&self.body.particle(node), &psi);
        let mut scale = Vec3::zeros();
        for &cluster in clusters {
            for p in clusters_of.points(cluster as usize) {
                for i in 0..dim {
                    scale[i] = scale[i].max((self.current[p][i] - centre[i]).abs());
                }
            }
        }
        let extents = &mut scale.as_mut_slice()[..dim];
        if let Some(ranks) = self.ranks {
            ranks.largest(extents);
        }
        let usable = total[0] > 0.0 && extents.iter().all(|s| *s > 0.0 && s.is_finite());
        usable.then_some((centre, scale, total[0]))
    }

    /// The polynomials of a particle; none where nothing is known around it.
    pub(super) fn fit(&self, node: usize) -> Option<Fit> {
        let (body, dim) = (self.body, self.body.dim());
        let (clusters_of, weights) = (body.clusters(), body.weights());
        let clusters = &self.patch(node);
        let (centre, scale, total) = self.frame(node, clusters)?;
        let mut system = Patch::new(&self.components, length(dim));
        // Pressures that are constant in their zones may alternate from zone to zone: only the linear functions of the
        // patch, which do not see that, are tested with them.
        let constant = |&c: &u32| clusters_of.points(c as usize).all(|p| body.zone_functions(p).len() == 1);
        let mut others = [f64::from(u8::from(!clusters.iter().all(constant)))];
        self.total(&mut others);
        let mut tests = (others[0] == 0.0).then(|| vec![(vec![0.0; length(dim)], 0.0); dim + 1]);
        for &cluster in clusters {
            let points = clusters_of.points(cluster as usize);
            let projected = points.clone().next().map_or(0, |p| body.zone_functions(p).len());
            let mut moments = vec![(vec![0.0; length(dim)], 0.0); projected];
            for p in points {
                let terms = terms(dim, &centre, &scale, &self.current[p]).values;
                let (weight, stress) = (weights[p], &self.stresses[p]);
                system.add_deviator(&terms, stress, weight);
                let pressure = stress.trace() / 3.0;
                let (tested, functions) = match &mut tests {
                    Some(tests) => (tests, &terms[..=dim]),
                    None => (&mut moments, body.zone_functions(p)),
                };
                if functions.is_empty() {
                    system.add_pressure(&terms, pressure, weight);
                }
                for ((left, right), phi) in tested.iter_mut().zip(functions) {
                    add(left, weight * phi, &terms);
                    *right += weight * phi * pressure;
                }
            }
            for (left, right) in moments.iter().filter(|_| tests.is_none()) {
                system.add_pressure(left, *right, 1.0);
            }
        }
        for (left, right) in tests.iter_mut().flatten() {
            left.push(*right);
            self.total(left);
            *right = left.pop().unwrap_or(0.0);
        }
        // What all ranks know one of them adds.
        let first = self.ranks.is_none_or(|ranks| ranks.rank() == 0);
        for (left, right) in tests.iter().flatten().filter(|_| first) {
            system.add_pressure(left, *right, 1.0 / total);
        }
        if !self.obscure[node] {
            self.add_equilibrium(&mut system, node, clusters, &centre, &scale, total);
        }
        self.total(system.matrix.as_mut_slice());
        self.total(system.rhs.as_mut_slice());
        let coefficients = system.solve(total)?;
        Some(Fit { centre, scale, coefficients })
    }

    /// Equilibrium inside the patch of a particle, and on its part of the surface.
    fn add_equilibrium(
        &self,
        system: &mut Patch,
        node: usize,
        clusters: &[u32],
        centre: &Vec3,
        scale: &Vec3,
        total: f64,
    ) {
        let (clusters_of, hoops, dim) = (self.body.clusters(), self.body.hoops(), self.body.dim());
        // The polynomials' divergence is linear: these points determine it.
        let mut places = Vec::new();
        for &cluster in clusters {
            let points = clusters_of.points(cluster as usize);
            let step = (points.len() / (4 * dim)).max(1);
            places.extend(points.step_by(step));
        }
        let mut count = [places.len() as f64];
        self.total(&mut count);
        let weight = EQUILIBRIUM * total / count[0].max(1.0);
        let size = scale.as_slice()[..dim].iter().copied().fold(f64::INFINITY, f64::min);
        for &p in &places {
            let x = &self.current[p];
            let terms = terms(dim, centre, scale, x);
            let force = self.body_force.as_ref().map_or_else(Vec3::zeros, |force| force[p]);
            for i in 0..dim {
                let mut row = Vec::new();
                for (c, &(a, b)) in self.components.iter().enumerate() {
                    // ∂σ_ij/∂x_j, and (n σ_rr − Σ σ_hoop)/r in the radial direction.
                    let along = if a == i && b < dim {
                        Some(b)
                    } else if b == i && a < dim {
                        Some(a)
                    } else {
                        None
                    };
                    let hoop = if i != 0 {
                        if (a, b) == (0, i) { hoops.len() as f64 } else { 0.0 }
                    } else if (a, b) == (0, 0) {
                        hoops.len() as f64
                    } else if a == b && hoops.contains(&a) {
                        -1.0
                    } else {
                        0.0
                    };
                    if along.is_none() && hoop == 0.0 {
                        continue;
                    }
                    for (k, (value, slope)) in terms.values.iter().zip(&terms.slopes).enumerate() {
                        let by_hoop = if hoop == 0.0 { 0.0 } else { hoop * value / x[0] };
                        let entry = along.map_or(0.0, |j| slope[j]) + by_hoop;
                        row.push((system.place(c, k), size * entry));
                    }
                }
                system.add_row(&row, -size * force[i], weight);
            }
        }
        if self.ranks.is_some_and(|ranks| ranks.rank() > 0) {
            return;
        }
        let facets = &self.facets_of[node];
        let area: f64 = facets.summed(|&f| self.facets[f as usize].weight);
        for &facet in facets {
            let Facet { current, weight, area: normal, traction, known, .. } = &self.facets[facet as usize];
            let terms = terms(dim, centre, scale, current).values;
            for i in (0..dim).filter(|&i| known[i]) {
                let mut row = Vec::new();
                for (c, &(a, b)) in self.components.iter().enumerate() {
                    let factor = if a == i {
                        normal[b]
                    } else if b == i {
                        normal[a]
                    } else {
                        continue;
                    };
                    row.extend(terms.iter().enumerate().map(|(k, t)| (system.place(c, k), factor * t)));
                }
                system.add_row(&row, traction[i], EQUILIBRIUM * total * weight / area);
            }
        }
    }
}

/// Normal equations of a patch.
struct Patch<'a> {
    components: &'a [(usize, usize)],
    terms: usize,
    matrix: DMatrix<f64>,
    rhs: DVector<f64>,
}

impl<'a> Patch<'a> {
    fn new(components: &'a [(usize, usize)], terms: usize) -> Self {
        let size = components.len() * terms;
        Patch { components, terms, matrix: DMatrix::zeros(size, size), rhs: DVector::zeros(size) }
    }

    /// Where the coefficient of a component's term stands.
    fn place(&self, component: usize, term: usize) -> usize {
        component * self.terms + term
    }

    /// Adds $w\\,|\operatorname{dev}(\sigma(x) - \sigma)|^2$.
    fn add_deviator(&mut self, values: &[f64], stress: &Mat3, weight: f64) {
        let deviator = stress - Mat3::identity() * (stress.trace() / 3.0);
        for (c, &(i, j)) in self.components.iter().enumerate() {
            let scaled = weight * if i == j { 1.0 } else { 2.0 };
            for (k, a) in values.iter().enumerate() {
                self.rhs[c * self.terms + k] += scaled * a * deviator[(i, j)];
            }
            for (d, &(p, q)) in self.components.iter().enumerate() {
                let metric = match (i == j, p == q) {
                    (true, true) => f64::from(u8::from(c == d)) - 1.0 / 3.0,
                    (false, false) if c == d => 2.0,
                    _ => continue,
                };
                for (k, a) in values.iter().enumerate() {
                    for (l, b) in values.iter().enumerate() {
                        self.matrix[(d * self.terms + l, c * self.terms + k)] += weight * metric * a * b;
                    }
                }
            }
        }
    }

    /// Adds $w\\,(l[\operatorname{tr}\sigma/3] - r)^2$, a linear functional $l$ of a polynomial given by its values for the basis.
    fn add_pressure(&mut self, functional: &[f64], value: f64, weight: f64) {
        let terms = self.terms;
        let mut row = Vec::with_capacity(3 * terms);
        for (c, component) in self.components.iter().enumerate() {
            if component.0 == component.1 {
                for (k, f) in functional.iter().enumerate() {
                    row.push((c * terms + k, f / 3.0));
                }
            }
        }
        self.add_row(&row, value, weight);
    }

    /// Adds $w\\,(\sum_k a_k c_k - r)^2$.
    fn add_row(&mut self, row: &[(usize, f64)], value: f64, weight: f64) {
        for &(k, a) in row {
            self.rhs[k] += weight * a * value;
            for &(l, b) in row {
                self.matrix[(l, k)] += weight * a * b;
            }
        }
    }

    /// The coefficients; terms that the data leave open stay small.
    fn solve(mut self, total: f64) -> Option<DVector<f64>> {
        for k in 0..self.matrix.nrows() {
            let constant = k % self.terms == 0;
            self.matrix[(k, k)] += total * RIDGE * if constant { 1e-4 } else { 1.0 };
        }
        let solved = Cholesky::new(self.matrix)?.solve(&self.rhs);
        solved.iter().all(|c| c.is_finite()).then_some(solved)
    }
}
