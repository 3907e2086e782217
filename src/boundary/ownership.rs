//! Which piece of a boundary owns the equations of a particle that lies on several.

use std::collections::{BTreeMap, HashSet};
use std::ops::Range;
use std::sync::Arc;

use crate::cells::BoundaryCells;
use crate::each::Each;
use crate::error::{BoundaryError, Error};
use crate::geometry::{Point, Vec3};

use super::over_boundary::rounding;
use super::prescribed_directions::{PrescribedDirection, is_redundant, repeats};
use super::row_values::Prescription;

/// Values of $|n\cdot e|$ that differ by less than this are equal.
const TIE: f64 = 1e-6;

/// Rank of curved pieces that can't do without particles, beyond all values of $|n\cdot e|$.
const CURVED: f64 = 2.0;

/// What a condition prescribes of a particle on one piece.
struct Claim {
    piece: usize,
    /// $|n\cdot e|$ with the normal of the piece at the particle and the direction of the condition, more on pieces that come first.
    facing: f64,
    prescription: PrescribedDirection,
}

/// What conditions prescribe of the particles on pieces of a boundary, gathered before there are equations.
///
/// Where pieces meet, a particle has one equation along each direction. It belongs to the piece whose normal is nearest to the
/// direction, the one with the largest $|n\cdot e|$; among equal ones to the first. There the traction along the direction is a
/// pressure, which may be singular; on the other pieces it is a shear that has to vanish or is bounded, and an equation at the edge
/// would clamp what is free to slide. Curved pieces come first where their functions can't be made anew: merged, they would not give the
/// normals. Where a piece would be left without particles and has some in turn, the equations of all particles on it belong to the pieces
/// in turn, the first one before others: the functions of each piece still sum to one.
#[derive(Default)]
pub(crate) struct Claims {
    of: BTreeMap<u32, Vec<Claim>>,
    pieces: usize,
    /// Pieces that take functions of their neighbours' particles where they are left without.
    rebuilt: HashSet<usize>,
}

/// Who owns what.
#[derive(Default)]
pub(crate) struct Owners {
    /// For each piece its particles whose equation belongs to another one.
    pub(crate) yielded: Vec<HashSet<u32>>,
    /// Conditions whose values do not hold at an edge, where those of the owner do: one error for each two.
    pub(crate) overruled: Vec<BoundaryError>,
    /// Pieces whose values hold nowhere: all of their particles have equations of others with other values.
    pub(crate) refused: BTreeMap<usize, BoundaryError>,
}

impl Claims {
    /// Takes in what one direction of a condition prescribes over pieces, whose functions may be `rebuilt` without some of their particles;
    /// the numbers that the pieces have from then on.
    ///
    /// # Errors
    /// Where the value differs from that of an earlier condition on a piece that faces the direction as much: neither owns the equation.
    pub(crate) fn add(
        &mut self,
        (dim, nodes): (usize, &[Vec3]),
        (pieces, rebuilt): (&[Arc<BoundaryCells<3>>], bool),
        prescription: &Prescription<'_>,
    ) -> Result<Range<usize>, Error> {
        let rounding = rounding(nodes);
        let mut made = Vec::new();
        for (place, cells) in pieces.iter().enumerate() {
            cells.validate(nodes.len())?;
            let all = &cells.points.normals;
            let first = if !rebuilt && all.iter().any(|n| (n - all[0]).norm() > TIE) { CURVED } else { 0.0 };
            let normals = cells.normals_at_particles();
            let mut particles: Vec<u32> = cells.traces.iter().flatten().map(|trace| trace.0).collect();
            particles.sort_unstable();
            particles.dedup();
            for particle in particles {
                let at = nodes[particle as usize];
                let normal = normals.get(&particle).copied().unwrap_or_else(Point::zeros);
                let wanted = prescription.at(&at, &normal)?;
                let facing = first + wanted.facing(normal.as_slice());
                let known = self.of.get(&particle).map_or(&[][..], Vec::as_slice);
                let equal = known.iter().filter(|claim| (claim.facing - facing).abs() <= TIE);
                let equal: Vec<PrescribedDirection> = equal.map(|claim| claim.prescription.clone()).collect();
                is_redundant(&equal, &wanted, &at.as_slice()[..dim], rounding)?;
                made.push((particle, Claim { piece: self.pieces + place, facing, prescription: wanted }));
            }
        }
        for (particle, claim) in made {
            self.of.entry(particle).or_default().push(claim);
        }
        let first = self.pieces;
        self.pieces += pieces.len();
        if rebuilt {
            self.rebuilt.extend(first..self.pieces);
        }
        Ok(first..self.pieces)
    }

    /// Gives each equation to one piece.
    pub(crate) fn settle(&self, (dim, nodes): (usize, &[Vec3])) -> Owners {
        let owned = self.owned();
        let mut settled = Owners { yielded: vec![HashSet::new(); self.pieces], ..Owners::default() };
        let (rounding, mut known, mut holding) = (rounding(nodes), HashSet::new(), HashSet::new());
        for (particle, claims) in &self.of {
            let owners = &owned[particle];
            holding.extend(owners.iter().map(|&claim| claims[claim].piece));
            if owners.len() == claims.len() {
                continue;
            }
            let prescriptions: Vec<PrescribedDirection> = owners.mapped(|&claim| claims[claim].prescription.clone());
            let at = &nodes[*particle as usize].as_slice()[..dim];
            for (_, claim) in claims.iter().enumerate().filter(|(number, _)| !owners.contains(number)) {
                settled.yielded[claim.piece].insert(*particle);
                let repeated = is_redundant(&prescriptions, &claim.prescription, at, rounding);
                let Err(conflict) = repeated else {
                    holding.insert(claim.piece);
                    continue;
                };
                settled.refused.entry(claim.piece).or_insert_with(|| conflict.clone());
                if let BoundaryError::Conflict { first: owner, second: other, component, at, values } = conflict
                    && known.insert((owner.clone(), other.clone()))
                {
                    settled.overruled.push(BoundaryError::Overruled { owner, other, component, at, values });
                }
            }
        }
        settled.refused.retain(|piece, _| !holding.contains(piece) && !self.rebuilt.contains(piece));
        settled
    }

    /// The claims on each particle that become equations.
    fn owned(&self) -> BTreeMap<u32, Vec<usize>> {
        let mut owned: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        // How many equations each piece has, by normals and in turn.
        let (mut kept, mut in_turn) = (vec![0usize; self.pieces], vec![0usize; self.pieces]);
        for (&particle, claims) in &self.of {
            let owners = owners(claims, true);
            owners.iter().for_each(|&claim| kept[claims[claim].piece] += 1);
            self::owners(claims, false).iter().for_each(|&claim| in_turn[claims[claim].piece] += 1);
            owned.insert(particle, owners);
        }
        let mut reverted = HashSet::new();
        loop {
            // Reverted ones have what they have in turn: each round reverts more.
            let without = |claim: &Claim| {
                kept[claim.piece] == 0 && in_turn[claim.piece] > 0 && !self.rebuilt.contains(&claim.piece)
            };
            let on = |(_, claims): &(&u32, &Vec<Claim>)| claims.iter().any(without);
            let more: Vec<u32> = self.of.iter().filter(on).map(|(particle, _)| *particle).collect();
            let more: Vec<u32> = more.into_iter().filter(|particle| reverted.insert(*particle)).collect();
            if more.is_empty() {
                return owned;
            }
            for particle in more {
                let (claims, after) = (&self.of[&particle], owners(&self.of[&particle], false));
                after.iter().for_each(|&claim| kept[claims[claim].piece] += 1);
                let before = owned.insert(particle, after).unwrap_or_default();
                before.iter().for_each(|&claim| kept[claims[claim].piece] -= 1);
            }
        }
    }
}

/// The claims on a particle that become equations: by falling $|n\cdot e|$ or in turn, each along a direction that those before it leave
/// free.
fn owners(claims: &[Claim], by_normal: bool) -> Vec<usize> {
    let facing = |claim: usize| if by_normal { claims[claim].facing } else { 0.0 };
    let mut left: Vec<usize> = (0..claims.len()).collect();
    let (mut taken, mut prescriptions) = (Vec::with_capacity(claims.len()), Vec::with_capacity(claims.len()));
    while !left.is_empty() {
        let most = left.largest(|&claim| facing(claim));
        let Some(&next) = left.iter().find(|claim| facing(**claim) >= most - TIE) else { break };
        taken.push(next);
        prescriptions.push(claims[next].prescription.clone());
        left.retain(|&claim| claim != next && !repeats(&prescriptions, &claims[claim].prescription.direction));
    }
    taken
}
