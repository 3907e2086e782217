//! The order of trace functions along the boundary.

use super::contact_surface::Trace;

/// The places of trace functions along a boundary curve, chain by chain: neighbours share facet points, or the particle of a corner.
/// Chains begin at their ends, closed ones, told by `true`, at the trace function that was made first.
pub(crate) fn chains(traces: &[Trace]) -> Vec<(Vec<usize>, bool)> {
    let most =
        traces.iter().flat_map(|trace| trace.points.iter().map(|point| point.0)).max().map_or(0, |p| p as usize + 1);
    let mut at_point: Vec<Option<usize>> = vec![None; most];
    let particles = traces.iter().map(|trace| trace.particle as usize).max().map_or(0, |p| p + 1);
    let mut at_particle: Vec<Option<usize>> = vec![None; particles];
    let mut beside: Vec<Vec<usize>> = vec![Vec::new(); traces.len()];
    let mut join = |a: usize, b: usize| {
        if !beside[a].contains(&b) {
            beside[a].push(b);
            beside[b].push(a);
        }
    };
    for (k, trace) in traces.iter().enumerate() {
        if let Some(other) = at_particle[trace.particle as usize].replace(k) {
            join(other, k);
        }
        for &(point, _) in &trace.points {
            if let Some(other) = at_point[point as usize].replace(k) {
                join(other, k);
            }
        }
    }
    let ends = (0..traces.len()).filter(|&k| beside[k].len() < 2);
    let mut seen = vec![false; traces.len()];
    let mut chains = Vec::new();
    for start in ends.chain(0..traces.len()) {
        if seen[start] {
            continue;
        }
        let mut chain = vec![start];
        seen[start] = true;
        let mut now = start;
        while let Some(&next) = beside[now].iter().find(|&&next| !seen[next]) {
            seen[next] = true;
            chain.push(next);
            now = next;
        }
        let closed = chain.len() > 2 && beside[now].contains(&start);
        chains.push((chain, closed));
    }
    chains
}
