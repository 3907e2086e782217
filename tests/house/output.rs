//! What the files of `rkpm::output` promise to those who read them.

use rkpm::error::OutputError;
use rkpm::nalgebra::{Matrix3, Vector2};
use rkpm::output::{Cell, PvdCollection, Table, VtkCell, VtkField, VtkGrid};
use std::path::PathBuf;

/// A directory of this test run that does not exist yet.
fn fresh(name: &str) -> PathBuf {
    let directory = std::env::temp_dir().join(format!("rkpm-output-{}-{name}", std::process::id()));
    let _ = std::fs::remove_dir_all(&directory);
    directory
}

#[test]
fn numbers_in_csv_read_back_to_the_same_bits() {
    let numbers = [0.1 + 0.2, -0.0, 1e-300, 123_456_789.0, f64::MIN_POSITIVE, f64::MAX, 1.0 / 3.0];
    let mut table = Table::new(["number"]);
    for number in numbers {
        table.push([number]).unwrap();
    }
    let csv = table.to_csv().unwrap();
    let read: Vec<u64> = csv.lines().skip(1).map(|line| line.parse::<f64>().unwrap().to_bits()).collect();
    assert_eq!(read, numbers.map(f64::to_bits));
    assert!(csv.lines().all(|line| line.len() < 25), "{csv}");
}

#[test]
fn csv_quotes_text_and_leaves_missing_numbers_empty() {
    let mut table = Table::new(["what", "value, if any", "count"]);
    table.push([Cell::from("a \"b\""), f64::NAN.into(), 3usize.into()]).unwrap();
    table.push([Cell::from("plain"), None::<f64>.into(), Cell::Empty]).unwrap();
    let expected = "what,\"value, if any\",count\n\"a \"\"b\"\"\",,3\nplain,,\n";
    assert_eq!(table.to_csv().unwrap(), expected);
}

/// Readers skip empty lines: a row of one cell that is empty is a line all the same.
#[test]
fn every_row_has_a_line_that_readers_keep() {
    let mut table = Table::new(["number"]);
    for number in [1.0, f64::NAN, f64::INFINITY] {
        table.push([number]).unwrap();
    }
    table.push([""]).unwrap();
    assert_eq!(table.to_csv().unwrap(), "number\n1\n\"\"\ninf\n\"\"\n");
}

#[test]
fn ragged_rows_are_refused() {
    let mut table = Table::new(["a", "b"]);
    let refused = table.push([1.0]);
    assert!(matches!(refused, Err(OutputError::Length { given: 1, needed: 2, .. })));
    table.rows.push(vec![1.0.into()]);
    assert!(matches!(table.to_csv(), Err(OutputError::Length { .. })));
}

#[test]
fn files_appear_with_the_directories_above_them() {
    let directory = fresh("csv");
    let path = directory.join("deep/er/table.csv");
    let mut table = Table::new(["steps"]);
    table.push([3.0]).unwrap();
    table.write(&path).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    assert_eq!(text, table.to_csv().unwrap());
    // A file where a directory is needed.
    let blocked = table.write(path.join("below.csv"));
    assert!(matches!(blocked, Err(OutputError::Io { .. })));
    std::fs::remove_dir_all(directory).unwrap();
}

/// Whoever reads a collection finds its files beside it, however the places of both are written.
#[test]
fn collections_name_files_as_they_lie_beside_them() {
    let folder = fresh("beside");
    // Joined paths keep the dots in them.
    for (film, file) in
        [("a/run.pvd", "a/s.vtu"), ("./a/run.pvd", "a/s.vtu"), ("a/run.pvd", "./a/s.vtu"), ("a/run.pvd", "a/b/s.vtu")]
    {
        let mut films = PvdCollection::default();
        films.push(0.0, folder.join(file));
        films.write(folder.join(film)).unwrap();
        let xml = std::fs::read_to_string(folder.join(film)).unwrap();
        let expected = if file.contains("/b/") { "file=\"b/s.vtu\"" } else { "file=\"s.vtu\"" };
        assert!(xml.contains(expected), "{film}, {file}: {xml}");
    }
    std::fs::remove_dir_all(folder).unwrap();
}

/// Files that lie elsewhere are found from where the collection is, whatever dots and links their paths have.
#[test]
fn collections_find_files_that_lie_elsewhere() {
    let folder = fresh("elsewhere");
    std::fs::create_dir_all(folder.join("a/b")).unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink("a/b", folder.join("link")).unwrap();
    let mut cases = vec![
        ("a/run.pvd", "a/../s.vtu", "../s.vtu"),
        ("a/run.pvd", "a/b/../s.vtu", "s.vtu"),
        ("a/run.pvd", "steps/s.vtu", "../steps/s.vtu"),
        ("a/b/../run.pvd", "a/b/s.vtu", "b/s.vtu"),
        ("new/../run.pvd", "new/s.vtu", "new/s.vtu"),
        ("new/one/run.pvd", "new/two/s.vtu", "../two/s.vtu"),
    ];
    if cfg!(unix) {
        cases.extend([("link/../run.pvd", "a/s.vtu", "s.vtu"), ("run.pvd", "link/../s.vtu", "a/s.vtu")]);
    }
    for (film, file, expected) in cases {
        let mut films = PvdCollection::default();
        films.push(0.0, folder.join(file));
        films.write(folder.join(film)).unwrap();
        let xml = std::fs::read_to_string(folder.join(film)).unwrap();
        assert!(xml.contains(&format!("file=\"{expected}\"")), "{film}, {file}: {xml}");
        // There it is.
        grid().write(folder.join(file)).unwrap();
        let found = folder.join(film).parent().unwrap().join(expected).canonicalize().unwrap();
        assert_eq!(found, folder.join(file).canonicalize().unwrap());
    }
    std::fs::remove_dir_all(folder).unwrap();
}

/// Names that XML makes the same are the same.
#[test]
fn fields_are_told_apart_by_the_names_that_are_written() {
    let mut grid = VtkGrid::new(&[Vector2::new(0.0, 0.0)], vec![VtkCell::Vertex(0)]);
    grid.point_data = vec![VtkField::scalars("a\u{1}b", [1.0]), VtkField::scalars("a b", [2.0])];
    assert!(matches!(grid.to_xml(), Err(OutputError::Length { .. })));
}

/// Four particles of a bent sheet, a polygon and mixed cells over them, every kind of field.
fn grid() -> VtkGrid {
    let points =
        [Vector2::new(0.0, 0.0), Vector2::new(1.0, -0.1), Vector2::new(1.1, 1.0), Vector2::new(1.0 / 3.0, 1.0)];
    let cells = vec![
        VtkCell::Quad([0, 1, 2, 3]),
        VtkCell::Triangle([0, 1, 2]),
        VtkCell::Line([0, 3]),
        VtkCell::Vertex(2),
        VtkCell::Polygon(vec![0, 1, 2, 3]),
    ];
    let mut grid = VtkGrid::new(&points, cells);
    let gradient = Matrix3::new(1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0);
    grid.point_data = vec![
        VtkField::scalars("pressure", [0.1, 0.2, 0.3, f64::MAX]),
        VtkField::vectors("displacement", &points),
        VtkField::tensors("deformation <F>", &[gradient; 4]),
    ];
    grid.cell_data = vec![VtkField::integers("zone", [7, -8, 9, 10, 11])];
    grid
}

/// The bytes of an array, decoded by arithmetic of its own.
fn decode(xml: &str, name: &str) -> Vec<u8> {
    let start = xml.find(&format!("Name=\"{name}\"")).expect(name);
    let body = &xml[start..];
    let body = &body[body.find('>').unwrap() + 1..];
    let text = &body[..body.find('<').unwrap()];
    let (mut bits, mut held, mut bytes) = (0u32, 0, Vec::new());
    for digit in text.bytes().take_while(|&b| b != b'=') {
        let value = match digit {
            b'A'..=b'Z' => digit - b'A',
            b'a'..=b'z' => digit - b'a' + 26,
            b'0'..=b'9' => digit - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            other => panic!("{other} is no digit of base64"),
        };
        bits = (bits << 6) | u32::from(value);
        held += 6;
        if held >= 8 {
            held -= 8;
            bytes.push((bits >> held) as u8);
            bits &= (1 << held) - 1;
        }
    }
    assert_eq!(text.len() % 4, 0, "{name} is not padded");
    let payload = bytes.split_off(8);
    let count = u64::from_le_bytes(bytes.try_into().unwrap());
    assert_eq!(count, payload.len() as u64, "{name}");
    payload
}

fn floats(bytes: &[u8]) -> Vec<f64> {
    let words = bytes.chunks_exact(8);
    words.map(|w| f64::from_le_bytes(w.try_into().unwrap())).collect()
}

fn integers(bytes: &[u8]) -> Vec<i64> {
    let words = bytes.chunks_exact(8);
    words.map(|w| i64::from_le_bytes(w.try_into().unwrap())).collect()
}

#[test]
fn a_grid_survives_the_round_trip() {
    let grid = grid();
    let xml = grid.to_xml().unwrap();
    assert!(xml.contains("NumberOfPoints=\"4\" NumberOfCells=\"5\""));
    assert_eq!(floats(&decode(&xml, "Points")), grid.points.as_flattened());
    assert_eq!(integers(&decode(&xml, "offsets")), [4, 7, 9, 10, 14]);
    assert_eq!(integers(&decode(&xml, "connectivity")), [0, 1, 2, 3, 0, 1, 2, 0, 3, 2, 0, 1, 2, 3]);
    assert_eq!(decode(&xml, "types"), [9, 5, 3, 1, 7]);
    assert_eq!(floats(&decode(&xml, "pressure")), [0.1, 0.2, 0.3, f64::MAX]);
    let displacement = floats(&decode(&xml, "displacement"));
    assert_eq!(displacement, grid.points.as_flattened());
    let gradient = floats(&decode(&xml, "deformation &lt;F&gt;"));
    assert_eq!(gradient[..9], [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]);
    assert_eq!(integers(&decode(&xml, "zone")), [7, -8, 9, 10, 11]);
}

#[test]
fn a_grid_that_contradicts_itself_is_refused() {
    let refused = |change: fn(&mut VtkGrid)| {
        let mut grid = grid();
        change(&mut grid);
        let error = grid.to_xml().unwrap_err();
        assert!(matches!(error, OutputError::Length { .. }), "{error}");
        error.to_string()
    };
    let short = refused(|g| g.point_data[0] = VtkField::scalars("pressure", [1.0]));
    assert!(short.contains("pressure"), "{short}");
    refused(|g| g.cell_data[0] = VtkField::integers("zone", [1]));
    refused(|g| g.cells.push(VtkCell::Vertex(4)));
    refused(|g| g.cells[4] = VtkCell::Polygon(vec![0, 1]));
    refused(|g| g.point_data[1].name = "pressure".into());
}

#[test]
fn an_index_names_its_pieces_and_their_fields() {
    let directory = fresh("pieces");
    let grid = grid();
    for part in [1, 0, 2] {
        grid.write_piece(directory.join("deep/run.pvtu"), part, 3).unwrap();
    }
    let read = |name: &str| std::fs::read_to_string(directory.join("deep").join(name)).unwrap();
    let index = read("run.pvtu");
    let (mut cells, mut points) = (0, 0);
    for part in 0..3 {
        let name = format!("run_{part}.vtu");
        assert!(index.contains(&format!("<Piece Source=\"{name}\"/>")), "{index}");
        let piece = read(&name);
        cells += integers(&decode(&piece, "offsets")).len();
        points += floats(&decode(&piece, "Points")).len() / 3;
        // What the index says of a field is what the pieces say.
        for array in index.split("<PDataArray ").skip(1).filter_map(|rest| rest.split_once("/>")) {
            assert!(piece.contains(&format!("<DataArray {}", array.0)), "{part}: {}", array.0);
        }
    }
    assert_eq!(cells, grid.cells.len());
    // Those at borders stand in both pieces.
    assert!(points >= grid.points.len());
    assert_eq!(grid.piece(0, 1).unwrap(), grid);
    std::fs::remove_dir_all(&directory).unwrap();
}

#[test]
fn a_collection_names_its_files_beside_itself() {
    let directory = fresh("pvd");
    let mut path = PvdCollection::default();
    for (step, load) in [0.0, 0.5].into_iter().enumerate() {
        let file = directory.join(format!("steps/{step}.vtu"));
        grid().write(&file).unwrap();
        path.push(load, file);
        path.write(directory.join("path.pvd")).unwrap();
    }
    let xml = std::fs::read_to_string(directory.join("path.pvd")).unwrap();
    assert!(xml.contains("timestep=\"0.5\" part=\"0\" file=\"steps/1.vtu\""), "{xml}");
    path.push(f64::NAN, "late.vtu");
    assert!(matches!(path.write(directory.join("path.pvd")), Err(OutputError::Io { .. })));
    // RKPM_KEEP leaves the files for tests/check_vtu.py.
    match std::env::var_os("RKPM_KEEP") {
        Some(kept) => std::fs::rename(&directory, kept).unwrap(),
        None => std::fs::remove_dir_all(directory).unwrap(),
    }
}

#[cfg(feature = "chart")]
mod chart {
    use rkpm::error::OutputError;
    use rkpm::output::Chart;
    use rkpm::output::chart::{Colour, Marker, Series, Stroke};

    const LINE: [(f64, f64); 3] = [(0.0, 0.1), (1.0, 0.2), (2.0, 0.4)];

    fn refused(chart: Chart) -> String {
        let error = chart.to_svg().unwrap_err();
        assert!(matches!(error, OutputError::Chart { .. }), "{error}");
        error.to_string()
    }

    #[test]
    fn everything_named_is_in_the_picture() {
        let svg = Chart::new("Tube & bore")
            .x("u [cm]")
            .y("p [MPa]")
            .line("exact", &LINE)
            .marked_line("RKPM", &[[0.5, 0.15], [1.5, 0.3]])
            .dashed("Lindley", &LINE)
            .horizontal("limit", 0.35)
            .vertical("contact", 1.2)
            .band("uncertainty", 0.3, 0.32)
            .to_svg()
            .unwrap();
        for text in
            ["Tube &amp; bore", "u [cm]", "p [MPa]", "exact", "RKPM", "Lindley", "limit", "contact", "uncertainty"]
        {
            assert!(svg.contains(text), "{text} is missing");
        }
        assert!(svg.trim_end().ends_with("</svg>"));
    }

    #[test]
    fn powers_of_ten_are_raised() {
        let svg = Chart::new("convergence")
            .x_log("h")
            .y_log("error")
            .line("e", &[(1e-3, 1e-6), (1e-1, 1e-2)])
            .to_svg()
            .unwrap();
        assert!(svg.contains("10⁻³"), "{svg}");
    }

    /// Words of a chart that are numbers.
    fn numbers(svg: &str) -> Vec<String> {
        let words = svg.lines().map(|line| line.trim().split('<').next().unwrap_or_default());
        words.filter(|word| word.parse::<f64>().is_ok()).map(String::from).collect()
    }

    #[test]
    fn ticks_of_narrow_ranges_are_told_apart() {
        for (low, high) in [(1.0, 1.0004), (1e7, 1e7 + 1e-2), (-3e-5, 2e-5), (0.0, 1e6), (1e9, 1e9 + 3e5), (0.3, 0.31)]
        {
            let chart = Chart::new("").line("", &[(low, low), (high, high)]);
            let charts = [chart.clone(), chart.clone().x_log("").y_log("")];
            for svg in charts[..if low > 0.0 { 2 } else { 1 }].iter().map(|chart| chart.to_svg().unwrap()) {
                let found = numbers(&svg);
                let mut apart = found.clone();
                apart.sort();
                apart.dedup();
                // The two axes have the same range; the upper one has ticks that the other lacks.
                let most = found.iter().map(|number| found.iter().filter(|other| *other == number).count()).max();
                assert!(apart.len() > 2 && most <= Some(2), "{low} to {high}: {found:?}");
            }
        }
    }

    #[test]
    fn points_that_cannot_be_shown_break_the_line() {
        let data = [(1.0, 1.0), (2.0, 2.0), (f64::NAN, 1.0), (3.0, -1.0), (4.0, 3.0), (5.0, 5.0), (6.0, f64::INFINITY)];
        let series = Series::line("", &data).marker(Marker::Circle).colour(Colour::Rgb(1, 2, 3));
        let chart = Chart::new("").x_log("x").y_log("y").with(series);
        let svg = chart.to_svg().unwrap();
        let count = |tag: &str| {
            let lines = svg.lines().filter(|line| line.contains("#010203"));
            lines.filter(|line| line.starts_with(tag)).count()
        };
        assert_eq!((count("<polyline"), count("<circle")), (2, 4), "{svg}");
    }

    #[test]
    fn lines_end_at_a_fixed_range() {
        let series = Series::line("", &[(-10.0, -10.0), (10.0, 10.0)]).colour(Colour::Rgb(1, 2, 3));
        let chart = Chart::new("").x_range(0.0, 1.0).y_range(0.0, 1.0);
        let svg = chart.with(series.stroke(Stroke::Solid)).size(400, 300).to_svg().unwrap();
        let line = svg.lines().find(|l| l.contains("#010203")).unwrap();
        let points = line.split("points=\"").nth(1).unwrap();
        for pair in points.split('"').next().unwrap().split_whitespace() {
            let (x, y) = pair.split_once(',').unwrap();
            let at: [f64; 2] = [x.parse().unwrap(), y.parse().unwrap()];
            assert!(at[0] > 0.0 && at[0] < 4000.0 && at[1] > 0.0 && at[1] < 3000.0);
        }
    }

    #[test]
    fn equal_aspect_draws_circles_round() {
        let circle: Vec<[f64; 2]> = (0..=360)
            .map(|k| f64::from(k).to_radians())
            .map(|angle| [3.0 * angle.cos(), 7.0 + 3.0 * angle.sin()])
            .collect();
        let chart = Chart::new("").equal_aspect();
        let svg = chart.with(Series::line("", &circle).colour(Colour::Rgb(1, 2, 3))).to_svg().unwrap();
        let line = svg.lines().find(|l| l.contains("#010203")).unwrap();
        let points = line.split("points=\"").nth(1).unwrap();
        let mut extent = [[f64::MAX, f64::MIN]; 2];
        for pair in points.split('"').next().unwrap().split_whitespace() {
            for (value, extent) in pair.split(',').zip(&mut extent) {
                let value: f64 = value.parse().unwrap();
                *extent = [extent[0].min(value), extent[1].max(value)];
            }
        }
        let [width, height] = extent.map(|[low, high]| high - low);
        // Two roundings to a tenth of a pixel.
        assert!((width - height).abs() <= 2.0, "{width} {height}");
    }

    #[test]
    fn what_cannot_be_drawn_is_an_error() {
        let chart = || Chart::new("empty").line("exact", &LINE);
        refused(Chart::new("empty"));
        refused(Chart::new("empty").line("nothing", &[(f64::NAN, 1.0), (1.0, f64::INFINITY)]));
        let logarithmic = refused(Chart::new("empty").y_log("y").line("n", &[(1.0, -1.0)]));
        assert!(logarithmic.contains("logarithmic"), "{logarithmic}");
        refused(chart().x_range(1.0, 1.0));
        refused(chart().x_range(1.0, f64::NAN));
        refused(chart().x_log("x").x_range(0.0, 1.0));
        refused(chart().x_range(10.0, 11.0));
        refused(chart().y_log("y").horizontal("zero", 0.0));
        refused(chart().band("upside down", 1.0, 0.5));
        refused(chart().x_log("x").equal_aspect());
    }

    #[test]
    fn extreme_data_are_drawn_all_the_same() {
        for points in [
            vec![(0.0, 0.0)],
            vec![(1e300, -1e300), (-1e300, 1e300)],
            vec![(5e-324, 5e-324), (1e-320, 1e-310)],
            vec![(1.0, 1.0 + 1e-15), (1.0 + 1e-15, 1.0)],
            vec![(1e15, 1.0), (1e15 + 1.0, 1.0)],
        ] {
            let linear = Chart::new("t").marked_line("s", &points);
            assert!(linear.to_svg().is_ok());
            if points[0].0 > 0.0 && points[0].1 > 0.0 {
                let log = Chart::new("t").x_log("x").y_log("y").line("s", &points);
                assert!(log.to_svg().is_ok());
            }
        }
    }
}

/// Whether XML may hold each character of a text.
fn is_xml(text: &str) -> bool {
    text.chars().all(|c| c >= ' ' && !matches!(c, '\u{FFFE}' | '\u{FFFF}') || matches!(c, '\t' | '\n' | '\r'))
}

#[cfg(feature = "chart")]
#[test]
fn words_with_characters_that_documents_forbid_are_written_without_them() {
    use rkpm::output::{Chart, Page, Picture};
    let odd = "a\u{1}b\u{0}c\u{FFFE}d <&\"e";
    let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(Vector2::from);
    let picture = || Picture::new(&corners, vec![vec![0, 1, 2]]).coloured(odd, vec![0.0, 0.5, 1.0]).title(odd);
    let chart = Chart::new(odd).x(odd).y(odd).line(odd, &[(0.0, 0.0), (1.0, 1.0)]).horizontal(odd, 0.5);
    let mut fields = grid();
    fields.cell_data[0].name = odd.into();
    let page = Page::new(odd).frame(odd, picture()).to_html().unwrap();
    for text in [picture().to_svg().unwrap(), chart.to_svg().unwrap(), fields.to_xml().unwrap(), page.clone()] {
        assert!(is_xml(&text), "{text}");
        assert!(!text.contains("<&"), "{text}");
    }
    // Words of a script are what they were, and words of the page are no places of its template.
    assert!(page.contains(r#"label:"a\u0001b\u0000c"#), "{page}");
    let page = Page::new("@DATA@").frame("e\u{301}", picture()).to_html().unwrap();
    assert!(page.contains("<title>@DATA@</title>") && page.contains("label:\"e\u{301}\""));
}

#[test]
fn endings_of_other_formats_are_refused() {
    let directory = fresh("endings");
    let refused =
        |result: Result<(), OutputError>| assert!(matches!(result, Err(OutputError::Ending { .. })), "{result:?}");
    refused(grid().write(directory.join("grid.vtk")));
    refused(grid().write_piece(directory.join("grid.vtu"), 0, 2));
    refused(PvdCollection::default().write(directory.join("path.vtu")));
    refused(Table::new(["x"]).write(directory.join("table.xlsx")));
    #[cfg(feature = "chart")]
    {
        use rkpm::output::{Chart, Page, Picture};
        let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(Vector2::from);
        let picture = Picture::new(&corners, vec![vec![0, 1, 2]]);
        for name in ["body.gif", "body.jpg", "body.pdf"] {
            refused(picture.write(directory.join(name)));
        }
        refused(Chart::new("").line("s", &[(0.0, 0.0), (1.0, 1.0)]).write(directory.join("curve.png")));
        refused(Page::new("").frame("", picture.clone()).write(directory.join("page.svg")));
    }
    assert!(!directory.exists());
    grid().write(directory.join("grid.VTU")).unwrap();
    std::fs::remove_dir_all(directory).unwrap();
}
