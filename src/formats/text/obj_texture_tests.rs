//! Textured OBJ: materials, pictures, and what is missing.

use super::obj::read_obj_with;
use super::obj_materials::obj_siblings;
use crate::formats::raw_mesh::RawMesh;
use crate::formats::srgb::linear_of_byte;
use crate::formats::texture::{RawTexture, Wrap};
use std::collections::BTreeMap;

/// A square of two triangles and a third beside it, each with a material of its own.
const OBJ: &str = "mtllib my scan.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0.25 0.75\n\
    f 1/1 2/2 3/3\nusemtl Skin #1\nf 1/1 3/3 4/4\nusemtl cloth\nf -4/-3 -1/-4 -3/-2\nusemtl Skin #1\nf 1 2 5\n";
const MTL: &str = "newmtl Skin #1\nKd 0 0 0\nmap_Kd -s 2 2 -o 0.5 -clamp on tex/my skin.png\nnewmtl cloth\nKd 1 0 0\n";

type Files<'a> = BTreeMap<&'a str, &'a [u8]>;

fn files<'a>(list: &[(&'a str, &'a [u8])]) -> Files<'a> {
    list.iter().copied().collect()
}

fn read(obj: &str, files: &Files) -> RawMesh {
    read_obj_with(obj.as_bytes(), &mut |name| files.get(name).map(|bytes| bytes.to_vec())).unwrap()
}

fn said(mesh: &RawMesh) -> Vec<&str> {
    mesh.unread.iter().map(|part| part.what.as_str()).collect()
}

#[test]
fn each_face_has_its_material_and_each_corner_its_coordinate() {
    let files = files(&[("my scan.mtl", MTL.as_bytes()), ("tex/my skin.png", b"picture")]);
    let mesh = read(OBJ, &files);
    let texture = mesh.texture.as_ref().unwrap();
    assert_eq!(texture.face_materials, [RawTexture::NO_MATERIAL, 0, 1, 0]);
    let names: Vec<&str> = texture.materials.iter().map(|m| m.name.as_str()).collect();
    assert_eq!(names, ["Skin #1", "cloth"]);
    let skin = &texture.materials[0];
    assert_eq!((skin.picture, skin.wrap, skin.color), (Some(0), [Wrap::Clamp; 2], [1.0; 3]));
    assert_eq!(texture.pictures[0].bytes, b"picture");
    // Twice the coordinate, and half to the right.
    assert_eq!(texture.coords_of(1, mesh.faces[1]), Some([[0.5, 0.0], [2.5, 2.0], [1.0, 1.5]]));
    assert_eq!(
        texture.coords_of(2, mesh.faces[2]),
        Some([[1.0, 0.0], [0.0, 0.0], [1.0, 1.0]]),
        "counted from the last"
    );
    assert_eq!(texture.coords_of(3, mesh.faces[3]), None, "a face without coordinates");
    let cloth = &texture.materials[1];
    assert_eq!((cloth.picture, cloth.color), (None, [linear_of_byte(255), 0.0, 0.0]));
    assert_eq!(said(&mesh), [""; 0]);
}

#[test]
fn the_files_of_a_scan_are_those_that_its_reader_asks_for() {
    let all = files(&[("my scan.mtl", MTL.as_bytes()), ("tex/my skin.png", b"p"), ("other.png", b"q")]);
    let mut asked = Vec::new();
    read_obj_with(OBJ.as_bytes(), &mut |name| {
        let found = all.get(name).map(|bytes| bytes.to_vec());
        asked.extend(found.is_some().then(|| name.to_string()));
        found
    })
    .unwrap();
    let listed = obj_siblings(OBJ.as_bytes(), &mut |name| all.get(name).map(|b| b.to_vec())).unwrap();
    assert_eq!(listed, asked);
    assert_eq!(listed, ["my scan.mtl", "tex/my skin.png"]);
}

#[test]
fn what_is_missing_is_said_and_the_rest_is_read() {
    let mesh = read(OBJ, &files(&[]));
    assert_eq!(said(&mesh), ["the material file 'my scan.mtl' is not beside the scan"]);
    assert_eq!((mesh.texture, mesh.faces.len()), (None, 4));

    let mesh = read(OBJ, &files(&[("my scan.mtl", MTL.as_bytes())]));
    assert_eq!(said(&mesh), ["the picture 'tex/my skin.png' of the material 'Skin #1' is missing"]);
    let texture = mesh.texture.unwrap();
    assert_eq!(texture.materials[0].color, [0.0; 3], "the plain colour");

    let one = &MTL[..MTL.find("newmtl cloth").unwrap()];
    let mesh = read(OBJ, &files(&[("my scan.mtl", one.as_bytes()), ("my skin.png", b"p")]));
    assert_eq!(said(&mesh), ["the material 'cloth' is not in 'my scan.mtl'"]);
    assert_eq!(mesh.texture.unwrap().pictures[0].name, "my skin.png", "found beside the scan");
}

#[test]
fn colours_of_vertices_suffice_without_the_picture() {
    let colored = OBJ.replace(" 0\nv", " 0 1 0 0\nv").replace("v 2 0 0\n", "v 2 0 0 1 0 0\n");
    let mesh = read(&colored, &files(&[]));
    assert_eq!((mesh.colors.as_ref().map(Vec::len), said(&mesh).len()), (Some(5), 0));
    let mesh = read(&colored, &files(&[("my scan.mtl", MTL.as_bytes()), ("tex/my skin.png", b"p")]));
    assert!(mesh.colors.is_some() && mesh.texture.is_some());
}

#[test]
fn one_plain_material_is_no_texture() {
    let plain = "mtllib a.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nf 1/1 2/1 3/1\n";
    let mesh = read(plain, &files(&[("a.mtl", b"newmtl a\nKd .5 .5 .5\n")]));
    assert_eq!((&mesh.texture, said(&mesh).len()), (&None, 0));
    // Without `usemtl`, the only material is meant.
    let unnamed = plain.replace("usemtl a\n", "");
    let mesh = read(&unnamed, &files(&[("a.mtl", b"newmtl a\nmap_Kd a.png\n"), ("a.png", b"p")]));
    assert_eq!(mesh.texture.unwrap().material_of(0).unwrap().1.picture, Some(0));
}

#[test]
fn a_picture_without_coordinates_is_said() {
    let bare = "mtllib a.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n";
    let mesh = read(bare, &files(&[("a.mtl", b"newmtl a\nmap_Kd a.png\n"), ("a.png", b"p")]));
    assert_eq!(said(&mesh), ["the faces have no coordinates in the picture 'a.png'"]);
}

#[test]
fn two_library_names_on_one_line_are_two_files() {
    let obj = "mtllib a.mtl b.mtl\nusemtl b\nv 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nf 1/1 2/1 3/1\n";
    let all = files(&[("a.mtl", b"newmtl a\n"), ("b.mtl", b"newmtl b\nmap_Kd b.png\n"), ("b.png", b"p")]);
    assert_eq!(read(obj, &all).texture.unwrap().pictures.len(), 1);
}
