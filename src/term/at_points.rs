//! Matrices of clusters whose nodes act through points that move with them: summed over the points, handed on column by column.

/// Points that move with the nodes of a cluster: each is a combination of their displacements, $x = T d$, component by component.
#[derive(Debug, Default)]
pub struct PointMotion {
    /// For each point places of nodes in the cluster, rising, and factors.
    of_points: Vec<Vec<(u16, f64)>>,
    /// For each node its points and factors.
    of_nodes: Vec<Vec<(u32, f64)>>,
}

/// A matrix $M$ over points, by columns of blocks.
#[derive(Debug, Clone, Default)]
pub(crate) struct PointMatrix {
    /// The first block of each column, and the end; empty where there is no matrix.
    first: Vec<usize>,
    /// Points of the blocks, rising in each column.
    rows: Vec<u32>,
    /// Block by block, each by columns.
    values: Vec<f64>,
}

/// The columns of $T^{\mathsf T} M\,T$ that belong to a node.
#[derive(Debug, Clone, Default)]
pub(crate) struct PointColumns {
    /// Places of the nodes that it is coupled with.
    pub(crate) rows: Vec<u16>,
    /// Blocks by places, each by columns; those of other rows are left over from before.
    values: Vec<f64>,
    seen: Vec<bool>,
    /// $M\,T$.
    points: Vec<u32>,
    half: Vec<f64>,
    points_seen: Vec<bool>,
}

/// Numbers as blocks by columns.
fn blocks<const D: usize>(values: &[f64]) -> &[[[f64; D]; D]] {
    values.as_chunks::<D>().0.as_chunks::<D>().0
}

fn blocks_mut<const D: usize>(values: &mut [f64]) -> &mut [[[f64; D]; D]] {
    values.as_chunks_mut::<D>().0.as_chunks_mut::<D>().0
}

fn add<const D: usize>(target: &mut [[f64; D]; D], factor: f64, block: &[[f64; D]; D]) {
    for j in 0..D {
        (0..D).for_each(|i| target[j][i] += factor * block[j][i]);
    }
}

impl PointMotion {
    /// Of combinations of the displacements of so many nodes.
    pub(crate) fn new(of_points: Vec<Vec<(u16, f64)>>, nodes: usize) -> Self {
        let mut of_nodes = vec![Vec::new(); nodes];
        for (point, of) in of_points.iter().enumerate() {
            of.iter().for_each(|&(place, factor)| of_nodes[place as usize].push((point as u32, factor)));
        }
        PointMotion { of_points, of_nodes }
    }

    /// Number of points.
    pub(crate) fn len(&self) -> usize {
        self.of_points.len()
    }

    /// What a point is of the displacements of nodes.
    pub(crate) fn of(&self, point: u32) -> &[(u16, f64)] {
        &self.of_points[point as usize]
    }

    /// Adds what a force on a point is on the nodes.
    pub(crate) fn add_force(&self, point: u32, force: &[f64], out: &mut [f64]) {
        for &(place, factor) in self.of(point) {
            let target = &mut out[place as usize * force.len()..][..force.len()];
            target.iter_mut().zip(force).for_each(|(target, force)| *target += factor * force);
        }
    }

    /// The columns of a node in a matrix over the nodes, from its own row on.
    pub(crate) fn columns<const D: usize>(&self, matrix: &PointMatrix, node: usize, out: &mut PointColumns) {
        out.begin::<D>(self);
        let PointColumns { rows, values, seen, points, half, points_seen } = out;
        let (values, half) = (blocks_mut::<D>(values), blocks_mut::<D>(half));
        for &(point, factor) in &self.of_nodes[node] {
            let range = matrix.first[point as usize]..matrix.first[point as usize + 1];
            for (&row, block) in matrix.rows[range.clone()].iter().zip(&blocks::<D>(&matrix.values)[range]) {
                let place = row as usize;
                if !std::mem::replace(&mut points_seen[place], true) {
                    points.push(row);
                    half[place] = [[0.0; D]; D];
                }
                add(&mut half[place], factor, block);
            }
        }
        for &point in points.iter() {
            let (of, block) = (self.of(point), &half[point as usize]);
            let first = of.partition_point(|entry| (entry.0 as usize) < node);
            for &(place, factor) in &of[first..] {
                let target = &mut values[place as usize];
                if !std::mem::replace(&mut seen[place as usize], true) {
                    rows.push(place);
                    *target = [[0.0; D]; D];
                }
                add(target, factor, block);
            }
        }
    }
}

impl PointColumns {
    fn begin<const D: usize>(&mut self, motion: &PointMotion) {
        self.rows.drain(..).for_each(|row| self.seen[row as usize] = false);
        self.points.drain(..).for_each(|point| self.points_seen[point as usize] = false);
        self.seen.resize(motion.of_nodes.len(), false);
        self.values.resize(motion.of_nodes.len() * D * D, 0.0);
        self.points_seen.resize(motion.len(), false);
        self.half.resize(motion.len() * D * D, 0.0);
    }

    /// The block of one of the rows, by columns.
    pub(crate) fn block<const D: usize>(&self, row: u16) -> &[[f64; D]; D] {
        &blocks::<D>(&self.values)[row as usize]
    }
}

impl PointMatrix {
    /// Whether there is no matrix.
    pub(crate) fn is_empty(&self) -> bool {
        self.first.is_empty()
    }

    /// Leaves no matrix.
    pub(crate) fn clear(&mut self) {
        self.first.clear();
    }

    /// Zeros over so many points, of which those of each list are coupled.
    pub(crate) fn reset<'a>(&mut self, dim: usize, count: usize, lists: impl Iterator<Item = &'a [u32]> + Clone) {
        let mut holders: Vec<Vec<u32>> = vec![Vec::new(); count];
        for (k, list) in lists.clone().enumerate() {
            list.iter().for_each(|&point| holders[point as usize].push(k as u32));
        }
        let lists: Vec<&[u32]> = lists.collect();
        self.first.clear();
        self.first.push(0);
        self.rows.clear();
        let mut seen = vec![u32::MAX; count];
        for (point, holders) in holders.iter().enumerate() {
            let from = self.rows.len();
            for &row in holders.iter().flat_map(|&k| lists[k as usize]) {
                if std::mem::replace(&mut seen[row as usize], point as u32) != point as u32 {
                    self.rows.push(row);
                }
            }
            self.rows[from..].sort_unstable();
            self.first.push(self.rows.len());
        }
        self.values.clear();
        self.values.resize(self.rows.len() * dim * dim, 0.0);
    }

    /// The block of two points that are coupled.
    pub(crate) fn block<const D: usize>(&mut self, row: u32, column: u32) -> &mut [[f64; D]; D] {
        let range = self.first[column as usize]..self.first[column as usize + 1];
        let place = range.start + self.rows[range].partition_point(|&r| r < row);
        &mut blocks_mut::<D>(&mut self.values)[place]
    }

    /// Adds a matrix over the coordinates of some points that are coupled, by rising number; by columns.
    pub(crate) fn add<const D: usize>(&mut self, points: &[u32], matrix: &[f64]) {
        let size = points.len() * D;
        for (b, &column) in points.iter().enumerate() {
            let range = self.first[column as usize]..self.first[column as usize + 1];
            let mut both = self.rows[range.clone()].iter().zip(&mut blocks_mut::<D>(&mut self.values)[range]);
            for (a, point) in points.iter().enumerate() {
                let Some((_, block)) = both.find(|(row, _)| *row == point) else { break };
                for j in 0..D {
                    let source = &matrix[(b * D + j) * size + a * D..][..D];
                    block[j].iter_mut().zip(source).for_each(|(target, value)| *target += value);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::abs_diff_eq;

    /// Columns are those of the product of dense matrices.
    #[test]
    fn columns_are_those_of_the_product() {
        const D: usize = 2;
        let (nodes, points) = (5, 4);
        let of_points =
            vec![vec![(0, 1.0), (2, -0.5)], vec![(1, 2.0)], vec![(2, 0.3), (3, 0.4), (4, 1.1)], vec![(0, 0.7)]];
        let motion = PointMotion::new(of_points, nodes);
        let lists: [&[u32]; 2] = [&[0, 1], &[1, 2, 3]];
        let mut matrix = PointMatrix::default();
        matrix.reset(D, points, lists.iter().copied());
        let mut dense = vec![vec![0.0; points * D]; points * D];
        for list in lists {
            let size = list.len() * D;
            let own: Vec<f64> = (0..size * size).map(|k| (k as f64 + size as f64).sin()).collect();
            matrix.add::<D>(list, &own);
            for (k, value) in own.iter().enumerate() {
                let at = |k: usize| list[k / D] as usize * D + k % D;
                dense[at(k % size)][at(k / size)] += value;
            }
        }
        let factor = |point: usize, node: usize| {
            motion.of(point as u32).iter().filter(|entry| entry.0 as usize == node).map(|entry| entry.1).sum::<f64>()
        };
        let mut columns = PointColumns::default();
        for node in 0..nodes {
            motion.columns::<D>(&matrix, node, &mut columns);
            for row in node..nodes {
                for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                    let mut expected = 0.0;
                    for (p, q) in (0..points).flat_map(|p| (0..points).map(move |q| (p, q))) {
                        expected += factor(p, row) * dense[p * D + i][q * D + j] * factor(q, node);
                    }
                    let coupled = columns.rows.contains(&(row as u16));
                    let found = if coupled { columns.block::<D>(row as u16)[j][i] } else { 0.0 };
                    assert!(abs_diff_eq!(found, expected, epsilon = 1e-14), "{row} {node}: {found} {expected}");
                }
            }
        }
    }
}
