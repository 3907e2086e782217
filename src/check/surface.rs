//! Surfaces of triangles: what keeps them from enclosing a solid.

use crate::each::Each;
use crate::error::GeometryError;
use crate::geometry::Vec3;
use crate::solid::SurfaceFlaws;

use super::{Finding, Report};

/// Places of one kind that a finding lists; the values are in [`SurfaceFlaws`].
const LISTED: usize = 20;

/// Whether facets, three vertices each, enclose a solid as they are; [`SurfaceFlaws`] has the same as values.
///
/// [`Solid3::new`](crate::solid::Solid3::new) mends small openings, facets without area, facets that stand twice, facets and parts that face
/// the wrong way, and cavities that face outwards as the part around them does: each is listed with its place.
///
/// ```
/// use rkpm::geometry::Point;
/// let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(Point::<3>::from);
/// let report = rkpm::check::surface(&corners, &[[0, 2, 1], [0, 1, 3], [1, 2, 3]])?; // one side is missing
/// assert_eq!(report.finding("edges bound two facets").map(|finding| finding.violation), Some(3.0));
/// # Ok::<(), rkpm::Error>(())
/// ```
///
/// # Errors
/// For facets that name no vertex, and numbers that are not finite.
pub fn surface(vertices: &[Vec3], facets: &[[u32; 3]]) -> Result<Report, GeometryError> {
    let flaws = SurfaceFlaws::of(vertices, facets)?;
    let middle = |edge: &[Vec3; 2]| (edge[0] + edge[1]) * 0.5;
    let middles = |edges: &[[Vec3; 2]]| edges.mapped(middle);
    let crossings = flaws.crossing.mapped(|(_, at)| *at);
    let of_facets = |numbers: &[usize]| -> Vec<Vec3> {
        numbers.mapped(|&facet| facets[facet].iter().map(|&v| vertices[v as usize]).sum::<Vec3>() / 3.0)
    };
    let laws = [
        ("edges bound two facets", middles(&flaws.open)),
        ("neighbours face the same way", middles(&flaws.turned)),
        ("edges bound no more than two facets", middles(&flaws.branching)),
        ("facets do not cross", crossings),
        ("facets have areas", of_facets(&flaws.flat)),
        ("facets stand once", of_facets(&flaws.doubled)),
        ("parts face outwards", flaws.inside_out),
        ("no part lies within another that faces the same way", flaws.nested),
    ];
    let findings = laws.into_iter().map(|(law, places)| Finding {
        law,
        violation: places.len() as f64,
        tolerance: 0.0,
        at: listed(&places),
    });
    Ok(Report { findings: findings.collect(), ..Report::default() })
}

/// The first places.
fn listed(places: &[Vec3]) -> String {
    let shown: Vec<String> = places.iter().take(LISTED).map(|at| format!("X = {:?}", at.as_slice())).collect();
    let more = match places.len().checked_sub(LISTED) {
        None | Some(0) => String::new(),
        Some(more) => format!(" and {more} more"),
    };
    shown.join(", ") + &more
}
