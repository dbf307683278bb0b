//! The measures of a step, for a user who decides whether to scan it again.

use crate::session::{Stage, StepStatus};

/// The lines shown after a step was built: measures, findings and advice.
pub(super) fn lines(step: &StepStatus) -> Vec<String> {
    let value = |stage: Stage, name: &str| {
        step.up_to_date.iter().find(|r| r.stage == stage).and_then(|r| r.measures.get(name)).copied()
    };
    let mut parts = Vec::new();
    let mut add = |what: &str, value: Option<f64>, unit: &str| {
        parts.extend(value.map(|v| match v.fract() {
            0.0 => format!("{what} {v:.0}{unit}"),
            _ => format!("{what} {v:.1}{unit}"),
        }));
    };
    match step.template {
        None => {
            add("mean distance from body to scan:", value(Stage::Register, "residual_mean_mm"), " mm");
            add("95 % of the body within", value(Stage::Register, "residual_p95_mm"), " mm");
        }
        Some(_) => {
            add("skin pokes through the scan:", value(Stage::Pose, "outside_percent"), " %");
            add("hem loops:", value(Stage::Cut, "hem_loops"), "");
            add("crossing triangle pairs:", value(Stage::Stack, "intersecting_pairs"), "");
            add("corrected by hand:", value(Stage::Segment, "by_hand_vertices"), " vertices");
        }
    }
    // The assumptions about the file and the findings of the cut; `status` reports the convergence of fits.
    let read_first = |stage: Stage| matches!(stage, Stage::Scan | Stage::Cut);
    let findings: Vec<&String> =
        step.up_to_date.iter().filter(|r| read_first(r.stage)).flat_map(|r| &r.findings).collect();
    let verdict = step.verdict.as_ref().map_or_else(|| "not built".to_string(), |verdict| verdict.to_string());
    let mut lines = vec![format!("{}: {verdict}", step.name)];
    lines.extend(step.warnings.iter().skip(1).map(|warning| format!("  also: {warning}")));
    lines.push(format!("  {}", parts.join("; ")));
    lines.extend(findings.iter().map(|f| format!("  {f}")));
    lines.push(match step.template {
        None => "Check it with `view`: is the whole body there, and every limb in place? If not, type `again`.".into(),
        Some(_) => format!(
            "Check it with `view`. If {0} is cut wrongly: `paint` opens a page to correct it on; `mask` takes a file painted elsewhere. Or `again`.",
            step.name
        ),
    });
    lines
}
