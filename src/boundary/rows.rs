//! Rows of essential conditions, at particles and over boundaries.

use std::collections::HashMap;
use std::sync::Arc;

use crate::cells::BoundaryCells;
use crate::error::{ApproximationError, BoundaryError, Error};
use crate::geometry::Point;
use crate::kinematics::Kinematics;
use crate::shape::{Approximation, ShapeFunctions};
use crate::table::check_values;
use crate::term::Amplitude;

use super::claims::{Claim, own_component, says_again, spans};

/// One condition $\sum_k c_k d_k = g\\,a(\lambda)$ on the coefficients $d$.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// (unknown, coefficient) pairs.
    pub entries: Vec<(usize, f64)>,
    /// The unknown that the row owns: component of the particle it belongs to.
    pub dependent: usize,
    /// $g$ \[length; length × measure for rows over a boundary\].
    pub target: f64,
    /// Its factor $a(\lambda)$.
    pub amplitude: Amplitude,
    /// The condition that the row comes from, for messages.
    pub label: String,
}

impl Row {
    /// $\sum_k |c_k|$: what makes values of rows over a boundary lengths, of those at particles about 1.
    pub(crate) fn measure(&self) -> f64 {
        self.entries.iter().map(|(_, c)| c.abs()).sum()
    }
}

/// A displacement component as a function of $X$ and the load factor.
pub type Motion<const D: usize> = Arc<dyn Fn(&Point<D>, f64) -> f64 + Send + Sync>;

/// The value of a row that weighs the given points: $g$ and $a(\lambda)$.
pub(crate) type Value<'a, const D: usize> = &'a dyn Fn(Vec<(Point<D>, f64)>) -> (f64, Amplitude);

/// $g\\,a(\lambda)$ with $g = \sum w\\,g(X)$.
pub(crate) fn scaled<'a, const D: usize>(
    target: &'a dyn Fn(&Point<D>) -> f64,
    amplitude: &'a Amplitude,
) -> impl Fn(Vec<(Point<D>, f64)>) -> (f64, Amplitude) + 'a {
    move |points| (points.iter().map(|(x, w)| w * target(x)).sum(), amplitude.clone())
}

/// $\sum w\\,g(X, \lambda)$, all of it in the amplitude.
pub(crate) fn moved<'a, const D: usize>(
    motion: &'a Motion<D>,
) -> impl Fn(Vec<(Point<D>, f64)>) -> (f64, Amplitude) + 'a {
    move |points| {
        let motion = motion.clone();
        let sum = move |load: f64| points.iter().map(|(x, w)| w * motion(x, load)).sum();
        (1.0, Amplitude::Function(Arc::new(sum)))
    }
}

/// The unit vector along which a condition acts, at a point with the outward normal of the boundary there (zero where there
/// is none).
pub(crate) type Along<'a, const D: usize> = &'a dyn Fn(&Point<D>, &Point<D>) -> Result<Point<D>, BoundaryError>;

/// Conditions along an axis.
fn along_axis<const D: usize>(component: usize) -> impl Fn(&Point<D>, &Point<D>) -> Result<Point<D>, BoundaryError> {
    move |_, _| Ok(Point::from_fn(|i, _| f64::from(u8::from(i == component))))
}

/// The rows of a problem.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Constraints {
    rows: Vec<Row>,
    /// By particle: what boundary integrals have claimed of it.
    claimed: HashMap<usize, Vec<Claim>>,
    /// By particle: its values that are prescribed, to find repeated and conflicting conditions.
    at_particles: HashMap<usize, Vec<Claim>>,
    /// Kinks of motions, whose rows don't know them.
    kinks: Vec<f64>,
}

impl Constraints {
    /// No rows.
    pub fn new() -> Self {
        Constraints::default()
    }

    /// The rows, in the order in which they were added.
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// Load factors inside $(0, 1)$ at which prescribed values have kinks: steps of the load stop there.
    pub fn break_points(&self) -> Vec<f64> {
        self.rows.iter().flat_map(|row| row.amplitude.break_points()).chain(self.kinks.iter().copied()).collect()
    }

    /// Adds load factors at which motions have kinks.
    pub(crate) fn add_knots(&mut self, loads: Vec<f64>) {
        self.kinks.extend(loads);
    }

    /// How far rows and kinks have come, to [`take_back`](Constraints::take_back) what is added from here on.
    pub(crate) fn mark(&self) -> [usize; 2] {
        [self.rows.len(), self.kinks.len()]
    }

    /// Takes back what was added since a mark: copies of all rows would cost as many as there are for each condition.
    pub(crate) fn take_back(&mut self, [rows, kinks]: [usize; 2]) {
        for claims in [&mut self.at_particles, &mut self.claimed] {
            claims.retain(|_, of_particle| {
                of_particle.retain(|claim| claim.row < rows);
                !of_particle.is_empty()
            });
        }
        self.rows.truncate(rows);
        self.kinks.truncate(kinks);
    }

    /// Whether a condition prescribes a component of a particle.
    pub(crate) fn claims(&self, particle: usize, component: usize) -> bool {
        [&self.claimed, &self.at_particles]
            .iter()
            .any(|claims| claims.get(&particle).is_some_and(|claims| spans(claims, component)))
    }

    /// Appends the rows of a body whose particles stand `nodes` behind the first, each with `dimension` components.
    pub(crate) fn append(&mut self, other: Constraints, nodes: usize, dimension: usize) {
        let before = self.rows.len();
        let shift = nodes * dimension;
        self.rows.extend(other.rows.into_iter().map(|mut row| {
            row.dependent += shift;
            row.entries.iter_mut().for_each(|entry| entry.0 += shift);
            row
        }));
        for (mine, others) in [(&mut self.claimed, other.claimed), (&mut self.at_particles, other.at_particles)] {
            mine.extend(others.into_iter().map(|(particle, mut claims)| {
                claims.iter_mut().for_each(|claim| claim.row += before);
                (particle + nodes, claims)
            }));
        }
        self.kinks.extend(other.kinks);
    }

    /// Adds entries to a row.
    pub(crate) fn extend_row(&mut self, row: usize, entries: Vec<(usize, f64)>) {
        if let Some(row) = self.rows.get_mut(row) {
            row.entries.extend(entries);
        }
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Adds a row as it is.
    ///
    /// # Errors
    /// Where a number is not finite or the row has no entry.
    pub fn push(&mut self, row: Row) -> Result<(), BoundaryError> {
        if let Some(&(_, value)) = row.entries.iter().find(|(_, c)| !c.is_finite()) {
            return Err(BoundaryError::Value { what: row.label, value, load: 1.0 });
        }
        for load in [0.0, 1.0] {
            let value = row.target * row.amplitude.evaluate(load).0;
            if !value.is_finite() {
                return Err(BoundaryError::Value { what: row.label, value, load });
            }
        }
        if row.entries.iter().all(|(_, c)| *c == 0.0) {
            return Err(BoundaryError::Dependent { row: self.rows.len(), what: row.label, pivot: 0.0 });
        }
        self.rows.push(row);
        Ok(())
    }

    /// Conditions $u_i(X_J) = g(X_J)\\,a(\lambda)$ at particles: the rows $\Psi_I(X_J)$ of the paper's
    /// transformation (4.29).
    ///
    /// A condition given twice with equal values is taken once.
    ///
    /// # Errors
    /// Where two conditions conflict, a component does not exist, or a shape function is not defined.
    pub fn at_particles<const D: usize, A: Approximation<D>>(
        &mut self,
        approximation: &A,
        particles: &[usize],
        component: usize,
        target: &dyn Fn(&Point<D>) -> f64,
        amplitude: &Amplitude,
        label: &str,
    ) -> Result<(), Error> {
        check_component(component, D, label)?;
        self.collocate(approximation, particles, &[], &along_axis(component), &scaled(target, amplitude), label)
    }

    /// Conditions $u_i(X_J) = g(X_J, \lambda)$ at particles: as [`at_particles`](Constraints::at_particles)
    /// for values that do not grow in proportion, such as those of a rotation.
    ///
    /// # Errors
    /// As [`at_particles`](Constraints::at_particles).
    pub fn motion_at_particles<const D: usize, A: Approximation<D>>(
        &mut self,
        approximation: &A,
        particles: &[usize],
        component: usize,
        motion: &Motion<D>,
        label: &str,
    ) -> Result<(), Error> {
        check_component(component, D, label)?;
        self.collocate(approximation, particles, &[], &along_axis(component), &moved(motion), label)
    }

    /// Conditions $e(X_J)\\cdot u(X_J) = g$ at particles, with the outward normals there where they are known.
    pub(crate) fn collocate<const D: usize, A: Approximation<D>>(
        &mut self,
        approximation: &A,
        particles: &[usize],
        normals: &[Point<D>],
        along: Along<'_, D>,
        value: Value<'_, D>,
        label: &str,
    ) -> Result<(), Error> {
        let rounding = rounding(approximation.nodes());
        let mut scratch = A::Scratch::default();
        let mut psi = ShapeFunctions::default();
        for (place, &particle) in particles.iter().enumerate() {
            let Some(&at) = approximation.nodes().get(particle) else {
                return Err(no_particle(particle).into());
            };
            let normal = normals.get(place).copied().unwrap_or_else(Point::zeros);
            let direction = along(&at, &normal)?;
            let (target, amplitude) = value(vec![(at, 1.0)]);
            let claims = self.at_particles.get(&particle).map_or(&[][..], Vec::as_slice);
            let asked = Claim::new(direction, label, target, amplitude.clone(), self.rows.len());
            if says_again(claims, &asked, &at, rounding)? {
                continue;
            }
            let dependent = particle * D + own_component(claims, &direction, |row| self.rows[row].dependent % D);
            approximation.evaluate_at_node(particle, &mut scratch, &mut psi)?;
            check_values(&psi, approximation.nodes().len(), &at)?;
            let mut entries = Vec::with_capacity(psi.nodes.len());
            for (&node, &value) in psi.nodes.iter().zip(&psi.values) {
                let parts = (0..D).filter(|&i| direction[i] != 0.0);
                entries.extend(parts.map(|i| (node as usize * D + i, value * direction[i])));
            }
            self.push(Row { entries, dependent, target, amplitude, label: label.to_string() })?;
            self.at_particles.entry(particle).or_default().push(asked);
        }
        Ok(())
    }

    /// Conditions $\int\Theta_J(u_i - g\\,a(\lambda))\\,\mathrm d\Gamma = 0$ over a boundary part with its linear
    /// hats $\Theta_J$, (4.8), (4.16).
    ///
    /// Each corner and edge is owned by the part that claims it first; on the others its hat is merged
    /// into its neighbour's, so that there are as many rows as boundary particles and the hats of each
    /// part still sum to one. On the axis of a body of revolution the measure is that of the line.
    ///
    /// # Errors
    /// Where two conditions conflict at a corner, a component does not exist, or a shape function is not defined.
    #[allow(clippy::too_many_arguments)]
    pub fn over_boundary<const D: usize, A: Approximation<D>>(
        &mut self,
        approximation: &A,
        boundary: &BoundaryCells<D>,
        kinematics: &(impl Kinematics<D> + ?Sized),
        component: usize,
        target: &dyn Fn(&Point<D>) -> f64,
        amplitude: &Amplitude,
        label: &str,
    ) -> Result<(), Error> {
        check_component(component, D, label)?;
        self.integrate(approximation, boundary, kinematics, &along_axis(component), &scaled(target, amplitude), label)
    }

    /// Conditions $\int\Theta_J(u_i - g(X, \lambda))\\,\mathrm d\Gamma = 0$: as
    /// [`over_boundary`](Constraints::over_boundary) for values that do not grow in proportion.
    ///
    /// # Errors
    /// As [`over_boundary`](Constraints::over_boundary).
    pub fn motion_over_boundary<const D: usize, A: Approximation<D>>(
        &mut self,
        approximation: &A,
        boundary: &BoundaryCells<D>,
        kinematics: &(impl Kinematics<D> + ?Sized),
        component: usize,
        motion: &Motion<D>,
        label: &str,
    ) -> Result<(), Error> {
        check_component(component, D, label)?;
        self.integrate(approximation, boundary, kinematics, &along_axis(component), &moved(motion), label)
    }

    /// Conditions $\int\Theta_J\,(e(X)\cdot u - g)\,\mathrm d\Gamma = 0$ along a direction that may vary.
    pub(crate) fn integrate<const D: usize, A: Approximation<D>>(
        &mut self,
        approximation: &A,
        boundary: &BoundaryCells<D>,
        kinematics: &(impl Kinematics<D> + ?Sized),
        along: Along<'_, D>,
        value: Value<'_, D>,
        label: &str,
    ) -> Result<(), Error> {
        boundary.validate(approximation.nodes().len())?;
        // Where each hat goes: to its own particle, or to the nearest free one on a shared facet.
        let mut facets_of: HashMap<u32, Vec<u32>> = HashMap::new();
        let mut order: Vec<u32> = Vec::new();
        for group in boundary.points.groups.windows(2) {
            let mut members: Vec<u32> = Vec::new();
            for hats in &boundary.hats[group[0]..group[1]] {
                for &(particle, _) in hats {
                    if !members.contains(&particle) {
                        members.push(particle);
                    }
                }
            }
            for &particle in &members {
                if !facets_of.contains_key(&particle) {
                    order.push(particle);
                }
                facets_of.entry(particle).or_default().extend(&members);
            }
        }
        let rounding = rounding(approximation.nodes());
        let normals = boundary.normals_at_particles();
        // What this condition asks of each particle, and which have said it already.
        let mut asked: HashMap<u32, (Claim, bool)> = HashMap::with_capacity(order.len());
        for &particle in &order {
            let at = approximation.nodes()[particle as usize];
            let normal = normals.get(&particle).copied().unwrap_or_else(Point::zeros);
            let (target, amplitude) = value(vec![(at, 1.0)]);
            let claim = Claim::new(along(&at, &normal)?, label, target, amplitude, 0);
            let claims = self.claimed.get(&(particle as usize)).map_or(&[][..], Vec::as_slice);
            // Both conditions hold at the corner, whoever owns it: merged without a look, the later one would be spread
            // over its neighbours and the answer depend on the order.
            let again = says_again(claims, &claim, &at, rounding)?;
            asked.insert(particle, (claim, again));
        }
        let mut receiver: HashMap<u32, u32> = HashMap::new();
        for &particle in &order {
            if !asked[&particle].1 {
                receiver.insert(particle, particle);
                continue;
            }
            let at = approximation.nodes()[particle as usize];
            let nearer = |a: &u32, b: &u32| {
                let distance = |n: &u32| (approximation.nodes()[*n as usize] - at).norm_squared();
                distance(a).total_cmp(&distance(b)).then(a.cmp(b))
            };
            let nearest = facets_of[&particle].iter().copied().filter(|other| !asked[other].1).min_by(nearer);
            // In corners of triangles all particles around may be claimed: the hats of the part still sum to one.
            let nearest = nearest.or_else(|| order.iter().copied().filter(|other| !asked[other].1).min_by(nearer));
            // A hat that has nowhere to go says again what an earlier condition said.
            if let Some(nearest) = nearest {
                receiver.insert(particle, nearest);
            }
        }
        type Sum<const D: usize> = (HashMap<usize, f64>, Vec<(Point<D>, f64)>);
        let mut sums: HashMap<u32, Sum<D>> = HashMap::new();
        let mut scratch = A::Scratch::default();
        let mut psi = ShapeFunctions::default();
        let has_hoops = !crate::kinematics::hoop_components(kinematics)?.is_empty();
        for group in boundary.points.groups.windows(2) {
            let mut at_group = boundary.points.positions[group[0]..group[1]].iter();
            let on_axis = has_hoops && at_group.all(|x| kinematics.measure(x) == 0.0);
            for point in group[0]..group[1] {
                let at = boundary.points.positions[point];
                approximation.evaluate_values(&at, &mut scratch, &mut psi)?;
                check_values(&psi, approximation.nodes().len(), &at)?;
                let measure = if on_axis { 1.0 } else { crate::kinematics::measure(kinematics, has_hoops, &at)? };
                let normal = boundary.points.normals.get(point).copied().unwrap_or_else(Point::zeros);
                let direction = along(&at, &normal)?;
                for &(particle, hat) in &boundary.hats[point] {
                    let Some(&particle) = receiver.get(&particle) else { continue };
                    let weight = boundary.points.weights[point] * measure * hat;
                    let (entries, points) = sums.entry(particle).or_default();
                    for (&node, psi) in psi.nodes.iter().zip(&psi.values) {
                        for i in (0..D).filter(|&i| direction[i] != 0.0) {
                            *entries.entry(node as usize * D + i).or_default() += weight * psi * direction[i];
                        }
                    }
                    points.push((at, weight));
                }
            }
        }
        for particle in order {
            let Some((entries, points)) = sums.remove(&particle) else { continue };
            let (target, amplitude) = value(points);
            let mut entries: Vec<(usize, f64)> = entries.into_iter().collect();
            entries.sort_unstable_by_key(|e| e.0);
            // The hats carry their measure: a multiplier is a traction [stress], whatever the spacing.
            let Some((mut claim, _)) = asked.remove(&particle) else { continue };
            let claims = self.claimed.get(&(particle as usize)).map_or(&[][..], Vec::as_slice);
            let own = own_component(claims, &claim.direction::<D>(), |row| self.rows[row].dependent % D);
            let dependent = particle as usize * D + own;
            claim.row = self.rows.len();
            self.push(Row { entries, dependent, target, amplitude, label: label.to_string() })?;
            self.claimed.entry(particle as usize).or_default().push(claim);
        }
        Ok(())
    }

    /// Writes $g\\,a(\lambda) - Gd$, row by row.
    pub fn violation(&self, displacement: &[f64], load: f64, violation: &mut Vec<f64>) {
        violation.clear();
        violation.extend(self.rows.iter().map(|row| {
            let value: f64 = row.entries.iter().map(|&(k, c)| c * displacement[k]).sum();
            row.target * row.amplitude.evaluate(load).0 - value
        }));
    }

    /// Writes $g\\,a'(\lambda)$, row by row.
    pub fn load_slope(&self, load: f64, slope: &mut Vec<f64>) {
        slope.clear();
        slope.extend(self.rows.iter().map(|row| row.target * row.amplitude.evaluate(load).1));
    }
}

fn no_particle(particle: usize) -> ApproximationError {
    ApproximationError::Particle {
        particle,
        what: "there is no particle of this number",
        remedy: "give indices below the number of particles",
    }
}

/// Refuses rows that name unknowns beyond the `unknowns` of a model.
pub(crate) fn check_unknowns(rows: &[Row], unknowns: usize) -> Result<(), BoundaryError> {
    let beyond = |row: &&Row| row.dependent >= unknowns || row.entries.iter().any(|e| e.0 >= unknowns);
    match rows.iter().find(beyond) {
        Some(row) => Err(BoundaryError::Unsuitable {
            enforcement: "row",
            reason: format!("{} names an unknown beyond the {unknowns} of the model", row.label),
        }),
        None => Ok(()),
    }
}

pub(crate) fn check_component(component: usize, dimension: usize, label: &str) -> Result<(), BoundaryError> {
    if component < dimension {
        Ok(())
    } else {
        Err(BoundaryError::Component { what: label.to_string(), component, dimension })
    }
}

/// Displacements closer than this part of the coordinates are equal: they may be differences of them.
const ROUNDING: f64 = 1e-14;

/// The rounding of displacements of some nodes.
pub(crate) fn rounding<const D: usize>(nodes: &[Point<D>]) -> f64 {
    ROUNDING * nodes.iter().fold(0.0, |largest: f64, x| largest.max(x.amax()))
}
