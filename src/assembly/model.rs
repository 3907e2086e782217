//! Models: terms over one set of nodes, their forces and condensed unknowns.

use std::sync::Arc;

use crate::each::{Each, list_of};
use crate::error::{BoundaryError, SolveError};
use crate::geometry::{Morton, Point};
use crate::term::{Amplitude, Product, Term, TermState, View, Zone};

use super::Ranks;
use super::state_ref::{Origin, StateRef};

/// Unknowns below which everything stays on one thread.
pub(super) const SERIAL_BELOW: usize = 400;

/// Terms of a potential over the coefficients of one set of nodes.
pub struct Model {
    dim: usize,
    /// Reference positions, node by node.
    coordinates: Vec<f64>,
    pub(super) terms: Vec<Arc<dyn Term>>,
    /// Which of them are replicated on all ranks.
    replicated: Vec<bool>,
    /// Number of condensed unknowns and of internal variables of each term.
    sizes: Vec<[usize; 2]>,
    /// Why the first term that does not fit the model does not.
    pub(crate) misfit: Option<SolveError>,
    /// Those that share the clusters, where it is not one alone.
    pub(super) ranks: Option<Arc<dyn Ranks>>,
    /// That of its states.
    origin: Origin,
    /// Time by the load factor.
    clock: Option<Amplitude>,
}

impl Model {
    /// A model without terms over nodes at the given reference positions.
    pub fn new<const D: usize>(positions: &[Point<D>]) -> Self {
        const { assert!(D >= 1 && D <= 3, "bodies have one, two or three dimensions") };
        let mut coordinates = Vec::with_capacity(D * positions.len());
        for position in positions {
            coordinates.extend_from_slice(position.as_slice());
        }
        Model::over(D, coordinates)
    }

    fn over(dim: usize, coordinates: Vec<f64>) -> Self {
        Model {
            dim,
            origin: Origin::of(&coordinates),
            coordinates,
            terms: Vec::new(),
            replicated: Vec::new(),
            sizes: Vec::new(),
            misfit: None,
            ranks: None,
            clock: None,
        }
    }

    /// Says that the terms hold one rank's share of the clusters: all sums go over the ranks from here on.
    pub(crate) fn share(&mut self, ranks: Arc<dyn Ranks>) -> &mut Self {
        self.ranks = (ranks.count() > 1).then_some(ranks);
        self
    }

    /// Gives the model a clock: time as a function of the load factor, not falling. Laws that relax do so by it; without one every step is
    /// sudden.
    ///
    /// # Errors
    /// [`BoundaryError::Amplitude`] for a time that is not finite or falls.
    pub fn set_clock(&mut self, clock: Option<Amplitude>) -> Result<&mut Self, BoundaryError> {
        const LOOKS: usize = 64;
        if let Some(clock) = &clock {
            let of = || "the clock".to_string();
            clock.validate(of)?;
            let times: Vec<f64> = match clock {
                Amplitude::Table(pairs) => pairs.mapped(|pair| pair.1),
                _ => list_of(LOOKS + 1, |k| clock.value(k as f64 / LOOKS as f64)),
            };
            ensure!(
                times.iter().all(|time| time.is_finite()) && times.is_sorted(),
                BoundaryError::Amplitude { of: of(), what: "the time is not finite, or falls" }
            );
        }
        self.clock = clock;
        Ok(self)
    }

    /// Whether it takes time.
    pub(crate) fn has_clock(&self) -> bool {
        self.clock.is_some()
    }

    /// Time at a load factor \[time\]; 0 without a clock.
    pub fn time(&self, load: f64) -> f64 {
        self.clock.as_ref().map_or(0.0, |clock| clock.value(load))
    }

    /// The ranks that share the clusters; none where this process holds all of them.
    pub fn ranks(&self) -> Option<&dyn Ranks> {
        self.ranks.as_deref()
    }

    /// Whether an observer breaks off here: where one rank's does, all stop.
    pub(crate) fn is_ended_by(&self, flow: std::ops::ControlFlow<()>) -> bool {
        let mine = f64::from(u8::from(flow.is_continue()));
        match &self.ranks {
            Some(ranks) => ranks.least(mine) == 0.0,
            None => flow.is_break(),
        }
    }

    pub(crate) fn shared_ranks(&self) -> Option<Arc<dyn Ranks>> {
        self.ranks.clone()
    }

    /// Adds a term.
    pub fn add(&mut self, term: impl Term + 'static) -> &mut Self {
        self.add_shared(Arc::new(term))
    }

    /// Adds a term that others look at too.
    pub fn add_shared(&mut self, term: Arc<dyn Term>) -> &mut Self {
        self.push(term, false)
    }

    /// Adds a term that is replicated on all ranks, its condensed unknowns included: the first rank alone sums it.
    pub(crate) fn add_replicated(&mut self, term: Arc<dyn Term>) -> &mut Self {
        self.push(term, true)
    }

    fn push(&mut self, term: Arc<dyn Term>, replicated: bool) -> &mut Self {
        let clusters = 0..term.clusters();
        let falls = |&cluster: &usize| !term.nodes(cluster).is_sorted_by(|a, b| a < b);
        if self.misfit.is_none() {
            let (number, given, needed) = (self.terms.len(), term.dim(), self.dim);
            let falls = clusters.clone().find(falls).map(|cluster| SolveError::Nodes { term: number, cluster });
            let other = (given != needed).then_some(SolveError::Dimension { given, needed });
            let misnumbered = other.or(falls).or_else(|| misnumbered(&*term, number, self.node_count()));
            self.misfit = misnumbered.or_else(|| {
                let needed = self.node_count();
                let given = term.layout().nodes.filter(|given| *given != needed)?;
                Some(SolveError::OtherNodes { term: number, given, needed })
            });
        }
        let condensed = clusters.map(|c| term.unknowns(c).end).max().unwrap_or(0);
        self.sizes.push([condensed, term.layout().history]);
        self.terms.push(term);
        self.replicated.push(replicated);
        self
    }

    /// The model with some of its terms.
    pub(crate) fn retained(&self, keep: impl Fn(&dyn Term) -> bool) -> Self {
        let mut model = Model {
            ranks: self.ranks.clone(),
            clock: self.clock.clone(),
            ..Model::over(self.dim, self.coordinates.clone())
        };
        for (term, replicated) in self.terms.iter().zip(&self.replicated).filter(|(term, _)| keep(&***term)) {
            model.push(term.clone(), *replicated);
        }
        model
    }

    /// Sums values over the ranks, where some share the clusters.
    pub(crate) fn total(&self, values: &mut [f64]) {
        if let Some(ranks) = &self.ranks {
            ranks.sum(values);
        }
    }

    /// The terms that this rank sums, with their numbers.
    pub(super) fn summed(&self) -> impl Iterator<Item = (usize, &dyn Term)> {
        self.terms.iter().enumerate().filter(|(number, _)| self.sums(*number)).map(|(number, term)| (number, &**term))
    }

    /// Whether this rank sums a term: all do with their shares, the first alone with one that is replicated.
    pub(crate) fn sums(&self, number: usize) -> bool {
        !self.replicated[number] || self.ranks().is_none_or(|ranks| ranks.rank() == 0)
    }

    /// The terms.
    pub fn terms(&self) -> &[Arc<dyn Term>] {
        &self.terms
    }

    /// Displacement components of a node.
    pub(crate) fn dim(&self) -> usize {
        self.dim
    }

    /// Number of nodes.
    pub fn node_count(&self) -> usize {
        self.coordinates.len() / self.dim
    }

    /// The reference position of a node, as many coordinates as the model has dimensions \[length\].
    pub(crate) fn coordinates(&self, node: usize) -> &[f64] {
        &self.coordinates[node * self.dim..(node + 1) * self.dim]
    }

    /// A curve through the nodes, along which each rank holds a region.
    pub(crate) fn curve(&self) -> Morton {
        Morton::through(self.dim, self.coordinates.chunks_exact(self.dim))
    }

    /// The reference position of a node; components beyond the model's own are zero.
    pub(crate) fn point<const D: usize>(&self, node: usize) -> Point<D> {
        let own = self.coordinates(node);
        Point::from_fn(|i, _| own.get(i).copied().unwrap_or(0.0))
    }

    /// The reference positions of all nodes, as [`point`](Model::point) has them.
    pub(crate) fn points<const D: usize>(&self) -> Vec<Point<D>> {
        (0..self.node_count()).map(|node| self.point(node)).collect()
    }

    /// Load factors inside $(0, 1)$ at which the forces of a term have break points.
    pub(crate) fn break_points(&self) -> Vec<f64> {
        let mut all = Vec::new();
        for term in &self.terms {
            all.append(&mut term.break_points());
        }
        all.extend(self.clock.iter().filter(|_| self.is_timed()).flat_map(Amplitude::break_points));
        all
    }

    /// The origin of its states.
    pub fn origin(&self) -> Origin {
        self.origin
    }

    /// Number of displacement unknowns.
    pub fn unknowns(&self) -> usize {
        self.coordinates.len()
    }

    /// Condensed unknowns and internal variables at zero displacement, term by term.
    pub fn start(&self) -> Vec<TermState> {
        self.terms.paired(&self.sizes, |term, &[condensed, history]| {
            let mut own = TermState { condensed: vec![0.0; condensed], history: vec![0.0; history] };
            term.start(&mut own.condensed, &mut own.history);
            own
        })
    }

    /// Refuses states whose vectors are not as long as the terms read them or that belong to other particles, and all where a term does not
    /// fit the model.
    pub(super) fn check(&self, at: StateRef<'_>) -> Result<(), SolveError> {
        let refuse = |what, given, needed| Err(SolveError::OtherModel { what, given, needed });
        if let Some(error) = &self.misfit {
            return Err(error.clone());
        }
        if at.displacement.len() != self.unknowns() {
            return refuse("displacement", at.displacement.len(), self.unknowns());
        }
        if at.terms.len() != self.terms.len() {
            return refuse("terms", at.terms.len(), self.terms.len());
        }
        for (own, sizes) in at.terms.iter().zip(&self.sizes) {
            let given = [(&own.condensed, "condensed unknowns"), (&own.history, "internal variables")];
            if let Some(((list, what), size)) = given.iter().zip(sizes).find(|((list, _), size)| list.len() != **size) {
                return refuse(what, list.len(), *size);
            }
        }
        if at.origin.differs(self.origin) { Err(SolveError::OtherParticles) } else { Ok(()) }
    }

    /// Refuses increments whose vectors are not as long as those of the model.
    pub(super) fn check_step(&self, step: &[f64], condensed: &[Vec<f64>]) -> Result<(), SolveError> {
        let refuse = |what, given, needed| Err(SolveError::OtherModel { what, given, needed });
        if step.len() != self.unknowns() {
            return refuse("displacement", step.len(), self.unknowns());
        }
        if condensed.len() != self.terms.len() {
            return refuse("terms", condensed.len(), self.terms.len());
        }
        match condensed.iter().zip(&self.sizes).find(|(list, [size, _])| list.len() != *size) {
            Some((list, [size, _])) => refuse("condensed unknowns", list.len(), *size),
            None => Ok(()),
        }
    }

    /// A state as the term of a number sees it; none where it does not hold the term.
    pub(crate) fn view<'a>(&self, state: impl Into<StateRef<'a>>, term: usize) -> Option<View<'a>> {
        let StateRef { displacement, terms, load, time, .. } = state.into();
        let TermState { condensed, history } = terms.get(term)?;
        let elapsed = if self.has_clock() { (self.time(load) - time).max(0.0) } else { 0.0 };
        Some(View { displacement, condensed, history, load, elapsed })
    }

    /// Whether the memory of a term fades with time: steps of the load are steps of time.
    pub(crate) fn is_timed(&self) -> bool {
        self.has_clock() && self.terms.iter().any(|term| term.layout().timed)
    }

    /// Whether a term acts from one side only.
    pub(crate) fn is_unilateral(&self) -> bool {
        self.terms.iter().any(|term| term.layout().unilateral)
    }

    /// Lets the searches of contacts rest as they were at the last state, or go on; whether there are any.
    pub(crate) fn hold_searches(&self, hold: bool) -> bool {
        self.terms.iter().filter(|term| term.hold_search(hold)).count() > 0
    }

    /// The product of a zone's matrix, $C^T H C$ left out, with a vector over all unknowns: node by node of the zone.
    pub(crate) fn multiply_zone(&self, zone: &Zone, x: &[f64], product: &mut Product) {
        product.values.clear();
        product.values.resize(self.dim * zone.nodes.len(), 0.0);
        if let Some(term) = self.terms.get(zone.owner[0] as usize).filter(|_| !zone.tangents.is_empty()) {
            term.multiply(zone, x, product);
        }
    }
}

/// The error of the first cluster of a term with a node beyond those of the model, or else with condensed unknowns that run backwards or
/// are those of another one.
pub(crate) fn misnumbered(term: &dyn Term, number: usize, nodes: usize) -> Option<SolveError> {
    for cluster in 0..term.clusters() {
        if let Some(node) = term.nodes(cluster).iter().map(|&node| node as usize).find(|&node| node >= nodes) {
            return Some(SolveError::MissingNode { term: number, cluster, node, nodes });
        }
    }
    let own = |cluster| (term.unknowns(cluster), cluster);
    let mut ranges: Vec<[usize; 3]> =
        (0..term.clusters()).map(own).map(|(range, cluster)| [range.start, range.end, cluster]).collect();
    ranges.retain(|[start, end, _]| start != end);
    ranges.sort_unstable();
    let mut free = 0;
    for [start, end, cluster] in ranges {
        if start < free || end < start {
            return Some(SolveError::Unknowns { term: number, cluster, start, end });
        }
        free = end;
    }
    None
}
