//! Text within a page.

use std::fmt::Write;

/// Text as HTML, for content and for quoted attributes.
pub(super) fn escaped(text: &str) -> String {
    let mut html = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => html.push_str("&amp;"),
            '<' => html.push_str("&lt;"),
            '>' => html.push_str("&gt;"),
            '"' => html.push_str("&quot;"),
            '\'' => html.push_str("&#39;"),
            c => html.push(c),
        }
    }
    html
}

/// JSON within a `script` element, which only `<` could end.
pub(super) fn json_in_script(value: &serde_json::Value) -> String {
    value.to_string().replace('<', "\\u003c")
}

/// A table with a head; cells are HTML already, and the first of each row heads it.
pub(super) fn table(head: &[&str], rows: &[Vec<String>]) -> String {
    let mut html = String::from("<div class=\"wide\" tabindex=\"0\"><table><thead><tr>");
    html.extend(head.iter().map(|cell| format!("<th scope=\"col\">{cell}</th>")));
    html.push_str("</tr></thead><tbody>");
    for row in rows {
        html.push_str("<tr>");
        for (k, cell) in row.iter().enumerate() {
            let tag = if k == 0 { "th scope=\"row\"" } else { "td" };
            let end = if k == 0 { "th" } else { "td" };
            let _ = write!(html, "<{tag}>{cell}</{end}>");
        }
        html.push_str("</tr>");
    }
    html.push_str("</tbody></table></div>");
    html
}

/// Modules of JavaScript as one: each may import only from those before it.
///
/// A page in one file cannot import from files, so the lines that import are left out, and `export` before a declaration.
pub(super) fn one_module(modules: &[&str]) -> String {
    let lines = modules.iter().flat_map(|module| module.lines());
    let lines = lines.filter(|line| !line.starts_with("import "));
    lines.map(|line| line.strip_prefix("export ").unwrap_or(line).to_string() + "\n").collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_cannot_become_markup() {
        let name = "<img src=x onerror='alert(1)'>&\"";
        let html = escaped(name);
        assert!(!html.contains(['<', '>', '"', '\'']), "{html}");
        assert_eq!(table(&["a"], &[vec![html.clone()]]).matches("&lt;img").count(), 1);
        let json = json_in_script(&serde_json::json!({ "name": "</script><b>" }));
        assert!(!json.contains('<') && json.contains("\\u003c/script>"), "{json}");
        let back: serde_json::Value = serde_json::from_str(&json).unwrap();
        assert_eq!(back["name"], "</script><b>");
    }

    #[test]
    fn modules_become_one_without_imports_and_exports() {
        let one =
            one_module(&["export const a = 1;\n", "import { a } from \"./a.js\";\nexport function b() { return a; }"]);
        assert_eq!(one, "const a = 1;\nfunction b() { return a; }\n");
    }
}
