//! What holds a round body that is free to roll.

use crate::each::{add, sum_of};
use crate::geometry::Vec2;
use crate::term::{Element, Layout, Term, View};

/// A spring between two opposite places of a round body, along its circumference: the mean displacements of two trace functions,
/// $e = t_A\cdot\bar u_A + t_B\cdot\bar u_B$ with the tangents $t_A = -t_B$, so that it takes no part in translations.
pub(crate) struct RollingSpring {
    pub nodes: Vec<u32>,
    /// What each node moves the ends by.
    pub weights: Vec<Vec2>,
    /// Force per elongation.
    pub stiffness: f64,
}

impl RollingSpring {
    /// The force that it takes \[force\]: none where the motion that it holds is neutral.
    pub(crate) fn force(&self, displacement: &[f64]) -> f64 {
        let each = self.nodes.iter().zip(&self.weights);
        let moved = |(&node, weight): (&u32, &Vec2)| sum_of(2, |i| weight[i] * displacement[node as usize * 2 + i]);
        self.stiffness * each.map(moved).sum::<f64>()
    }
}

impl Term for RollingSpring {
    fn dim(&self) -> usize {
        2
    }

    fn nodes(&self, _: usize) -> &[u32] {
        &self.nodes
    }

    fn layout(&self) -> Layout {
        Layout { follows_load: false, ..Layout::default() }
    }

    fn linearize(&self, _: usize, view: View<'_>, out: &mut Element) {
        let force = self.force(view.displacement);
        let mut weights: Vec<f64> = Vec::with_capacity(2 * self.weights.len());
        for weight in &self.weights {
            weights.extend_from_slice(weight.as_slice());
        }
        add(&mut out.residual, force, &weights);
        if out.with_matrix {
            for (column, b) in out.matrix.chunks_exact_mut(weights.len()).zip(&weights) {
                column.iter_mut().zip(&weights).for_each(|(entry, a)| *entry += self.stiffness * a * b);
            }
        }
    }

    fn energy(&self, _: usize, view: View<'_>) -> f64 {
        0.5 * self.force(view.displacement).powi(2) / self.stiffness
    }
}
