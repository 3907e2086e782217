//! Gradients by linear fits: what stands for a body on any particles where it is solved by iteration.

use nalgebra::{Matrix4, Vector4};

use crate::each::{Each, list_of};
use crate::error::Error;
use crate::geometry::{Point, Vec3, all_padded, padded};
use crate::kinematics::Kinematics;
use crate::quadrature::Points;
use crate::table::ShapeTable;

/// Particles that a fit takes first, and where those lie in a plane.
const NEAREST: [usize; 4] = [8, 14, 27, usize::MAX];
/// Smallest over largest eigenvalue of the moments, below which particles lie in a plane.
const FLAT: f64 = 0.02;
/// Distance at which weights vanish, in that of the last particle, and the power by which they fall: fits to close particles are as stiff as
/// trilinear elements, fits to many average out displacements that alternate from particle to particle.
const REACH: f64 = 1.2;
const FALL: i32 = 6;
/// Points in whose fits a particle has a weight at least, and the distance at which the weight vanishes, in that of the last of them: the
/// stiffness of a particle goes with the square of its weights.
const POINTS: usize = 4;
const OWN_REACH: f64 = 2.5;

/// A table on the points and clusters of another one whose gradients are those of the linear field that fits the nearest particles best,
/// of those that the other sees. Weights fall with the distance, so that points of one cell fit different fields and rigid motions alone
/// have no energy. Free expansion is left out: `stretch` is what the other table's weights hold of it.
///
/// # Errors
/// As [`ShapeTable::tabulate`].
pub(super) fn linear_fits<const D: usize>(
    of: &ShapeTable<D>,
    nodes: &[Point<D>],
    kinematics: &dyn Kinematics<D>,
    stretch: &(dyn Fn(&Point<D>) -> f64 + Sync),
) -> Result<ShapeTable<D>, Error> {
    let clusters = of.clusters();
    let weights = list_of(of.weights().len(), |point| of.weights()[point] / stretch(&of.positions()[point]).powi(3));
    let mut points = Points { positions: of.positions().to_vec(), weights, ..Points::empty() };
    for cluster in 0..clusters.count() {
        points.groups.push(clusters.points(cluster).end);
    }
    let closest = closest(of, nodes);
    let nodes: Vec<Vec3> = all_padded(nodes);
    ShapeTable::tabulate(nodes.len(), &points, kinematics, &|scratch, point, out| {
        let near = scratch.of::<Vec<(f64, u32)>>();
        out.nodes.clear();
        out.values.clear();
        out.gradients.clear();
        fit(
            &padded(&of.positions()[point]),
            of.nodes(point),
            (&nodes, &closest),
            near,
            &mut |node, value, gradient| {
                out.nodes.push(node);
                out.values.push(value);
                out.gradients.push(padded(&gradient));
            },
        );
        out.rcond = 1.0;
        Ok(())
    })
}

/// Hands out the value and gradient of each particle that has a weight in the fit at a point, of those that it sees.
fn fit(
    at: &Vec3,
    seen: &[u32],
    (nodes, closest): (&[Vec3], &[f64]),
    near: &mut Vec<(f64, u32)>,
    push: &mut dyn FnMut(u32, f64, Vec3),
) {
    near.clear();
    near.extend(seen.iter().map(|&node| ((nodes[node as usize] - at).norm(), node)));
    near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let (mut scale, mut moments) = (1.0, Matrix4::zeros());
    let term = |node: u32, scale: f64| {
        let off = (nodes[node as usize] - at) / scale;
        Vector4::new(1.0, off[0], off[1], off[2])
    };
    // Particles far from all points have weights in the fits of those that are nearest to them.
    let weight = |distance: f64, node: u32, scale: f64| {
        (1.0 - (distance / scale.max(OWN_REACH * closest[node as usize])).powi(2)).max(0.0).powi(FALL)
    };
    for nearest in NEAREST {
        let count = nearest.min(near.len());
        scale = REACH * near.get(count.saturating_sub(1)).map_or(1.0, |last| last.0).max(f64::MIN_POSITIVE);
        moments = Matrix4::zeros();
        for &(distance, node) in near.iter() {
            let p = term(node, scale);
            moments += p * p.transpose() * weight(distance, node, scale);
        }
        let eigenvalues = moments.symmetric_eigenvalues();
        if eigenvalues.min() > FLAT * eigenvalues.max() || count == near.len() {
            break;
        }
    }
    // Directions in which no particle lies have no gradient.
    let inverse = moments.pseudo_inverse(1e-9 * moments.trace()).unwrap_or_else(|_| Matrix4::zeros());
    near.retain(|&(distance, node)| weight(distance, node, scale) > 0.0);
    near.sort_unstable_by_key(|own| own.1);
    for &(distance, node) in near.iter() {
        let own = inverse * term(node, scale) * weight(distance, node, scale);
        push(node, own[0], Vec3::new(own[1], own[2], own[3]) / scale);
    }
}

/// The distance of each particle from the last of its nearest points.
fn closest<const D: usize>(of: &ShapeTable<D>, nodes: &[Point<D>]) -> Vec<f64> {
    let mut nearest = vec![[f64::INFINITY; POINTS]; nodes.len()];
    for (point, at) in of.positions().iter().enumerate() {
        for &node in of.nodes(point) {
            let distance = (nodes[node as usize] - at).norm();
            let known = &mut nearest[node as usize];
            let place = known.partition_point(|own| *own <= distance);
            if place < POINTS {
                known[place..].rotate_right(1);
                known[place] = distance;
            }
        }
    }
    nearest.mapped(|own| own.iter().copied().filter(|d| d.is_finite()).fold(0.0, f64::max))
}
