//! The travel of pushed surfaces, and what keeps bodies regular that nothing but contact holds.

use crate::term::{Amplitude, Element, Layout, Term, View};

/// The unknown travel of a rigid surface that is pushed, and the turn of one that is free to turn, as a length at the end of a lever: their
/// loads, and what keeps the components regular that it has no use for.
pub(crate) struct RigidBodyDof {
    /// Components of a node.
    pub dim: usize,
    pub node: [u32; 1],
    /// Force and moment over the lever with their amplitudes, where it is free to move so.
    pub loads: [Option<(f64, Amplitude)>; 2],
    /// Stiffness of the unused components.
    pub stiffness: f64,
}

impl Term for RigidBodyDof {
    fn dim(&self) -> usize {
        self.dim
    }

    fn nodes(&self, _: usize) -> &[u32] {
        &self.node
    }

    fn break_points(&self) -> Vec<f64> {
        let mut all = Vec::new();
        for (_, amplitude) in self.loads.iter().flatten() {
            all.append(&mut amplitude.break_points());
        }
        all
    }

    fn amplitudes(&self) -> Vec<Amplitude> {
        self.loads.iter().flatten().map(|(_, amplitude)| amplitude.clone()).collect()
    }

    fn layout(&self) -> Layout {
        Layout { follows_load: false, ..Layout::default() }
    }

    fn linearize(&self, _: usize, view: View<'_>, out: &mut Element) {
        for i in 0..self.dim {
            if let Some((force, amplitude)) = self.loads.get(i).and_then(Option::as_ref) {
                let (factor, slope) = amplitude.evaluate(view.load);
                out.residual[i] = -force * factor;
                out.load_slope[i] = -force * slope;
                continue;
            }
            out.residual[i] = self.stiffness * view.displacement[self.node[0] as usize * self.dim + i];
            if out.with_matrix {
                out.matrix[i * self.dim + i] = self.stiffness;
            }
        }
    }
}

/// Keeps a body regular that nothing but contact holds: an added diagonal, $\alpha_I |\delta d_I|^2$, that acts on the steps of
/// Newton's method and not on its solution.
pub(crate) struct ArtificialSpring {
    /// Components of a node.
    pub dim: usize,
    pub nodes: Vec<[u32; 1]>,
    pub stiffness: Vec<f64>,
}

impl Term for ArtificialSpring {
    fn dim(&self) -> usize {
        self.dim
    }

    fn clusters(&self) -> usize {
        self.nodes.len()
    }

    fn nodes(&self, cluster: usize) -> &[u32] {
        &self.nodes[cluster]
    }

    fn layout(&self) -> Layout {
        Layout { follows_load: false, artificial: true, ..Layout::default() }
    }

    fn linearize(&self, cluster: usize, _: View<'_>, out: &mut Element) {
        if out.with_matrix {
            for i in 0..self.dim {
                out.matrix[i * self.dim + i] = self.stiffness[cluster];
            }
        }
    }
}
