//! What was measured, with its goals.

use std::fmt;

#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Group {
    Naked,
    Tight,
    Loose,
    Arms,
    Whole,
    Armless,
    Holes,
}

impl Group {
    const ALL: [Self; 7] = [Self::Naked, Self::Tight, Self::Loose, Self::Arms, Self::Whole, Self::Armless, Self::Holes];

    fn title(self) -> &'static str {
        match self {
            Self::Naked => "Naked",
            Self::Tight => "In something close (t-shirt, jeans, pullover, leggings, shirt by turns)",
            Self::Loose => "In something wide (coat, dress, skirt, jacket, blouse by turns)",
            Self::Arms => "Naked, arms 30° above or below the A-pose, any heading",
            Self::Whole => "Shape from the naked scan alone, and from all three",
            Self::Armless => "The same, the naked scan without the right arm",
            Self::Holes => "The same, the naked scan with a knee and a hand torn out",
        }
    }
}

/// How it was fitted.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Way {
    Robust,
    /// `--method paper`
    Paper,
    /// `--method hybrid`: the paper's equations with our solver.
    Hybrid,
    /// `--method unweighted`
    Unweighted,
    /// `--method unconstrained`
    Unconstrained,
    Shrunk,
    Shifted,
    Together,
}

impl Way {
    const ALL: [Self; 8] = [
        Self::Robust,
        Self::Together,
        Self::Paper,
        Self::Hybrid,
        Self::Unweighted,
        Self::Unconstrained,
        Self::Shrunk,
        Self::Shifted,
    ];

    pub fn word(self) -> &'static str {
        match self {
            Self::Robust => "robust",
            Self::Paper => "paper",
            Self::Hybrid => "hybrid",
            Self::Unweighted => "unweighted",
            Self::Unconstrained => "unconstrained",
            Self::Shrunk => "shrunk",
            Self::Shifted => "shifted",
            Self::Together => "all",
        }
    }

    fn title(self) -> &'static str {
        match self {
            Self::Robust => "the fit",
            Self::Paper => "--method paper",
            Self::Hybrid => "--method hybrid",
            Self::Unweighted => "--method unweighted",
            Self::Unconstrained => "--method unconstrained",
            Self::Shrunk => "wrong: -8 mm",
            Self::Shifted => "wrong: aside 15 mm",
            Self::Together => "--shape-from all",
        }
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Metric {
    Model,
    Registered,
    JointsNaked,
    JointsDressed,
    OutsideScan,
    OutsideTruth,
    Depth,
    Tight,
    Loose,
    First,
    Second,
}

impl Metric {
    const ALL: [Self; 11] = [
        Self::Model,
        Self::Registered,
        Self::JointsNaked,
        Self::JointsDressed,
        Self::OutsideScan,
        Self::OutsideTruth,
        Self::Depth,
        Self::Tight,
        Self::Loose,
        Self::First,
        Self::Second,
    ];

    /// Name and goal.
    fn label_and_goal(self) -> (&'static str, f64) {
        match self {
            Self::Model => ("T2 model only, mm", 4.0),
            Self::Registered => ("T4 registered, mm", 1.2),
            Self::JointsNaked => ("T5 joints, mm", 10.0),
            Self::JointsDressed => ("T5 joints, mm", 12.0),
            Self::OutsideScan => ("T6 outside scan, %", 0.0),
            Self::OutsideTruth => ("T6 outside truth, %", 0.1),
            Self::Depth => ("T6 depth at 99.9 %, mm", 1.0),
            Self::Tight => ("T7 close skin, mm", 5.0),
            Self::Loose => ("T7 far skin, mm", 8.0),
            // T4's *first* of a body that lies in another scan than its own: the errors of registration and of its pose.
            Self::First => ("whole body in the first dressed scan, mm", 4.0),
            Self::Second => ("whole body in the second, mm", 4.0),
        }
    }

    fn is_met(self, value: f64) -> bool {
        value <= self.label_and_goal().1
    }
}

#[derive(Clone, PartialEq)]
pub enum State {
    Converged,
    /// Out of iterations.
    Running,
    Refused(String),
}

/// One fit of one subject.
pub struct Row {
    pub group: Group,
    pub way: Way,
    pub name: String,
    pub measured: Vec<(Metric, Option<f64>)>,
    pub state: State,
    /// What the fit says of itself, 0 to 1.
    pub confidence: f64,
    /// Processor time.
    pub secs: f64,
}

impl Row {
    fn value(&self, metric: Metric) -> Option<f64> {
        self.measured.iter().find(|m| m.0 == metric)?.1
    }

    fn is_refused(&self) -> bool {
        matches!(self.state, State::Refused(_))
    }

    fn is_running(&self) -> bool {
        self.state == State::Running
    }

    fn meets_all(&self) -> bool {
        !self.measured.is_empty() && self.measured.iter().all(|&(m, v)| v.is_none_or(|v| m.is_met(v)))
    }
}

#[derive(Default)]
pub struct Table {
    rows: Vec<Row>,
}

impl Table {
    /// Takes a row in, and shows it.
    pub fn add(&mut self, row: Row) {
        let values: Vec<String> = (row.measured.iter())
            .filter_map(|&(m, v)| {
                v.map(|v| format!("{} {v:.2}{}", m.label_and_goal().0, if m.is_met(v) { "" } else { " !" }))
            })
            .collect();
        let state = match &row.state {
            State::Converged => String::new(),
            State::Running => "; not converged".into(),
            State::Refused(why) => format!("refused: {why}"),
        };
        println!("{:28} {:13} {}{state}", row.name, row.way.word(), values.join("; "));
        self.rows.push(row);
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for group in Group::ALL {
            let of_group: Vec<&Row> = self.rows.iter().filter(|r| r.group == group).collect();
            if !of_group.is_empty() {
                of_one_group(f, group, &of_group)?;
            }
        }
        Ok(())
    }
}

fn of_one_group(f: &mut fmt::Formatter<'_>, group: Group, rows: &[&Row]) -> fmt::Result {
    let of_way = |way: Way| rows.iter().copied().filter(move |r| r.way == way);
    let ways: Vec<Way> = Way::ALL.into_iter().filter(|&way| of_way(way).next().is_some()).collect();
    writeln!(f, "### {}\n", group.title())?;
    write!(f, "| mean / worst, goal met | goal |")?;
    ways.iter().try_for_each(|way| write!(f, " {} |", way.title()))?;
    writeln!(f, "\n|---|---|{}", "---|".repeat(ways.len()))?;
    for metric in Metric::ALL {
        let (name, goal) = metric.label_and_goal();
        if rows.iter().all(|r| r.value(metric).is_none()) {
            continue;
        }
        write!(f, "| {name} | {goal} |")?;
        for &way in &ways {
            let values: Vec<f64> = of_way(way).filter_map(|r| r.value(metric)).collect();
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            let worst = values.iter().copied().fold(0.0, f64::max);
            let met = values.iter().filter(|v| metric.is_met(**v)).count();
            write!(f, " {mean:.2} / {worst:.2}, {met} of {} |", values.len())?;
        }
        writeln!(f)?;
    }
    for (k, name) in ["all goals met", "refused", "not converged"].into_iter().enumerate() {
        write!(f, "| {name} | |")?;
        for &way in &ways {
            let counted = of_way(way).filter(|r| [r.meets_all(), r.is_refused(), r.is_running()][k]);
            write!(f, " {} of {} |", counted.count(), of_way(way).count())?;
        }
        writeln!(f)?;
    }
    write!(f, "| confidence, least | |")?;
    for &way in &ways {
        write!(f, " {:.2} |", of_way(way).map(|r| r.confidence).fold(1.0, f64::min))?;
    }
    write!(f, "\n| processor seconds a fit | |")?;
    for &way in &ways {
        let secs: Vec<f64> = of_way(way).filter(|r| r.secs > 0.0).map(|r| r.secs).collect();
        let mean = secs.iter().sum::<f64>() / secs.len() as f64;
        write!(f, " {} |", if secs.is_empty() { String::new() } else { format!("{mean:.2}") })?;
    }
    writeln!(f, "\n")?;
    worst_cases(f, rows)
}

/// Of the fit itself: which subject is the worst at what.
fn worst_cases(f: &mut fmt::Formatter<'_>, rows: &[&Row]) -> fmt::Result {
    let worst = Metric::ALL.into_iter().filter_map(|metric| {
        let of_fit = rows.iter().filter(|r| r.way == Way::Robust);
        let found = of_fit.filter_map(|r| Some((r.value(metric)?, r))).max_by(|a, b| a.0.total_cmp(&b.0))?;
        (!metric.is_met(found.0)).then(|| format!("{} {:.2}: {}", metric.label_and_goal().0, found.0, found.1.name))
    });
    let worst: Vec<String> = worst.collect();
    if !worst.is_empty() {
        writeln!(f, "Worst of the fit: {}.\n", worst.join("; "))?;
    }
    Ok(())
}
