//! What is wrong with a surface as it was given, with the places.

use crate::each::{Each, EachOf};
use crate::error::GeometryError;
use crate::geometry::{Vec3, double_area};

use super::closed::{SAME, Solid3, checked};
use super::crossing::crossings;
use super::edges::{balance, by_edge, ends, half_edges};
use super::weld::{drop_doubles, weld};

/// What is wrong with a surface of triangles: values with places, where [`Solid3::new`] mends or stops at the first.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SurfaceFlaws {
    /// Ends of the edges that bound one facet alone.
    pub open: Vec<[Vec3; 2]>,
    /// Ends of the edges whose two facets face opposite ways.
    pub turned: Vec<[Vec3; 2]>,
    /// Ends of the edges of more than two facets.
    pub branching: Vec<[Vec3; 2]>,
    /// Pairs of facets that cross, as numbers among those given, and a point of both.
    pub crossing: Vec<([usize; 2], Vec3)>,
    /// Facets without area.
    pub flat: Vec<usize>,
    /// Facets that stand more than once, but for one of those that face the same way.
    pub doubled: Vec<usize>,
    /// A point of each connected part that faces inwards.
    pub inside_out: Vec<Vec3>,
    /// A point of each connected part that lies within another and faces the same way: a cavity, its facets turned.
    pub nested: Vec<Vec3>,
}

impl SurfaceFlaws {
    /// Looks for all of them.
    ///
    /// # Errors
    /// As [`Solid3::new`] for facets that name no vertex, and numbers that are not finite.
    pub fn of(vertices: &[Vec3], facets: &[[u32; 3]]) -> Result<Self, GeometryError> {
        let tolerance = SAME * checked(vertices, facets)?;
        let mut flaws = SurfaceFlaws::default();
        let mut kept = vec![false; facets.len()];
        let (vertices, mut welded) = weld(vertices, facets, tolerance);
        welded.iter().for_each(|facet| kept[facet.origin as usize] = true);
        welded.retain(|facet| {
            let x = facet.corners.each(|vertex| vertices[vertex as usize]);
            let [a, b, c] = x;
            let has_area = double_area(&x).norm() > tolerance * (b - a).amax().max((c - a).amax());
            kept[facet.origin as usize] &= has_area;
            has_area
        });
        flaws.flat = (0..facets.len()).filter(|&facet| !kept[facet]).collect();
        drop_doubles(&mut welded);
        let mut once = vec![false; facets.len()];
        welded.iter().for_each(|facet| once[facet.origin as usize] = true);
        flaws.doubled = (0..facets.len()).filter(|&facet| kept[facet] && !once[facet]).collect();
        let halves = half_edges(welded.iter().map(|facet| facet.corners));
        for group in by_edge(&halves) {
            let place = ends(group[0].key).each(|vertex| vertices[vertex as usize]);
            match (group.len(), balance(group)) {
                (1, _) => flaws.open.push(place),
                (2, 0) => {}
                (2, _) => flaws.turned.push(place),
                _ => flaws.branching.push(place),
            }
        }
        let origins: Vec<u32> = welded.mapped(|facet| facet.origin);
        let corners = welded.mapped(|facet| facet.corners);
        let solid = Solid3::measured(vertices, corners);
        for found in crossings(&solid.vertices, &solid.facets, &solid.tree) {
            let facets = found.facets.each(|facet| origins[facet as usize] as usize);
            flaws.crossing.push((facets, found.at.into()));
        }
        for facet in solid.widest_of_parts().1 {
            match solid.sides(facet) {
                [_, inner] if inner < 1 => flaws.inside_out.push(solid.centre(facet)),
                [outer, _] if outer > 0 => flaws.nested.push(solid.centre(facet)),
                _ => {}
            }
        }
        Ok(flaws)
    }
}
