//! `overcoat report`: the session as one page that needs nothing else.

use super::error::DeskError;
use super::html::{escaped, json_in_script, one_module};
use super::marks::{Mark, crossings, of_step};
use super::pack::{Packer, base64};
use super::pictures::stills;
use super::{scenes, tables};
use crate::check::Verdict;
use crate::session::{AnimationStatus, Session, Shown, ShownStep};
use crate::view::ease_legend;
use serde_json::json;
use std::fmt::Write;

/// Width of the film of an animation, in pixels.
const FILM_WIDTH: usize = 240;

const PAGE: &str = include_str!("pages/report.html");
pub(super) const STYLE: &str = include_str!("pages/page.css");
const MODULES: [&str; 4] = [
    include_str!("pages/pack.js"),
    include_str!("pages/math.js"),
    include_str!("pages/viewer.js"),
    include_str!("pages/report.js"),
];

/// The page. Loads what is built and runs nothing.
///
/// **Errors** for a session without a step.
pub fn report_page(session: &Session) -> Result<String, DeskError> {
    let shown = session.shown()?;
    let eases = shown.figure.as_ref().map(scenes::eases).unwrap_or_default();
    let crossings = shown.figure.as_ref().map(crossings).transpose()?.unwrap_or_default();
    let mut packer = Packer::default();
    let scenes = scenes::scenes(&shown, &eases, &crossings, &mut packer);
    let geometry = base64(&packer.finish().map_err(DeskError::Packing)?);
    let scene = json!({ "scenes": scenes, "ease": ease_legend() });
    let mut steps = String::new();
    for (k, step) in shown.steps.iter().enumerate() {
        let at = k + usize::from(shown.figure.is_some());
        steps += &step_section(step, k, at)?;
    }
    let parts = [
        ("TITLE", escaped(&shown.name)),
        ("STYLE", STYLE.to_string()),
        ("SUMMARY", summary(&shown)),
        ("VERDICTS", verdicts(&shown)),
        ("CROSSINGS", crossing_list(&shown, &crossings)),
        ("LAYERS", tables::layers(&shown, &eases)),
        ("STEPS", steps),
        ("MOTION", motion(&shown, session)?),
        ("TIMINGS", tables::timings(&shown)),
        ("PROVENANCE", tables::provenance(&shown, session)),
        ("SCENE", json_in_script(&scene)),
        ("GEOMETRY", geometry),
        ("SCRIPT", one_module(&MODULES)),
    ];
    Ok(filled(PAGE, &parts))
}

/// A page with its places `{{NAME}}` filled; what is filled in is not searched again.
pub(super) fn filled(page: &str, parts: &[(&str, String)]) -> String {
    let mut rest = page;
    let mut html = String::new();
    while let Some((before, after)) = rest.split_once("{{") {
        html.push_str(before);
        let (name, after) = after.split_once("}}").unwrap_or((after, ""));
        html.extend(parts.iter().find(|(part, _)| *part == name).map(|(_, text)| text.as_str()));
        rest = after;
    }
    html + rest
}

fn summary(shown: &Shown) -> String {
    let good = shown.steps.iter().filter(|step| step.status.verdict.as_ref().is_some_and(Verdict::is_good)).count();
    let layers = shown.figure.as_ref().map_or(0, |figure| figure.layers.len());
    let steps = shown.steps.len();
    let after = shown.change.as_ref().map(|(n, change)| format!(", after change {n}: {}", escaped(change)));
    format!(
        "{good} of {steps} steps {} good; {layers} {}{}",
        if good == 1 { "is" } else { "are" },
        if layers == 1 { "layer" } else { "layers" },
        after.unwrap_or_default()
    )
}

/// The class of a verdict, and its text as `status` says it.
fn verdict_of(step: &ShownStep) -> (&'static str, String) {
    match &step.status.verdict {
        Some(verdict @ Verdict::Good) => ("good", verdict.to_string()),
        Some(verdict @ Verdict::Check(_)) => ("doubt", verdict.to_string()),
        Some(verdict @ Verdict::Failed(_)) => ("bad", verdict.to_string()),
        None => ("waits", "out of date: run `overcoat build`".into()),
    }
}

fn verdicts(shown: &Shown) -> String {
    let mut html = String::from("<ul class=\"verdicts\">");
    for (k, step) in shown.steps.iter().enumerate() {
        let (class, text) = verdict_of(step);
        let name = escaped(&step.status.name);
        let _ = write!(html, "<li class=\"{class}\"><a href=\"#step-{k}\">{name}</a> {}", escaped(&text));
        for warning in step.status.warnings.iter().skip(1) {
            let _ = write!(html, "<br><small>also: {}</small>", escaped(warning));
        }
        html.push_str("</li>");
    }
    html + "</ul>"
}

fn crossing_list(shown: &Shown, crossings: &[Mark]) -> String {
    match (shown.figure.is_some(), crossings.is_empty()) {
        (false, _) => "<p>Nothing is built yet.</p>".into(),
        (true, true) => "<p>No layers cross in the bind pose.</p>".into(),
        (true, false) => format!("<p>Layers cross in the bind pose:</p>{}", mark_list(crossings, 0)),
    }
}

/// Buttons that show the places of a scene.
fn mark_list(marks: &[Mark], scene: usize) -> String {
    let button = |(k, mark): (usize, &Mark)| {
        format!(
            "<li><button type=\"button\" class=\"mark\" data-scene=\"{scene}\" data-mark=\"{k}\">{}</button></li>",
            escaped(&mark.text)
        )
    };
    format!("<ul class=\"marks\">{}</ul>", marks.iter().enumerate().map(button).collect::<String>())
}

/// Step number `k`, which the viewer shows as scene number `scene`.
fn step_section(step: &ShownStep, k: usize, scene: usize) -> Result<String, DeskError> {
    let (class, verdict) = verdict_of(step);
    let (name, status) = (escaped(&step.status.name), &step.status);
    let kind = status.template.as_ref().filter(|kind| **kind != status.name).map(|kind| format!(", {}", escaped(kind)));
    let masks = match status.masks {
        0 => String::new(),
        1 => ", corrected by 1 mask".into(),
        n => format!(", corrected by {n} masks"),
    };
    let mut html = format!(
        "<section class=\"step\" id=\"step-{k}\"><h3>{name}</h3><p class=\"{class}\">{}</p><p class=\"source\">{}{}{masks}</p>",
        escaped(&verdict),
        escaped(&step.file),
        kind.unwrap_or_default()
    );
    html.push_str("<div class=\"strip\">");
    for still in stills(step)? {
        let _ = write!(
            html,
            "<figure><img src=\"{}\" alt=\"{name}: {}\" width=\"250\" height=\"380\"><figcaption>{}</figcaption></figure>",
            still.address, still.caption, still.caption
        );
    }
    html.push_str("</div>");
    let _ =
        write!(html, "<p><button type=\"button\" class=\"show\" data-scene=\"{scene}\">Show {name} in 3D</button></p>");
    let marks = of_step(step);
    if !marks.is_empty() {
        html += &mark_list(&marks, scene);
    }
    html += &tables::measures(step);
    html += &tables::findings(step);
    Ok(html + "</section>")
}

/// The animations, with a film of the first that is up to date.
fn motion(shown: &Shown, session: &Session) -> Result<String, DeskError> {
    if shown.animations.is_empty() {
        return Ok(String::new());
    }
    let line = |animation: &AnimationStatus| {
        let state = match (&animation.made, &animation.failed) {
            (Some(_), _) => "up to date".to_string(),
            (None, Some(what)) => format!("failed: {}", escaped(what)),
            (None, None) => "out of date".to_string(),
        };
        format!("<li>{}: {state}</li>", escaped(&animation.name))
    };
    let mut html = String::from("<section><h2>Motion</h2><ul>");
    shown.animations.iter().for_each(|animation| html += &line(animation));
    html.push_str("</ul>");
    if let Some(made) = shown.animations.iter().find(|animation| animation.made.is_some()) {
        let gif = session.short_film(&made.name, FILM_WIDTH)?;
        let name = escaped(&made.name);
        let _ = write!(
            html,
            "<figure><img src=\"data:image/gif;base64,{}\" alt=\"the figure moves: {name}\"><figcaption>{name}, the first seconds</figcaption></figure>",
            base64(&gif)
        );
    }
    Ok(html + "</section>")
}
