//! Sections of MSH 2.2.

use std::collections::{HashMap, HashSet};

use crate::error::MeshError;

use super::bytes::Bytes;
use super::reading::{Reading, kind};

/// Nodes; `parametric` ones also have the dimension and the number of their entity, and coordinates on curves and surfaces.
pub(super) fn nodes(bytes: &mut Bytes<'_>, content: &mut Reading, parametric: bool) -> Result<(), MeshError> {
    bytes.enter(if parametric { "ParametricNodes" } else { "Nodes" });
    let count = bytes.text_integer()?.max(0) as u64;
    bytes.begin_numbers()?;
    let count = bytes.count_of(count, 8, 28)?;
    let (mut tags, mut points) = (Vec::with_capacity(count), Vec::with_capacity(count));
    for _ in 0..count {
        let tag = bytes.int()?;
        tags.push(u64::try_from(tag).map_err(|_| bytes.malformed("Nodes", format!("a node has the number {tag}")))?);
        points.push(bytes.place(0)?);
        if parametric {
            let (dimension, _) = (bytes.int()?, bytes.int()?);
            for _ in 0..if matches!(dimension, 1 | 2) { dimension } else { 0 } {
                bytes.real()?;
            }
        }
    }
    content.take_nodes(tags, points)
}

pub(super) fn elements(bytes: &mut Bytes<'_>, content: &mut Reading) -> Result<(), MeshError> {
    bytes.enter("Elements");
    content.begin_elements()?;
    let count = bytes.text_integer()?.max(0) as u64;
    bytes.begin_numbers()?;
    let count = bytes.count_of(count, 4, 8)?;
    // Elements of an entity with several physical groups are written once for each of them.
    let mut groups_of: HashMap<(usize, i64), Vec<i64>> = HashMap::new();
    let mut entity_of: [Vec<(u32, i64)>; 4] = Default::default();
    let mut read = 0;
    let mut nodes = [0u64; 27];
    while read < count {
        // Text has one element to a line, binary blocks of one kind.
        let (mut number, kind_number, follow, tags);
        if bytes.is_text() {
            number = bytes.int()?;
            kind_number = bytes.int()?;
            tags = bytes.int()?;
            follow = 1;
        } else {
            kind_number = bytes.int()?;
            follow = bytes.int()?.max(0) as usize;
            tags = bytes.int()?;
            number = 0;
            ensure!(follow != 0, bytes.malformed("Elements", "a block holds no element".to_string()));
        }
        let (shape, node_count) =
            kind(kind_number).ok_or_else(|| MeshError::Kind { element: number.max(0) as u64, kind: kind_number })?;
        let tags = bytes.count_of(tags.max(0) as u64, 2, 4)?;
        for _ in 0..follow.min(count - read) {
            if !bytes.is_text() {
                number = bytes.int()?;
            }
            let (mut physical, mut entity) = (0, 0);
            for k in 0..tags {
                let tag = bytes.int()?;
                match k {
                    0 => physical = tag,
                    1 => entity = tag,
                    _ => {}
                }
            }
            for node in &mut nodes[..node_count] {
                *node = bytes.int()?.max(0) as u64;
            }
            let dimension = shape.dimension();
            let place = content.push(number.max(0) as u64, shape, &nodes[..shape.corner_count()])?;
            content.bend(shape, &nodes[..node_count]);
            if physical != 0 {
                let group = content.group(dimension, physical);
                content.groups[group].1.push(place);
            }
            let of_entity = groups_of.entry((dimension, entity)).or_default();
            if !of_entity.contains(&physical) {
                of_entity.push(physical);
            }
            let entities = &mut entity_of[dimension];
            if entities.last().is_none_or(|last| last.1 != entity) {
                entities.push((place, entity));
            }
        }
        read += follow;
    }
    for dimension in 0..4 {
        let repeated: HashSet<i64> = groups_of
            .iter()
            .filter(|(key, groups)| key.0 == dimension && groups.len() > 1)
            .map(|(key, _)| key.1)
            .collect();
        if !repeated.is_empty() {
            join_repeated(content, dimension, &entity_of[dimension], &repeated);
        }
    }
    Ok(())
}

/// Keeps the first of equal elements in entities of several groups.
fn join_repeated(content: &mut Reading, dimension: usize, runs: &[(u32, i64)], repeated: &HashSet<i64>) {
    let list = std::mem::take(&mut content.elements[dimension]);
    let mut first: HashMap<Vec<u32>, u32> = HashMap::new();
    let mut place = vec![0u32; list.len()];
    let kept = &mut content.elements[dimension];
    for (run, &(start, entity)) in runs.iter().enumerate() {
        let end = runs.get(run + 1).map_or(list.len(), |next| next.0 as usize);
        for element in start as usize..end {
            let next = kept.len() as u32;
            place[element] = if repeated.contains(&entity) {
                *first.entry(list.corners(element).to_vec()).or_insert(next)
            } else {
                next
            };
            if place[element] == next {
                kept.push(list.shape(element), list.corners(element).iter().copied());
            }
        }
    }
    for ((of, _), members) in &mut content.groups {
        if *of == dimension {
            for member in members {
                *member = place[*member as usize];
            }
        }
    }
}
