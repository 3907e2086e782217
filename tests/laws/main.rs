//! Laws of shape functions, cells, tables and terms on random clouds and lattices.

mod consistent;
mod curved;
mod nodal_rules;
mod refined;
mod scattered;
mod shape_laws;
mod term_laws;
mod turned;
