//! Layers as text, `.usda`.

use super::{Content, Property, UsdInterpolation, UsdLayer, UsdPrim, UsdValue};
use std::fmt::{Display, Write};

impl UsdLayer {
    /// The layer as text.
    pub fn to_text(&self) -> Vec<u8> {
        let mut out = String::from("#usda 1.0\n(\n");
        line(&mut out, 1, format_args!("defaultPrim = {}", quoted(&self.root.name)));
        line(&mut out, 1, format_args!("doc = {}", quoted(&self.documentation)));
        if !self.extras.is_empty() {
            line(&mut out, 1, "customLayerData = {");
            for (key, text) in &self.extras {
                line(&mut out, 2, format_args!("string {} = {}", quoted(key), quoted(text)));
            }
            line(&mut out, 1, "}");
        }
        line(&mut out, 1, format_args!("metersPerUnit = {}", self.meters_per_unit));
        if let Some(([start, end], per_second)) = self.time_codes {
            line(&mut out, 1, format_args!("startTimeCode = {start}"));
            line(&mut out, 1, format_args!("endTimeCode = {end}"));
            line(&mut out, 1, format_args!("timeCodesPerSecond = {per_second}"));
            line(&mut out, 1, format_args!("framesPerSecond = {per_second}"));
        }
        line(&mut out, 1, format_args!("upAxis = {}", quoted(self.up_axis)));
        out.push_str(")\n\n");
        prim(&mut out, 0, &self.root);
        out.into_bytes()
    }
}

fn line(out: &mut String, depth: usize, text: impl Display) {
    // Writing to a string cannot fail.
    let _ = writeln!(out, "{:1$}{text}", "", 4 * depth);
}

fn prim(out: &mut String, depth: usize, prim_: &UsdPrim) {
    let UsdPrim { name, type_name, schemas, properties, children } = prim_;
    if schemas.is_empty() {
        line(out, depth, format_args!("def {type_name} \"{name}\""));
    } else {
        let schemas: Vec<String> = schemas.iter().map(|schema| quoted(schema)).collect();
        line(out, depth, format_args!("def {type_name} \"{name}\" ("));
        line(out, depth + 1, format_args!("prepend apiSchemas = [{}]", schemas.join(", ")));
        line(out, depth, ")");
    }
    line(out, depth, "{");
    properties.iter().for_each(|property| attribute(out, depth + 1, property));
    for child in children {
        out.push('\n');
        prim(out, depth + 1, child);
    }
    line(out, depth, "}");
}

fn attribute(out: &mut String, depth: usize, property: &Property) {
    let Property { name, type_name, is_uniform, interpolation, content } = property;
    let uniform = if *is_uniform { "uniform " } else { "" };
    match content {
        Content::Target(path) => line(out, depth, format_args!("rel {name} = <{path}>")),
        Content::Connection(path) => line(out, depth, format_args!("{type_name} {name}.connect = <{path}>")),
        Content::Nothing => line(out, depth, format_args!("{type_name} {name}")),
        Content::Default(value) => {
            let value = text_of(value);
            match interpolation {
                None => line(out, depth, format_args!("{uniform}{type_name} {name} = {value}")),
                Some(interpolation) => {
                    line(out, depth, format_args!("{uniform}{type_name} {name} = {value} ("));
                    match interpolation {
                        UsdInterpolation::FaceVarying => line(out, depth + 1, "interpolation = \"faceVarying\""),
                        UsdInterpolation::Vertex(size) => {
                            if *size != 1 {
                                line(out, depth + 1, format_args!("elementSize = {size}"));
                            }
                            line(out, depth + 1, "interpolation = \"vertex\"");
                        }
                    }
                    line(out, depth, ")");
                }
            }
        }
        Content::Samples(samples) => {
            line(out, depth, format_args!("{uniform}{type_name} {name}.timeSamples = {{"));
            for (time, value) in samples {
                line(out, depth + 1, format_args!("{time}: {},", text_of(value)));
            }
            line(out, depth, "}");
        }
    }
}

fn text_of(value: &UsdValue) -> String {
    match value {
        UsdValue::Bool(value) => if *value { "true" } else { "false" }.into(),
        UsdValue::Float(value) => value.to_string(),
        UsdValue::Token(value) => quoted(value),
        UsdValue::Text(value) => quoted(value),
        // A path with this sign would end early.
        UsdValue::Asset(value) if value.contains('@') => format!("@@@{value}@@@"),
        UsdValue::Asset(value) => format!("@{value}@"),
        UsdValue::Color(value) => tuple(value),
        UsdValue::Vector4(value) => tuple(value),
        UsdValue::Tokens(values) => list(values, |out, value| out.push_str(&quoted(value))),
        UsdValue::Ints(values) => list(values, |out, value| out.push_str(&value.to_string())),
        UsdValue::Floats(values) => list(values, |out, value| out.push_str(&value.to_string())),
        UsdValue::UnitScales(count) => list(&vec![[1.0f32; 3]; *count], |out, value| out.push_str(&tuple(value))),
        UsdValue::Vectors(values) | UsdValue::Points(values) | UsdValue::Normals(values) | UsdValue::Colors(values) => {
            list(values, |out, value| out.push_str(&tuple(value)))
        }
        UsdValue::TexCoords(values) => list(values, |out, value| out.push_str(&tuple(value))),
        UsdValue::Quaternions(values) => list(values, |out, value| out.push_str(&tuple(value))),
        UsdValue::Matrices(values) => list(values, |out, value| {
            let rows: Vec<String> = value.chunks(4).map(tuple).collect();
            out.push_str(&format!("({})", rows.join(", ")));
        }),
    }
}

fn tuple(values: &[impl Display]) -> String {
    let mut out = String::from("(");
    for (k, value) in values.iter().enumerate() {
        let _ = write!(out, "{}{value}", if k > 0 { ", " } else { "" });
    }
    out + ")"
}

fn list<T>(values: &[T], write: impl Fn(&mut String, &T)) -> String {
    let mut out = String::from("[");
    for (k, value) in values.iter().enumerate() {
        if k > 0 {
            out.push_str(", ");
        }
        write(&mut out, value);
    }
    out + "]"
}

fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            '\n' => out.push_str("\\n"),
            '\r' => out.push_str("\\r"),
            '\t' => out.push_str("\\t"),
            other => out.push(other),
        }
    }
    out + "\""
}
