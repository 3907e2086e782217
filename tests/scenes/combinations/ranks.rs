//! Ranks that are threads of this process.

use std::sync::{Arc, Barrier, Mutex};
use std::thread;

use rkpm::prelude::*;

use crate::ranks::{Exchange, Gathered, Rank};

use super::Failure;

/// What each of two ranks finds.
pub fn on_two(
    find: impl Fn(&dyn Fn(Scheme) -> Scheme) -> Result<Vec<f64>, Failure> + Sync,
) -> Vec<Result<Vec<f64>, Failure>> {
    let count = 2;
    let exchange = Arc::new(Exchange { gate: Barrier::new(count), values: Mutex::new(vec![Vec::new(); count]) });
    thread::scope(|scope| {
        let (find, exchange) = (&find, &exchange);
        let run = |rank| {
            scope.spawn(move || {
                let shared =
                    |scheme: Scheme| scheme.solver(Gathered::new(Rank { rank, count, exchange: exchange.clone() }));
                find(&shared)
            })
        };
        let threads: Vec<_> = (0..count).map(run).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    })
}
