//! The session in the Rerun viewer: as a file, or live while the session changes.

use super::show_in::ShowIn;
use crate::check::Verdict;
use crate::cut::Garment;
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::results::outputs::{Content, Outputs};
use crate::session::results::pictures::{SeenStep, Turned};
use crate::session::results::status::StepStatus;
use crate::session::store::name_and_unit;
use crate::view::{Error, Part, Recording, Sink, layer_color};
use std::path::Path;

impl Session {
    /// Writes every built step as a Rerun recording, with the verdicts.
    pub fn write_recording(&self, path: &Path, outputs: &mut Outputs) -> Result<(), SessionError> {
        let failed = |e| SessionError::bad_source(path, e);
        let recording = Recording::try_new(&self.name()).map_err(failed)?;
        self.log_steps(&recording, failed)?;
        outputs.write(path, Content::Recording, |out| recording.finish(out))
    }

    /// Logs every step, and returns where each was placed.
    fn log_steps(
        &self,
        recording: &Recording,
        failed: impl Fn(Error) -> SessionError + Copy,
    ) -> Result<Vec<(String, Turned)>, SessionError> {
        let steps = self.posed_steps_so_far()?;
        if steps.is_empty() {
            return self.posed_steps(None).map(|_| Vec::new());
        }
        let status = self.status()?;
        let mut placed = Vec::new();
        for (k, (posed, status)) in steps.iter().zip(&status).enumerate() {
            let (seen, turned) = (SeenStep::of(posed), Turned::of(posed));
            recording.set_step(k);
            recording.log_scan(&seen.scan()?).map_err(failed)?;
            for (layer, (part, of)) in seen.layers().iter().zip(&posed.figure.layers).enumerate() {
                match layer {
                    0 => recording.log_body(part).map_err(failed)?,
                    _ => recording.log_garment(&of.name, part).map_err(failed)?,
                }
            }
            let skeleton = &posed.figure.skeleton;
            let joints: Vec<_> = posed.joints().iter().map(|p| turned.point(p)).collect();
            let parents: Vec<Option<usize>> = skeleton.parents.iter().map(|p| p.map(|p| p.index())).collect();
            recording.log_skeleton(&joints, &skeleton.names, &parents).map_err(failed)?;
            recording.log_notes(&notes_in_markdown(status)).map_err(failed)?;
            for report in &status.up_to_date {
                for (name, value) in &report.measures {
                    recording.log_measure(&format!("{}_{name}", report.stage), *value).map_err(failed)?;
                }
            }
            placed.push((posed.step.name.clone(), turned));
        }
        Ok(placed)
    }
}

/// A live view of a session in the viewer, along the timelines `step` and `change`.
pub struct LiveView {
    recording: Recording,
    /// The steps in order, and where each was placed.
    placed: Vec<(String, Turned)>,
    change: usize,
}

impl LiveView {
    /// Shows everything that is built in a viewer.
    ///
    /// **Errors** if `shown` is a file, and if the viewer does not answer.
    pub fn open(session: &Session, shown: &ShowIn) -> Result<Self, SessionError> {
        let name = session.name();
        let sink = match shown {
            ShowIn::Viewer(bind) => Sink::NewViewer(*bind),
            ShowIn::ViewerAt(url) => Sink::ViewerAt(url),
            ShowIn::File(path) => {
                return Err(SessionError::BadRequest {
                    what: format!("'{}' is not the URL of a viewer", path.display()),
                    hint: "give a URL such as rerun+http://127.0.0.1:9876/proxy; --save OUT.rrd writes a recording"
                        .into(),
                });
            }
        };
        let recording = Recording::in_viewer(&name, sink).map_err(SessionError::viewer)?;
        let mut live = Self { recording, placed: Vec::new(), change: 0 };
        live.show_all(session)?;
        live.recording.sent().map_err(SessionError::viewer)?;
        Ok(live)
    }

    /// Shows the current state of everything that is built.
    pub fn show_all(&mut self, session: &Session) -> Result<(), SessionError> {
        self.recording.set_change(self.change);
        self.placed = session.log_steps(&self.recording, SessionError::viewer)?;
        Ok(())
    }

    /// Shows a newly cut garment in its scan's pose, before its dependents are rebuilt.
    pub fn show_cut(&mut self, layer: &str, garment: &Garment) -> Result<(), SessionError> {
        self.change += 1;
        let Some(k) = self.placed.iter().position(|(name, _)| name == layer) else { return Ok(()) };
        self.recording.set_change(self.change);
        self.recording.set_step(k);
        let mesh = self.placed[k].1.mesh(&garment.mesh);
        self.recording.log_garment(layer, &Part::solid(&mesh, layer_color(k))).map_err(SessionError::viewer)?;
        self.recording.sent().map_err(SessionError::viewer)
    }
}

fn notes_in_markdown(status: &StepStatus) -> String {
    let verdict = status.verdict.as_ref().map_or_else(|| "out of date".to_string(), Verdict::to_string);
    let mut text = format!("# {}: {verdict}\n", status.name);
    text.extend(status.warnings.iter().skip(1).map(|warning| format!("- {warning}\n")));
    for report in &status.up_to_date {
        text += &format!("\n**{}**\n", report.stage);
        text.extend(report.measures.iter().map(|(measure, value)| {
            let (name, unit) = name_and_unit(measure);
            format!("- {name}: {value:.3}{unit}\n")
        }));
        text.extend(report.findings.iter().map(|finding| format!("- {finding}\n")));
    }
    text
}
