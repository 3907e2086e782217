//! The volume behind a loaded boundary: control an inflation by what is pumped in.

use crate::error::SolveError;
use crate::geometry::{Mat3, Vec3, padded};
use crate::table::ShapeTable;
use crate::tensor::{Tangent, add_determinant_hessian, cofactor};

use super::functional::Functional;

/// The change of the volume enclosed by a boundary part,
/// $$V(d) = -\tfrac1m\int x\cdot\operatorname{cof}(F)N\\,\mathrm d\Gamma - V(0),$$
/// $N$ outward from the body, $m$ the number of directions that the kinematics moves (2 in plane strain and
/// for cylinders, 3 otherwise). A uniform pressure is its work conjugate: $-p\\,\partial V/\partial d$ are the
/// forces of a follower pressure on a part that is closed, or held at its ends. Behind a sheet in plane stress it is taken with the
/// thickness at rest: the pressure acts on the thickness that is left, and is no conjugate of it.
#[derive(Debug, Clone)]
pub struct EnclosedVolume<const D: usize> {
    table: ShapeTable<D>,
    at_rest: f64,
}

impl<const D: usize> EnclosedVolume<D> {
    /// The volume behind the boundary of a table with normals and values.
    ///
    /// # Errors
    /// [`SolveError::Empty`] for a table without normals or without values: no boundary moves behind it.
    pub fn new(table: ShapeTable<D>) -> Result<Self, SolveError> {
        ensure!(
            table.point_count() > 0 && table.normals().len() == table.point_count(),
            SolveError::Empty {
                what: "normals at the points of an enclosed volume",
                remedy: "points inside a body have none: tabulate it over the points of a boundary (Cells::boundary)",
            }
        );
        ensure!(
            table.has_values(),
            SolveError::Empty {
                what: "values in the table of an enclosed volume",
                remedy: "smoothed tables hold gradients alone: tabulate the points of the boundary with ShapeTable::new",
            }
        );
        let mut volume = EnclosedVolume { table, at_rest: 0.0 };
        let rest = vec![0.0; volume.table.node_count() * D];
        volume.at_rest = volume.total(&rest);
        Ok(volume)
    }

    /// Directions in which the kinematics moves: the plane's and the hoops'.
    fn directions(&self) -> f64 {
        (D + self.table.hoop_components().len()) as f64
    }

    /// Current position, deformation gradient and reference normal at a point.
    fn state(&self, point: usize, d: &[f64]) -> (Vec3, Mat3, Vec3) {
        let x = self.table.positions()[point] + self.table.displacement(point, d);
        let normal = self.table.normals()[point];
        (padded(&x), Mat3::identity() + self.table.displacement_gradient(point, d), padded(&normal))
    }

    fn total(&self, d: &[f64]) -> f64 {
        let points = 0..self.table.normals().len();
        let sum: f64 = points
            .map(|point| {
                let (x, f, normal) = self.state(point, d);
                self.table.weights()[point] * x.dot(&(cofactor(&f) * normal))
            })
            .sum();
        -sum / self.directions()
    }
}

impl<const D: usize> Functional for EnclosedVolume<D> {
    fn value(&self, displacement: &[f64]) -> f64 {
        self.total(displacement) - self.at_rest
    }

    fn unknowns(&self) -> Option<usize> {
        Some(self.table.node_count() * D)
    }

    fn gradient(&self, displacement: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        let factor = -1.0 / self.directions();
        for point in 0..self.table.normals().len() {
            let (x, f, normal) = self.state(point, displacement);
            let weight = factor * self.table.weights()[point];
            let area = cofactor(&f) * normal;
            // ∂(x·cof(F)N)/∂F = x N : ∂cof/∂F.
            let mut hessian = Tangent::zeros();
            add_determinant_hessian(&mut hessian, &f, 1.0);
            let outer = crate::tensor::components(&(x * normal.transpose()));
            let slope = hessian * outer;
            let nodes = self.table.nodes(point);
            let gradients = self.table.gradients(point);
            let values = self.table.values(point);
            let n = nodes.len();
            for (a, &node) in nodes.iter().enumerate() {
                for i in 0..D {
                    let mut sum = values[a] * area[i];
                    for s in 0..D {
                        sum += slope[3 * i + s] * gradients[s * n + a];
                    }
                    if i == 0 {
                        for &k in self.table.hoop_components() {
                            sum += slope[4 * k] * gradients[D * n + a];
                        }
                    }
                    if let Some(out) = out.get_mut(node as usize * D + i) {
                        *out += weight * sum;
                    }
                }
            }
        }
    }
}
