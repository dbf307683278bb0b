//! Pictures as SVG text.

use std::fmt::Write;

/// Colours that are told apart, also by the colour-blind (Okabe and Ito).
const COLORS: [&str; 8] = ["#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#7f7f00", "#555555"];

pub fn color(k: usize) -> &'static str {
    COLORS[k % COLORS.len()]
}

pub struct Svg {
    size: [f64; 2],
    body: String,
}

impl Svg {
    pub fn new(width: f64, height: f64) -> Self {
        Self { size: [width, height], body: String::new() }
    }

    pub fn rect(&mut self, [x, y]: [f64; 2], [w, h]: [f64; 2], fill: &str) {
        let _ = writeln!(self.body, r#"<rect x="{x:.1}" y="{y:.1}" width="{w:.1}" height="{h:.1}" fill="{fill}"/>"#);
    }

    pub fn dot(&mut self, [x, y]: [f64; 2], radius: f64, fill: &str) {
        let _ =
            writeln!(self.body, r#"<circle cx="{x:.1}" cy="{y:.1}" r="{radius}" fill="{fill}" fill-opacity="0.75"/>"#);
    }

    pub fn line(&mut self, points: &[[f64; 2]], stroke: &str, width: f64) {
        let all: Vec<String> = points.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
        let all = all.join(" ");
        let _ =
            writeln!(self.body, r#"<polyline points="{all}" fill="none" stroke="{stroke}" stroke-width="{width}"/>"#);
    }

    /// `anchor`: start, middle or end.
    pub fn text(&mut self, [x, y]: [f64; 2], size: f64, anchor: &str, text: &str) {
        let text = text.replace('&', "&amp;").replace('<', "&lt;");
        let _ = writeln!(
            self.body,
            r##"<text x="{x:.1}" y="{y:.1}" font-size="{size}" text-anchor="{anchor}" fill="#222">{text}</text>"##
        );
    }

    pub fn end(self) -> String {
        let [w, h] = self.size;
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {w} {h}\" font-family=\"sans-serif\">\n<rect width=\"{w}\" height=\"{h}\" fill=\"#fff\"/>\n{}</svg>\n",
            self.body
        )
    }
}
