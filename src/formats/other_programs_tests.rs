//! Files as other programs write them, each small and generated: what they mean, and what is said of what is not read.

use super::{MeshKind, RawMesh, mesh_siblings, read_bvh, read_camera_json, read_mesh, read_mesh_with};

fn ply(header: &str, body: &str) -> String {
    format!("ply\nformat ascii 1.0\n{header}\nend_header\n{body}")
}

/// A quad of two triangles, with more properties and values of vertices and of faces.
fn quad_ply(comment: &str, of_vertex: &str, vertex: &str, of_face: &str, faces: [&str; 2]) -> String {
    let header = format!(
        "{comment}element vertex 4\nproperty float x\nproperty float y\nproperty float z\n{of_vertex}element face 2\n\
         property list uchar int vertex_indices\n{of_face}"
    );
    let rows: Vec<String> = ["0 0 0", "1 0 0", "1 1 0", "0 1 0"].iter().map(|p| format!("{p}{vertex}\n")).collect();
    ply(header.trim_end(), &format!("{}3 0 1 2{}\n3 0 2 3{}\n", rows.concat(), faces[0], faces[1]))
}

fn read(kind: MeshKind, text: impl AsRef<[u8]>) -> RawMesh {
    read_mesh_with(kind, text.as_ref(), &mut |name| (name == "skin.png").then(|| b"picture".to_vec())).unwrap()
}

fn unread(mesh: &RawMesh) -> Vec<&str> {
    mesh.unread.iter().map(|part| part.what.as_str()).collect()
}

#[test]
fn ply_colours_of_faces_reach_the_vertices() {
    let colors = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    let mesh = read(MeshKind::Ply, quad_ply("", "", "", colors, [" 200 0 0", " 100 0 0"]));
    assert_eq!(mesh.colors.unwrap(), [[150, 0, 0], [200, 0, 0], [150, 0, 0], [100, 0, 0]]);
}

#[test]
fn ply_pictures_are_found_by_their_comment() {
    let coords = "property list uchar float texcoord\n";
    let faces = [" 6 0 0 1 0 1 1", " 6 0.5 0 1 1 0 1"];
    let file = quad_ply("comment TextureFile skin.png\n", "", "", coords, faces);
    let mesh = read(MeshKind::Ply, &file);
    let texture = mesh.texture.unwrap();
    assert_eq!(texture.pictures[0].bytes, b"picture");
    assert_eq!(texture.coords_of(1, mesh.faces[1]).unwrap(), [[0.5, 0.0], [1.0, 1.0], [0.0, 1.0]]);
    assert!(mesh.unread.is_empty());
    let beside = mesh_siblings(MeshKind::Ply, file.as_bytes(), &mut |name| (name == "skin.png").then(Vec::new));
    assert_eq!(beside.unwrap(), ["skin.png"]);
    // Two pictures, chosen by a number per face; one of them is not there.
    let file = quad_ply(
        "comment TextureFile skin.png\ncomment TextureFile none.png\n",
        "",
        "",
        "property list uchar float texcoord\nproperty int texnumber\n",
        [" 6 0 0 1 0 1 1 0", " 6 0 0 1 1 0 1 1"],
    );
    let mesh = read(MeshKind::Ply, file);
    assert_eq!(unread(&mesh), ["the picture 'none.png' is missing"]);
    assert_eq!(mesh.texture.unwrap().face_materials, [0, 1]);
    // Colours of the vertices are no reason to be silent.
    let of_vertex =
        "property float s\nproperty float t\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n";
    let file = quad_ply("comment TextureFile none.png\n", of_vertex, " 0.5 1 9 9 9", "", ["", ""]);
    assert_eq!(
        unread(&read(MeshKind::Ply, file)),
        ["the picture 'none.png' is missing, and the colours of the vertices are used instead"]
    );
    // Coordinates per vertex.
    let of_vertex = "property float texture_u\nproperty float texture_v\n";
    let mesh = read(MeshKind::Ply, quad_ply("comment TextureFile: skin.png\n", of_vertex, " 0.5 1", "", ["", ""]));
    assert_eq!(mesh.texture.unwrap().coords, [[0.5, 1.0]; 4]);
    let mesh = read(MeshKind::Ply, quad_ply("", of_vertex, " 0.5 1", "", ["", ""]));
    assert_eq!(unread(&mesh), ["the scan has texture coordinates, but the file names no picture"]);
}

#[test]
fn ply_colours_that_are_not_read_are_said() {
    let mesh = read(MeshKind::Ply, quad_ply("", "property list uchar int vertex_color\n", " 3 1 2 3", "", ["", ""]));
    assert_eq!(unread(&mesh), ["the colours in 'vertex_color' have an unknown form"]);
    let mesh = read(MeshKind::Ply, quad_ply("", "property float quality\n", " 0.5", "", ["", ""]));
    assert!(mesh.unread.is_empty());
}

#[test]
fn ply_strips_become_triangles() {
    let header = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement tristrips 1\n\
        property list int int vertex_indices";
    let mesh = read(MeshKind::Ply, ply(header, "0 0 0\n1 0 0\n0 1 0\n1 1 0\n8 0 1 2 3 -1 3 2 1\n"));
    assert_eq!(mesh.faces, [[0, 1, 2], [2, 1, 3], [3, 2, 1]]);
}

#[test]
fn colours_of_an_obj_that_are_not_read_are_said() {
    let faces = "vt 0 0\nvt 1 0\nvt 1 1\nf 1/1 2/2 3/3\n";
    let points = "v 0 0 0\nv 1 0 0\nv 1 1 0\n";
    let mesh = read(MeshKind::Obj, format!("{points}{faces}"));
    assert_eq!(unread(&mesh), ["the scan has texture coordinates, but the file names no picture"]);
    let mesh = read(MeshKind::Obj, "v 0 0 0 1 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n");
    assert_eq!(unread(&mesh), ["only 1 of 3 vertices have a colour"]);
    let mesh = read(MeshKind::Obj, format!("{points}#MRGB ffff0000ff00ff00ff0000ff\nf 1 2 3\n"));
    assert_eq!(mesh.colors.unwrap(), [[255, 0, 0], [0, 255, 0], [0, 0, 255]]);
    let with_material = |mtl: &str| {
        let obj = format!("mtllib a.mtl\nusemtl skin\n{points}{faces}");
        read_mesh_with(MeshKind::Obj, obj.as_bytes(), &mut |name| match name {
            "a.mtl" => Some(mtl.as_bytes().to_vec()),
            _ => Some(b"picture".to_vec()),
        })
        .unwrap()
    };
    for map in ["map_Ka", "map_Ke", "map_BaseColor"] {
        let mesh = with_material(&format!("newmtl skin\n{map} skin.png\nmap_Bump bump.png\n"));
        assert_eq!(mesh.texture.unwrap().pictures[0].name, "skin.png", "{map}");
    }
    let mesh = with_material("newmtl skin\nmap_Ka dark.png\nmap_Kd skin.png\nmap_Ka dark.png\n");
    assert_eq!(mesh.texture.unwrap().pictures[0].name, "skin.png");
    let mesh = with_material("newmtl skin\nmap_Ks shine.png\n");
    assert!(unread(&mesh)[0].contains("'map_Ks shine.png'"), "{:?}", unread(&mesh));
    assert!(with_material("newmtl skin\nmap_Kd a.png\nmap_Ks shine.png\n").unread.is_empty());
}

#[test]
fn byte_order_marks_line_ends_and_continued_lines() {
    let obj = "v 0 0 0\nv 1 0 \\\n 0\nv 1 1 0\n# C:\\scans\\\nf 1 2 \\\r\n3\n";
    let off = "OFF\n3 1 0\n0 0 0\n1 0 0\n1 1 0\n3 0 1 2\n";
    let stl = "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nendloop\nendfacet\nendsolid\n";
    let ply = ply(
        "element vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n\
         property list uchar int vertex_index",
        "0 0 0\n1 0 0\n1 1 0\n3 0 1 2\n",
    );
    for (kind, text) in
        [(MeshKind::Obj, obj), (MeshKind::Off, off), (MeshKind::Stl, stl), (MeshKind::Ply, ply.as_str())]
    {
        let expected = read(kind, text);
        assert_eq!((expected.points.len(), &expected.faces[..]), (3, &[[0, 1, 2]][..]), "{kind:?}");
        assert_eq!(read(kind, format!("\u{feff}{text}")), expected, "{kind:?} with a mark");
        assert_eq!(read(kind, text.replace("\r\n", "\n").replace('\n', "\r")), expected, "{kind:?} of an old Mac");
        let utf_16: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
        for bytes in [utf_16.clone(), [vec![0xff, 0xfe], utf_16].concat()] {
            let error = read_mesh(kind, bytes.as_slice()).unwrap_err().to_string();
            assert!(error.ends_with("file is text in UTF-16, not in UTF-8"), "{kind:?}: {error}");
        }
        let comma = text.replace("1 1 0", "0,5 1 0");
        let error = read_mesh(kind, comma.as_bytes()).unwrap_err().to_string();
        assert!(error.contains("a number with a decimal point, not a comma, found '0,5'"), "{kind:?}: {error}");
        let nan = read(kind, text.replace("1 1 0", "-nan(ind) 1 0"));
        assert!(nan.points[2][0].is_nan(), "{kind:?}");
    }
    let camera = r#"{"width":16,"height":16,"fx":10,"fy":10,"cx":8,"cy":8,"depth_scale":1000}"#;
    assert!(read_camera_json(format!("\u{feff}{camera}").as_bytes()).is_ok());
}

#[test]
fn bvh_with_wrapped_rows_old_line_ends_and_text_behind() {
    let bvh = "HIERARCHY\nROOT hips\n{\nOFFSET 0 0 0\nCHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation \
        Yrotation\nEnd Site\n{\nOFFSET 0 1 0\n}\n}\nMOTION\nFrames: 2\nFrame Time: 0.1\n1 2 3 4 5 6\n7 8 9 10 11 12\n";
    let expected = read_bvh(bvh.as_bytes()).unwrap();
    assert_eq!(read_bvh(bvh.replace(" 3 4 ", " 3\n4 ").replace(" 9 10", " 9\n10").as_bytes()).unwrap(), expected);
    assert_eq!(read_bvh(bvh.replace('\n', "\r").as_bytes()).unwrap(), expected);
    let behind = read_bvh(format!("{bvh}exported by me\n1 2 3\n").as_bytes()).unwrap();
    assert_eq!(behind.frames, expected.frames);
    assert_eq!(behind.notes, ["line 16 and what follows is no frame, and is left out"]);
    let error = read_bvh(bvh.replace("1 2 3 4", "1,5 2 3 4").as_bytes()).unwrap_err().to_string();
    assert_eq!(error, "BVH, line 14: expected a number with a decimal point, not a comma, found '1,5'");
    let utf_16: Vec<u8> = bvh.encode_utf16().flat_map(u16::to_be_bytes).collect();
    assert_eq!(read_bvh(utf_16.as_slice()).unwrap_err().to_string(), "the BVH file is text in UTF-16, not in UTF-8");
}

/// Public reports about other readers, in the order of docs/files.md, each as a small file.
#[test]
fn files_of_public_reports_about_meshes() {
    let point = "property float x\nproperty float y\nproperty float z\n";
    let cloud = |more: &str, row: &str| ply(format!("element vertex 1\n{point}{more}").trim_end(), row);
    // meshlab 186, trimesh 49, assimp 1167.
    let colored = cloud("property uchar r\nproperty uchar g\nproperty uchar b\n", "0 0 0 1 2 3\n");
    assert_eq!(read(MeshKind::Ply, colored).colors.unwrap(), [[1, 2, 3]]);
    let colored = cloud("property float red\nproperty float green\nproperty float blue\n", "0.188808 0 0 1 0.5 0\n");
    assert_eq!(read(MeshKind::Ply, colored).colors.unwrap(), [[255, 128, 0]]);
    // trimesh 2419: both coordinates and colours.
    let both = cloud(
        "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty float s\nproperty float t\n",
        "0 0 0 1 2 3 0.5 1\n",
    );
    let mesh = read(MeshKind::Ply, both);
    assert_eq!((mesh.colors.unwrap(), mesh.uvs.unwrap(), mesh.unread.len()), (vec![[1, 2, 3]], vec![[0.5, 1.0]], 0));
    // three.js 19254: the first object has no colours.
    let mesh = read(MeshKind::Obj, "o a\nv 0 0 0\nv 1 0 0\no b\nv 1 1 0 1 0 0\nf 1 2 3\n");
    assert_eq!(unread(&mesh), ["only 1 of 3 vertices have a colour"]);
    // trimesh 2364, f3d 2320: backward indices between vertices.
    let mesh = read(
        MeshKind::Obj,
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -1 -2 -3\nv 0 0 1\nv 1 0 1\nv 0 1 1\nf -1//-1 -2//-1 -3//-1\nvn 0 0 1\n"
            .replace("f -1//", "vn 0 0 1\nf -1//"),
    );
    assert_eq!(mesh.faces, [[2, 1, 0], [5, 4, 3]]);
    // tinyobjloader 140: indices from 0.
    let error = read_mesh(MeshKind::Obj, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0/0/0 1/1/0 2/2/0\n".as_bytes()).unwrap_err();
    assert_eq!(error.to_string(), "OBJ, line 4: expected the index of a vertex, found '0/0/0'");
    // meshlab 194: words of their own; numpy-stl 37: a facet of two corners.
    let stl = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nend loop\nend facet\nendsolid\n";
    assert_eq!(read(MeshKind::Stl, stl).faces.len(), 1);
    let error = read_mesh(MeshKind::Stl, stl.replace("vertex 0 1 0\n", "").as_bytes()).unwrap_err();
    assert!(error.to_string().contains("expected a facet of 3 vertices, found '2'"), "{error}");
    // stl_reader 3: binary, although it begins with `solid`.
    let mut binary = b"solid made by a CAD program".to_vec();
    binary.resize(84 + 50, 0);
    binary[80] = 1;
    assert_eq!(read(MeshKind::Stl, binary).faces.len(), 1);
    // assimp 2359: a sparse accessor without a buffer view, here one point of three that is not zero; and one out of range.
    let gltf = r#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
        "buffers":[{"byteLength":14,"uri":"data:;base64,AgAAAIA/AAAAQAAAQEA="}],
        "bufferViews":[{"buffer":0,"byteLength":2},{"buffer":0,"byteOffset":2,"byteLength":12}],
        "accessors":[{"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,2,3],
        "sparse":{"count":1,"indices":{"bufferView":0,"componentType":5123},"values":{"bufferView":1}}}]}"#;
    let mesh = read(MeshKind::Gltf, gltf);
    assert_eq!((mesh.points, mesh.faces), (vec![[0.0; 3], [0.0; 3], [1.0, 2.0, 3.0]], vec![[0, 1, 2]]));
    let error = read_mesh(MeshKind::Gltf, gltf.replace("\"count\":3", "\"count\":2").as_bytes()).unwrap_err();
    assert!(error.to_string().contains("sparse rows"), "{error}");
}

#[test]
fn files_of_public_reports_about_clips() {
    let hierarchy = |channels: &str| {
        format!(
            "HIERARCHY\nROOT a b\n{{\n\tOFFSET 0 0 0\n\tCHANNELS {channels}\n\tEnd site\n\t{{\n\tOFFSET 0 1 0\n\t}}\n}}\nMOTION\n"
        )
    };
    let three = hierarchy("3 Zrotation Xrotation Yrotation");
    let frames = |text: &str| read_bvh(format!("{three}{text}").as_bytes()).unwrap();
    // usdBVHAnim 36: exponents. SlimeVR 995: no space before a minus. PyMO 14: `End site`.
    let motion = frames("Frames: 2\nFrame Time: 1e-2\n1e-7 -2.5E-3 0\n0.0-7.5 -5.4\n");
    assert_eq!((motion.frames.len(), motion.frame_secs), (2, Some(0.01)));
    // bvh-python 7: no line end behind the last frame. AnimatedDrawings 106: one frame more than stated.
    assert_eq!(frames("Frames: 2\nFrame Time: 0.1\n1 2 3\n4 5 6").frames.len(), 2);
    let motion = frames("Frames: 1\nFrame Time: 0.1\n1 2 3\n4 5 6\n");
    assert_eq!(motion.notes, ["the file states 1 frames, but 2 frames are there"]);
    // ganimator 10, Anytop 9: joints with other numbers of channels, a root with none.
    let none = "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 0\nJOINT b\n{\nOFFSET 0 1 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n\
        JOINT c\n{\nOFFSET 0 1 0\nCHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n}\n}\n}\nMOTION\n\
        Frames: 1\nFrame Time: 0.1\n1 2 3 0 1 0 4 5 6\n";
    assert_eq!(read_bvh(none.as_bytes()).unwrap().joints.len(), 3);
}
