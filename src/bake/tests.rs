//! Textures of small surfaces, with what they must show.

use super::*;
use crate::body::Figure;
use crate::formats::{EncodedPicture, RawMaterial, RawMesh, RawTexture, write_color_png};
use crate::geometry::{FaceId, sphere};

/// A square of one metre in the plane of x and y, of `n × n` pairs of triangles.
fn plate(n: u32) -> TriMesh {
    let at = |i: u32| f64::from(i) / f64::from(n);
    let points = (0..=n).flat_map(|y| (0..=n).map(move |x| Point::new(at(x), at(y), 0.0))).collect();
    let corner = |x: u32, y: u32| y * (n + 1) + x;
    let faces: Vec<[u32; 3]> = (0..n)
        .flat_map(|y| (0..n).map(move |x| (x, y)))
        .flat_map(|(x, y)| {
            let [a, b, c, d] = [corner(x, y), corner(x + 1, y), corner(x + 1, y + 1), corner(x, y + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    TriMesh::try_from_indices(points, &faces).unwrap()
}

fn checked(p: &Point, cell: f64) -> bool {
    ((p.x / cell).floor() + (p.y / cell).floor()).rem_euclid(2.0) < 1.0
}

/// The pixel that shows a place of a surface.
fn shown(texture: &Texture, uvs: &UvMap, face: usize, weights: [f64; 3]) -> [u8; 3] {
    let at = uvs.triangle(face);
    let [u, v] = [0, 1].map(|i| (0..3).map(|k| at[k][i] * weights[k]).sum::<f64>());
    let place = |c: f64| ((c * texture.side as f64) as usize).min(texture.side - 1);
    texture.pixels[place(1.0 - v) * texture.side + place(u)]
}

#[test]
fn charts_cover_every_face_once_with_little_stretch() {
    let ball = sphere(24, 48);
    let uvs = charts(&ball, None).unwrap();
    assert!(uvs.fits(&ball) && uvs.coords.iter().flatten().all(|c| (0.0..=1.0).contains(c)));
    let figures = ChartFigures::of(&ball, &uvs);
    assert!((20..60).contains(&figures.charts), "{figures:?}");
    assert!(figures.page_use > 0.4 && figures.stretch < 1.3, "{figures:?}");
    let texels = Texels::of(&uvs, 256);
    let mut area = 0;
    let mut seen = vec![false; ball.face_count()];
    for y in 0..256 {
        for x in (0..256).filter(|&x| texels.face_at(x, y) != NOWHERE) {
            seen[texels.face_at(x, y) as usize] = true;
            area += 1;
        }
    }
    // Charts that overlapped would cover fewer pixels than their areas sum up to.
    assert!((f64::from(area) / 65536.0 - figures.page_use).abs() < 0.02, "{area} {figures:?}");
    assert!(seen.iter().filter(|seen| **seen).count() * 10 > seen.len() * 9);
    let shifted = ball.map_points(|p| p + Vec3::new(900.0, 0.0, -400.0));
    assert!(charts(&shifted, None).unwrap().fits(&shifted), "far from the origin too");
}

#[test]
fn a_step_leads_from_one_texel_to_the_next() {
    let mesh = plate(1);
    let uvs = UvMap::per_vertex(&mesh, mesh.points().iter().map(|p| [p.x, p.y]).collect());
    let texels = Texels::of(&uvs, 10);
    let [right, down] = texels.steps(&uvs, 0, mesh.triangle(crate::geometry::FaceId(0)));
    assert!((right - Vec3::new(0.1, 0.0, 0.0)).norm() < 1e-9 && (down - Vec3::new(0.0, -0.1, 0.0)).norm() < 1e-9);
    let weights = texels.weights(&uvs, texels.face_at(7, 8), 7, 8);
    let at: Vec3 = (0..3).map(|k| mesh.triangle(crate::geometry::FaceId(0))[k].coords * weights[k]).sum();
    assert!((at - Vec3::new(0.75, 0.15, 0.0)).norm() < 1e-9, "{at}");
}

#[test]
fn a_checked_picture_comes_back_with_its_contrast() {
    // Cells of 2 cm on a square of 1 m, in a picture of 1 mm per pixel.
    let pixels: Vec<[u8; 3]> = (0..1_000_000)
        .map(|i| {
            if checked(&Point::new(0.001 * f64::from(i % 1000), 0.001 * f64::from(i / 1000), 0.0), 0.02) {
                [230, 40, 40]
            } else {
                [30, 30, 90]
            }
        })
        .collect();
    let mesh = plate(4);
    let raw = RawMesh {
        points: mesh.points().iter().map(|p| p.coords.into()).collect(),
        faces: mesh.faces().iter().map(|f| f.map(|v| v.0)).collect(),
        texture: Some(RawTexture {
            coords: mesh.points().iter().map(|p| [p.x as f32, 1.0 - p.y as f32]).collect(),
            corners: None,
            face_materials: vec![0; mesh.face_count()],
            materials: vec![RawMaterial { picture: Some(0), ..RawMaterial::default() }],
            pictures: vec![EncodedPicture { name: "c".into(), bytes: write_color_png([1000, 1000], &pixels).unwrap() }],
        }),
        ..RawMesh::default()
    };
    let source = PaintedSurface::of_file(raw, |p| *p).unwrap();
    // Another mesh, 3 mm off, with its own charts.
    let worn = plate(7).map_points(|p| p + Vec3::new(0.0, 0.0, 0.003));
    let uvs = charts(&worn, None).unwrap();
    let texture = baked(&worn, &uvs, None, 512, &|place| source.color_at(place));
    let (mut light, mut dark) = (Vec::new(), Vec::new());
    for face in 0..worn.face_count() {
        let corners = worn.triangle(crate::geometry::FaceId(face as u32));
        for weights in [[0.6, 0.2, 0.2], [0.2, 0.6, 0.2], [0.2, 0.2, 0.6], [0.34, 0.33, 0.33]] {
            let p: Vec3 = (0..3).map(|k| corners[k].coords * weights[k]).sum();
            // Within a cell, 4 mm from its rim.
            let inside = |x: f64| (0.2..0.8).contains(&(x / 0.02).fract());
            if inside(p.x) && inside(p.y) {
                let red = f64::from(shown(&texture, &uvs, face, weights)[0]);
                if checked(&Point::from(p), 0.02) { light.push(red) } else { dark.push(red) }
            }
        }
    }
    let mean = |of: &[f64]| of.iter().sum::<f64>() / of.len() as f64;
    assert!(light.len() > 20 && dark.len() > 20);
    assert!(
        (mean(&light) - 230.0).abs() < 6.0 && (mean(&dark) - 30.0).abs() < 12.0,
        "{} {}",
        mean(&light),
        mean(&dark)
    );
}

#[test]
fn what_was_not_seen_continues_the_cloth_around_it() {
    let mesh = plate(10);
    let uvs = charts(&mesh, None).unwrap();
    // Red on the left, blue on the right; the scan ends at 0.8 m, and the middle is said to be unseen.
    let is_seen: PerVertex<bool> = mesh.points().iter().map(|p| (p.x - 0.5).abs() > 0.25).collect();
    let color_at = |place: &Place| {
        let color = if place.point.x < 0.5 { [1.0, 0.0, 0.0] } else { [0.0, 0.0, 1.0] };
        (place.point.x < 0.85).then_some(color)
    };
    let texture = baked(&mesh, &uvs, Some(&is_seen), 128, &color_at);
    let at = |x: f64| {
        let face = mesh.face_ids().find(|f| {
            let middle: Vec3 = mesh.triangle(*f).iter().map(|p| p.coords / 3.0).sum();
            (middle.x - x).abs() < 0.04 && (middle.y - 0.5).abs() < 0.1
        });
        shown(&texture, &uvs, face.unwrap().index(), [1.0 / 3.0; 3])
    };
    assert_eq!((at(0.05), at(0.95)), ([255, 0, 0], [0, 0, 255]));
    let [r, _, b] = at(0.46);
    assert!(r > 60 && b > 60, "between red and blue: {r} {b}");
    let unseen = baked(&mesh, &uvs, None, 64, &|_| None);
    assert!(unseen.pixels.iter().all(|p| *p == [188; 3]), "grey where nothing is known");
}

#[test]
fn no_pixel_between_charts_is_left_as_background() {
    let ball = sphere(12, 24);
    let uvs = charts(&ball, None).unwrap();
    let texture = baked(&ball, &uvs, None, 256, &|_| Some([1.0, 1.0, 1.0]));
    assert!(texture.pixels.iter().all(|p| *p == [255; 3]));
}

#[test]
fn one_thread_and_many_bake_the_same_bytes() {
    let ball = sphere(12, 24);
    let colors: PerVertex<[u8; 3]> =
        ball.points().iter().map(|p| [(120.0 + 90.0 * p.x) as u8, (120.0 + 90.0 * p.y) as u8, 40]).collect();
    let bake = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let uvs = charts(&ball, None).unwrap();
            let source = PaintedSurface::of_vertices(&ball, &colors);
            let texture = baked(&ball, &uvs, None, 128, &|place| source.color_at(place));
            (uvs, texture)
        })
    };
    assert!(bake(1) == bake(3));
}

#[test]
fn a_normal_map_shows_the_waves_of_a_finer_ball() {
    let (coarse, fine) = (sphere(10, 20), sphere(80, 160));
    let uvs = charts(&coarse, None).unwrap();
    let waves = |p: &Point| Point::from(p.coords * (0.99 + 0.004 * (20.0 * p.y).sin()));
    let detail = DetailedSurface::of(&fine.map_points(waves));
    let side = 512;
    let map = normal_map(&coarse, &uvs, None, side, &|place, is_seen| {
        assert!(is_seen);
        detail.normal_at(place)
    });
    let (tangents, normals) = (tangents(&coarse, &uvs), coarse.vertex_normals());
    let (mut before, mut after, mut count) = (0.0, 0.0, 0.0);
    let texels = Texels::of(&uvs, side);
    for (x, y) in (0..side * side).map(|i| (i % side, i / side)) {
        let face = texels.face_at(x, y);
        if face == NOWHERE {
            continue;
        }
        let weights = texels.weights(&uvs, face, x, y);
        let corners = coarse.faces().0[face as usize];
        let of = |k: usize| tangents.0[face as usize][k];
        let normal: Vec3 = (0..3).map(|k| normals[corners[k]] * weights[k]).sum();
        let tangent: Vec3 =
            (0..3).map(|k| Vec3::new(of(k)[0].into(), of(k)[1].into(), of(k)[2].into()) * weights[k]).sum();
        let bitangent = normal.cross(&tangent) * f64::from(of(0)[3]);
        let [r, g, b] = map.pixels[y * side + x].map(|byte| f64::from(byte) / 127.5 - 1.0);
        // As a renderer does it.
        let shown = (tangent * r + bitangent * g + normal * b).normalize();
        let point: Vec3 = (0..3).map(|k| coarse.points()[corners[k]].coords * weights[k]).sum();
        let place = Place { point: Point::from(point), normal: normal.normalize(), steps: [Vec3::zeros(); 2] };
        let Some(truth) = detail.normal_at(&place) else { continue };
        before += normal.normalize().angle(&truth).to_degrees();
        after += shown.angle(&truth).to_degrees();
        count += 1.0;
    }
    // What is left is the rounding to bytes.
    assert!(before / count > 1.5 && after / count < 0.4, "{} {}", before / count, after / count);
    // The bitangent leads up in the picture: to the next row above.
    let steps = texels.steps(&uvs, 0, coarse.triangle(crate::geometry::FaceId(0)));
    let [x, y, z, sign] = tangents.0[0][0].map(f64::from);
    let (tangent, normal) = (Vec3::new(x, y, z), normals[coarse.faces().0[0][0]]);
    assert!(tangent.dot(&steps[0]) > 0.0 && (normal.cross(&tangent) * sign).dot(&steps[1]) < 0.0);
}

#[test]
fn seams_cut_a_suit_into_the_pieces_of_a_pattern() {
    let figure = Figure::mean(&crate::body::embedded_model().unwrap());
    let suit = figure.body();
    let (seams, adjacency) = (seams(suit, &figure.skeleton), Adjacency::prepare(&suit.mesh));
    let mut piece_of = vec![usize::MAX; seams.len()];
    let mut areas = Vec::new();
    for seed in suit.mesh.face_ids() {
        if piece_of[seed.index()] != usize::MAX {
            continue;
        }
        let (piece, mut area, mut open) = (areas.len(), 0.0, vec![seed]);
        piece_of[seed.index()] = piece;
        while let Some(face) = open.pop() {
            area += suit.mesh.face_area(face);
            for (across, is_seam) in adjacency.face_neighbours(face).into_iter().zip(seams[face.index()]) {
                let Some(next) = across.filter(|next| !is_seam && piece_of[next.index()] == usize::MAX) else {
                    continue;
                };
                piece_of[next.index()] = piece;
                open.push(next);
            }
        }
        areas.push(area);
    }
    areas.sort_by(|a, b| b.total_cmp(a));
    // Front and back of each half, and two sleeves.
    assert!(areas[..6].iter().sum::<f64>() > 0.95 * suit.mesh.area(), "{:?}", &areas[..8]);
    assert!(areas[0] < 0.3 * suit.mesh.area() && areas[5] > 0.04 * suit.mesh.area(), "{:?}", &areas[..8]);
    let uvs = charts(&suit.mesh, Some(&seams)).unwrap();
    let joined = |face: FaceId, k: usize, across: FaceId| {
        let of = |face: FaceId| uvs.corners[face];
        let shared = |place: u32| of(across).contains(&place);
        shared(of(face)[k]) && shared(of(face)[(k + 1) % 3])
    };
    let mut sides = 0;
    for face in suit.mesh.face_ids() {
        for (k, across) in adjacency.face_neighbours(face).into_iter().enumerate() {
            let Some(across) = across.filter(|_| seams[face.index()][k]) else { continue };
            sides += 1;
            // A chart may lie on both sides of a slit that divides no piece.
            let same = piece_of[face.index()] == piece_of[across.index()];
            assert!(same || !joined(face, k, across), "a chart crosses a seam at face {}", face.index());
        }
    }
    assert!(sides > 500, "{sides}");
}
