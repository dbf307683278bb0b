//! Runs single stages with parameters that are saved in the recipe.

use crate::parameters::Setting;
use crate::session::error::SessionError;
use crate::session::open::{Writer, source};
use crate::session::pipeline::{self, Event, Forced, StageReport, Walk};
use crate::session::recipe::{StepKind, check_stage, has_parameters, parameters_of};
use crate::session::results::FitRecording;
use crate::session::results::ShowIn;
use crate::session::stage::Stage;

/// The request to run single stages.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StageRequest {
    /// The command: `segment`.
    pub name: String,
    /// The stages whose parameters may be set. In each step the last of them runs, after everything that it depends on.
    pub stages: Vec<Stage>,
    /// The step; `None` for all steps that have such a stage.
    pub step: Option<String>,
    /// Parameters: their stages, of which a step has at most one, name and value.
    pub settings: Vec<(Vec<Stage>, String, Setting)>,
    /// Whether to reset those stages to the defaults first.
    pub reset: bool,
    /// Target of the recording of fits; they run again even if they are up to date.
    pub view: Option<ShowIn>,
    /// Replace a file of the user by the recording.
    pub force: bool,
}

/// The outcome.
#[derive(Clone, Debug, PartialEq)]
pub struct StageRun {
    /// The changes of parameters, step by step: `shirt.segment.color 1 → 0.5`.
    pub set: Vec<String>,
    /// The stages that ran or were up to date.
    pub reports: Vec<StageReport>,
}

impl Writer {
    /// Sets parameters and runs the stages. If one fails, only the results of earlier stages are kept.
    pub fn run_stages(
        &mut self,
        request: &StageRequest,
        on_event: &mut dyn FnMut(&Event),
    ) -> Result<StageRun, SessionError> {
        let Some(to) = &request.view else { return self.run_unseen(request, on_event) };
        let mut recording = FitRecording::try_new(&self.session.name(), to, self.session.outputs(request.force))?;
        let run = self.run_unseen(request, &mut |event| {
            recording.see(event);
            on_event(event);
        });
        // A refused fit is recorded too.
        let shown = recording.finish();
        run.and_then(|run| shown.map(|()| run))
    }

    fn run_unseen(
        &mut self,
        request: &StageRequest,
        on_event: &mut dyn FnMut(&Event),
    ) -> Result<StageRun, SessionError> {
        let steps = self.steps_of(request)?;
        self.check_taken(request, &steps)?;
        let mut recipe = self.session.recipe.clone();
        let mut set = Vec::new();
        for name in &steps {
            set.extend(change_settings(recipe.step_mut(name)?, request)?);
            recipe.share_in_outfit(name);
        }
        recipe.check().map_err(|fault| fault.error)?;
        if !set.is_empty() {
            // Earlier stages are not part of the change; their results are kept if it fails.
            self.make_until(&steps[..1], before(&request.stages), "build", &Forced::Nothing, on_event)?;
            source::fill_in(&mut recipe, &self.session)?;
        }
        let change = change_of(&request.name, &set);
        let (at, recipe_before) = (self.session.lines, self.session.recipe.clone());
        self.session.recipe = recipe;
        let forced = match &request.view {
            Some(_) => forced_in(&steps, &request.stages),
            None => Forced::Nothing,
        };
        let made = self.make_until(&steps, Some(&request.stages), &change, &forced, on_event);
        match made {
            Ok(reports) => {
                self.save(&change)?;
                Ok(StageRun { set, reports })
            }
            Err(e) => {
                if !set.is_empty() && self.session.lines > at {
                    self.undo(1)?;
                } else {
                    self.session.recipe = recipe_before;
                }
                Err(e)
            }
        }
    }

    /// The steps of the request, in order.
    fn steps_of(&self, request: &StageRequest) -> Result<Vec<String>, SessionError> {
        let recipe = &self.session.recipe;
        if let Some(name) = &request.step {
            let step = recipe.step(name)?;
            let of_step = step.kind().stages();
            return match request.stages.iter().any(|s| of_step.contains(s)) {
                true => Ok(vec![name.clone()]),
                // `stack` also runs stages before the one of its name, which the user did not ask for.
                false => {
                    let named = request.stages.iter().find(|stage| stage.to_string() == request.name);
                    let asked = named.unwrap_or(&request.stages[0]);
                    check_stage(name, step.kind(), *asked).map(|()| Vec::new())
                }
            };
        }
        if recipe.steps.is_empty() {
            return Err(SessionError::NoScans { dir: self.session.dir().to_path_buf() });
        }
        let has = |kind: StepKind| request.stages.iter().any(|s| kind.stages().contains(s));
        let names: Vec<String> = recipe.steps.iter().filter(|s| has(s.kind())).map(|s| s.name.clone()).collect();
        match names.is_empty() {
            false => Ok(names),
            true => Err(SessionError::BadRequest {
                what: format!("no step has a stage for {}: it is for garments, and none is scanned", request.name),
                hint: "scan one: `overcoat scan NAME FILE --template …`".into(),
            }),
        }
    }

    /// Refuses a parameter that none of the steps has; it would be ignored silently.
    fn check_taken(&self, request: &StageRequest, steps: &[String]) -> Result<(), SessionError> {
        for (stages, name, _) in &request.settings {
            let mut taken = false;
            for step in steps {
                let kind = self.session.recipe.step(step)?.kind();
                taken |= stages.iter().any(|s| has_parameters(kind, *s));
            }
            if !taken {
                let whose = if StepKind::Body.stages().contains(&stages[0]) && stages[0] != Stage::Figure {
                    "the body's step"
                } else {
                    "garments"
                };
                return Err(SessionError::BadRequest {
                    what: format!("{name} is a parameter of {whose} ({}), not of '{}'", stages[0], steps.join("', '")),
                    hint: format!("`overcoat {} --help` shows what can be set", request.name),
                });
            }
        }
        Ok(())
    }

    /// Runs the stages that are out of date up to the last of `stages` in the last of `steps`; runs nothing for `None`.
    fn make_until(
        &mut self,
        steps: &[String],
        stages: Option<&[Stage]>,
        change: &str,
        forced: &Forced,
        on_event: &mut dyn FnMut(&Event),
    ) -> Result<Vec<StageReport>, SessionError> {
        let (Some(stages), Some(last)) = (stages, steps.last()) else { return Ok(Vec::new()) };
        let kind = self.session.recipe.step(last)?.kind();
        let Some(stage) = kind.stages().iter().rev().find(|s| stages.contains(s)) else {
            return Ok(Vec::new());
        };
        source::keep_missing(&mut self.session)?;
        let mut walk = Walk::make(self, change, forced, on_event).until(last, *stage);
        match pipeline::steps(&mut walk, Some(last)) {
            Err(SessionError::NotBuilt { .. }) | Ok(_) => Ok(walk.into_reports()),
            Err(e) => Err(e),
        }
    }
}

/// These stages of these steps.
fn forced_in(steps: &[String], stages: &[Stage]) -> Forced {
    let of_step = |step: &String| stages.iter().map(|&stage| (step.clone(), Some(stage))).collect::<Vec<_>>();
    Forced::Named(steps.iter().flat_map(of_step).collect())
}

/// The stages that come before the first of `stages`.
fn before(stages: &[Stage]) -> Option<&'static [Stage]> {
    const ALL: [Stage; 3] = [Stage::Pose, Stage::Cut, Stage::Stack];
    match stages.iter().min() {
        Some(Stage::Segment) => Some(&ALL[..1]),
        Some(Stage::Rig) => Some(&ALL[1..2]),
        Some(Stage::Figure) => Some(&ALL[2..]),
        _ => None,
    }
}

fn change_settings(
    step: &mut crate::session::recipe::StepRecipe,
    request: &StageRequest,
) -> Result<Vec<String>, SessionError> {
    let (step_name, kind) = (step.name.clone(), step.kind());
    let mut changes = Vec::new();
    for &stage in request.stages.iter().filter(|s| has_parameters(kind, **s)) {
        let old = step.settings(stage).clone();
        let Some(settings) = step.settings_mut(stage) else { continue };
        if request.reset {
            settings.clear();
        }
        for (_, name, setting) in request.settings.iter().filter(|(of, ..)| of.contains(&stage)) {
            settings.insert(name.clone(), setting.clone());
        }
        let mut parameters: Vec<_> = parameters_of(stage).collect();
        parameters.sort_by_key(|p| p.name);
        for parameter in parameters {
            let (before, after) = (old.get(parameter.name), settings.get(parameter.name));
            if before != after {
                let text = |set: Option<&Setting>| set.map_or_else(|| parameter.default(), Setting::to_string);
                let name = parameter.name;
                changes.push(format!("{step_name}.{stage}.{name} {} → {}", text(before), text(after)));
            }
        }
    }
    Ok(changes)
}

fn change_of(command: &str, set: &[String]) -> String {
    if set.is_empty() { command.into() } else { format!("set {}", set.join(", ")) }
}
