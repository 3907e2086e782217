use rkpm::output::*;

use super::harness::Input;

fn name(input: &mut Input) -> String {
    let letters = ["a", "\n", "\"", ",", "<", "&", "\0", "µ", "𝕏", " ", "\u{202e}", "long label "];
    (0..input.random.usize(0..6)).map(|_| input.pick(&letters)).collect()
}

pub fn tables(input: &mut Input) {
    let columns = input.random.usize(0..4);
    let mut table = Table::new((0..columns).map(|_| name(input)).collect::<Vec<_>>());
    for _ in 0..input.random.usize(0..4) {
        let row: Vec<Cell> = (0..input.length(columns))
            .map(|_| match input.random.usize(0..4) {
                0 => Cell::Empty,
                1 => Cell::Number(input.number(-1e3, 1e3)),
                2 => Cell::Integer(if input.once_in(2) { i128::MIN } else { 3 }),
                _ => Cell::Text(name(input)),
            })
            .collect();
        let _ = input.saw("row", &row);
        if input.once_in(2) {
            let _ = table.push(row);
        } else {
            table.rows.push(row);
        }
    }
    input.passed = table.to_csv().is_ok();
}

pub fn grids(input: &mut Input) {
    let points: Vec<[f64; 3]> =
        (0..input.random.usize(0..6)).map(|_| std::array::from_fn(|_| input.number(0.0, 1.0))).collect();
    let n = points.len();
    let cells: Vec<VtkCell> = (0..input.random.usize(0..4))
        .map(|_| match input.random.usize(0..4) {
            0 => VtkCell::Vertex(input.index(n)),
            1 => VtkCell::Quad(std::array::from_fn(|_| input.index(n))),
            2 => VtkCell::Hexahedron(std::array::from_fn(|_| input.index(n))),
            _ => VtkCell::Polygon((0..input.random.usize(0..5)).map(|_| input.index(n)).collect()),
        })
        .collect();
    let field = |input: &mut Input, right: usize| {
        let length = input.length(right);
        let values = match input.random.usize(0..4) {
            0 => VtkValues::Integers(vec![i64::MIN; length]),
            1 => VtkValues::Vectors(vec![[input.bad(); 3]; length]),
            2 => VtkValues::Tensors(vec![[input.bad(); 9]; length]),
            _ => VtkValues::Scalars(vec![input.bad(); length]),
        };
        VtkField { name: name(input), values }
    };
    let point_data = (0..input.random.usize(0..3)).map(|_| field(input, n)).collect();
    let cell_data = (0..input.random.usize(0..3)).map(|_| field(input, cells.len())).collect();
    let grid = VtkGrid { points, cells, point_data, cell_data };
    input.passed = input.saw("grid", &grid).to_xml().is_ok();
}

#[cfg(feature = "chart")]
pub fn charts(input: &mut Input) {
    use rkpm::output::chart::*;
    let mut chart = Chart::new(name(input));
    chart = if input.once_in(3) { chart.x_log(name(input)) } else { chart.x(name(input)) };
    chart = if input.once_in(3) { chart.y_log(name(input)) } else { chart.y(name(input)) };
    if input.once_in(4) {
        chart = chart.x_range(input.number(-1.0, 1.0), input.number(-1.0, 1.0));
    }
    if input.once_in(4) {
        chart = chart.y_range(input.number(-1.0, 1.0), input.number(-1.0, 1.0));
    }
    let scale = if input.once_in(3) { input.bad() } else { 1.0 };
    for _ in 0..input.random.usize(0..4) {
        let paths: Vec<Vec<[f64; 2]>> = (0..input.random.usize(0..3))
            .map(|_| {
                let points = 0..input.random.usize(0..6);
                points.map(|_| [scale * input.number(-1.0, 1.0), input.number(-1.0, 1.0)]).collect()
            })
            .collect();
        let series = Series::outlines(name(input), &paths)
            .stroke(input.pick(&[Stroke::None, Stroke::Solid, Stroke::Dashed]))
            .marker(input.pick(&[Marker::None, Marker::Automatic, Marker::Cross]));
        chart = chart.with(series);
    }
    if input.once_in(4) {
        chart = chart.horizontal(name(input), input.number(-1.0, 1.0));
    }
    if input.once_in(4) {
        chart = chart.vertical(name(input), input.number(-1.0, 1.0));
    }
    if input.once_in(4) {
        chart = chart.band(name(input), input.number(-1.0, 0.0), input.number(0.0, 1.0));
    }
    if input.once_in(2) {
        chart = chart.equal_aspect();
    }
    if input.once_in(4) {
        chart = chart.size(input.random.u32(..), input.pick(&[0, 1, 240, u32::MAX]));
    }
    input.passed = input.saw("chart", &chart).to_svg().is_ok();
}
