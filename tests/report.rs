//! `report`: one page that needs nothing else.

use crate::common::{built_quick_session, fingerprint, overcoat, overcoat_ok, quick_session};
use std::path::PathBuf;

/// The text of the element with this id, up to its end.
fn element<'a>(page: &'a str, id: &str) -> &'a str {
    let (_, after) = page.split_once(&format!("id=\"{id}\">")).unwrap();
    after.split_once("</script>").unwrap().0
}

#[test]
fn a_report_holds_everything_and_changes_no_artefact() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_quick_session(dir.path(), "alice");
    let before = fingerprint(&session);
    let done = overcoat_ok(&session, &["report", "--json"]).json();
    let page = std::fs::read_to_string(session.join("report.html")).unwrap();
    assert_eq!(done["bytes"], page.len());
    assert!(page.len() < 6_000_000, "{}", page.len());
    let mut after = fingerprint(&session);
    for own in ["outputs.json", "report.html"] {
        after.remove(&PathBuf::from(own));
    }
    assert_eq!(after, before);
    // Nothing is loaded from elsewhere, and every place of the page is filled.
    for outside in ["http://", "https://", "src=\"/", "{{TITLE", "{{SCENE", "import {"] {
        assert!(!page.contains(outside), "{outside}");
    }
    let status = overcoat_ok(&session, &["status", "--json"]).json();
    let escaped = |text: &str| text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    for step in status["steps"].as_array().unwrap() {
        let (name, verdict) = (step["name"].as_str().unwrap(), step["verdict"].as_str().unwrap());
        assert!(page.contains(&format!(">{name}</a> {}", escaped(verdict))), "{name}: {verdict}");
        let file = PathBuf::from(step["scan"].as_str().unwrap());
        assert!(page.contains(&*file.file_name().unwrap().to_string_lossy()));
        assert!(
            !page.contains(&*file.parent().unwrap().to_string_lossy()) || file.parent().unwrap().as_os_str().is_empty()
        );
    }
    let scenes: serde_json::Value = serde_json::from_str(element(&page, "scene-data")).unwrap();
    let names = |scene: &serde_json::Value| {
        let parts = scene["parts"].as_array().unwrap().iter();
        parts.map(|part| part["name"].as_str().unwrap().to_string()).collect::<Vec<_>>()
    };
    assert_eq!(names(&scenes["scenes"][0]), ["body", "tshirt"]);
    assert_eq!(names(&scenes["scenes"][2]), ["body", "tshirt", "scan"]);
    assert_eq!(scenes["scenes"][2]["hems"].as_array().unwrap().len() as u64, hems(&status));
    // A second report replaces the first with the same bytes.
    overcoat_ok(&session, &["report"]);
    assert!(std::fs::read_to_string(session.join("report.html")).unwrap() == page);
}

fn hems(status: &serde_json::Value) -> u64 {
    let judged = status["steps"][1]["judged"].as_array().unwrap();
    judged.iter().find(|judged| judged["measure"] == "hem_loops").unwrap()["value"].as_f64().unwrap() as u64
}

#[test]
fn a_report_replaces_no_foreign_file_and_is_a_page() {
    let dir = tempfile::tempdir().unwrap();
    let session = quick_session(dir.path(), "alice");
    std::fs::write(session.join("report.html"), "mine").unwrap();
    let refused = overcoat(&session, &["report"]);
    assert_eq!(refused.code, 2, "{refused:?}");
    assert!(refused.stderr.contains("--force"), "{refused:?}");
    assert_eq!(std::fs::read_to_string(session.join("report.html")).unwrap(), "mine");
    let refused = overcoat(&session, &["report", "report.txt"]);
    assert!(refused.code == 2 && refused.stderr.contains(".html"), "{refused:?}");
    // What is not built yet is said, not left out.
    overcoat_ok(&session, &["report", "--force"]);
    let page = std::fs::read_to_string(session.join("report.html")).unwrap();
    assert!(page.contains("</a> out of date: run `overcoat build`") && page.contains("Nothing is built yet"));
    overcoat_ok(dir.path(), &["new", "empty"]);
    let refused = overcoat(&dir.path().join("empty"), &["report"]);
    assert!(refused.code != 0 && refused.stderr.contains("hint:"), "{refused:?}");
}
