//! Arguments that are recorded, and one of which is replaced.

use std::cell::RefCell;
use std::sync::Arc;

use rkpm::check;
use rkpm::error::Error;
use rkpm::prelude::*;

/// What an argument is replaced by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wrong {
    Sign,
    Zero,
    Nan,
    Infinite,
    /// A count that no machine holds.
    Huge,
    /// An index that nothing has.
    Beyond,
    /// A name that nothing has.
    Unknown,
    /// No name, or a list of nothing.
    Empty,
    /// A place of a body that is not there.
    OtherBody,
    /// A place or point far from the body.
    Far,
    /// A predicate that holds nowhere.
    Nowhere,
    Shorter,
    Longer,
    /// Numbers of a list in the reverse order.
    Falling,
    /// A state of another body with as many particles.
    Other,
    /// A state of a model with fewer particles.
    Coarser,
}

impl Wrong {
    /// Whether what is replaced may be told as a number that is none.
    pub fn is_nan(self) -> bool {
        matches!(self, Wrong::Nan | Wrong::Infinite)
    }
}

/// One argument, by its number, and what it is replaced by.
#[derive(Debug, Clone, Copy)]
pub struct Swap {
    pub number: usize,
    pub wrong: Wrong,
}

/// The arguments of a scene in the order in which it takes them.
pub struct Args {
    swap: Option<Swap>,
    /// Their names, one of which a message has to hold, and what they may be replaced by.
    pub taken: Vec<(&'static str, &'static [Wrong])>,
}

/// What was said of a scene that ran.
pub struct Heard {
    pub findings: Vec<String>,
}

use Wrong::*;

impl Args {
    pub fn new(swap: Option<Swap>) -> Self {
        Args { swap, taken: Vec::new() }
    }

    fn take(&mut self, names: &'static str, wrongs: &'static [Wrong]) -> Option<Wrong> {
        self.taken.push((names, wrongs));
        self.swap.filter(|swap| swap.number + 1 == self.taken.len()).map(|swap| swap.wrong)
    }

    pub fn number(&mut self, names: &'static str, valid: f64) -> f64 {
        match self.take(names, &[Sign, Zero, Nan, Infinite]) {
            Some(Sign) => -valid,
            Some(Zero) => 0.0,
            Some(Nan) => f64::NAN,
            Some(Infinite) => f64::INFINITY,
            _ => valid,
        }
    }

    pub fn vector<const N: usize>(&mut self, names: &'static str, valid: [f64; N]) -> [f64; N] {
        let mut vector = valid;
        match self.take(names, &[Sign, Zero, Nan, Infinite]) {
            Some(Sign) => vector = valid.map(|v| -v),
            Some(Zero) => vector = [0.0; N],
            Some(Nan) => vector[N - 1] = f64::NAN,
            Some(Infinite) => vector[0] = f64::INFINITY,
            _ => {}
        }
        vector
    }

    /// A point of the body.
    pub fn point<const N: usize>(&mut self, names: &'static str, valid: [f64; N]) -> [f64; N] {
        let mut point = valid;
        match self.take(names, &[Far, Nan, Infinite]) {
            Some(Far) => point = valid.map(|x| x + 1e3),
            Some(Nan) => point[N - 1] = f64::NAN,
            Some(Infinite) => point[0] = f64::INFINITY,
            _ => {}
        }
        point
    }

    pub fn count(&mut self, names: &'static str, valid: usize) -> usize {
        match self.take(names, &[Zero, Huge]) {
            Some(Zero) => 0,
            Some(Huge) => usize::MAX / 2,
            _ => valid,
        }
    }

    /// The index of a component.
    pub fn index(&mut self, names: &'static str, valid: usize) -> usize {
        if self.take(names, &[Beyond]).is_some() { 7 } else { valid }
    }

    /// A name that is given.
    pub fn given(&mut self, names: &'static str, valid: &'static str) -> &'static str {
        if self.take(names, &[Empty]).is_some() { "" } else { valid }
    }

    /// The name of something that there is.
    pub fn name(&mut self, names: &'static str, valid: &'static str) -> &'static str {
        match self.take(names, &[Unknown, Empty]) {
            Some(Unknown) => "nobody",
            Some(Empty) => "",
            _ => valid,
        }
    }

    pub fn place<const D: usize>(&mut self, names: &'static str, valid: impl Into<Place<D>>) -> Place<D> {
        let valid = valid.into();
        match self.take(names, &[Unknown, Empty, OtherBody, Far, Nowhere]) {
            Some(Unknown) => Place::on("nobody"),
            Some(Empty) => Place::on(""),
            Some(OtherBody) => valid.of("nobody"),
            Some(Far) => Place::at([1e3; D]),
            Some(Nowhere) => valid.within(|_| false),
            _ => valid,
        }
    }

    pub fn counts(&mut self, names: &'static str, valid: &[usize]) -> Vec<usize> {
        let mut list = valid.to_vec();
        match self.take(names, &[Empty, Shorter, Longer, Zero, Huge]) {
            Some(Empty) => list.clear(),
            Some(Shorter) => drop(list.pop()),
            Some(Longer) => list.push(3),
            Some(Zero) => list[0] = 0,
            Some(Huge) => list[0] = usize::MAX / 2,
            _ => {}
        }
        list
    }

    pub fn numbers(&mut self, names: &'static str, valid: &[f64]) -> Vec<f64> {
        let mut list = valid.to_vec();
        match self.take(names, &[Empty, Sign, Zero, Nan, Infinite]) {
            Some(Empty) => list.clear(),
            Some(Sign) => list[0] = -list[0],
            Some(Zero) => list[0] = 0.0,
            Some(Nan) => list[0] = f64::NAN,
            Some(Infinite) => list[0] = f64::INFINITY,
            _ => {}
        }
        list
    }

    /// Pairs of numbers that rise.
    pub fn pairs(&mut self, names: &'static str, valid: &[(f64, f64)]) -> Vec<(f64, f64)> {
        let mut list = valid.to_vec();
        let last = list.len() - 1;
        match self.take(names, &[Empty, Shorter, Falling, Nan, Infinite]) {
            Some(Empty) => list.clear(),
            Some(Shorter) => list.truncate(1),
            Some(Falling) => list.reverse(),
            Some(Nan) => list[last].1 = f64::NAN,
            Some(Infinite) => list[last].0 = f64::INFINITY,
            _ => {}
        }
        list
    }

    /// A list that is as long as others need it, and what it is made longer by.
    pub fn list<T: Clone>(&mut self, names: &'static str, valid: &[T], more: T) -> Vec<T> {
        let mut list = valid.to_vec();
        match self.take(names, &[Empty, Shorter, Longer]) {
            Some(Empty) => list.clear(),
            Some(Shorter) => drop(list.pop()),
            Some(Longer) => list.push(more),
            _ => {}
        }
        list
    }

    /// A function of the load factor.
    pub fn amplitude(&mut self, names: &'static str) -> Amplitude {
        match self.take(names, &[Nan, Infinite, Zero, Falling]) {
            Some(Nan) => Amplitude::Function(Arc::new(|load: f64| if load > 0.3 { f64::NAN } else { load })),
            Some(Infinite) => Amplitude::Function(Arc::new(|load: f64| if load > 0.3 { f64::INFINITY } else { load })),
            Some(Zero) => Amplitude::Function(Arc::new(|_| 0.0)),
            Some(Falling) => Amplitude::Table(vec![(1.0, 1.0), (0.0, 0.0)]),
            _ => Amplitude::Table(vec![(0.0, 0.0), (1.0, 1.0)]),
        }
    }

    /// A value that varies over the body.
    pub fn field<const D: usize>(&mut self, names: &'static str, valid: f64) -> Value<D> {
        match self.take(names, &[Sign, Zero, Nan, Infinite]) {
            Some(Sign) => Value::field(move |_| -valid),
            Some(Zero) => Value::field(|_| 0.0),
            Some(Nan) => Value::field(|_| f64::NAN),
            Some(Infinite) => Value::field(|_| f64::INFINITY),
            _ => Value::field(move |_| valid),
        }
    }

    /// A state of this problem, of another body with as many particles, or of a coarser model.
    pub fn state<'a>(&mut self, names: &'static str, states: &'a [State; 3]) -> &'a State {
        match self.take(names, &[Other, Coarser]) {
            Some(Other) => &states[1],
            Some(Coarser) => &states[2],
            _ => &states[0],
        }
    }
}

thread_local! {
    /// What was found of the scenes of a build so far.
    static FINDINGS: RefCell<Vec<String>> = const { RefCell::new(Vec::new()) };
}

/// All that was found since it was asked last.
pub fn heard() -> Heard {
    FINDINGS.with_borrow(|all| Heard { findings: all.clone() })
}

/// Forgets what was found.
pub fn forget() {
    FINDINGS.with_borrow_mut(Vec::clear);
}

/// Runs a scene, asks for results, and hears what `check::scene` finds where nothing else is said.
pub fn hear<const D: usize>(
    scene: &Scene<D>,
    scheme: &Scheme,
    ask: impl FnOnce(&Problem<D>, &EquilibriumPath) -> Result<Vec<f64>, Error>,
) -> Result<Heard, Error> {
    let problem = scene.discretize(scheme)?;
    let path = problem.run()?.completed()?;
    let numbers = ask(&problem, &path)?;
    let diagnosis = check::scene(scene, scheme)?;
    let mut findings: Vec<String> =
        diagnosis.report().violations().map(|found| format!("{}: {}", found.law, found.at)).collect();
    // A number that is none is no answer.
    assert!(numbers.iter().all(|number| number.is_finite()), "an answer that is no number: {numbers:?}");
    FINDINGS.with_borrow_mut(|all| all.append(&mut findings));
    Ok(heard())
}

/// The last state of a path of a scene, of the same scene over another body, and of a coarser model.
pub fn states<const D: usize>(
    own: &EquilibriumPath,
    other: &Scene<D>,
    scheme: &Scheme,
    coarser: &Scheme,
) -> Result<[State; 3], Error> {
    let last = |scheme: &Scheme| Ok::<_, Error>(other.discretize(scheme)?.run()?.completed()?.last().clone());
    Ok([own.last().clone(), last(scheme)?, last(coarser)?])
}
