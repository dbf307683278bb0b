//! What a step measured, in the words of a person who wants to know whether to scan it again.

use crate::session::{Stage, StepStatus};

/// Lines to read after a step was built: what was measured, noticed, and what to look at.
pub(super) fn lines(step: &StepStatus) -> Vec<String> {
    let value = |stage: Stage, name: &str| {
        step.standing.iter().find(|r| r.stage == stage).and_then(|r| r.measures.get(name)).copied()
    };
    let mut told = Vec::new();
    let mut tell = |what: &str, value: Option<f64>, unit: &str| {
        told.extend(value.map(|v| match v.fract() {
            0.0 => format!("{what} {v:.0}{unit}"),
            _ => format!("{what} {v:.1}{unit}"),
        }));
    };
    match step.template {
        None => {
            tell("the body lies", value(Stage::Register, "residual_mean_mm"), " mm from the scan on the mean");
            tell("95 % of it within", value(Stage::Register, "residual_p95_mm"), " mm");
        }
        Some(_) => {
            tell("skin seen outside the scan:", value(Stage::Pose, "outside_percent"), " %");
            tell("hems:", value(Stage::Cut, "hem_loops"), "");
            tell("triangles that cross:", value(Stage::Stack, "intersecting_pairs"), "");
            tell("by hand:", value(Stage::Segment, "by_hand_vertices"), " vertices");
        }
    }
    // What was assumed of the file, and what is odd about the cut; how a fit went on its way is for `status`.
    let read_first = |stage: Stage| matches!(stage, Stage::Scan | Stage::Cut);
    let findings: Vec<&String> =
        step.standing.iter().filter(|r| read_first(r.stage)).flat_map(|r| &r.findings).collect();
    let mut lines = vec![format!("{}: {}.", step.name, told.join("; "))];
    lines.extend(findings.iter().map(|f| format!("  {f}")));
    lines.push(match step.template {
        None => "Look at it: `view`. Is it the whole body, is every limb in place? If not: `again`.".into(),
        Some(_) => format!(
            "Look at it: `view`. Where {0} is cut wrongly: `mask --template {0}.ply`, paint it, `mask {0}.ply`. Or `again`.",
            step.name
        ),
    });
    lines
}
