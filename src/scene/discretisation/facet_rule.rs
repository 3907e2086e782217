//! How boundaries of a discretised body are integrated.

/// How boundaries are integrated: sub-facets per direction and Gauss points on each.
#[derive(Clone, Copy)]
pub(crate) struct FacetRule {
    pub parts: usize,
    pub gauss: usize,
}

/// How the surface of a problem is integrated.
#[derive(Clone, Copy)]
pub(crate) enum Facets {
    /// Facets of the cells, as rows and loads over boundaries take them.
    OfCells(FacetRule),
    /// Faces of finite elements of an order, with so many Gauss points per direction.
    OfElements { order: usize, gauss: usize },
}
