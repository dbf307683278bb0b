//! No reader panics, hangs or takes more memory than a file deserves, on any bytes: small valid files of every kind with bytes
//! changed, cut off, doubled and exchanged. Here 1000 of each; `just mutations` tries 100 000. What was found is in `bad_input`.

use overcoat::drive::{StreamOptions, StreamReader};
use overcoat::formats::{
    MeshKind, NpyArray, Npz, NpzCompression, mesh_siblings, read_bvh, read_camera_json, read_color_picture,
    read_depth_png, read_gltf_motion, read_mesh_with, read_npy, read_npz, read_ply, read_pose_lines, read_recording,
    read_rgba_png, read_texture_picture, write_color_jpeg, write_color_png, write_depth_png, write_gray_png, write_npy,
    write_npz, write_recording,
};
use overcoat::segment::{GarmentTemplate, LabelledSurface, Stroke};
use overcoat::session::{NewSession, Session, create, fsck};
use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::{Duration, Instant};

/// Longest time for a file of a few kilobytes: a thousand times what a valid one takes.
const LONGEST: Duration = Duration::from_secs(5);

/// Numbers that look random and are the same each time (xorshift).
struct Random(u64);

impl Random {
    fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % end.max(1) as u64) as usize
    }
}

/// A changed copy of a file.
fn mutated(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    const WORDS: [&[u8]; 14] = [
        b"-1",
        b"0",
        b"4294967295",
        b"99999999999999999999",
        b"1e308",
        b"nan",
        b"null",
        b"\xff\xff\xff\xff",
        b"\0\0\0\0",
        b"\r",
        b"\"",
        b"[[[[",
        b"\xef\xbb\xbf",
        b"\\\n",
    ];
    let mut changed = bytes.to_vec();
    for _ in 0..1 + random.below(3) {
        let at = random.below(changed.len() + 1);
        match random.below(6) {
            0 => changed.truncate(at),
            1 | 2 if at < changed.len() => changed[at] = random.below(256) as u8,
            3 => {
                let word = WORDS[random.below(WORDS.len())];
                let end = (at + random.below(word.len() + 1)).min(changed.len());
                changed.splice(at..end, word.iter().copied());
            }
            4 => {
                let end = (at + random.below(64)).min(changed.len());
                let part = changed[at..end].to_vec();
                let to = random.below(changed.len() + 1);
                changed.splice(to..to, part);
            }
            _ => {
                let end = (at + random.below(16)).min(changed.len());
                changed.drain(at..end);
            }
        }
    }
    changed
}

fn count() -> usize {
    std::env::var("OVERCOAT_MUTATIONS").ok().and_then(|text| text.parse().ok()).unwrap_or(1000)
}

/// Reads changed copies of a file; a fault names its number, so that it can be made again.
fn survives(what: &str, valid: &[u8], count: usize, read: &dyn Fn(&[u8])) {
    read(valid);
    let mut random =
        Random(what.bytes().fold(0x9e37_79b9_7f4a_7c15, |seed, b| (seed ^ u64::from(b)).rotate_left(9) | 1));
    for number in 0..count {
        let bytes = mutated(valid, &mut random);
        let began = Instant::now();
        if catch_unwind(AssertUnwindSafe(|| read(&bytes))).is_err() {
            panic!("{what}: change {number} panics: {:?}", String::from_utf8_lossy(&bytes));
        }
        assert!(began.elapsed() < LONGEST, "{what}: change {number} takes {:?}", began.elapsed());
    }
}

const OBJ: &str = "mtllib a.mtl\nusemtl b\nv 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1 1 0 0 0 1\nvt 0 0\nvt 0.5 1\nvn 0 0 1\n\
    f 1/1/1 2/2/1 -1/-1/1\nusemtl a\nf 3/2 2/1 \\\n 1\n#MRGB ffff0000ff00ff00ff0000ff\n";
const PLY: &str = "ply\nformat ascii 1.0\ncomment TextureFile a.png\nelement vertex 3\nproperty float x\nproperty float y\n\
    property float z\nproperty float rgb\nproperty int label\nelement face 1\nproperty list uchar int vertex_indices\n\
    property list uchar float texcoord\nproperty int texnumber\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
    element tristrips 1\nproperty list int int vertex_indices\nend_header\n0 0 0 1 0\n1 0 0 2 1\n0 1 0 3 1\n\
    3 0 1 2 6 0 0 1 0 1 1 0 9 9 9\n4 0 1 2 -1\n";
const BVH: &str = "HIERARCHY\nROOT hips\n{\nOFFSET 0 0 0\nCHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n\
    JOINT a\n{\nOFFSET 0 1 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nEnd Site\n{\nOFFSET 0 1 0\n}\n}\n}\nMOTION\n\
    Frames: 2\nFrame Time: 0.1\n1 2 3 4 5 6 7 8 9\n1 2 3 4\n5 6 7 8 9\n";
const CAMERA: &str = r#"{"width":16,"height":16,"fx":10,"fy":10,"cx":8,"cy":8,"depth_scale":1000,"distortion":[0.1]}"#;
const GLTF: &str = r#"{"asset":{"version":"2.0"},"extensionsUsed":["EXT_meshopt_compression","EXT_texture_webp"],
    "extensionsRequired":["KHR_mesh_quantization"],"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0,"children":[1]},{"name":"b"}],
    "skins":[{"joints":[0,1]}],"meshes":[{"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":1},"material":0}]}],
    "materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}],
    "textures":[{"extensions":{"EXT_texture_webp":{"source":0}}}],"images":[{"uri":"a.png"}],
    "animations":[{"name":"a","samplers":[{"input":2,"output":3}],"channels":[{"sampler":0,"target":{"node":0,"path":"translation"}}]}],
    "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[0,0,0]},
    {"bufferView":0,"componentType":5126,"count":3,"type":"VEC2"},
    {"bufferView":0,"componentType":5126,"count":1,"type":"SCALAR","min":[0],"max":[0]},
    {"bufferView":0,"componentType":5126,"count":1,"type":"VEC3"}],
    "bufferViews":[{"buffer":0,"byteLength":36},{"buffer":1,"byteLength":36,"extensions":{"EXT_meshopt_compression":
    {"buffer":0,"byteLength":36,"byteStride":12,"count":3,"mode":"ATTRIBUTES"}}}],
    "buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"},
    {"byteLength":36,"extensions":{"EXT_meshopt_compression":{"fallback":true}}}]}"#;

fn beside(name: &str) -> Option<Vec<u8>> {
    match name {
        "a.mtl" => Some(b"newmtl a\nKd 1 0 0\nnewmtl b\nmap_Ka -s 2 2 a.png\nmap_Kd a.png\n".to_vec()),
        "a.png" => Some(b"picture".to_vec()),
        _ => None,
    }
}

fn mesh(kind: MeshKind) -> impl Fn(&[u8]) {
    move |bytes| {
        let _ = mesh_siblings(kind, bytes, &mut beside);
        if let Ok(mesh) = read_mesh_with(kind, bytes, &mut beside) {
            let count = mesh.points.len();
            assert!(mesh.faces.as_flattened().iter().all(|&v| (v as usize) < count));
            assert!(mesh.colors.is_none_or(|colors| colors.len() == count));
        }
    }
}

#[test]
fn meshes_survive_any_bytes() {
    let mut stl = vec![0u8; 84 + 50];
    stl[80] = 1;
    let binary_ply = [
        b"ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
          element face 1\nproperty list uchar int vertex_index\nend_header\n"
            .as_slice(),
        &[0; 12],
        &[3, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0],
    ]
    .concat();
    let glb = {
        let json = GLTF.replace('\n', " ");
        let padded = format!("{json:<width$}", width = json.len().next_multiple_of(4));
        let length = (12 + 8 + padded.len()) as u32;
        [
            b"glTF".as_slice(),
            &2u32.to_le_bytes(),
            &length.to_le_bytes(),
            &(padded.len() as u32).to_le_bytes(),
            b"JSON",
            padded.as_bytes(),
        ]
        .concat()
    };
    for (what, kind, bytes) in [
        ("obj", MeshKind::Obj, OBJ.as_bytes()),
        ("ply", MeshKind::Ply, PLY.as_bytes()),
        ("binary ply", MeshKind::Ply, &binary_ply),
        ("off", MeshKind::Off, b"COFF\n3 1 0\n0 0 0 1 0 0\n1 0 0 0 1 0\n0 1 0 0 0 1\n3 0 1 2 9 9 9\n"),
        ("stl", MeshKind::Stl, b"solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n"),
        ("binary stl", MeshKind::Stl, &stl),
        ("gltf", MeshKind::Gltf, GLTF.as_bytes()),
        ("glb", MeshKind::Gltf, &glb),
    ] {
        survives(what, bytes, count(), &mesh(kind));
    }
}

#[test]
fn pictures_and_frames_survive_any_bytes() {
    let pixels: Vec<[u8; 3]> = (0..=255).map(|k| [k, 255 - k, 7]).collect();
    let png = write_color_png([16, 16], &pixels).unwrap();
    let jpeg = write_color_jpeg([16, 16], &pixels, 80).unwrap();
    let depth = write_depth_png([16, 16], &(0..256).collect::<Vec<u16>>()).unwrap();
    for (what, bytes) in [("png", &png), ("jpeg", &jpeg), ("grey png", &write_gray_png([16, 16], &[7; 256]).unwrap())] {
        survives(what, bytes, count(), &|bytes| {
            let _ = (read_color_picture(bytes), read_texture_picture(bytes), read_rgba_png(bytes));
        });
    }
    survives("depth", &depth, count(), &|bytes| drop(read_depth_png(bytes)));
    survives("camera", CAMERA.as_bytes(), count(), &|bytes| drop(read_camera_json(bytes)));
    let mut zip = Vec::new();
    let files = [
        ("camera.json", CAMERA.as_bytes()),
        ("associations.txt", b"0 rgb/1.png 0 depth/1.png\n1 rgb/2.png 1 depth/2.png\n"),
        ("depth/1.png", &depth),
        ("depth/2.png", &depth),
        ("rgb/1.png", &png),
    ];
    let files = files.map(|(name, bytes)| (name.to_string(), bytes.to_vec()));
    write_recording(&files, &mut zip).unwrap();
    survives("recording", &zip, count(), &|bytes| drop(read_recording(bytes)));
    for list in ["0.1 rgb/1.png 0.1 depth/1.png\n0.2 depth/2.png 0.2 rgb/2.png\n", "# c\n0.1 depth/1.png\n"] {
        survives("frame list", list.as_bytes(), count(), &|bytes| {
            for name in ["associations.txt", "depth.txt"] {
                let mut zip = Vec::new();
                let files = [("camera.json", CAMERA.as_bytes()), (name, bytes), ("depth/1.png", b"")];
                write_recording(&files.map(|(name, bytes)| (name.to_string(), bytes.to_vec())), &mut zip).unwrap();
                let _ = read_recording(&zip);
            }
        });
    }
}

#[test]
fn clips_and_streams_survive_any_bytes() {
    survives("bvh", BVH.as_bytes(), count(), &|bytes| drop(read_bvh(bytes)));
    survives("gltf clip", GLTF.as_bytes(), count(), &|bytes| drop(read_gltf_motion(bytes, None)));
    let poses = "{\"overcoat\":\"poses\",\"skeleton\":{\"names\":[\"hips\",\"spine\"],\"parents\":[null,0],\
        \"joints\":[[0,0.95,0],[0,1.05,-0.01]]}}\n{\"t\":0.0,\"root\":[0,0.95,0],\"joints\":{\"hips\":[0,0,0,1]}}\n\
        {\"t\":0.1,\"root\":[0,0.95,0],\"joints\":{\"hips\":[0,0,0,1]}}\n";
    survives("poses", poses.as_bytes(), count(), &|bytes| drop(read_pose_lines(bytes)));
    let landmarks = "{\"t\":0.0,\"landmarks\":{\"head\":[0,1.6,0],\"pelvis\":[0,0.9,0],\"leftHip\":[0.1,0.9,0],\
        \"rightHip\":[-0.1,0.9,0],\"leftKnee\":[0.1,0.5,0],\"rightKnee\":[-0.1,0.5,0],\"leftAnkle\":[0.1,0.1,0],\
        \"rightAnkle\":[-0.1,0.1,0]},\"confidence\":{\"head\":0.9}}\n";
    let trc = "PathFileType\t4\t(X/Y/Z)\ta.trc\nDataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\n30\t30\t2\t2\tmm\n\
        Frame#\tTime\thead\t\t\tpelvis\t\t\n\t\tX1\tY1\tZ1\tX2\tY2\tZ2\n\n1\t0.0\t0\t1600\t0\t0\t900\t0\n2\t0.1\t0\t1600\t0\t0\t900\t\n";
    for (what, text) in [("landmarks", landmarks.repeat(3).as_str()), ("trc", trc)] {
        survives(what, text.as_bytes(), count(), &|bytes| {
            // It ends at the first error that ends the stream, and within its lines in any case.
            let mut reader = StreamReader::new(Cursor::new(bytes), StreamOptions::default());
            for _ in 0..1000 {
                if reader.next_frame().is_none() {
                    break;
                }
            }
        });
    }
}

#[test]
fn labels_brushes_and_templates_survive_any_bytes() {
    let strokes = "{\"layer\":\"tshirt\",\"op\":\"add\",\"radius\":0.02,\"points\":[[0,1,0],[0,1.1,0]],\"normal\":[0,0,1]}\n\
        {\"layer\":\"tshirt\",\"op\":\"erase\",\"radius\":0.02,\"points\":[[0,1,0]],\"frame\":\"world\"}\n";
    survives("strokes", strokes.as_bytes(), count(), &|bytes| {
        drop(Stroke::read_lines(&String::from_utf8_lossy(bytes)))
    });
    survives("labelled ply", PLY.as_bytes(), count(), &|bytes| {
        if let Ok(raw) = read_ply(bytes) {
            let _ = LabelledSurface::read(&raw);
        }
    });
    let mut npy = Vec::new();
    write_npy(&NpyArray::vector(vec![0i32, 1, -1, 3]), &mut npy).unwrap();
    survives("npy", &npy, count(), &|bytes| {
        if let Ok(array) = read_npy(bytes) {
            let _ = array.to_f64("labels");
        }
    });
    let mut npz = Npz::new();
    npz.insert("v", NpyArray::rows(&[[1.0f64, 2.0, 3.0]; 4]));
    npz.insert("names", NpyArray::vector(vec!["a".to_string(), "bc".into()]));
    for compression in [NpzCompression::Stored, NpzCompression::Deflated] {
        let mut bytes = Vec::new();
        write_npz(&npz, compression, &mut bytes).unwrap();
        survives("npz", &bytes, count(), &|bytes| {
            if let Ok(npz) = read_npz(Cursor::new(bytes)) {
                let _ = npz.f64_rows::<3>("v");
            }
        });
    }
    let template = std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("templates/garments/tshirt.toml")).unwrap();
    survives("template", &template, count(), &|bytes| {
        let _ = GarmentTemplate::parse("tshirt", &String::from_utf8_lossy(bytes));
    });
}

#[test]
fn recipes_and_journals_survive_any_bytes() {
    let dir = tempfile::tempdir().unwrap();
    let session = dir.path().join("alice");
    create(&session, &NewSession::default()).unwrap();
    for file in ["recipe.toml", "session.json", "journal.jsonl"] {
        let path = session.join(file);
        let valid = std::fs::read(&path).unwrap();
        survives(file, &valid, count() / 10, &|bytes| {
            std::fs::write(&path, bytes).unwrap();
            let _ = Session::open(&session);
            let _ = fsck(&session, false, &mut |_| {});
        });
        std::fs::write(&path, &valid).unwrap();
    }
    assert!(Session::open(&session).is_ok());
}
