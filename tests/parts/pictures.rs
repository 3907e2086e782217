//! GOAL: pictures show what is in front, in the colours of the bar and where it is, and refuse what they can't show.

use rkpm::error::OutputError;
use rkpm::geometry::Point;
use rkpm::mesh::Mesh;
use rkpm::output::{Page, Picture};
use rkpm::prelude::*;
use rkpm::scene::Field;

use super::file;
use approx::{abs_diff_eq, assert_abs_diff_eq};

/// The pixels of a picture, row by row.
struct Image {
    width: usize,
    height: usize,
    bytes: Vec<u8>,
}

impl Image {
    fn of(picture: &Picture) -> Image {
        let file = picture.to_png().unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(file)).read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut bytes).unwrap();
        Image { width: info.width as usize, height: info.height as usize, bytes }
    }

    /// The colour at parts of width and height.
    fn at(&self, across: f64, down: f64) -> [u8; 3] {
        let pixel = (down * self.height as f64) as usize * self.width + (across * self.width as f64) as usize;
        [0, 1, 2].map(|i| self.bytes[3 * pixel + i])
    }

    /// The part of the pixels that are not of the ground.
    fn covered(&self) -> f64 {
        let drawn = self.bytes.chunks(3).filter(|pixel| pixel.iter().any(|c| *c < 250)).count();
        drawn as f64 / (self.width * self.height) as f64
    }
}

/// A square in the plane of axes 0 and 1, or above it.
fn square(height: f64, from: f64, to: f64) -> [Point<3>; 4] {
    [[from, from, height], [to, from, height], [to, to, height], [from, to, height]].map(Point::<3>::from)
}

#[test]
fn what_is_in_front_hides_what_is_behind() {
    // A small square above a large one, in either order of the faces: red would be a value between.
    let points = [square(0.0, 0.0, 4.0), square(1.0, 1.0, 3.0)].concat();
    let values = [[0.0; 4], [1.0; 4]].concat();
    let faces = vec![vec![0, 1, 2, 3], vec![4, 5, 6, 7]];
    for faces in [faces.clone(), faces.into_iter().rev().collect()] {
        let picture =
            Picture::new(&points, faces).coloured("u", values.clone()).lines(vec![]).view(-90.0, 90.0).size(200, 200);
        let image = Image::of(&picture);
        let (low, high) = (image.at(0.1, 0.5), image.at(0.45, 0.55));
        assert!(low[2] > low[1], "dark blue for the least value: {low:?}");
        assert!(high[0] > 2 * high[2] && high[1] > 2 * high[2], "yellow for the largest value: {high:?}");
        // From below the large one hides the small one.
        let below = Image::of(&picture.view(-90.0, -90.0)).at(0.45, 0.55);
        assert!(below[2] > below[1], "{below:?}");
    }
}

/// The file is what its name says.
#[test]
fn written_as_png_or_svg() {
    let picture = Picture::new(&square(0.0, 0.0, 1.0), vec![vec![0, 1, 2, 3]]).coloured("u", vec![0.0, 1.0, 1.0, 0.0]);
    let directory = std::env::temp_dir().join(format!("rkpm-pictures-{}", std::process::id()));
    for (name, begins) in [("a.png", &b"\x89PNG"[..]), ("a.PNG", b"\x89PNG"), ("a.svg", b"<svg"), ("a", b"<svg")] {
        picture.write(directory.join(name)).unwrap();
        assert!(std::fs::read(directory.join(name)).unwrap().starts_with(begins), "{name}");
    }
    std::fs::remove_dir_all(directory).unwrap();
}

#[test]
fn a_body_covers_its_projection() {
    let brick = Scene::new(Block::new([0.0; 3], [2.0, 1.0, 1.0]), Solid, Rubber::neo_hookean(0.5, 10.0).unwrap());
    let problem = brick.hold((0, Side::Min)).discretize(&Scheme::default().particles([4, 3, 3])).unwrap();
    let picture = problem.picture(&problem.at_rest(), Field::Displacement).unwrap();
    // The brick fills a width of 400 with 2 units: along axis 2 a height of 200, along axis 1 the same.
    for view in [(-90.0, 90.0), (-90.0, 0.0)] {
        let covered = Image::of(&picture.clone().view(view.0, view.1).size(400, 400)).covered();
        // Half of the image, and half a pixel of an edge around.
        assert!(abs_diff_eq!(covered, 0.5, epsilon = 0.01), "{view:?}: {covered}");
    }
    // Seen along the diagonal of the brick's plane: its width is 2 sin + 1 cos, its height 1.
    let covered = Image::of(&picture.view(-45.0, 0.0).size(400, 400)).covered();
    assert_abs_diff_eq!(covered, 2f64.sqrt() / 3.0, epsilon = 0.01);
}

#[test]
fn faces_of_tetrahedra_that_look_at_the_eye_are_seen() {
    // A plug whose upper face moved: from above one sees that face, from below the one that is held.
    let plug = Mesh::<3>::parse(&file("plug_41_binary.msh")).unwrap().body("rubber").unwrap();
    let scene = Scene::new(plug, Solid, Rubber::neo_hookean(0.5, 10.0).unwrap())
        .hold("base")
        .with(Condition::on("steel plate").displacement([0.02, 0.0, -0.02]));
    let problem = scene.discretize(&Scheme::default()).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    let picture = problem.picture(path.last(), Field::Displacement).unwrap().size(300, 300);
    let [above, below] = [90.0, -90.0].map(|elevation| Image::of(&picture.clone().view(0.0, elevation)));
    for at in [[0.42, 0.44], [0.54, 0.53], [0.47, 0.57]] {
        let (above, below) = (above.at(at[0], at[1]), below.at(at[0], at[1]));
        assert!(above[0] > 2 * above[2], "yellow for the face that moved: {above:?}");
        assert!(below[2] > below[1], "dark blue for the face that is held: {below:?}");
    }
}

#[test]
fn faces_follow_the_shape_functions_between_particles() {
    // A strip of four cells bent by its right end: divided faces give a smooth outline, not one of four chords.
    let strip = Scene::new(Block::new([0.0, 0.0], [4.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 10.0).unwrap())
        .hold((0, Side::Min))
        .prescribe((0, Side::Max), 1, 1.0);
    let problem = strip.discretize(&Scheme::default().particles([5, 3])).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    let page = problem.page(&path, Field::LargestStretch, "a <strip>").unwrap().to_html().unwrap();
    assert!(page.contains("a &lt;strip&gt;") && page.contains("load factor 1.000") && page.contains("largest stretch"));
    assert!(!page.contains("@DATA@") && !page.contains("NaN,"));
    let svg = problem.picture(path.last(), Field::LargestStretch).unwrap().to_svg().unwrap();
    assert!(svg.contains("largest stretch") && !svg.contains("NaN"));
    assert!(problem.picture(&State::default(), Field::Displacement).is_err());
}

#[test]
fn meshes_and_two_states_side_by_side_are_shown() {
    for name in ["prisms.msh", "hexahedra.msh"] {
        let mesh = Mesh::<3>::parse(&file(name)).unwrap();
        let scene = Scene::new(mesh, Solid, Rubber::neo_hookean(0.5, 10.0).unwrap()).hold("left");
        let problem = scene.discretize(&Scheme::default()).unwrap();
        let picture = problem.picture(&problem.at_rest(), Field::LargestStretch).unwrap().view(0.0, 0.0);
        assert!(Image::of(&picture).covered() > 0.1, "{name}");
        let svg = picture.clone().title("at rest").beside(picture.title("the same")).to_svg().unwrap();
        assert_eq!(svg.matches("<image").count(), 2);
        assert_eq!(svg.matches("largest stretch").count(), 1);
        assert!(problem.vtk_grid(&problem.at_rest()).unwrap().to_xml().is_ok());
    }
}

/// Pictures side by side have one bar: what one of them says of it is not lost.
#[test]
fn pictures_side_by_side_share_range_and_label() {
    let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(Point::<2>::from);
    let plain = || Picture::new(&corners, vec![vec![0, 1, 2]]);
    let stretched = || plain().coloured("stretch", vec![1.2, 1.2003, 1.2004]);
    let svg = plain().beside(stretched()).to_svg().unwrap();
    for text in [">stretch<", ">1.200000<", ">1.200100<", ">1.200400<"] {
        assert!(svg.contains(text), "{text}");
    }
    // Gaps are infinite where nothing is opposite: the finite ones keep their colours, in pictures as on pages.
    let gaps = |gaps: [f64; 3]| plain().coloured("gap [mm]", gaps.to_vec());
    for (picture, ends) in [
        (gaps([0.0, 1.5, f64::INFINITY]), [">0.00<", ">1.50<"]),
        (gaps([f64::NEG_INFINITY, 0.5, 2.0]), [">0.50<", ">2.00<"]),
        (gaps([f64::INFINITY; 3]), [">0.00e0<"; 2]),
    ] {
        let svg = picture.to_svg().unwrap();
        assert!(ends.iter().all(|end| svg.contains(end)), "{ends:?}");
        assert!(Page::new("gaps").frame("one", picture).to_html().is_ok());
    }
    let svg = stretched().range(0.5, 1.0).beside(stretched().range(1.0, 2.0)).beside(plain()).to_svg().unwrap();
    assert!(svg.contains(">0.50<") && svg.contains(">2.00<"));
    let page =
        Page::new("two").frame("plain", plain()).frame("stretched", stretched().range(0.5, 2.0)).to_html().unwrap();
    assert!(page.contains("label:\"stretch\",range:[0.5,2.0]"));
}

#[test]
fn what_can_not_be_shown_is_refused() {
    let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(Point::<2>::from);
    let sound = || Picture::new(&corners, vec![vec![0, 1, 2]]);
    assert_abs_diff_eq!(Image::of(&sound().size(100, 100)).covered(), 0.5, epsilon = 0.03);
    let svg = sound().coloured("u < v", vec![0.0, 0.5, 1.0]).range(0.0, 2.0).to_svg().unwrap();
    assert!(svg.contains("u &lt; v") && !svg.contains("NaN"));
    assert!(!sound().coloured("", vec![1.0; 3]).to_svg().unwrap().contains("NaN"));
    let refused = |picture: Picture| picture.to_svg().unwrap_err();
    assert!(matches!(refused(Picture::new(&corners, vec![])), OutputError::Chart { .. }));
    assert!(matches!(refused(Picture::new(&corners, vec![vec![0, 1]])), OutputError::Length { .. }));
    assert!(matches!(refused(Picture::new(&corners, vec![vec![0, 1, 3]])), OutputError::Length { .. }));
    assert!(matches!(refused(sound().lines(vec![vec![0, 3]])), OutputError::Length { .. }));
    assert!(matches!(refused(sound().coloured("u", vec![1.0])), OutputError::Length { .. }));
    assert!(matches!(refused(sound().size(10, 10)), OutputError::Chart { .. }));
    assert!(matches!(refused(sound().size(100_000, 10)), OutputError::Chart { .. }));
    for (lower, upper) in [(1.0, 0.0), (f64::NAN, 1.0), (0.0, f64::NAN), (0.0, f64::INFINITY), (-1e308, 1e308)] {
        let picture = || sound().coloured("u", vec![0.0, 0.5, 1.0]).range(lower, upper);
        assert!(matches!(refused(picture()), OutputError::Chart { .. }), "{lower} {upper}");
        assert!(matches!(picture().to_png().unwrap_err(), OutputError::Chart { .. }), "{lower} {upper}");
        assert!(matches!(refused(sound().beside(picture())), OutputError::Chart { .. }), "{lower} {upper}");
        assert!(matches!(Page::new("one").frame("a", picture()).to_html().unwrap_err(), OutputError::Chart { .. }));
    }
    assert!(sound().coloured("u", vec![1.0; 3]).range(1.0, 1.0).to_svg().is_ok());
    let far = [[f64::NAN, 0.0], [1.0, 0.0], [0.0, 1.0]].map(Point::<2>::from);
    assert!(matches!(refused(Picture::new(&far, vec![vec![0, 1, 2]])), OutputError::Chart { .. }));
    assert!(matches!(Page::new("empty").to_html().unwrap_err(), OutputError::Chart { .. }));
    let other = Picture::new(&corners, vec![vec![0, 2, 1]]);
    let page = Page::new("two").frame("a", sound()).frame("b", other);
    assert!(matches!(page.to_html().unwrap_err(), OutputError::Chart { .. }));
}
