//! Contact of a body with a rigid surface.

use crate::geometry::Point;
use crate::term::{Element, Term, View};

use super::rigid::{Drive, Placed};
use super::{Nearest, RigidSurface, Skin};

/// How stiff a contact answers between two iterations, from the stiffness of the body and the size of a hat.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stiffness {
    /// $\varepsilon w$ \[stress\]: the change of a pressure by a gap as wide as the hat.
    pub proximal: f64,
    /// $c w$ \[stress\]: what a gap counts beside a pressure where it is asked whether they touch.
    pub decisive: f64,
}

/// Shear moduli of [`Stiffness::proximal`].
const PROXIMAL_SHEAR: f64 = 1e4;
/// Bulk moduli of it.
const PROXIMAL_BULK: f64 = 1e2;

impl Stiffness {
    /// For a body of the given initial moduli.
    pub fn of(shear: f64, bulk: f64) -> Self {
        Stiffness { proximal: PROXIMAL_SHEAR * shear + PROXIMAL_BULK * bulk.max(0.0), decisive: shear }
    }
}

/// Part of its width that a hat may go too far in one iteration where it comes to touch.
const TOO_FAR: f64 = 0.5;

/// Unilateral contact of a part of the boundary with a rigid surface, without friction.
///
/// With the mean gap of a hat, $\bar g_J = \int\Theta_J\\,g(x)\\,\mathrm d\Gamma/A_J$, and its pressure $\pi_J$ per
/// reference area, equilibrium is a saddle of $\Pi(d) - \sum_J A_J\\,\pi_J\\,\bar g_J$ with
/// $$\bar g_J \ge 0,\quad \pi_J \ge 0,\quad \pi_J\\,\bar g_J = 0.$$
/// Pressures are condensed unknowns, condensed before assembly: with the hats in contact those where
/// $\pi_J > c\\,\bar g_J$ (a semismooth Newton method on the complementarity), an iteration solves for
/// $$\pi_J^{new} = \pi_J - \varepsilon\\,(\bar g_J + \nabla\bar g_J\cdot\delta d),$$
/// and all others have none. At rest of the iteration $\bar g_J = 0$ whatever $\varepsilon$: it says how fast pressures come to
/// rest, not where. Force $-\pi_J A_J\nabla\bar g_J$; the matrix is symmetric.
pub(crate) struct RigidContact<const D: usize> {
    pub skin: Skin<D>,
    pub surface: RigidSurface<D>,
    /// The node whose first component is the travel of a surface that is pushed.
    pub carriage: Option<u32>,
    pub stiffness: Stiffness,
}

/// What a hat knows of the surface at a state.
pub(crate) struct Touch {
    /// $\bar g_J$ \[length\].
    pub gap: f64,
    /// Its change with the load factor.
    pub by_load: f64,
}

impl<const D: usize> RigidContact<D> {
    pub(crate) fn placed(&self, displacement: &[f64], load: f64) -> Placed<D> {
        let travel = self.carriage.map_or(0.0, |node| displacement[node as usize * D]);
        self.surface.placed(load, travel)
    }

    /// Visits the points of a hat; the mean gap.
    pub(crate) fn touch(&self, hat: usize, view: &View<'_>, mut visit: impl FnMut(usize, f64, &Nearest<D>)) -> Touch {
        let hat = &self.skin.hats[hat];
        let placed = self.placed(view.displacement, view.load);
        let (mut gap, mut by_load) = (0.0, 0.0);
        for (k, &(point, weight)) in hat.points.iter().enumerate() {
            let x = self.skin.position(point, view.displacement);
            let found = placed.nearest(&*self.surface.shape, &x);
            gap += weight * found.gap;
            by_load -= weight * found.normal.dot(&placed.slope);
            visit(k, weight, &found);
        }
        Touch { gap: gap / hat.area, by_load: by_load / hat.area }
    }

    /// $\varepsilon$ of a hat \[stress/length\].
    fn proximal(&self, hat: usize) -> f64 {
        self.stiffness.proximal / self.skin.hats[hat].width
    }

    pub(crate) fn touches(&self, hat: usize, pressure: f64, gap: f64) -> bool {
        pressure > self.stiffness.decisive / self.skin.hats[hat].width * gap
    }

    /// $\nabla\bar g\cdot\delta d$ of a hat.
    fn change(&self, hat: usize, view: &View<'_>, step: &[f64]) -> (f64, f64) {
        let travel = self.carriage.map_or(0.0, |node| step[node as usize * D]);
        let pushed = self.surface.free_direction().map_or_else(Point::zeros, |along| along * travel);
        let mut change = 0.0;
        let points = &self.skin.hats[hat].points;
        let touch = self.touch(hat, view, |k, weight, found| {
            let (point, _) = points[k];
            change += weight * found.normal.dot(&(self.skin.displacement(point, step) - pushed));
        });
        (touch.gap, change / self.skin.hats[hat].area)
    }
}

impl<const D: usize> Term<D> for RigidContact<D> {
    fn clusters(&self) -> usize {
        self.skin.hats.len()
    }

    fn nodes(&self, cluster: usize) -> &[u32] {
        &self.skin.hats[cluster].nodes
    }

    fn break_points(&self) -> Vec<f64> {
        self.surface.break_points()
    }

    fn is_unilateral(&self) -> bool {
        true
    }

    fn condensed(&self, cluster: usize) -> std::ops::Range<usize> {
        cluster..cluster + 1
    }

    fn linearize(&self, cluster: usize, view: View<'_>, out: &mut Element) {
        let hat = &self.skin.hats[cluster];
        let size = hat.nodes.len() * D;
        let pressure = view.condensed[cluster];
        // ∇ḡ A, in the buffer of the element.
        let mut slope = std::mem::take(&mut out.scratch);
        slope.clear();
        slope.resize(size, 0.0);
        let free = self.surface.free_direction();
        let travel = self.carriage.map(|_| size - D);
        let matrix = &mut out.matrix;
        let curved = out.with_matrix && pressure > 0.0;
        let touch = self.touch(cluster, &view, |k, weight, found| {
            let values = self.skin.table.values(hat.points[k].0 as usize);
            let local = hat.local(k);
            for (&l, value) in local.iter().zip(values) {
                for i in 0..D {
                    slope[l as usize * D + i] += weight * value * found.normal[i];
                }
            }
            if let (Some(place), Some(along)) = (travel, &free) {
                slope[place] -= weight * found.normal.dot(along);
            }
            if curved && found.curvature.iter().any(|c| *c != 0.0) {
                let factor = -pressure * weight;
                for (&b, value) in local.iter().zip(values) {
                    for j in 0..D {
                        let column = &mut matrix[(b as usize * D + j) * size..][..size];
                        for (&a, other) in local.iter().zip(values) {
                            for i in 0..D {
                                column[a as usize * D + i] += factor * value * other * found.curvature[(i, j)];
                            }
                        }
                    }
                }
                if let (Some(place), Some(along)) = (travel, &free) {
                    let turned = found.curvature * along;
                    for (&a, value) in local.iter().zip(values) {
                        for i in 0..D {
                            let entry = -factor * value * turned[i];
                            matrix[place * size + a as usize * D + i] += entry;
                            matrix[(a as usize * D + i) * size + place] += entry;
                        }
                    }
                    matrix[place * size + place] += factor * along.dot(&turned);
                }
            }
        });
        if !self.touches(cluster, pressure, touch.gap) {
            matrix.fill(0.0);
            out.scratch = slope;
            return;
        }
        let proximal = self.proximal(cluster);
        let force = pressure - proximal * touch.gap;
        for (r, s) in out.residual.iter_mut().zip(&slope) {
            *r -= force * s;
        }
        for (l, s) in out.load_slope.iter_mut().zip(&slope) {
            *l += proximal * touch.by_load * s;
        }
        if out.with_matrix {
            for (column, b) in out.matrix.chunks_exact_mut(size).zip(&slope) {
                let factor = proximal / hat.area * b;
                if factor != 0.0 {
                    for (entry, a) in column.iter_mut().zip(&slope) {
                        *entry += factor * a;
                    }
                }
            }
        }
        out.scratch = slope;
    }

    fn advance(&self, cluster: usize, view: View<'_>, step: &[f64], condensed_step: &mut [f64]) -> f64 {
        let pressure = view.condensed[cluster];
        let (gap, change) = self.change(cluster, &view, step);
        if self.touches(cluster, pressure, gap) {
            condensed_step[0] = -self.proximal(cluster) * (gap + change);
            return 1.0;
        }
        condensed_step[0] = -pressure;
        let most = TOO_FAR * self.skin.hats[cluster].width;
        if gap + change < -most && change < 0.0 {
            return ((gap + most) / -change).min(1.0);
        }
        1.0
    }

    fn farthest_load(&self, from: f64, to: f64) -> f64 {
        let depth = 0.5 * self.surface.shape.depth();
        let Drive::Moved { by, amplitude } = &self.surface.drive else { return to };
        if !depth.is_finite() {
            return to;
        }
        let way = |load: f64| by.norm() * (amplitude.evaluate(load).0 - amplitude.evaluate(from).0).abs();
        let mut part = 1.0;
        while way(from + part * (to - from)) > depth && part > 1e-3 {
            part *= 0.5;
        }
        from + part * (to - from)
    }
}

/// The unknown travel of a rigid surface that is pushed: its load, and what keeps the components regular that it has no use
/// for.
pub(crate) struct Carriage<const D: usize> {
    pub node: [u32; 1],
    pub force: f64,
    pub amplitude: crate::term::Amplitude,
    /// Stiffness of the unused components.
    pub stiffness: f64,
}

impl<const D: usize> Term<D> for Carriage<D> {
    fn clusters(&self) -> usize {
        1
    }

    fn nodes(&self, _: usize) -> &[u32] {
        &self.node
    }

    fn break_points(&self) -> Vec<f64> {
        self.amplitude.break_points()
    }

    fn matrix_follows_load(&self) -> bool {
        false
    }

    fn linearize(&self, _: usize, view: View<'_>, out: &mut Element) {
        let (factor, slope) = self.amplitude.evaluate(view.load);
        out.residual[0] = -self.force * factor;
        out.load_slope[0] = -self.force * slope;
        for i in 1..D {
            out.residual[i] = self.stiffness * view.displacement[self.node[0] as usize * D + i];
            if out.with_matrix {
                out.matrix[i * D + i] = self.stiffness;
            }
        }
    }
}

/// Keeps a body regular that nothing but contact holds: an added diagonal, $\alpha_I |\delta d_I|^2$, that acts on the steps of
/// Newton's method and not on its solution.
pub(crate) struct Leash {
    pub nodes: Vec<[u32; 1]>,
    pub stiffness: Vec<f64>,
}

impl<const D: usize> Term<D> for Leash {
    fn clusters(&self) -> usize {
        self.nodes.len()
    }

    fn nodes(&self, cluster: usize) -> &[u32] {
        &self.nodes[cluster]
    }

    fn matrix_follows_load(&self) -> bool {
        false
    }

    fn linearize(&self, cluster: usize, _: View<'_>, out: &mut Element) {
        if out.with_matrix {
            for i in 0..D {
                out.matrix[i * D + i] = self.stiffness[cluster];
            }
        }
    }
}
