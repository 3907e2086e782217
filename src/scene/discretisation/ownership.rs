//! What a rank holds of the condensed unknowns, by names that belong to the scene.

use crate::geometry::Point;
use crate::term::{Term, TermState};

use crate::scene::{DiscreteBody, Problem};

/// Whose condensed unknowns the states of a problem hold: those of this rank's zones, or all. Another number of ranks shares
/// the same zones otherwise and finds them by their keys.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LocalOwnership {
    /// Term by term of the model.
    pub terms: Vec<TermOwnership>,
}

/// What a rank holds of a term: in each of its two lists of a state first what all ranks have in common, then what belongs to its clusters,
/// one after the other.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TermOwnership {
    /// What each cluster is known by on any rank: for bodies a checksum over the places of its points.
    pub keys: Vec<u64>,
    /// How many condensed unknowns each cluster has.
    pub unknowns: Vec<usize>,
    /// Number of internal variables of each cluster.
    pub internal_variables: Vec<usize>,
    /// How many condensed unknowns and internal variables all ranks hold: those of replicated terms.
    pub common: [usize; 2],
}

impl TermOwnership {
    /// Numbers of condensed unknowns and of internal variables of the term.
    pub fn total(&self) -> [usize; 2] {
        let [unknowns, internal_variables] = self.common;
        let of_clusters = [&self.unknowns, &self.internal_variables].map(|counts| counts.iter().sum::<usize>());
        [unknowns + of_clusters[0], internal_variables + of_clusters[1]]
    }

    fn of_body<const D: usize>(discrete_body: &DiscreteBody<D>) -> Self {
        let table = discrete_body.body.table();
        let each = discrete_body.body.layout().history / table.point_count().max(1);
        let mut ownership = TermOwnership::default();
        for cluster in 0..table.clusters().count() {
            let points = table.clusters().points(cluster);
            ownership.keys.push(key(&table.positions()[points.clone()]));
            ownership.unknowns.push(discrete_body.body.unknowns(cluster).len());
            ownership.internal_variables.push(each * points.len());
        }
        ownership
    }
}

impl<const D: usize> Problem<D> {
    /// Whose condensed unknowns this rank holds; alone, those of all zones.
    pub fn ownership(&self) -> LocalOwnership {
        let of = |(number, start): (usize, &TermState)| {
            let total = [start.condensed.len(), start.history.len()];
            match self.discrete_bodies.get(number) {
                _ if total == [0; 2] => TermOwnership::default(),
                Some(discrete_body) => TermOwnership::of_body(discrete_body),
                // Replicated terms.
                None => TermOwnership { common: total, ..TermOwnership::default() },
            }
        };
        LocalOwnership { terms: self.model.start().iter().enumerate().map(of).collect() }
    }
}

/// FNV-1a in 64 bits over coordinates.
fn key<const D: usize>(points: &[Point<D>]) -> u64 {
    let bytes = points.iter().flat_map(|point| point.iter().flat_map(|x| x.to_bits().to_le_bytes()));
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}
