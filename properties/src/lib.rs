//! Laws of shape functions, terms, conditions and materials, tried on random cases; see `tests`.
