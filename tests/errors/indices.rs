//! Shares, numbers and names that do not exist: nothing, or an error, and never those of something else.
#![cfg(feature = "solve")]

use rkpm::cells::Zones;
use rkpm::error::ApproximationError;
use rkpm::prelude::*;
use rkpm::quadrature::Points;
use rkpm::shape::{FiniteElements, Scratch, ShapeFunctions};

#[test]
fn shares_of_sets_are_parts_of_them() {
    let nothing = Points::<2>::default();
    assert_eq!(nothing.share(0, 1), nothing);
    assert!(nothing.validate().is_ok());
    let bare = Points::<2> { groups: Vec::new(), ..Points::empty() };
    assert!(bare.share(0, 1).positions.is_empty() && bare.share(3, 2).positions.is_empty());

    let points = Block::new([0.0, 0.0], [2.0, 1.0]).lattice([5, 4]).unwrap().gauss(2).unwrap();
    for parts in [1, 2, 5, 100] {
        let mut whole = Points::default();
        (0..parts).for_each(|part| whole.append(points.share(part, parts)));
        assert_eq!(whole, points, "{parts}");
    }
    for (part, parts) in [(2, 2), (usize::MAX, 3), (usize::MAX, usize::MAX)] {
        assert!(points.share(part, parts).positions.is_empty(), "{part} of {parts}");
        assert!(Zones::single(4).share(part, parts, u64::from).cells.is_empty(), "{part} of {parts}");
    }
    // Sets that `validate` refuses have what there is of a share.
    let mut short = points.clone();
    short.weights.truncate(3);
    short.groups.push(usize::MAX);
    assert!(short.validate().is_err());
    let _ = (short.share(0, 1), short.share(1, 2));
}

#[test]
fn functions_of_elements_and_nodes_that_are_not_there() {
    let lattice = Block::new([0.0, 0.0], [2.0, 1.0]).lattice([5, 5]).unwrap();
    for order in [1, 2] {
        let elements = FiniteElements::new(lattice.clone(), order).unwrap();
        let count = elements.element_count();
        let mut psi = ShapeFunctions::default();
        let middle = Point::<2>::new(0.5, 0.5);
        assert!(elements.fill(count - 1, &middle, &mut psi).is_ok());
        for element in [count, count + 1, usize::MAX] {
            let error = elements.fill(element, &middle, &mut psi).unwrap_err();
            assert_eq!(error, ApproximationError::Element { element, elements: count });
        }
        let error = elements.fill(0, &Point::<2>::new(f64::NAN, 0.5), &mut psi).unwrap_err();
        assert!(matches!(error, ApproximationError::Point { .. }), "{error}");
        let error = elements.evaluate_at_node(25, &mut Scratch::default(), &mut psi).unwrap_err();
        assert!(matches!(error, ApproximationError::Particle { particle: 25, .. }), "{error}");
    }
    assert_eq!(lattice.node([4, 4]), 24);
    // Not node 5, the first of the next row.
    assert_eq!((lattice.node([5, 0]), lattice.node([0, 5])), (25, 25));
}
