//! GOAL: pictures show what is in front, in the colours of the bar, and refuse what they can't show.

use rkpm::error::OutputError;
use rkpm::geometry::Point;
use rkpm::mesh::Mesh;
use rkpm::output::Picture;
use rkpm::prelude::*;
use rkpm::scene::Field;

use super::file;

/// Faces drawn: each has an outline.
fn outlines(svg: &str) -> usize {
    svg.matches("fill=\"none\"").count()
}

fn held(name: &str) -> Problem<3> {
    let mesh = Mesh::<3>::parse(&file(name)).unwrap();
    let scene = Scene::new(mesh, Solid, Rubber::neo_hookean(0.5, 10.0).unwrap()).hold("left");
    scene.discretize(&Scheme::default()).unwrap()
}

#[test]
fn a_body_in_space_shows_the_faces_that_look_at_the_eye() {
    let brick = Scene::new(Block::new([0.0; 3], [2.0, 1.0, 1.0]), Solid, Rubber::neo_hookean(0.5, 10.0).unwrap());
    let problem = brick.hold((0, Side::Min)).discretize(&Scheme::default().particles([4, 3, 3])).unwrap();
    let picture = problem.picture(&problem.at_rest(), Field::Displacement).unwrap();
    // Three sides are seen from aside: 3·2 in front, 3·2 above, 2·2 at an end; one from straight above.
    assert_eq!(outlines(&picture.to_svg().unwrap()), 6 + 6 + 4);
    assert_eq!(outlines(&picture.clone().view(0.0, 90.0).to_svg().unwrap()), 6);
    assert_eq!(outlines(&picture.view(0.0, 0.0).to_svg().unwrap()), 4);
    for name in ["prisms.msh", "hexahedra.msh"] {
        let problem = held(name);
        let svg = problem.picture(&problem.at_rest(), Field::LargestStretch).unwrap().view(0.0, 0.0).to_svg().unwrap();
        // Along axis 0 only the right side and half of the hole look at the eye.
        let seen = outlines(&svg);
        assert!((10..60).contains(&seen), "{name}: {seen}");
        assert!(svg.contains("largest stretch"));
        assert!(problem.vtk_grid(&problem.at_rest()).unwrap().to_xml().is_ok());
    }
}

#[test]
fn what_can_not_be_shown_is_refused() {
    let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(Point::<2>::from);
    let sound = || Picture::new(&corners, vec![vec![0, 1, 2]]);
    assert_eq!(outlines(&sound().to_svg().unwrap()), 1);
    // A colour for each band between the ends, whatever the range.
    let svg = sound().coloured("u < v", vec![0.0, 0.5, 1.0]).range(0.0, 2.0).to_svg().unwrap();
    assert!(svg.contains("u &lt; v") && !svg.contains("NaN"));
    assert!(!sound().coloured("", vec![1.0; 3]).to_svg().unwrap().contains("NaN"));
    let refused = |picture: Picture| picture.to_svg().unwrap_err();
    assert!(matches!(refused(Picture::new(&corners, vec![])), OutputError::Chart { .. }));
    assert!(matches!(refused(Picture::new(&corners, vec![vec![0, 1]])), OutputError::Length { .. }));
    assert!(matches!(refused(Picture::new(&corners, vec![vec![0, 1, 3]])), OutputError::Length { .. }));
    assert!(matches!(refused(sound().coloured("u", vec![1.0])), OutputError::Length { .. }));
    assert!(matches!(refused(sound().size(10, 10)), OutputError::Chart { .. }));
    let far = [[f64::NAN, 0.0], [1.0, 0.0], [0.0, 1.0]].map(Point::<2>::from);
    assert!(matches!(refused(Picture::new(&far, vec![vec![0, 1, 2]])), OutputError::Chart { .. }));
}
