//! Text by what OpenUSD reads; crate files read back by the format's definition alone.

use super::coding::packed_integers;
use super::{UsdInterpolation, UsdLayer, UsdPrim, UsdValue, usd_names, write_usd_package};
use proptest::prelude::*;

fn layer() -> UsdLayer {
    let mut mesh = UsdPrim::new("shirt", "Mesh", &["SkelBindingAPI", "MaterialBindingAPI"]);
    mesh.uniform("subdivisionScheme", UsdValue::Token("none"));
    mesh.attribute("points", UsdValue::Points(vec![[0.0, 1.5, -2.0]; 3]));
    mesh.interpolated("primvars:_PHYSW", UsdValue::Floats(vec![0.0, 0.5, 1.0]), UsdInterpolation::Vertex(1));
    mesh.interpolated("primvars:skel:jointIndices", UsdValue::Ints(vec![3; 12]), UsdInterpolation::Vertex(4));
    mesh.relationship("material:binding", "/figure/materials/shirt");
    let mut moved = UsdPrim::new("walk", "SkelAnimation", &[]);
    let turned = |x| UsdValue::Quaternions(vec![[0.5, x, 0.25, 0.125]]);
    moved.samples("rotations", vec![(0.0, turned(1.0)), (1.0, turned(2.0))]);
    let mut materials = UsdPrim::new("materials", "Scope", &[]);
    let mut material = UsdPrim::new("shirt", "Material", &[]);
    material.connected("outputs:surface", "token", "/figure/materials/shirt/surface.outputs:surface");
    material.add(UsdPrim::new("surface", "Shader", &[]));
    materials.add(material);
    let mut root = UsdPrim::new("figure", "SkelRoot", &[]);
    [moved, mesh, materials].into_iter().for_each(|prim| root.add(prim));
    let extras = [("licence \"of\" it".to_string(), "CC0\nno more".to_string())].into();
    let time_codes = Some(([0.0, 1.0], 30.0));
    UsdLayer { root, up_axis: "Y", meters_per_unit: 1.0, time_codes, documentation: "a test".into(), extras }
}

#[test]
fn text_has_the_form_that_open_usd_reads() {
    let text = String::from_utf8(layer().to_text()).unwrap();
    for line in [
        "#usda 1.0",
        "    defaultPrim = \"figure\"",
        "        string \"licence \\\"of\\\" it\" = \"CC0\\nno more\"",
        "def SkelRoot \"figure\"",
        "        prepend apiSchemas = [\"SkelBindingAPI\", \"MaterialBindingAPI\"]",
        "        uniform token subdivisionScheme = \"none\"",
        "        point3f[] points = [(0, 1.5, -2), (0, 1.5, -2), (0, 1.5, -2)]",
        "            elementSize = 4",
        "        rel material:binding = </figure/materials/shirt>",
        "            1: [(0.5, 2, 0.25, 0.125)],",
        "            token outputs:surface.connect = </figure/materials/shirt/surface.outputs:surface>",
    ] {
        assert!(text.lines().any(|found| found == line), "{line}\n{text}");
    }
    assert_eq!(text.matches('{').count(), text.matches('}').count());
}

/// Integers from their packed form.
fn unpacked(packed: &[u8], count: usize) -> Vec<i32> {
    if count == 0 {
        return Vec::new();
    }
    let common = i32::from_le_bytes(packed[..4].try_into().unwrap());
    let codes = &packed[4..4 + count.div_ceil(4)];
    let mut rest = &packed[4 + codes.len()..];
    let mut value = 0i32;
    let of = |k: usize| -> i32 {
        let code = codes[k / 4] >> (2 * (k % 4)) & 3;
        let width = [0, 1, 2, 4][usize::from(code)];
        let (bytes, after) = rest.split_at(width);
        rest = after;
        value = value.wrapping_add(match width {
            0 => common,
            1 => i32::from(bytes[0] as i8),
            2 => i32::from(i16::from_le_bytes(bytes.try_into().unwrap())),
            _ => i32::from_le_bytes(bytes.try_into().unwrap()),
        });
        value
    };
    let values = (0..count).map(of).collect();
    assert!(rest.is_empty(), "{} bytes too many", rest.len());
    values
}

proptest! {
    #[test]
    fn packed_integers_come_back(values in prop::collection::vec(prop_oneof![-3i32..3, any::<i32>(), -40_000i32..40_000], 0..60)) {
        prop_assert_eq!(unpacked(&packed_integers(&values), values.len()), values);
    }
}

/// A crate file's bytes from a place on.
struct Bytes<'a>(&'a [u8]);

impl Bytes<'_> {
    fn number(&mut self) -> usize {
        let (number, rest) = self.0.split_at(8);
        self.0 = rest;
        u64::from_le_bytes(number.try_into().unwrap()) as usize
    }

    fn unpacked(&mut self, size: usize) -> Vec<u8> {
        let packed = self.number();
        let (packed, rest) = self.0.split_at(packed);
        self.0 = rest;
        assert_eq!(packed[0], 0, "one block");
        lz4_flex::block::decompress(&packed[1..], size).unwrap()
    }

    fn integers(&mut self, count: usize) -> Vec<i32> {
        let most = 4 + count.div_ceil(4) + 4 * count;
        unpacked(&self.unpacked(most), count)
    }
}

fn section<'a>(file: &'a [u8], name: &str) -> Bytes<'a> {
    let mut contents = Bytes(&file[u64::from_le_bytes(file[16..24].try_into().unwrap()) as usize..]);
    for _ in 0..contents.number() {
        let (found, rest) = contents.0.split_at(16);
        contents.0 = rest;
        let (start, size) = (contents.number(), contents.number());
        if found.split(|byte| *byte == 0).next() == Some(name.as_bytes()) {
            return Bytes(&file[start..start + size]);
        }
    }
    panic!("no section {name}")
}

fn tokens(file: &[u8]) -> Vec<String> {
    let mut bytes = section(file, "TOKENS");
    let (count, size) = (bytes.number(), bytes.number());
    let texts = bytes.unpacked(size);
    let texts: Vec<String> =
        texts.split(|byte| *byte == 0).take(count).map(|text| String::from_utf8(text.to_vec()).unwrap()).collect();
    texts
}

/// The paths of a crate file, walked as OpenUSD walks them.
fn paths(file: &[u8]) -> Vec<String> {
    let tokens = tokens(file);
    let mut bytes = section(file, "PATHS");
    let (count, entries) = (bytes.number(), bytes.number());
    let (indices, names, jumps) = (bytes.integers(entries), bytes.integers(entries), bytes.integers(entries));
    let mut paths = vec![String::new(); count];
    let mut open = vec![(0usize, String::new())];
    while let Some((mut at, parent)) = open.pop() {
        let mut parent = parent;
        loop {
            let name = &tokens[names[at].unsigned_abs() as usize];
            let path = match at {
                0 => "/".to_string(),
                _ if names[at] < 0 => format!("{parent}.{name}"),
                _ => format!("{}/{name}", parent.trim_end_matches('/')),
            };
            paths[indices[at] as usize] = path.clone();
            let (has_child, has_sibling) = (jumps[at] > 0 || jumps[at] == -1, jumps[at] >= 0);
            match (has_child, has_sibling) {
                (true, true) => open.push((at + jumps[at] as usize, parent)),
                (false, false) => break,
                _ => {}
            }
            if has_child {
                parent = path;
            } else {
                // The next entry is a sibling.
                parent = paths[indices[at] as usize].clone();
                parent.truncate(parent.rfind(if names[at] < 0 { '.' } else { '/' }).unwrap_or(0));
            }
            at += 1;
        }
    }
    paths
}

#[test]
fn a_crate_file_holds_the_tree_of_paths_and_its_tables_agree() {
    let file = layer().to_binary();
    assert!(file.starts_with(b"PXR-USDC\0\x08\0"));
    let found = paths(&file);
    for path in [
        "/",
        "/figure",
        "/figure/walk.rotations",
        "/figure/shirt.primvars:skel:jointIndices",
        "/figure/materials/shirt/surface",
        "/figure/materials/shirt.outputs:surface",
    ] {
        assert_eq!(found.iter().filter(|found| *found == path).count(), 1, "{path} in {found:?}");
    }
    let mut bytes = section(&file, "SPECS");
    let count = bytes.number();
    let (of_paths, sets, kinds) = (bytes.integers(count), bytes.integers(count), bytes.integers(count));
    let mut bytes = section(&file, "FIELDSETS");
    let length = bytes.number();
    let fields = bytes.integers(length);
    let field_count = section(&file, "FIELDS").number() as i32;
    assert!(fields.iter().all(|&field| (-1..field_count).contains(&field)));
    for ((path, set), kind) in of_paths.iter().zip(sets).zip(kinds) {
        let path = &found[*path as usize];
        assert!(set == 0 || fields[set as usize - 1] == -1, "{path} begins within a set");
        let expected: &[i32] = match path.as_str() {
            "/" => &[7],
            path if path.contains('.') => &[1, 8],
            _ => &[6],
        };
        assert!(expected.contains(&kind), "{path} is {kind}");
    }
    // A target that has no spec is a path too.
    assert!(found.len() > count);
    assert_eq!(file, layer().to_binary());
}

#[test]
fn contents_of_a_package_begin_at_multiples_of_64_bytes() {
    let (first, second) = (vec![7u8; 100], vec![9u8; 33]);
    let package = write_usd_package([("a.usdc", first.as_slice()), ("textures/b.png", second.as_slice())]).unwrap();
    for content in [first, second] {
        let at = package.windows(content.len()).position(|window| window == content).unwrap();
        assert_eq!(at % 64, 0);
    }
}

#[test]
fn names_become_different_identifiers() {
    assert_eq!(usd_names(["a b", "a-b", "7", "ü", ""]), ["a_b", "a_b_2", "_7", "_", "__2"]);
}
