//! USD layers: a tree of prims, written as text (`.usda`), as a crate file (`.usdc`), or packed with pictures (`.usdz`).
//!
//! Own code: of the crates that were tried, `openusd` 0.6 writes crate files that OpenUSD refuses (its lists of children have
//! the wrong type, and OpenUSD reads other numbers from its compressed arrays than were written).

mod binary;
mod coding;
mod package;
#[cfg(test)]
mod tests;
mod text;

pub use package::write_usd_package;

use std::collections::{BTreeMap, BTreeSet};

/// A value of an attribute, with the type that USD gives it.
#[derive(Clone, Debug, PartialEq)]
pub enum UsdValue {
    /// `bool`
    Bool(bool),
    /// `float`
    Float(f32),
    /// `token`
    Token(&'static str),
    /// `string`
    Text(String),
    /// `asset`: the path of another file, relative to this one
    Asset(String),
    /// `color3f`
    Color([f32; 3]),
    /// `float4`
    Vector4([f32; 4]),
    /// `token[]`
    Tokens(Vec<String>),
    /// `int[]`
    Ints(Vec<i32>),
    /// `float[]`
    Floats(Vec<f32>),
    /// `float3[]`
    Vectors(Vec<[f32; 3]>),
    /// `half3[]` of so many scales of 1
    UnitScales(usize),
    /// `point3f[]`
    Points(Vec<[f32; 3]>),
    /// `normal3f[]`
    Normals(Vec<[f32; 3]>),
    /// `color3f[]`, linear
    Colors(Vec<[f32; 3]>),
    /// `texCoord2f[]`, from the lower left
    TexCoords(Vec<[f32; 2]>),
    /// `quatf[]`: w, x, y, z
    Quaternions(Vec<[f32; 4]>),
    /// `matrix4d[]` for row vectors, row by row
    Matrices(Vec<[f64; 16]>),
}

impl UsdValue {
    /// The number of values of an array; `None` for a single value.
    pub fn value_count(&self) -> Option<usize> {
        Some(match self {
            Self::Bool(_) | Self::Float(_) | Self::Token(_) | Self::Text(_) | Self::Asset(_) => return None,
            Self::Color(_) | Self::Vector4(_) => return None,
            Self::Tokens(values) => values.len(),
            Self::Ints(values) => values.len(),
            Self::Floats(values) => values.len(),
            Self::Vectors(values) | Self::Points(values) | Self::Normals(values) | Self::Colors(values) => values.len(),
            Self::UnitScales(count) => *count,
            Self::TexCoords(values) => values.len(),
            Self::Quaternions(values) => values.len(),
            Self::Matrices(values) => values.len(),
        })
    }

    fn type_name(&self) -> &'static str {
        match self {
            Self::Bool(_) => "bool",
            Self::Float(_) => "float",
            Self::Token(_) => "token",
            Self::Text(_) => "string",
            Self::Asset(_) => "asset",
            Self::Color(_) => "color3f",
            Self::Vector4(_) => "float4",
            Self::Tokens(_) => "token[]",
            Self::Ints(_) => "int[]",
            Self::Floats(_) => "float[]",
            Self::Vectors(_) => "float3[]",
            Self::UnitScales(_) => "half3[]",
            Self::Points(_) => "point3f[]",
            Self::Normals(_) => "normal3f[]",
            Self::Colors(_) => "color3f[]",
            Self::TexCoords(_) => "texCoord2f[]",
            Self::Quaternions(_) => "quatf[]",
            Self::Matrices(_) => "matrix4d[]",
        }
    }
}

/// How values of an attribute belong to a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UsdInterpolation {
    /// So many values for each vertex.
    Vertex(i32),
    /// One for each corner of each face.
    FaceVarying,
}

/// What a property holds.
#[derive(Clone, Debug)]
enum Content {
    Default(UsdValue),
    Samples(Vec<(f64, UsdValue)>),
    /// The value is that of another attribute, by its path.
    Connection(String),
    Nothing,
    /// A relationship to a prim, by its path.
    Target(String),
}

#[derive(Clone, Debug)]
struct Property {
    name: String,
    type_name: &'static str,
    is_uniform: bool,
    interpolation: Option<UsdInterpolation>,
    content: Content,
}

/// A prim with its properties and the prims below it.
///
/// **Requires** names of prims that [`usd_names`] made, and no two properties or children of one name.
#[derive(Clone, Debug)]
pub struct UsdPrim {
    name: String,
    type_name: &'static str,
    schemas: Vec<&'static str>,
    properties: Vec<Property>,
    children: Vec<UsdPrim>,
}

impl UsdPrim {
    /// A prim without properties, with the API schemas that are applied to it.
    pub fn new(name: &str, type_name: &'static str, schemas: &[&'static str]) -> Self {
        let (name, schemas) = (name.to_string(), schemas.to_vec());
        Self { name, type_name, schemas, properties: Vec::new(), children: Vec::new() }
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The name of its schema.
    pub fn type_name(&self) -> &str {
        self.type_name
    }

    /// The API schemas that are applied to it.
    pub fn schemas(&self) -> &[&'static str] {
        &self.schemas
    }

    /// The prims below it.
    pub fn children(&self) -> &[UsdPrim] {
        &self.children
    }

    /// The names of its attributes and relationships.
    pub fn property_names(&self) -> impl Iterator<Item = &str> {
        self.properties.iter().map(|property| property.name.as_str())
    }

    /// The value of an attribute, its first where it has several over time.
    pub fn value(&self, name: &str) -> Option<&UsdValue> {
        match &self.properties.iter().find(|property| property.name == name)?.content {
            Content::Default(value) => Some(value),
            Content::Samples(samples) => samples.first().map(|(_, value)| value),
            Content::Connection(_) | Content::Nothing | Content::Target(_) => None,
        }
    }

    /// How the values of an attribute belong to the surface.
    pub fn interpolation(&self, name: &str) -> Option<UsdInterpolation> {
        self.properties.iter().find(|property| property.name == name)?.interpolation
    }

    /// The paths that its properties name.
    pub fn targets(&self) -> impl Iterator<Item = &str> {
        self.properties.iter().filter_map(|property| match &property.content {
            Content::Connection(path) | Content::Target(path) => Some(path.as_str()),
            _ => None,
        })
    }

    /// Adds a prim below this one.
    pub fn add(&mut self, child: UsdPrim) {
        self.children.push(child);
    }

    /// Adds an attribute that may vary over time.
    pub fn attribute(&mut self, name: &str, value: UsdValue) {
        self.property(name, value.type_name(), Content::Default(value));
    }

    /// Adds an attribute that is the same at all times.
    pub fn uniform(&mut self, name: &str, value: UsdValue) {
        self.property(name, value.type_name(), Content::Default(value)).is_uniform = true;
    }

    /// Adds an attribute of a surface's vertices or corners.
    pub fn interpolated(&mut self, name: &str, value: UsdValue, interpolation: UsdInterpolation) {
        let property = self.property(name, value.type_name(), Content::Default(value));
        property.interpolation = Some(interpolation);
    }

    /// Adds an attribute with a value at each time code; nothing without values.
    ///
    /// **Requires** values of one type, in the order of time.
    pub fn samples(&mut self, name: &str, values: Vec<(f64, UsdValue)>) {
        if let Some(type_name) = values.first().map(|(_, value)| value.type_name()) {
            self.property(name, type_name, Content::Samples(values));
        }
    }

    /// Adds an attribute whose value is that of the attribute at a path.
    pub fn connected(&mut self, name: &str, type_name: &'static str, source: &str) {
        self.property(name, type_name, Content::Connection(source.into()));
    }

    /// Adds an attribute without a value, to be connected to.
    pub fn output(&mut self, name: &str, type_name: &'static str) {
        self.property(name, type_name, Content::Nothing);
    }

    /// Adds a relationship to the prim at a path.
    pub fn relationship(&mut self, name: &str, target: &str) {
        self.property(name, "", Content::Target(target.into())).is_uniform = true;
    }

    fn property(&mut self, name: &str, type_name: &'static str, content: Content) -> &mut Property {
        self.properties.push(Property {
            name: name.into(),
            type_name,
            is_uniform: false,
            interpolation: None,
            content,
        });
        let last = self.properties.len() - 1;
        &mut self.properties[last]
    }
}

/// A layer: one prim at the root, and what is said about the whole.
#[derive(Clone, Debug)]
pub struct UsdLayer {
    /// The only prim at the root.
    pub root: UsdPrim,
    /// The axis that points up: `Y` or `Z`.
    pub up_axis: &'static str,
    /// Length of a unit in metres.
    pub meters_per_unit: f64,
    /// First and last time code, and codes per second; `None` for a scene without motion.
    pub time_codes: Option<([f64; 2], f64)>,
    /// What the file says about itself.
    pub documentation: String,
    /// Further keys and texts about the file.
    pub extras: BTreeMap<String, String>,
}

/// Names of prims for any names: letters, digits and underscores of ASCII, no digit first, no two equal.
pub fn usd_names<'a>(names: impl IntoIterator<Item = &'a str>) -> Vec<String> {
    let mut taken = BTreeSet::new();
    let mut unique = |name: &str| {
        let mut clean: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
        if clean.chars().next().is_none_or(|first| first.is_ascii_digit()) {
            clean.insert(0, '_');
        }
        let mut free = clean.clone();
        let mut count = 1;
        while !taken.insert(free.clone()) {
            count += 1;
            free = format!("{clean}_{count}");
        }
        free
    };
    names.into_iter().map(&mut unique).collect()
}
