//! Layers as crate files, `.usdc`, version 0.8.0.
//!
//! A crate file holds values, and then tables: tokens (texts), strings (tokens that are texts), fields (a token and a value),
//! sets of fields, paths (a tree), and specs (a path, a set of fields and a kind). A value is 8 bytes: its type, and the value
//! itself or where it is.

use super::coding::{compressed, packed_integers};
use super::{Content, Property, UsdInterpolation, UsdLayer, UsdPrim, UsdValue};
use std::collections::HashMap;

const VERSION: [u8; 3] = [0, 8, 0];
/// The header: name, version, place of the table of contents, reserved bytes.
const HEADER: usize = 88;

const IS_ARRAY: u64 = 1 << 63;
const IS_INLINE: u64 = 1 << 62;

/// OpenUSD's numbers of types.
mod kind {
    pub const BOOL: u64 = 1;
    pub const INT: u64 = 3;
    pub const FLOAT: u64 = 8;
    pub const DOUBLE: u64 = 9;
    pub const STRING: u64 = 10;
    pub const TOKEN: u64 = 11;
    pub const ASSET: u64 = 12;
    pub const MATRIX_4D: u64 = 15;
    pub const QUATERNION_F: u64 = 17;
    pub const VEC_2F: u64 = 20;
    pub const VEC_3F: u64 = 24;
    pub const VEC_3H: u64 = 25;
    pub const VEC_4F: u64 = 28;
    pub const DICTIONARY: u64 = 31;
    pub const TOKEN_LIST_OP: u64 = 32;
    pub const PATH_LIST_OP: u64 = 34;
    pub const TOKEN_VECTOR: u64 = 41;
    pub const SPECIFIER: u64 = 42;
    pub const VARIABILITY: u64 = 44;
    pub const TIME_SAMPLES: u64 = 46;
    pub const DOUBLE_VECTOR: u64 = 48;
}

/// OpenUSD's numbers of kinds of specs.
mod spec {
    pub const ATTRIBUTE: i32 = 1;
    pub const PRIM: i32 = 6;
    pub const PSEUDO_ROOT: i32 = 7;
    pub const RELATIONSHIP: i32 = 8;
}

impl UsdLayer {
    /// The layer as a crate file.
    pub fn to_binary(&self) -> Vec<u8> {
        let mut file = CrateFile { out: vec![0; HEADER], ..CrateFile::default() };
        let root = file.layer(self);
        file.finish(&root)
    }
}

/// A place in the tree of paths.
struct Node {
    path: usize,
    name: u32,
    is_property: bool,
    children: Vec<Node>,
}

#[derive(Default)]
struct CrateFile {
    out: Vec<u8>,
    tokens: Table<String>,
    /// Tokens.
    strings: Table<u32>,
    /// A token and a value.
    fields: Table<(u32, u64)>,
    /// Fields; −1 ends a set.
    field_sets: Vec<i32>,
    paths: Table<String>,
    /// Path, first of its fields, kind.
    specs: Vec<[i32; 3]>,
}

/// Different values, by the order in which they came.
struct Table<T> {
    values: Vec<T>,
    index: HashMap<T, u32>,
}

impl<T> Default for Table<T> {
    fn default() -> Self {
        Self { values: Vec::new(), index: HashMap::new() }
    }
}

impl<T: Clone + Eq + std::hash::Hash> Table<T> {
    fn index(&mut self, value: T) -> u32 {
        *self.index.entry(value).or_insert_with_key(|value| {
            self.values.push(value.clone());
            self.values.len() as u32 - 1
        })
    }
}

impl CrateFile {
    fn layer(&mut self, layer: &UsdLayer) -> Node {
        let path = self.path("/");
        let root = self.prim("", &layer.root);
        let mut fields = vec![
            ("defaultPrim", self.token(&layer.root.name)),
            ("documentation", self.string(&layer.documentation)),
            ("metersPerUnit", self.double(layer.meters_per_unit)),
            ("upAxis", self.token(layer.up_axis)),
            ("primChildren", self.token_vector(&[&layer.root.name])),
        ];
        if let Some(([start, end], per_second)) = layer.time_codes {
            fields.push(("startTimeCode", self.double(start)));
            fields.push(("endTimeCode", self.double(end)));
            fields.push(("timeCodesPerSecond", self.double(per_second)));
            fields.push(("framesPerSecond", self.double(per_second)));
        }
        if !layer.extras.is_empty() {
            let entries: Vec<(u32, u64)> =
                layer.extras.iter().map(|(key, text)| (self.string_index(key), self.string(text))).collect();
            let at = self.place();
            self.count(entries.len());
            for (key, value) in entries {
                self.out.extend(key.to_le_bytes());
                // The value follows at once.
                self.out.extend(8i64.to_le_bytes());
                self.out.extend(value.to_le_bytes());
            }
            fields.push(("customLayerData", stored(kind::DICTIONARY, at)));
        }
        self.spec(path, spec::PSEUDO_ROOT, fields);
        Node { path, name: 0, is_property: false, children: vec![root] }
    }

    fn prim(&mut self, parent: &str, prim: &UsdPrim) -> Node {
        let here = format!("{parent}/{}", prim.name);
        let path = self.path(&here);
        let mut fields = vec![("specifier", inline(kind::SPECIFIER, 0)), ("typeName", self.token(prim.type_name))];
        if !prim.schemas.is_empty() {
            const HAS_PREPENDED: u8 = 32;
            let schemas: Vec<u32> = prim.schemas.iter().map(|schema| self.token_index(schema)).collect();
            fields.push(("apiSchemas", self.list_op(kind::TOKEN_LIST_OP, HAS_PREPENDED, &schemas)));
        }
        let names: Vec<&str> = prim.properties.iter().map(|property| property.name.as_str()).collect();
        if !names.is_empty() {
            fields.push(("properties", self.token_vector(&names)));
        }
        let names: Vec<&str> = prim.children.iter().map(|child| child.name.as_str()).collect();
        if !names.is_empty() {
            fields.push(("primChildren", self.token_vector(&names)));
        }
        self.spec(path, spec::PRIM, fields);
        let mut children: Vec<Node> = prim.properties.iter().map(|property| self.property(&here, property)).collect();
        children.extend(prim.children.iter().map(|child| self.prim(&here, child)));
        Node { path, name: self.token_index(&prim.name), is_property: false, children }
    }

    fn property(&mut self, prim: &str, property: &Property) -> Node {
        let Property { name, type_name, is_uniform, interpolation, content } = property;
        let path = self.path(&format!("{prim}.{name}"));
        let mut fields = Vec::new();
        if let Content::Target(_) = content {
        } else {
            fields.push(("typeName", self.token(type_name)));
        }
        if *is_uniform {
            fields.push(("variability", inline(kind::VARIABILITY, 1)));
        }
        match interpolation {
            None => {}
            Some(UsdInterpolation::FaceVarying) => fields.push(("interpolation", self.token("faceVarying"))),
            Some(UsdInterpolation::Vertex(size)) => {
                fields.push(("interpolation", self.token("vertex")));
                if *size != 1 {
                    fields.push(("elementSize", inline(kind::INT, *size as u64)));
                }
            }
        }
        const IS_EXPLICIT: u8 = 1 | 2;
        let kind_of_spec = match content {
            Content::Target(target) => {
                let target = [self.path(target) as u32];
                fields.push(("targetPaths", self.list_op(kind::PATH_LIST_OP, IS_EXPLICIT, &target)));
                spec::RELATIONSHIP
            }
            Content::Connection(source) => {
                let source = [self.path(source) as u32];
                fields.push(("connectionPaths", self.list_op(kind::PATH_LIST_OP, IS_EXPLICIT, &source)));
                spec::ATTRIBUTE
            }
            Content::Nothing => spec::ATTRIBUTE,
            Content::Default(value) => {
                fields.push(("default", self.value(value)));
                spec::ATTRIBUTE
            }
            Content::Samples(samples) => {
                fields.push(("timeSamples", self.samples(samples)));
                spec::ATTRIBUTE
            }
        };
        self.spec(path, kind_of_spec, fields);
        Node { path, name: self.token_index(name), is_property: true, children: Vec::new() }
    }

    fn spec(&mut self, path: usize, kind: i32, fields: Vec<(&str, u64)>) {
        self.specs.push([path as i32, self.field_sets.len() as i32, kind]);
        for (name, value) in fields {
            let name = self.token_index(name);
            let field = self.fields.index((name, value));
            self.field_sets.push(field as i32);
        }
        self.field_sets.push(-1);
    }

    fn value(&mut self, value: &UsdValue) -> u64 {
        let floats = |rows: &[&[f32]]| -> Vec<u8> { rows.concat().iter().flat_map(|x| x.to_le_bytes()).collect() };
        fn bytes<const N: usize>(rows: &[[f32; N]]) -> Vec<u8> {
            rows.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect()
        }
        match value {
            UsdValue::Bool(value) => inline(kind::BOOL, u64::from(*value)),
            UsdValue::Float(value) => inline(kind::FLOAT, u64::from(value.to_bits())),
            UsdValue::Token(value) => self.token(value),
            UsdValue::Text(value) => self.string(value),
            UsdValue::Asset(value) => inline(kind::ASSET, u64::from(self.token_index(value))),
            UsdValue::Color(value) => {
                let at = self.place();
                self.out.extend(floats(&[value]));
                stored(kind::VEC_3F, at)
            }
            UsdValue::Vector4(value) => {
                let at = self.place();
                self.out.extend(floats(&[value]));
                stored(kind::VEC_4F, at)
            }
            UsdValue::Tokens(values) => {
                let tokens: Vec<u8> = values.iter().flat_map(|value| self.token_index(value).to_le_bytes()).collect();
                self.array(kind::TOKEN, values.len(), tokens)
            }
            UsdValue::Ints(values) => {
                self.array(kind::INT, values.len(), values.iter().flat_map(|x| x.to_le_bytes()).collect())
            }
            UsdValue::Floats(values) => self.array(kind::FLOAT, values.len(), floats(&[values])),
            UsdValue::UnitScales(count) => {
                const ONE: [u8; 2] = 0x3c00u16.to_le_bytes();
                self.array(kind::VEC_3H, *count, ONE.repeat(3 * count))
            }
            UsdValue::Vectors(values)
            | UsdValue::Points(values)
            | UsdValue::Normals(values)
            | UsdValue::Colors(values) => self.array(kind::VEC_3F, values.len(), bytes(values)),
            UsdValue::TexCoords(values) => self.array(kind::VEC_2F, values.len(), bytes(values)),
            UsdValue::Quaternions(values) => {
                let real_last: Vec<[f32; 4]> = values.iter().map(|&[w, x, y, z]| [x, y, z, w]).collect();
                self.array(kind::QUATERNION_F, values.len(), bytes(&real_last))
            }
            UsdValue::Matrices(values) => {
                let numbers = values.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
                self.array(kind::MATRIX_4D, values.len(), numbers)
            }
        }
    }

    /// The places of times and values, each relative to where it is written, before what they lead to.
    fn samples(&mut self, samples: &[(f64, UsdValue)]) -> u64 {
        let times = self.place();
        self.count(samples.len());
        samples.iter().for_each(|(time, _)| self.out.extend(time.to_le_bytes()));
        let values: Vec<u64> = samples.iter().map(|(_, value)| self.value(value)).collect();
        let at = self.place();
        self.out.extend(8i64.to_le_bytes());
        self.out.extend(stored(kind::DOUBLE_VECTOR, times).to_le_bytes());
        self.out.extend(8i64.to_le_bytes());
        self.count(values.len());
        values.iter().for_each(|value| self.out.extend(value.to_le_bytes()));
        stored(kind::TIME_SAMPLES, at)
    }

    fn array(&mut self, kind: u64, count: usize, bytes: Vec<u8>) -> u64 {
        if count == 0 {
            return IS_ARRAY | kind << 48;
        }
        let at = self.place();
        self.count(count);
        self.out.extend(bytes);
        stored(kind, at) | IS_ARRAY
    }

    fn list_op(&mut self, kind: u64, header: u8, items: &[u32]) -> u64 {
        let at = self.place();
        self.out.push(header);
        self.count(items.len());
        items.iter().for_each(|item| self.out.extend(item.to_le_bytes()));
        stored(kind, at)
    }

    fn token_vector(&mut self, names: &[&str]) -> u64 {
        let tokens: Vec<u32> = names.iter().map(|name| self.token_index(name)).collect();
        let at = self.place();
        self.count(tokens.len());
        tokens.iter().for_each(|token| self.out.extend(token.to_le_bytes()));
        stored(kind::TOKEN_VECTOR, at)
    }

    fn double(&mut self, value: f64) -> u64 {
        let at = self.place();
        self.out.extend(value.to_le_bytes());
        stored(kind::DOUBLE, at)
    }

    fn token(&mut self, text: &str) -> u64 {
        inline(kind::TOKEN, u64::from(self.token_index(text)))
    }

    fn string(&mut self, text: &str) -> u64 {
        inline(kind::STRING, u64::from(self.string_index(text)))
    }

    fn token_index(&mut self, text: &str) -> u32 {
        // The first token is empty: minus zero could not mark a property's name.
        if self.tokens.values.is_empty() {
            self.tokens.index(String::new());
        }
        self.tokens.index(text.into())
    }

    fn string_index(&mut self, text: &str) -> u32 {
        let token = self.token_index(text);
        self.strings.index(token)
    }

    fn path(&mut self, path: &str) -> usize {
        self.paths.index(path.into()) as usize
    }

    /// Where the next value begins.
    fn place(&mut self) -> usize {
        self.out.resize(self.out.len().next_multiple_of(8), 0);
        self.out.len()
    }

    fn count(&mut self, count: usize) {
        self.out.extend((count as u64).to_le_bytes());
    }

    fn packed(&mut self, bytes: &[u8]) {
        let packed = compressed(bytes);
        self.count(packed.len());
        self.out.extend(packed);
    }

    /// Appends the tables and their places, and writes the header.
    fn finish(mut self, root: &Node) -> Vec<u8> {
        let mut sections: Vec<(&str, usize, usize)> = Vec::new();
        let mut section = |file: &mut Self, name: &'static str, write: &mut dyn FnMut(&mut Self)| {
            let start = file.place();
            write(file);
            sections.push((name, start, file.out.len() - start));
        };
        section(&mut self, "TOKENS", &mut |file| {
            let texts: Vec<u8> = file.tokens.values.iter().flat_map(|text| [text.as_bytes(), &[0]].concat()).collect();
            file.count(file.tokens.values.len());
            file.count(texts.len());
            file.packed(&texts);
        });
        section(&mut self, "STRINGS", &mut |file| {
            file.count(file.strings.values.len());
            let tokens: Vec<u8> = file.strings.values.iter().flat_map(|token| token.to_le_bytes()).collect();
            file.out.extend(tokens);
        });
        section(&mut self, "FIELDS", &mut |file| {
            let names: Vec<i32> = file.fields.values.iter().map(|(name, _)| *name as i32).collect();
            let values: Vec<u8> = file.fields.values.iter().flat_map(|(_, value)| value.to_le_bytes()).collect();
            file.count(names.len());
            file.packed(&packed_integers(&names));
            file.packed(&values);
        });
        section(&mut self, "FIELDSETS", &mut |file| {
            file.count(file.field_sets.len());
            file.packed(&packed_integers(&file.field_sets.clone()));
        });
        section(&mut self, "PATHS", &mut |file| {
            let mut tree = [Vec::new(), Vec::new(), Vec::new()];
            flatten(root, false, &mut tree);
            file.count(file.paths.values.len());
            file.count(tree[0].len());
            tree.iter().for_each(|column| file.packed(&packed_integers(column)));
        });
        section(&mut self, "SPECS", &mut |file| {
            file.count(file.specs.len());
            for k in 0..3 {
                let column: Vec<i32> = file.specs.iter().map(|spec| spec[k]).collect();
                file.packed(&packed_integers(&column));
            }
        });
        let contents = self.place();
        self.count(sections.len());
        for (name, start, size) in sections {
            let mut padded = [0u8; 16];
            padded[..name.len()].copy_from_slice(name.as_bytes());
            self.out.extend(padded);
            self.count(start);
            self.count(size);
        }
        self.out[..8].copy_from_slice(b"PXR-USDC");
        self.out[8..11].copy_from_slice(&VERSION);
        self.out[16..24].copy_from_slice(&(contents as u64).to_le_bytes());
        self.out
    }
}

/// The tree of paths in depth-first order: path, name (negative for a property), and where the next sibling is: after so many
/// entries, 0 for the next entry where there are no children, −1 for children only, −2 for neither.
fn flatten(node: &Node, has_sibling: bool, tree: &mut [Vec<i32>; 3]) {
    let here = tree[0].len();
    tree[0].push(node.path as i32);
    tree[1].push(if node.is_property { -(node.name as i32) } else { node.name as i32 });
    tree[2].push(0);
    for (k, child) in node.children.iter().enumerate() {
        flatten(child, k + 1 < node.children.len(), tree);
    }
    tree[2][here] = match (node.children.is_empty(), has_sibling) {
        (false, true) => (tree[0].len() - here) as i32,
        (false, false) => -1,
        (true, true) => 0,
        (true, false) => -2,
    };
}

fn inline(kind: u64, payload: u64) -> u64 {
    IS_INLINE | kind << 48 | payload
}

fn stored(kind: u64, at: usize) -> u64 {
    kind << 48 | at as u64
}
