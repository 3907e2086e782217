//! Sections of MSH 4.1.

use crate::error::MeshError;

use super::bytes::Bytes;
use super::reading::{Reading, kind};

/// Physical groups of the geometric entities.
pub(super) fn entities(bytes: &mut Bytes<'_>, content: &mut Reading) -> Result<(), MeshError> {
    bytes.enter("Entities");
    bytes.begin_numbers()?;
    let counts = [bytes.size()?, bytes.size()?, bytes.size()?, bytes.size()?];
    for (dimension, count) in counts.into_iter().enumerate() {
        for _ in 0..bytes.count_of(count, 8, 36)? {
            let tag = bytes.int()?;
            // A point has its position, all others a box.
            bytes.place(if dimension == 0 { 0 } else { 3 })?;
            let count = bytes.size()?;
            let mut physical = Vec::new();
            for _ in 0..bytes.count_of(count, 2, 4)? {
                physical.push(bytes.int()?);
            }
            if dimension > 0 {
                let count = bytes.size()?;
                for _ in 0..bytes.count_of(count, 2, 4)? {
                    bytes.int()?;
                }
            }
            if !physical.is_empty() {
                content.physical.insert((dimension, tag), physical);
            }
        }
    }
    Ok(())
}

pub(super) fn nodes(bytes: &mut Bytes<'_>, content: &mut Reading) -> Result<(), MeshError> {
    bytes.enter("Nodes");
    bytes.begin_numbers()?;
    let (blocks, count) = (bytes.size()?, bytes.size()?);
    let (_, _) = (bytes.size()?, bytes.size()?);
    let count = bytes.count_of(count, 8, 32)?;
    let (mut tags, mut points) = (Vec::with_capacity(count), Vec::with_capacity(count));
    for _ in 0..bytes.count_of(blocks, 8, 20)? {
        let (dimension, _, parametric) = (bytes.int()?, bytes.int()?, bytes.int()?);
        let in_block = bytes.size()?;
        let in_block = bytes.count_of(in_block, 8, 32)?;
        if in_block > count - tags.len() {
            return Err(bytes.malformed("Nodes", format!("blocks hold more than the {count} nodes announced")));
        }
        for _ in 0..in_block {
            tags.push(bytes.size()?);
        }
        let extra = if parametric == 0 { 0 } else { dimension.clamp(0, 3) };
        for _ in 0..in_block {
            points.push(bytes.place(extra)?);
        }
    }
    content.take_nodes(tags, points)
}

pub(super) fn elements(bytes: &mut Bytes<'_>, content: &mut Reading) -> Result<(), MeshError> {
    bytes.enter("Elements");
    bytes.begin_numbers()?;
    content.begin_elements()?;
    let (blocks, _) = (bytes.size()?, bytes.size()?);
    let (_, _) = (bytes.size()?, bytes.size()?);
    let mut nodes = [0u64; 27];
    for _ in 0..bytes.count_of(blocks, 8, 20)? {
        let (dimension, entity, kind_number) = (bytes.int()?, bytes.int()?, bytes.int()?);
        let count = bytes.size()?;
        let Some((shape, node_count)) = kind(kind_number) else {
            // A block of no element does no harm.
            if count == 0 {
                continue;
            }
            let element = bytes.size()?;
            return Err(MeshError::Kind { element, kind: kind_number });
        };
        let count = bytes.count_of(count, 2 * (node_count + 1), 8 * (node_count + 1))?;
        content.elements[shape.dimension()].reserve(count, shape.corner_count());
        let first = content.elements[shape.dimension()].len() as u32;
        for _ in 0..count {
            let number = bytes.size()?;
            for node in &mut nodes[..node_count] {
                *node = bytes.size()?;
            }
            content.push(number, shape, &nodes[..shape.corner_count()])?;
            content.bend(shape, &nodes[..node_count]);
        }
        let physical = usize::try_from(dimension).ok().and_then(|d| content.physical.get(&(d, entity)).cloned());
        for number in physical.unwrap_or_default() {
            let group = content.group(shape.dimension(), number);
            content.groups[group].1.extend(first..first + count as u32);
        }
    }
    Ok(())
}
