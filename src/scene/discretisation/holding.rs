//! What a rank holds of the condensed unknowns, by names that belong to the scene.

use crate::geometry::Point;
use crate::term::Term;

use crate::scene::{Member, Problem};

/// Whose condensed unknowns the states of a problem hold: those of this rank's zones, or all. Another number of ranks shares
/// the same zones otherwise and finds them by their keys.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Holding {
    /// Term by term of the model.
    pub terms: Vec<TermHolding>,
}

/// What a rank holds of a term: its vector of a state has the unknowns cluster by cluster, then what the memory has in
/// common, then the memory cluster by cluster.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TermHolding {
    /// What each cluster is known by on any rank: for bodies a checksum over the places of its points.
    pub keys: Vec<u64>,
    /// How many condensed unknowns each cluster has.
    pub unknowns: Vec<usize>,
    /// How many numbers each cluster remembers.
    pub memory: Vec<usize>,
    /// How many numbers of the memory belong to all clusters: the time at which it was written.
    pub common: usize,
}

impl TermHolding {
    /// The length of the term's vector of a state.
    pub fn total(&self) -> usize {
        self.unknowns.iter().sum::<usize>() + self.common + self.memory.iter().sum::<usize>()
    }

    fn of_body<const D: usize>(member: &Member<D>) -> Self {
        let table = member.body.table();
        let remembered = Term::memory(&*member.body).len();
        let each = remembered.saturating_sub(1) / table.len().max(1);
        let mut holding = TermHolding { common: remembered.min(1), ..TermHolding::default() };
        for cluster in 0..table.clusters().len() {
            let points = table.clusters().points(cluster);
            holding.keys.push(key(&table.positions()[points.clone()]));
            holding.unknowns.push(Term::condensed(&*member.body, cluster).len());
            holding.memory.push(each * points.len());
        }
        holding
    }
}

impl<const D: usize> Problem<D> {
    /// Whose condensed unknowns this rank holds; alone, those of all zones.
    pub fn holding(&self) -> Holding {
        let of = |(number, start): (usize, &Vec<f64>)| match (self.members.get(number), start.len()) {
            (_, 0) => TermHolding::default(),
            (Some(member), _) => TermHolding::of_body(member),
            // Terms that one rank alone sums.
            (None, total) => TermHolding { keys: vec![0], unknowns: vec![total], memory: vec![0], common: 0 },
        };
        Holding { terms: self.model.start().iter().enumerate().map(of).collect() }
    }
}

/// FNV-1a in 64 bits over coordinates.
fn key<const D: usize>(points: &[Point<D>]) -> u64 {
    let bytes = points.iter().flat_map(|point| point.iter().flat_map(|x| x.to_bits().to_le_bytes()));
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}
