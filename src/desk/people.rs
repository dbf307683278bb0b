//! The people of a batch on one page, the worst first, each with a link to its report.

use super::html::{escaped, table};
use super::report::{STYLE, filled};
use crate::check::{StepVerdict, Verdict};
use crate::session::SubjectRun;
use std::cmp::Reverse;

const PAGE: &str = include_str!("pages/people.html");

/// The page. `has_report` says whether a person's folder contains a report.
pub fn people_page(runs: &[SubjectRun], has_report: &dyn Fn(&str) -> bool) -> String {
    let mut worst_first: Vec<&SubjectRun> = runs.iter().collect();
    worst_first.sort_by_key(|run| (Reverse(grave(run)), run.name.clone()));
    let rows: Vec<Vec<String>> = worst_first.into_iter().map(|run| row(run, has_report(&run.name))).collect();
    let good = runs.iter().filter(|run| grave(run) == [0; 3]).count();
    let summary = match runs.len() {
        1 => format!("1 person, {good} good"),
        n => format!("{n} people, {good} good; the worst first"),
    };
    let people = table(&["person", "verdicts", "doubts"], &rows);
    filled(PAGE, &[("STYLE", STYLE.to_string()), ("SUMMARY", summary), ("PEOPLE", people)])
}

/// How grave a result is: whether the person could not be dressed, how many steps failed, how many doubts there are.
fn grave(run: &SubjectRun) -> [usize; 3] {
    let Ok(replayed) = &run.outcome else { return [1, 0, 0] };
    let failed = replayed.verdicts.iter().filter(|step| matches!(step.verdict, Verdict::Failed(_))).count();
    let doubts = replayed.verdicts.iter().filter(|step| !step.verdict.is_good()).map(|step| step.warnings.len().max(1));
    [0, failed, doubts.sum::<usize>() + replayed.left_out.len()]
}

fn row(run: &SubjectRun, has_report: bool) -> Vec<String> {
    let name = escaped(&run.name);
    let name = if has_report { format!("<a href=\"{name}/report.html\">{name}</a>") } else { name };
    match &run.outcome {
        Err(why) => vec![name, format!("<span class=\"bad\">failed: {}</span>", escaped(why)), String::new()],
        Ok(replayed) => {
            let line = |step: &StepVerdict| {
                let class = match step.verdict {
                    Verdict::Good => "good",
                    Verdict::Check(_) => "doubt",
                    Verdict::Failed(_) => "bad",
                };
                format!(
                    "<span class=\"{class}\">{}: {}</span>",
                    escaped(&step.step),
                    escaped(&step.verdict.to_string())
                )
            };
            let mut lines: Vec<String> = replayed.verdicts.iter().map(line).collect();
            lines.extend(replayed.left_out.iter().map(|what| format!("left out {}", escaped(what))));
            vec![name, lines.join("<br>"), grave(run)[2].to_string()]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::Replayed;
    use std::time::Duration;

    fn person(name: &str, outcome: Result<Vec<(&str, Verdict)>, &str>) -> SubjectRun {
        let verdict = |(step, verdict): (&str, Verdict)| StepVerdict {
            step: step.into(),
            verdict,
            warnings: Vec::new(),
            notes: Vec::new(),
        };
        let replayed = |verdicts: Vec<(&str, Verdict)>| Replayed {
            reports: Vec::new(),
            verdicts: verdicts.into_iter().map(verdict).collect(),
            left_out: Vec::new(),
        };
        SubjectRun { name: name.into(), outcome: outcome.map(replayed).map_err(String::from), took: Duration::ZERO }
    }

    #[test]
    fn the_worst_comes_first_and_links_its_report() {
        let doubt = || Verdict::Check("3 hems were found".into());
        let runs = [
            person("ada", Ok(vec![("body", Verdict::Good)])),
            person("bob", Ok(vec![("body", Verdict::Good), ("shirt", doubt())])),
            person("cy", Err("there is no file '<cy>.ply'")),
            person("dee", Ok(vec![("body", Verdict::Failed("the scan is empty".into()))])),
            person("eve", Ok(vec![("body", doubt()), ("shirt", doubt())])),
        ];
        let page = people_page(&runs, &|name| name != "cy");
        let places: Vec<usize> = ["cy", "dee", "eve", "bob", "ada"]
            .iter()
            .map(|name| page.find(&format!(">{name}<")).unwrap_or_else(|| panic!("{name}: {page}")))
            .collect();
        assert!(places.is_sorted(), "{places:?}");
        assert!(page.contains("href=\"dee/report.html\"") && !page.contains("cy/report.html"));
        assert!(page.contains("&lt;cy&gt;.ply") && page.contains("5 people, 1 good"), "{page}");
        assert!(!page.contains("{{"));
    }
}
