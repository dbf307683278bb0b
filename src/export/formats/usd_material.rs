//! A layer's material in USD: a preview surface.

use crate::body::Layer;
use crate::export::palette::{color_of_rank, roughness_of};
use crate::formats::{UsdPrim, UsdValue, linear_of_byte};

/// The pictures of a layer, by their paths relative to the file.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pictures<'a> {
    /// Its texture.
    pub color: Option<&'a str>,
    /// Its normal map.
    pub normals: Option<&'a str>,
}

/// A preview surface with the texture, the vertex colours, or one colour, and with the normal map. `path` is that of the prim.
pub(super) fn material_prim(layer: &Layer, name: &str, pictures: Pictures, rank: usize, path: &str) -> UsdPrim {
    let mut surface = UsdPrim::new("surface", "Shader", &[]);
    surface.uniform("info:id", UsdValue::Token("UsdPreviewSurface"));
    surface.attribute("inputs:roughness", UsdValue::Float(roughness_of(layer)));
    surface.output("outputs:surface", "token");
    let mut material = UsdPrim::new(name, "Material", &[]);
    material.connected("outputs:surface", "token", &format!("{path}/surface.outputs:surface"));
    if pictures.color.or(pictures.normals).is_some() {
        let mut coords = UsdPrim::new("coordinates", "Shader", &[]);
        coords.uniform("info:id", UsdValue::Token("UsdPrimvarReader_float2"));
        coords.attribute("inputs:varname", UsdValue::Text("st".into()));
        coords.output("outputs:result", "float2");
        material.add(coords);
    }
    if let Some(file) = pictures.color {
        material.add(picture_prim("picture", file, "sRGB", path));
        surface.connected("inputs:diffuseColor", "color3f", &format!("{path}/picture.outputs:rgb"));
    } else if layer.colors.is_some() {
        let mut colors = UsdPrim::new("colors", "Shader", &[]);
        colors.uniform("info:id", UsdValue::Token("UsdPrimvarReader_float3"));
        colors.attribute("inputs:varname", UsdValue::Text("displayColor".into()));
        colors.output("outputs:result", "float3");
        surface.connected("inputs:diffuseColor", "color3f", &format!("{path}/colors.outputs:result"));
        material.add(colors);
    } else {
        surface.attribute("inputs:diffuseColor", UsdValue::Color(linear(&color_of_rank(rank))));
    }
    if let Some(file) = pictures.normals {
        let mut picture = picture_prim("normal_map", file, "raw", path);
        // From 0 … 1 to −1 … 1.
        picture.attribute("inputs:scale", UsdValue::Vector4([2.0, 2.0, 2.0, 1.0]));
        picture.attribute("inputs:bias", UsdValue::Vector4([-1.0, -1.0, -1.0, 0.0]));
        material.add(picture);
        surface.connected("inputs:normal", "normal3f", &format!("{path}/normal_map.outputs:rgb"));
    }
    material.add(surface);
    material
}

fn picture_prim(name: &str, file: &str, color_space: &'static str, material: &str) -> UsdPrim {
    let mut picture = UsdPrim::new(name, "Shader", &[]);
    picture.uniform("info:id", UsdValue::Token("UsdUVTexture"));
    picture.attribute("inputs:file", UsdValue::Asset(file.into()));
    picture.attribute("inputs:sourceColorSpace", UsdValue::Token(color_space));
    picture.attribute("inputs:wrapS", UsdValue::Token("repeat"));
    picture.attribute("inputs:wrapT", UsdValue::Token("repeat"));
    picture.connected("inputs:st", "float2", &format!("{material}/coordinates.outputs:result"));
    picture.output("outputs:rgb", "float3");
    picture
}

pub(super) fn linear(srgb: &[u8; 3]) -> [f32; 3] {
    srgb.map(|byte| linear_of_byte(byte) as f32)
}
