//! Trace functions of boundary conditions on pieces of a surface.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use nalgebra::{DMatrix, DVector};

use crate::cells::CORNER;
use crate::cells::pieces::{EXACT, reproducing};
use crate::each::{Each, EachOf, IntoEach};
use crate::geometry::{Cubes, Disjoint, Vec3};

/// Radius within which particles carry the functions of a point, in bricks of the spacing at the particle: with three quarters of it the patch test leaves 3e-3.
const REACH: f64 = 4.0;
/// Radii are raised so often, each time by half.
const RAISES: usize = 5;
/// Functions larger than this say that normals are extrapolated.
const LARGEST: f64 = 4.0;
/// Part of a function that lies in a part of a piece, of that of the particle with the largest, below which its particle has none there.
const SHARE: f64 = 0.3;
/// Part of an equation that is left beyond others, below which it counts as dependent on them.
const LEFT: f64 = 0.03;
/// Products of unit rows below this are taken for none.
const UNSEEN: f64 = 1e-3;
/// Rounds of leaving such ones out: functions of the others become wider.
const ROUNDS: usize = 20;

/// Particles on a piece, each with its normal there, by cubes.
pub(super) struct Traces<'a> {
    spread: Spread<'a>,
    particles: Vec<(u32, Vec3)>,
    /// Cubes for each spacing over the finest one.
    cubes: Vec<(f64, Cubes<3, u32>)>,
    curved: bool,
    /// Cosine between normals above which a particle counts at a point.
    facing: f64,
}

/// Positions of all particles, and the spacing at each over the finest one.
#[derive(Clone, Copy)]
pub(super) struct Spread<'a> {
    pub(super) positions: &'a [Vec3],
    pub(super) scales: &'a [f64],
}

/// Wendland's function of the distance in parts of the radius.
fn weight(q: f64) -> f64 {
    if q < 1.0 { (1.0 - q).powi(4) * (4.0 * q + 1.0) } else { 0.0 }
}

impl<'a> Traces<'a> {
    pub(super) fn new(spread: Spread<'a>, particles: Vec<(u32, Vec3)>, curved: bool, facing: f64) -> Self {
        let mut cubes: BTreeMap<u64, (f64, Cubes<3, u32>)> = BTreeMap::new();
        for (place, &(particle, _)) in particles.iter().enumerate() {
            let scale = spread.scales[particle as usize];
            let own = cubes.entry(scale.to_bits()).or_insert_with(|| (scale, Cubes::new(REACH)));
            own.1.add(&(spread.positions[particle as usize] / scale), place as u32);
        }
        Traces { spread, particles, cubes: cubes.into_values().collect(), curved, facing }
    }

    /// Particles within a radius, in units of their spacings, whose normals are not turned away, by rising index, with their weights.
    fn around(&self, x: &Vec3, normal: &Vec3, radius: f64) -> Vec<(u32, f64)> {
        let mut found: Vec<(u32, f64)> = Vec::new();
        for (scale, cubes) in &self.cubes {
            found.extend(cubes.near(&(x / *scale), radius).filter_map(|&place| {
                let (particle, towards) = self.particles[place as usize];
                let off = (self.spread.positions[particle as usize] - x).norm();
                let weight = weight(off / (radius * scale));
                (weight > 0.0 && towards.dot(normal) > self.facing).then_some((place, weight))
            }));
        }
        found.sort_unstable_by_key(|entry| entry.0);
        found
    }

    /// Functions of Shepard: positive, and one in sum.
    fn plain(&self, x: &Vec3, normal: &Vec3) -> Vec<(u32, f64)> {
        let mut radius = REACH;
        for _ in 0..RAISES {
            if let Some(found) = self.shepard(x, normal, radius) {
                return found;
            }
            radius *= 1.5;
        }
        let distance = |place: &u32| (self.spread.positions[self.particles[*place as usize].0 as usize] - x).norm();
        let all = 0..self.particles.len() as u32;
        all.min_by(|a, b| distance(a).total_cmp(&distance(b))).map(|place| (place, 1.0)).into_iter().collect()
    }

    fn shepard(&self, x: &Vec3, normal: &Vec3, radius: f64) -> Option<Vec<(u32, f64)>> {
        let around = self.around(x, normal, radius);
        let whole: f64 = around.summed(|entry| entry.1);
        // A single far particle has a weight that rounding may spoil.
        (whole > 1e-6).then(|| around.mapped(|&(place, weight)| (place, weight / whole)))
    }

    /// Functions $f_J$ at a point of the piece: moving least squares over the basis $(1, n)$, so that $\sum_J f_J = 1$ and
    /// $\sum_J f_J n_J = n$; those of Shepard where the particles can't give the normal, and whether they do.
    fn exact(&self, x: &Vec3, normal: &Vec3) -> (Vec<(u32, f64)>, bool) {
        if !self.curved {
            let plain = self.plain(x, normal);
            let some = !plain.is_empty();
            return (plain, some);
        }
        let mut radius = REACH;
        let mut best: Option<(f64, Vec<(u32, f64)>)> = None;
        for _ in 0..RAISES {
            let exact = self.shepard(x, normal, radius).and_then(|plain| self.reproducing(&plain, normal));
            radius *= 1.5;
            let Some(found) = exact else { continue };
            let largest = found.largest(|entry| entry.1.abs());
            if largest <= LARGEST {
                return (found, true);
            }
            if best.as_ref().is_none_or(|known| largest < known.0) {
                best = Some((largest, found));
            }
        }
        (best.map_or_else(|| self.plain(x, normal), |best| best.1), false)
    }

    /// The same by particles.
    fn named(&self, functions: Vec<(u32, f64)>) -> Vec<(u32, f64)> {
        functions.into_mapped(|(place, value)| (self.particles[place as usize].0, value))
    }

    /// Functions with these weights that give the normal; none where the particles can't.
    fn reproducing(&self, weights: &[(u32, f64)], normal: &Vec3) -> Option<Vec<(u32, f64)>> {
        let off = weights.mapped(|entry| self.particles[entry.0 as usize].1 - normal);
        if off.largest(|off| off.norm()) < EXACT {
            return Some(weights.to_vec());
        }
        let values = reproducing(vec![0.0; weights.len()], &off, &|k| weights[k].1)?;
        Some(weights.paired(&values, |entry, value| (entry.0, *value)))
    }
}

/// A point with its unit normal and its measure, and its number among those of all sites.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    pub(super) at: Vec3,
    pub(super) normal: Vec3,
    pub(super) measure: f64,
    pub(super) number: u32,
}

/// A particle on a piece: the normal there, and how near that is to the direction that equations are for, $|n\cdot e|$; 0 where they are
/// for no direction of their own.
#[derive(Debug, Clone, Copy)]
pub(super) struct OnPiece {
    pub(super) particle: u32,
    pub(super) normal: Vec3,
    pub(super) facing: f64,
}

/// A piece of the surface: its points by bricks, and the particles on it.
pub(super) struct Site {
    pub(super) places: Vec<Place>,
    /// The ends of groups.
    pub(super) groups: Vec<usize>,
    /// Which points are asked for; all where it is empty.
    pub(super) kept: Vec<bool>,
    /// Particles on it.
    pub(super) particles: Vec<OnPiece>,
    /// Particles that it needs at least.
    need: usize,
    /// The sub-cell and the brick of the group that points are added to.
    of: Option<(u32, [i32; 3])>,
}

impl Site {
    pub(super) fn new(need: usize) -> Self {
        Site { places: Vec::new(), groups: Vec::new(), kept: Vec::new(), particles: Vec::new(), need, of: None }
    }

    /// Begins a group of points, where those before are of another sub-cell or brick.
    pub(super) fn open(&mut self, of: (u32, [i32; 3])) {
        if self.of.replace(of).is_some_and(|before| before != of) {
            self.end();
        }
    }

    fn end(&mut self) {
        if self.groups.last().copied().unwrap_or(0) < self.places.len() {
            self.groups.push(self.places.len());
        }
    }

    /// Ends the last group, and keeps those whose middle a predicate holds for.
    pub(super) fn close(&mut self, holds: Option<impl Fn(&Vec3) -> bool>) {
        self.end();
        let Some(holds) = holds else { return };
        let mut first = 0;
        for &end in &self.groups {
            let own = &self.places[first..end];
            let middle = own.iter().map(|place| place.at).sum::<Vec3>() / own.len() as f64;
            self.kept.resize(end, holds(&middle));
            first = end;
        }
    }

    /// Its particles with their normals.
    fn with_normals(&self) -> impl Iterator<Item = (u32, Vec3)> + '_ {
        self.particles.iter().map(|own| (own.particle, own.normal))
    }

    /// Leaves the points out that are not asked for, and the particles whose functions lie among those.
    fn restrict(&mut self, spread: Spread) {
        let traces = Traces::new(spread, self.with_normals().collect(), false, 0.0);
        let mut shares = vec![[0.0; 2]; self.particles.len()];
        for (place, &kept) in self.places.iter().zip(&self.kept) {
            for (particle, value) in traces.plain(&place.at, &place.normal) {
                shares[particle as usize][0] += value * place.measure;
                shares[particle as usize][1] += if kept { value * place.measure } else { 0.0 };
            }
        }
        let part = |share: &[f64; 2]| if share[0] > 0.0 { share[1] / share[0] } else { 0.0 };
        let largest = shares.largest(part);
        let mut place = 0;
        self.particles.retain(|_| {
            place += 1;
            let own = part(&shares[place - 1]);
            own > 0.0 && own >= SHARE * largest.min(1.0)
        });
        let (mut left, mut ends, mut first) = (Vec::new(), Vec::new(), 0);
        for &end in &self.groups {
            left.extend((first..end).filter(|&place| self.kept[place]).map(|place| self.places[place]));
            if ends.last().copied().unwrap_or(0) < left.len() {
                ends.push(left.len());
            }
            first = end;
        }
        (self.places, self.groups) = (left, ends);
    }
}

/// Points of a piece, the ends of their groups, and the functions at each.
pub(super) type Found = (Vec<Place>, Vec<usize>, Functions);

/// Functions at points, by particles.
type Functions = Vec<Vec<(u32, f64)>>;

/// Trace functions on pieces of a surface, `beside` having the lengths of the edges between them: each particle carries functions of one
/// piece, and pieces whose particles cannot give their normals take those of the neighbour with the longest common edge as well. Particles
/// whose equations would depend on those of others carry none. With `positive` functions are those of
/// Shepard, of all particles on a piece.
pub(super) fn assign(spread: Spread, mut sites: Vec<Site>, beside: &[([usize; 2], f64)], positive: bool) -> Vec<Found> {
    sites.iter_mut().filter(|site| !site.kept.is_empty()).for_each(|site| site.restrict(spread));
    if !positive {
        own(&mut sites);
    }
    let mut found = functions(spread, &sites, beside, positive);
    if positive {
        return found;
    }
    let kernels = kernels(spread, &sites);
    for _ in 0..ROUNDS {
        let dependent = dependent(&kernels, &found);
        if dependent.is_empty() {
            break;
        }
        sites.iter_mut().for_each(|site| site.particles.retain(|own| !dependent.contains(&own.particle)));
        found = functions(spread, &sites, beside, positive);
    }
    found
}

/// The functions on sites, and on several together where the particles of one cannot give its normals.
fn functions(spread: Spread, sites: &[Site], beside: &[([usize; 2], f64)], positive: bool) -> Vec<Found> {
    let mut sets = Disjoint::new(sites.len());
    let mut found: Vec<Option<Functions>> = vec![None; sites.len()];
    let mut next = 0;
    while next < sites.len() {
        if sets.leader(next) != next || found[next].is_some() || sites[next].places.is_empty() {
            next += 1;
            continue;
        }
        let members: Vec<&Site> =
            (0..sites.len()).filter(|&site| sets.leader(site) == next).map(|site| &sites[site]).collect();
        let (own, exact) = on(spread, &members, positive);
        let other = if exact || positive { None } else { longest(sites, beside, &mut sets, next) };
        match other {
            Some(other) => {
                sets.join(next, other);
                (found[next], found[other]) = (None, None);
                next = next.min(other);
            }
            None => found[next] = Some(own),
        }
    }
    let mut all = Vec::new();
    for first in 0..sites.len() {
        let Some(functions) = found[first].take() else { continue };
        let (mut places, mut groups): (Vec<Place>, Vec<usize>) = (Vec::new(), Vec::new());
        for site in (first..sites.len()).filter(|&site| sets.leader(site) == first) {
            let before = places.len();
            places.extend_from_slice(&sites[site].places);
            groups.extend(sites[site].groups.iter().map(|end| before + end));
        }
        all.push((places, groups, functions));
    }
    all
}

/// The functions at the points of some sites together, and whether they give the normals.
fn on(spread: Spread, members: &[&Site], positive: bool) -> (Functions, bool) {
    let particles = members.iter().flat_map(|site| site.with_normals()).collect();
    let alone = members.len() == 1;
    let curved = !positive && (!alone || members[0].need > 1);
    let facing = match (positive, alone) {
        (true, _) => CORNER,
        (false, true) => 0.0,
        (false, false) => ACROSS,
    };
    let traces = Traces::new(spread, particles, curved, facing);
    let (mut own, mut exact) = (Vec::new(), true);
    for site in members {
        for Place { at, normal, .. } in &site.places {
            let (mut functions, is_exact) = traces.exact(at, normal);
            exact &= is_exact;
            // The rest of a piece has tractions of its own: there is nothing to extrapolate for.
            if !is_exact && !site.kept.is_empty() {
                functions = traces.plain(at, normal);
            }
            own.push(traces.named(functions));
        }
    }
    (own, exact)
}

/// The neighbour of a site with the longest common edge.
fn longest(sites: &[Site], beside: &[([usize; 2], f64)], sets: &mut Disjoint, own: usize) -> Option<usize> {
    let mut lengths: BTreeMap<usize, f64> = BTreeMap::new();
    for &([a, b], length) in beside {
        let [a, b] = [a, b].each(|site| sets.leader(site));
        if a != b && (a == own || b == own) {
            *lengths.entry(if a == own { b } else { a }).or_default() += length;
        }
    }
    lengths.retain(|other, _| !sites[*other].places.is_empty());
    lengths.into_iter().max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0))).map(|other| other.0)
}

/// Kernels of all particles that cover the points of sites, by the numbers of points.
fn kernels(spread: Spread, sites: &[Site]) -> Vec<Vec<(u32, f64)>> {
    let all = (0..spread.positions.len() as u32).map(|particle| (particle, Vec3::zeros())).collect();
    let traces = Traces::new(spread, all, false, f64::NEG_INFINITY);
    let numbers = sites.iter().flat_map(|site| &site.places).map(|place| place.number as usize + 1);
    let mut kernels = vec![Vec::new(); numbers.max().unwrap_or(0)];
    for place in sites.iter().flat_map(|site| &site.places) {
        kernels[place.number as usize] = traces.shepard(&place.at, &place.normal, REACH).unwrap_or_default();
    }
    kernels
}

/// Particles whose equations depend on those of others: their functions reach into a small part of a surface from outside, or there
/// are more of them than it has room for. Equations are $\int f_J\,\Psi_I$, kernels standing for shape functions; those of large measure
/// come first, and each is compared with those before it that it overlaps.
fn dependent(kernels: &[Vec<(u32, f64)>], found: &[Found]) -> BTreeSet<u32> {
    let mut rows: BTreeMap<u32, (f64, BTreeMap<u32, f64>)> = BTreeMap::new();
    for (place, functions) in found.iter().flat_map(|(places, _, functions)| places.iter().zip(functions)) {
        let around = &kernels[place.number as usize];
        if around.is_empty() {
            continue;
        }
        for &(particle, value) in functions {
            let (measure, row) = rows.entry(particle).or_default();
            *measure += place.measure * value;
            around.iter().for_each(|&(other, kernel)| *row.entry(other).or_default() += place.measure * value * kernel);
        }
    }
    let mut order: Vec<(u32, f64, Row)> =
        rows.into_iter().map(|(particle, (m, row))| (particle, m, unit(row))).collect();
    crate::order::sort(&mut order, &|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    let (mut independent, mut left) = (Independent::default(), BTreeSet::new());
    for (particle, _, row) in &order {
        if !independent.take(row) {
            left.insert(*particle);
        }
    }
    left
}

/// Nonzero entries of an equation by column.
type Row = Vec<(u32, f64)>;

/// A row scaled to length one.
fn unit(row: BTreeMap<u32, f64>) -> Row {
    let size = row.values().map(|value| value * value).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
    row.into_iter().map(|(other, value)| (other, value / size)).collect()
}

/// Unit rows none of which lies in the span of those before it.
#[derive(Default)]
struct Independent {
    /// The rows that have an entry in a column, and the entries.
    columns: HashMap<u32, Vec<(usize, f64)>>,
    /// Products of each row with those before it, by rising number.
    products: Vec<Vec<(usize, f64)>>,
}

impl Independent {
    /// Takes a row in, where enough of it is left beyond the span of others that it has a product with.
    fn take(&mut self, row: &[(u32, f64)]) -> bool {
        let mut products: BTreeMap<usize, f64> = BTreeMap::new();
        for (column, value) in row {
            for (other, entry) in self.columns.get(column).into_iter().flatten() {
                *products.entry(*other).or_default() += value * entry;
            }
        }
        products.retain(|_, product| product.abs() > UNSEEN);
        let near: Vec<(usize, f64)> = products.into_iter().collect();
        if self.beyond(&near) <= LEFT {
            return false;
        }
        let number = self.products.len();
        row.iter().for_each(|&(column, value)| self.columns.entry(column).or_default().push((number, value)));
        self.products.push(near);
        true
    }

    fn product(&self, a: usize, b: usize) -> f64 {
        let all = &self.products[a.max(b)];
        all.binary_search_by_key(&a.min(b), |known| known.0).map_or(0.0, |at| all[at].1)
    }

    /// The length of what a unit row with some products has beyond the span of others.
    fn beyond(&self, near: &[(usize, f64)]) -> f64 {
        let n = near.len();
        // What rounding may take from the products of dependent rows is given back.
        let gram = DMatrix::from_fn(n, n, |i, j| if i == j { 1.0 + 1e-10 } else { self.product(near[i].0, near[j].0) });
        let along = DVector::from_iterator(n, near.iter().map(|known| known.1));
        let Some(factor) = gram.cholesky() else { return 0.0 };
        (1.0 - along.dot(&factor.solve(&along))).max(0.0).sqrt()
    }
}

/// Cosine between normals above which a particle of a neighbouring piece counts at a point.
const ACROSS: f64 = -0.5;

/// Values of $|n\cdot e|$ that differ by less than this are equal.
const TIE: f64 = 1e-6;

/// Leaves each particle to one of its pieces: to one that lacks particles, then to the one whose normal is nearest to the direction of
/// the equations, then to a curved one, which would extrapolate without those along its rim.
fn own(sites: &mut [Site]) {
    let mut on: BTreeMap<u32, Vec<(usize, f64)>> = BTreeMap::new();
    for (number, site) in sites.iter().enumerate() {
        site.particles.iter().for_each(|own| on.entry(own.particle).or_default().push((number, own.facing)));
    }
    let mut has = vec![0usize; sites.len()];
    on.values().filter(|all| all.len() == 1).for_each(|all| has[all[0].0] += 1);
    let mut owner: BTreeMap<u32, usize> = BTreeMap::new();
    for (&particle, all) in &on {
        let lack = |site: usize| sites[site].need.saturating_sub(has[site]);
        let most = all.iter().map(|(site, _)| lack(*site)).max().unwrap_or(0);
        let lacking = || all.iter().filter(|(site, _)| lack(*site) == most);
        let nearest = lacking().map(|(_, facing)| *facing).fold(0.0, f64::max);
        let equal = lacking().filter(|(_, facing)| *facing >= nearest - TIE).map(|(site, _)| *site);
        let own = equal.max_by_key(|&site| (sites[site].need > 1, std::cmp::Reverse(site))).unwrap_or(all[0].0);
        has[own] += usize::from(all.len() > 1);
        owner.insert(particle, own);
    }
    for (number, site) in sites.iter_mut().enumerate() {
        site.particles.retain(|own| owner[&own.particle] == number);
    }
}
