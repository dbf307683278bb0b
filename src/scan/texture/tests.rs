//! Laws of colouring from pictures.

use super::{TextureReport, color_from_texture};
use crate::formats::{EncodedPicture, RawMaterial, RawMesh, RawTexture, Wrap, write_color_png};
use crate::geometry::{Adjacency, TriMesh};

/// A sheet of n × n vertices, one unit wide, upright in the xy plane.
fn sheet(n: u32) -> RawMesh {
    let share = |i: u32| f64::from(i) / f64::from(n - 1);
    let points = (0..n * n).map(|k| [share(k % n), share(k / n), 0.0]).collect();
    let mut faces = Vec::new();
    for i in 0..n - 1 {
        for j in 0..n - 1 {
            let [a, b, c, d] = [i * n + j, i * n + j + 1, (i + 1) * n + j + 1, (i + 1) * n + j];
            faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    RawMesh { points, faces, ..RawMesh::default() }
}

fn picture(name: &str, size: [usize; 2], pixel: impl Fn(usize, usize) -> [u8; 3]) -> EncodedPicture {
    let pixels: Vec<[u8; 3]> = (0..size[0] * size[1]).map(|k| pixel(k % size[0], k / size[0])).collect();
    EncodedPicture { name: name.into(), bytes: write_color_png(size, &pixels).unwrap() }
}

/// The mesh with a picture over all of it: x and y are the texture coordinates.
fn textured(mesh: RawMesh, picture: EncodedPicture) -> RawMesh {
    let texture = RawTexture {
        coords: mesh.points.iter().map(|p| [p[0] as f32, p[1] as f32]).collect(),
        corners: None,
        face_materials: vec![0; mesh.faces.len()],
        materials: vec![RawMaterial { name: "skin".into(), picture: Some(0), ..RawMaterial::default() }],
        pictures: vec![picture],
    };
    RawMesh { texture: Some(texture), ..mesh }
}

fn colored(mut mesh: RawMesh) -> (RawMesh, TextureReport) {
    let report = color_from_texture(&mut mesh, &mut |_| {}).unwrap();
    assert_eq!(mesh.texture, None);
    (mesh, report)
}

/// 8 × 8 squares of 32 pixels, each in a colour of its own.
fn checker() -> EncodedPicture {
    picture("checker.png", [256, 256], |x, y| square_color(x / 32, 7 - y / 32))
}

/// By column and by row from below.
fn square_color(column: usize, row: usize) -> [u8; 3] {
    [30 * column as u8, 30 * row as u8, if (column + row).is_multiple_of(2) { 250 } else { 5 }]
}

#[test]
fn inside_each_square_of_a_checker_vertices_have_its_colour() {
    let (mesh, report) = colored(textured(sheet(97), checker()));
    let colors = mesh.colors.unwrap();
    let mut checked = 0;
    for (p, color) in mesh.points.iter().zip(colors) {
        // A third of the diagonal of a cell, and a pixel.
        let to_line = |c: f64| ((8.0 * c) - (8.0 * c).round()).abs() / 8.0;
        if to_line(p[0]).min(to_line(p[1])) > 2f64.sqrt() / 96.0 / 3.0 + 1.0 / 256.0 {
            let at = |c: f64| (8.0 * c) as usize;
            assert_eq!(color, square_color(at(p[0]), at(p[1])), "{p:?}");
            checked += 1;
        }
    }
    assert!(checked > 4000, "{checked}");
    assert_eq!(report.findings, ["texture 256 × 256, 1 material"]);
    assert_eq!((report.pictures, report.doubts.len()), (vec![[256, 256]], 0));
}

#[test]
fn the_colours_of_a_picture_are_those_of_its_places() {
    // A picture without edges: every vertex has the colour of its own place, within a level of rounding on either side.
    let smooth = |x: f64, y: f64| [40.0 + 150.0 * x, 220.0 - 120.0 * y, 60.0 + 90.0 * x * y].map(|c| c.round() as u8);
    let at = |x: usize, y: usize| smooth((x as f64 + 0.5) / 256.0, 1.0 - (y as f64 + 0.5) / 256.0);
    for n in [20, 60, 300] {
        let mut mesh = textured(sheet(n), picture("smooth.png", [256, 256], at));
        mesh.texture.as_mut().unwrap().materials[0].wrap = [Wrap::Clamp; 2];
        let (mesh, _) = colored(mesh);
        let colors = mesh.colors.unwrap();
        let border = 1e-9 + 1.0 / f64::from(n - 1);
        for (p, color) in mesh.points.iter().zip(colors) {
            let expected = smooth(p[0], p[1]);
            let far = p[..2].iter().all(|&c| c > border && c < 1.0 - border);
            let most = if far { 1 } else { 2 + (150.0 * border / 3.0) as u8 };
            assert!((0..3).all(|k| color[k].abs_diff(expected[k]) <= most), "{n} {p:?} {color:?} {expected:?}");
        }
    }
}

#[test]
fn coordinates_outside_the_picture_repeat_or_end() {
    let mut inside = textured(sheet(33), checker());
    let mut outside = inside.clone();
    let middle = 33 * 15 + 15;
    for uv in &mut outside.texture.as_mut().unwrap().coords {
        *uv = [uv[0] + 3.0, uv[1] - 2.0];
    }
    assert_eq!(colored(inside.clone()).0.colors, colored(outside.clone()).0.colors);
    let clamp = |mesh: &mut RawMesh| mesh.texture.as_mut().unwrap().materials[0].wrap = [Wrap::Clamp; 2];
    clamp(&mut outside);
    let colors = colored(outside).0.colors.unwrap();
    assert!(colors.iter().all(|&c| c == square_color(7, 0)), "the lower right corner");
    clamp(&mut inside);
    assert_eq!(colored(inside).0.colors.unwrap()[middle], square_color(3, 3));
}

/// The sheet cut along its middle, the vertices there doubled; the right half shows the picture mirrored in x.
fn with_seam(n: u32) -> RawMesh {
    let mut mesh = textured(sheet(n), checker());
    let (points, faces) = (&mut mesh.points, &mut mesh.faces);
    let coords = &mut mesh.texture.as_mut().unwrap().coords;
    let count = points.len();
    let mut double: Vec<u32> = (0..count as u32).collect();
    for v in 0..count {
        let mirrored = [1.0 - coords[v][0], coords[v][1]];
        if points[v][0] == 0.5 {
            double[v] = points.len() as u32;
            points.push(points[v]);
            coords.push(mirrored);
        } else if points[v][0] > 0.5 {
            coords[v] = mirrored;
        }
    }
    for face in faces.iter_mut() {
        if face.iter().all(|&v| points[v as usize][0] >= 0.5) {
            *face = face.map(|v| double[v as usize]);
        }
    }
    mesh
}

fn surface(mesh: &RawMesh) -> (f64, usize) {
    let mesh = TriMesh::try_from_indices(mesh.points.iter().map(|&p| p.into()).collect(), &mesh.faces).unwrap();
    (mesh.area(), Adjacency::prepare(&mesh).boundary_edges().len())
}

#[test]
fn joining_a_seam_keeps_the_surface_and_closes_the_cut() {
    let cut = with_seam(33);
    let whole = sheet(33);
    assert_eq!(surface(&cut).1, surface(&whole).1 + 2 * 32, "cut open");
    let (joined, report) = colored(cut.clone());
    assert_eq!(surface(&joined), surface(&whole));
    assert_eq!((joined.points.len(), joined.faces.len()), (cut.points.len(), cut.faces.len()));
    assert_eq!(report.findings[1], "joined 33 points at the same place, as along seams of the texture");
    let colors = joined.colors.unwrap();
    for (v, p) in cut.points.iter().enumerate() {
        let same = cut.points.iter().position(|q| q == p).unwrap();
        assert_eq!(colors[v], colors[same]);
    }
    // Far from the seam, each half has its own colours.
    assert_eq!(colors[33 * 6 + 6], square_color(1, 1));
    assert_eq!(colors[33 * 6 + 26], square_color(1, 1));
}

#[test]
fn corners_and_vertices_as_places_give_the_same_colours() {
    let by_vertex = with_seam(33);
    let mut by_corner = by_vertex.clone();
    by_corner.texture.as_mut().unwrap().corners = Some(by_vertex.faces.clone());
    assert_eq!(colored(by_vertex), colored(by_corner));
}

#[test]
fn one_thread_gives_the_same_colours_as_many() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| colored(with_seam(301)))
    };
    assert_eq!(run(1), run(5));
}

#[test]
fn each_material_has_its_own_picture_factor_or_colour() {
    let mut mesh = textured(sheet(41), checker());
    let texture = mesh.texture.as_mut().unwrap();
    texture.pictures.push(picture("grey.png", [2, 2], |_, _| [255; 3]));
    let half = crate::formats::linear_of_byte(188);
    texture.materials.push(RawMaterial { picture: Some(1), color: [half, 1.0, 0.0], ..RawMaterial::default() });
    texture.materials.push(RawMaterial { color: [0.0, half, 0.0], ..RawMaterial::default() });
    for (f, face) in mesh.faces.iter().enumerate() {
        texture.face_materials[f] =
            if face.iter().all(|&v| v < 41 * 10) { 1 } else { u16::from(face[0] > 41 * 30) * 2 };
    }
    texture.face_materials[0] = RawTexture::NO_MATERIAL;
    let (mesh, report) = colored(mesh);
    let colors = mesh.colors.unwrap();
    assert_eq!(colors[41 * 3 + 20], [188, 255, 0]);
    assert_eq!(colors[41 * 22 + 22], square_color(4, 4));
    assert_eq!(colors[41 * 38 + 20], [0, 188, 0]);
    assert_eq!(colors[0], colors[41], "only the other face of the corner has a colour");
    assert_eq!(report.findings, ["2 textures, 1 of 256 × 256, 1 of 2 × 2, 3 materials"]);
}

#[test]
fn what_cannot_be_used_is_a_doubt() {
    let doubt = |mesh: RawMesh| {
        let (mesh, report) = colored(mesh);
        (mesh.colors, report.doubts.iter().map(|d| d.what.clone()).collect::<Vec<_>>().join("; "))
    };
    let encoded = |bytes: &[u8]| EncodedPicture { name: "skin.tif".into(), bytes: bytes.to_vec() };
    let own = Some(vec![[9; 3]; 25]);
    let (colors, said) = doubt(RawMesh { colors: own.clone(), ..textured(sheet(5), encoded(b"II*\0")) });
    assert_eq!((colors, said.as_str()), (own, "the picture 'skin.tif' is neither PNG, JPEG nor WebP"));
    let cut = checker().bytes[..60].to_vec();
    let (colors, said) = doubt(textured(sheet(5), encoded(&cut)));
    assert!(colors.is_none() && said.starts_with("the picture 'skin.tif' cannot be read: the PNG"), "{said}");

    let (_, said) = doubt(textured(sheet(97), picture("preview.png", [64, 64], |_, _| [8; 3])));
    assert_eq!(said, "a pixel of the texture covers 27 mm of an adult");

    let mut partly = textured(sheet(97), checker());
    let texture = partly.texture.as_mut().unwrap();
    texture.coords.iter_mut().take(97 * 24).for_each(|uv| *uv = [f32::NAN; 2]);
    let (colors, said) = doubt(partly);
    assert_eq!(said, "25 % of the surface has no valid texture coordinates");
    assert_eq!(colors.unwrap()[0], [255; 3]);

    let mut nowhere = textured(sheet(9), checker());
    nowhere.texture.as_mut().unwrap().coords.fill([0.5; 2]);
    assert_eq!(doubt(nowhere).1, "all texture coordinates are in one place of the picture");
}
