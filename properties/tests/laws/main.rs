//! Laws of shape functions, cells, tables, terms and conditions on random clouds and lattices.

mod conditions;
mod consistent;
mod curved;
mod nodal_rules;
mod refined;
mod scattered;
mod shape_laws;
mod term_laws;
mod turned;
