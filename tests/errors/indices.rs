//! Shares, numbers and names that do not exist: nothing, or an error, and never those of something else.
#![cfg(feature = "solve")]

use rkpm::error::ApproximationError;
use rkpm::prelude::*;
use rkpm::shape::{FiniteElements, Scratch, ShapeFunctions};

#[test]
fn functions_of_nodes_that_are_not_there() {
    let lattice = Block::new([0.0, 0.0], [2.0, 1.0]).lattice([5, 5]).unwrap();
    for order in [1, 2] {
        let elements = FiniteElements::new(lattice.clone(), order).unwrap();
        let mut psi = ShapeFunctions::default();
        let error = elements.evaluate_at_node(25, &mut Scratch::default(), &mut psi).unwrap_err();
        assert!(matches!(error, ApproximationError::Particle { particle: 25, .. }), "{error}");
    }
    assert_eq!(lattice.node([4, 4]), 24);
    // Not node 5, the first of the next row.
    assert_eq!((lattice.node([5, 0]), lattice.node([0, 5])), (25, 25));
}
