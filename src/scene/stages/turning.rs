//! How rigid bodies that conditions lead as a whole turn in a stage: they keep their shape at each load factor.

use std::collections::HashMap;
use std::f64::consts::TAU;
use std::sync::Arc;

use nalgebra::Rotation3;

use crate::each::Each;
use crate::geometry::{Mat3, Part, Vec3};
use crate::scene::{Place, Problem, RigidFrame, Spot, rotation_vector};
use crate::term::Amplitude;

use super::StagePath;

/// Matrices that are off a rotation by less are rotations, to what Newton's method leaves; turns by less have no axis.
const ROUNDING: f64 = 1e-9;

/// What an equation prescribes beside its own value and what that is off by at load factor 0, by the load factor; nothing at 0 and at 1.
pub(super) type Deviation = Arc<dyn Fn(f64) -> f64 + Send + Sync>;

/// The deviations of the equations that lead rigid bodies as a whole, by their numbers: nodes of frames move on arcs.
///
/// Where what is prescribed is a rotation $R_g(\\lambda)$ at each load factor, as a motion or a level is, a body that begins with
/// another rotation $R_0$ turns by $\\exp((1 - \\lambda)\\,s)\\,R_g(\\lambda)$, $\\exp s = R_0 R_g(0)^T$. Straight lines are
/// rotations at their ends alone: the body turns about one axis, $R_g = R_g(1)$.
pub(super) fn deviations<const D: usize>(
    done: &[StagePath<D>],
    problem: &Problem<D>,
    displacement: &[f64],
) -> HashMap<usize, Deviation> {
    let mut deviations = HashMap::new();
    // Of revolution none turns.
    for frame in problem.frames.iter().filter(|frame| frame.rigidity.is_some()) {
        let Some(leading) = leading(problem, frame) else { continue };
        let (first, led): (Vec<usize>, Vec<Led>) = leading.into_iter().unzip();
        let start = frame.motion(displacement).1;
        let Some(turning) = Turning::of(led, frame.size, start, turned(done, &frame.name)) else { continue };
        let turning = Arc::new(turning);
        for (direction, first) in first.into_iter().enumerate() {
            (1..=D).for_each(|node| drop(deviations.insert(first + node, turning.deviation(direction, node))));
        }
    }
    deviations
}

/// One direction in which a condition leads a rigid body as a whole: what it prescribes for each node of the frame, the first in the middle.
struct Led {
    along: Vec3,
    values: Vec<(f64, Amplitude)>,
}

impl Led {
    fn value(&self, node: usize, load: f64) -> f64 {
        let (target, amplitude) = &self.values[node];
        target * amplitude.value(load)
    }

    /// $F^T e$ of what it prescribes along $e$.
    fn image(&self, size: f64, load: f64) -> Vec3 {
        let middle = self.value(0, load);
        let slope = |i: usize| if i + 1 < self.values.len() { (self.value(i + 1, load) - middle) / size } else { 0.0 };
        self.along + Vec3::from_fn(|i, _| slope(i))
    }
}

/// The directions in which conditions lead a body as a whole, each with the number of its first equation; none where directions vary over
/// the body.
fn leading<const D: usize>(problem: &Problem<D>, frame: &RigidFrame) -> Option<Vec<(usize, Led)>> {
    let mut leading = Vec::new();
    for placed in problem.placed.iter().filter(|placed| placed.nodes == frame.nodes()) {
        let whole = |place: &&Place<D>| matches!(&place.spot, Spot::Part(Part::Named(name)) if *name == frame.name);
        if placed.place.as_ref().filter(whole).is_none() {
            continue;
        }
        for first in placed.equations.clone().step_by(D + 1) {
            let equations = problem.equations.equations().get(first..=first + D)?;
            let along = equations.mapped(|equation| {
                let mut along = Vec3::zeros();
                equation.entries.iter().for_each(|&(unknown, c)| along[unknown % D] += c);
                along
            });
            if along.iter().any(|other| (other - along[0]).norm() > ROUNDING) {
                return None;
            }
            let values = equations.mapped(|equation| (equation.target, equation.amplitude.clone()));
            leading.push((first, Led { along: along[0], values }));
        }
    }
    (!leading.is_empty()).then_some(leading)
}

/// How a rigid body turns that is led as a whole.
struct Turning {
    led: Vec<Led>,
    size: f64,
    /// Where it begins.
    start: Mat3,
    /// Where it ends, if what leads it goes on straight lines.
    end: Option<Mat3>,
    /// From what leads it at load factor 0, or from the end, to where it begins: a rotation vector.
    back: Vec3,
}

impl Turning {
    /// None where what leads it is no rotation, and where straight lines are as good as arcs.
    fn of(led: Vec<Led>, size: f64, start: Mat3, turned: Vec3) -> Option<Self> {
        let amplitudes = || led.iter().flat_map(|led| led.values.iter().map(|value| &value.1));
        let is_straight = amplitudes().all(|own| !own.is_function() && own.break_points().is_empty());
        let mut loads = vec![1.0];
        if !is_straight {
            // Those of functions between them can't be known.
            loads.extend([0.0, 0.21, 0.47, 0.76].into_iter().chain(amplitudes().flat_map(Amplitude::break_points)));
        }
        let mut turning = Turning { led, size, start, end: None, back: Vec3::zeros() };
        if loads.into_iter().any(|load| !turning.is_rotation(load)) {
            return None;
        }
        let target = turning.own(if is_straight { 1.0 } else { 0.0 });
        turning.end = is_straight.then_some(target);
        turning.back = -way(turned, &start, &target);
        // An arc is off a straight line by the square of its angle.
        (!is_straight || turning.back.norm() > f64::EPSILON.sqrt()).then_some(turning)
    }

    /// The rotation at a load factor.
    fn rotation(&self, load: f64) -> Mat3 {
        Rotation3::new(self.back * (1.0 - load)).into_inner() * self.end.unwrap_or_else(|| self.own(load))
    }

    /// Pairs $(e, R^T e)$ of the rotation that is prescribed.
    fn images(&self, load: f64) -> Vec<(Vec3, Vec3)> {
        let mut images = self.led.mapped(|led| (led.along, led.image(self.size, load)));
        if self.led[0].values.len() == 3 {
            images.push((Vec3::z(), Vec3::z()));
        }
        images
    }

    /// The rotation that is prescribed; of several the one that is nearest to the start.
    fn own(&self, load: f64) -> Mat3 {
        let mut basis: Vec<(Vec3, Vec3)> = Vec::with_capacity(3);
        for (mut from, mut to) in self.images(load) {
            for (known, image) in &basis {
                let part = known.dot(&from);
                from -= known * part;
                to -= image * part;
            }
            let size = from.norm();
            if size > ROUNDING {
                basis.push((from / size, to / size));
            }
        }
        if let [(from, to)] = basis[..] {
            // Free to turn about one axis: it keeps the axis that is across both.
            let was = self.start.transpose() * from;
            let apart = (to - was * was.dot(&to)).try_normalize(ROUNDING);
            let apart = apart.unwrap_or_else(|| was.cross(&Vec3::ith(was.iamin(), 1.0)).normalize());
            let axis = was.cross(&apart);
            basis.push((self.start * axis, axis));
        }
        if let [(a, x), (b, y), ..] = basis[..] {
            basis.truncate(2);
            basis.push((a.cross(&b), x.cross(&y)));
        }
        basis.iter().map(|(from, to)| from * to.transpose()).sum()
    }

    /// Whether a rotation is prescribed.
    fn is_rotation(&self, load: f64) -> bool {
        let own = self.own(load);
        let is_off = |(from, to): &(Vec3, Vec3)| !((own.transpose() * from - to).norm() <= ROUNDING);
        (own.transpose() * own - Mat3::identity()).norm() <= ROUNDING && !self.images(load).iter().any(is_off)
    }

    /// The deviation of the equation for a direction and a node.
    fn deviation(self: &Arc<Self>, direction: usize, node: usize) -> Deviation {
        let turning = self.clone();
        let beside = move |load: f64| {
            let led = &turning.led[direction];
            let arm = turning.rotation(load).column(node - 1) * turning.size;
            led.value(0, load) + led.along.dot(&arm) - led.value(node, load)
        };
        let [first, last] = [beside(0.0), beside(1.0)];
        Arc::new(move |load| beside(load) - (1.0 - load) * first - load * last)
    }
}

/// The rotation vector that takes a body to an orientation: the shortest one, or back as the body has turned where the orientation is nearer to
/// that at rest than to where the body is.
fn way(turned: Vec3, start: &Mat3, target: &Mat3) -> Vec3 {
    let between = target * start.transpose();
    let [at_rest, shortest] = [target, &between].map(|rotation| Vec3::from(rotation_vector(rotation)));
    if at_rest.norm() < shortest.norm() { unwound(&between, at_rest - turned) } else { shortest }
}

/// The rotation vector by which a body has turned through all states, whole turns included.
fn turned<const D: usize>(done: &[StagePath<D>], name: &str) -> Vec3 {
    let mut turned = Vec3::zeros();
    for StagePath { problem, path, .. } in done {
        let Some(frame) = problem.frames.iter().find(|frame| frame.name == name) else { continue };
        for state in path.states() {
            turned = unwound(&frame.motion(&state.displacement).1, turned);
        }
    }
    turned
}

/// The rotation vector of a rotation, with as many whole turns as bring it nearest to another vector.
fn unwound(rotation: &Mat3, near: Vec3) -> Vec3 {
    let vector = Vec3::from(rotation_vector(rotation));
    let Some(axis) = [vector, near].iter().find_map(|vector| vector.try_normalize(ROUNDING)) else { return vector };
    vector + axis * (TAU * ((near - vector).dot(&axis) / TAU).round())
}
