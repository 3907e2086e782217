//! A shape as numbered surfaces and how they are put together.

use std::sync::Arc;

use nalgebra::Rotation3;

use crate::each::{Each, IntoEach};
use crate::geometry::Vec3;

use super::surface::Surface;

/// What is inside, put together of smooth surfaces.
#[derive(Debug, Clone)]
pub(super) enum Node {
    Surface {
        surface: Surface,
        /// Outside and inside change places.
        flipped: bool,
        name: Option<Arc<str>>,
    },
    Union(Vec<Node>),
    Intersection(Vec<Node>),
}

impl Node {
    pub(crate) fn complement(self) -> Self {
        let all = |members: Vec<Node>| members.into_mapped(Node::complement);
        match self {
            Node::Surface { surface, flipped, name } => Node::Surface { surface, flipped: !flipped, name },
            Node::Union(members) => Node::Intersection(all(members)),
            Node::Intersection(members) => Node::Union(all(members)),
        }
    }

    pub(crate) fn moved(self, by: &Rotation3<f64>, to: &Vec3) -> Self {
        let all = |members: Vec<Node>| members.into_mapped(|node| node.moved(by, to));
        match self {
            Node::Surface { surface, flipped, name } => Node::Surface { surface: surface.moved(by, to), flipped, name },
            Node::Union(members) => Node::Union(all(members)),
            Node::Intersection(members) => Node::Intersection(all(members)),
        }
    }

    pub(crate) fn named(&mut self, given: &Arc<str>) {
        match self {
            Node::Surface { name, .. } => *name = name.take().or_else(|| Some(given.clone())),
            Node::Union(members) | Node::Intersection(members) => members.iter_mut().for_each(|node| node.named(given)),
        }
    }
}

/// How numbered surfaces are put together.
enum Op {
    Surface {
        number: u32,
        sign: f64,
    },
    /// The least, times the sign: unions 1, intersections -1 of opposite members.
    Least {
        sign: f64,
        members: Vec<Op>,
    },
}

/// Surfaces, each once, and the shape made of them.
pub(super) struct Program {
    pub surfaces: Vec<Surface>,
    pub names: Vec<Option<Arc<str>>>,
    root: Op,
}

/// The value of a shape at a point, and the surface that it is of, with its sign there.
#[derive(Clone, Copy)]
pub(super) struct Value {
    pub value: f64,
    pub surface: u32,
    pub sign: f64,
}

impl Program {
    /// `size` is that of the shape.
    pub(crate) fn new(node: &Node, size: f64) -> Self {
        let mut program =
            Program { surfaces: Vec::new(), names: Vec::new(), root: Op::Least { sign: 1.0, members: Vec::new() } };
        program.root = program.op(node, size);
        program
    }

    fn op(&mut self, node: &Node, size: f64) -> Op {
        match node {
            Node::Surface { surface, flipped, name } => {
                let sign = if *flipped { -1.0 } else { 1.0 };
                // Two shapes that are flush share a surface; a plane may face the other way.
                let known = self
                    .surfaces
                    .iter()
                    .zip(&self.names)
                    .position(|(other, theirs)| theirs == name && other.is_same(surface, size));
                let number = known.unwrap_or_else(|| {
                    self.surfaces.push(surface.clone());
                    self.names.push(name.clone());
                    self.surfaces.len() - 1
                });
                let facing = match (&self.surfaces[number], surface) {
                    (Surface::Plane { normal, .. }, Surface::Plane { normal: own, .. }) => normal.dot(own).signum(),
                    _ => 1.0,
                };
                Op::Surface { number: number as u32, sign: sign * facing }
            }
            Node::Union(members) => Op::Least { sign: 1.0, members: members.mapped(|member| self.op(member, size)) },
            Node::Intersection(members) => {
                Op::Least { sign: -1.0, members: members.mapped(|member| self.op(member, size)) }
            }
        }
    }

    /// The value at a point, negative inside.
    pub(crate) fn at(&self, x: &Vec3) -> Value {
        self.of(&self.root, x)
    }

    fn of(&self, op: &Op, x: &Vec3) -> Value {
        match op {
            Op::Surface { number, sign } => {
                let value = sign * self.surfaces[*number as usize].value(x);
                // What is no number is outside.
                Value { value: if value.is_nan() { f64::INFINITY } else { value }, surface: *number, sign: *sign }
            }
            Op::Least { sign, members } => {
                let mut best = Value { value: sign * f64::INFINITY, surface: u32::MAX, sign: 1.0 };
                for member in members {
                    let found = self.of(member, x);
                    if sign * found.value < sign * best.value || best.surface == u32::MAX {
                        best = found;
                    }
                }
                best
            }
        }
    }
}
