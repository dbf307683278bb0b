//! `overcoat templates`: the kinds of garment, built in and painted.

use super::console::{Context, Done, quoted, secs};
use super::paint::{in_words, serve};
use super::watch::ended_by_signal;
use crate::desk::Painting;
use crate::segment::GarmentTemplate;
use crate::session::{Content, Outputs, Session, SessionError, write_template_to_paint};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::time::Instant;

#[derive(clap::Args)]
pub(super) struct TemplatesArgs {
    #[command(subcommand)]
    action: Option<TemplatesAction>,
}

#[derive(clap::Subcommand)]
enum TemplatesAction {
    /// List all kinds, one line per kind
    List,
    /// Show one kind
    Show {
        /// Name of the kind
        name: String,
    },
    /// Write the body model for painting, with the part that a kind covers in red; or paint on a page
    Paint(PaintKindArgs),
    /// Add a kind to the session: the painted body is red where the garment covers it, and grey elsewhere
    Add {
        /// A name for the kind; a painted kind of that name is replaced
        kind: String,
        /// The painted body, as `templates paint` wrote it
        #[arg(value_name = "IN.ply")]
        file: PathBuf,
        /// The kind from which it has fabric, rank, hems, open front and loose part, instead of the built-in kind that covers
        /// the most similar part of the body
        #[arg(long, value_name = "KIND")]
        like: Option<String>,
    },
}

#[derive(clap::Args)]
struct PaintKindArgs {
    /// The kind to start from
    kind: String,
    /// The file to paint
    #[arg(value_name = "OUT.ply", required_unless_present = "page", conflicts_with = "page")]
    out: Option<PathBuf>,
    /// Replace a file that Overcoat did not write, or that was painted since
    #[arg(long, conflicts_with = "page")]
    force: bool,
    /// Paint in the browser instead: every stroke is saved in the session
    #[arg(long)]
    page: bool,
    /// The name of the painted kind [default: KIND itself, if it was painted]
    #[arg(long, value_name = "NEW_KIND", requires = "page", conflicts_with = "out")]
    name: Option<String>,
    /// The port of the page [default: a free one]
    #[arg(long, value_name = "PORT", requires = "page", conflicts_with = "out", value_parser = clap::value_parser!(u16).range(1..))]
    port: Option<u16>,
    /// Do not open the page in the browser
    #[arg(long, requires = "page", conflicts_with = "out")]
    no_browser: bool,
}

pub(super) fn run(args: TemplatesArgs, context: &Context) -> anyhow::Result<Done> {
    match args.action.unwrap_or(TemplatesAction::List) {
        TemplatesAction::List => list(context),
        TemplatesAction::Show { name } => show(&name, context),
        TemplatesAction::Paint(args) => match &args.out {
            Some(out) => paint(&args.kind, out, args.force, context),
            None => paint_on_page(&args, context),
        },
        TemplatesAction::Add { kind, file, like } => add(&kind, file, like.as_deref(), context),
    }
}

fn list(context: &Context) -> anyhow::Result<Done> {
    let mut templates =
        GarmentTemplate::names().map(GarmentTemplate::built_in).collect::<Result<Vec<_>, _>>().map_err(wrong)?;
    if let Some(session) = context.reader_if_any()? {
        templates.extend(session.recipe().painted_templates());
    }
    let json = json!({ "templates": templates.iter().map(as_json).collect::<Vec<_>>() });
    Ok(Done::new("templates", json)
        .lines(templates.iter().map(|t| format!("{:<12} {}", t.name, t.about)))
        .next(context.overcoat("scan NAME FILE --template KIND")))
}

fn show(name: &str, context: &Context) -> anyhow::Result<Done> {
    let template = match context.reader_if_any()? {
        Some(session) => session.recipe().template(name),
        None => GarmentTemplate::built_in(name),
    };
    let template = template.map_err(wrong)?;
    let yes_or_no = |is: bool| if is { "yes" } else { "no" };
    Ok(Done::new("templates", json!({ "template": as_json(&template) }))
        .line(format!("{}: {}", template.name, template.about))
        .line(format!("  hems            {}", template.hems.join(", ")))
        .line(format!("  pieces          {}", template.pieces))
        .line(format!("  opens in front  {}", yes_or_no(template.opens_in_front)))
        .line(format!("  bridges legs    {}", yes_or_no(template.bridges_legs)))
        .line(format!("  face is free    {}", yes_or_no(template.leaves_face_free)))
        .line(format!("  grows on body   {}", yes_or_no(template.grows)))
        .line(format!("  fabric          {}", template.fabric))
        .line(format!("  rank            {}", template.rank))
        .line(format!("  painted         {}", yes_or_no(template.is_painted())))
        .next(context.overcoat(&format!("scan NAME FILE --template {}", template.name))))
}

fn paint(kind: &str, out: &Path, force: bool, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let session = context.reader_if_any()?;
    let mut outputs = match &session {
        Some(session) => session.outputs(force),
        None => Outputs::without_session(&context.session, force),
    };
    outputs.claim(out, Content::Mesh)?;
    let vertices = write_template_to_paint(session.as_ref(), kind, out, &mut outputs)?;
    context.console.notices(outputs.notices());
    let json = json!({
        "session": session.as_ref().map(|session: &Session| session.dir().display().to_string()),
        "kind": kind,
        "file": out.display().to_string(),
        "vertices": vertices,
        "secs": began.elapsed().as_secs_f64(),
    });
    let line = format!("wrote {}: a body of {vertices} vertices to paint, in {}", out.display(), secs(began.elapsed()));
    Ok(Done::new("templates paint", json)
        .line(line)
        .next(context.overcoat(&format!("templates add NEW_KIND {}", quoted(out)))))
}

fn paint_on_page(args: &PaintKindArgs, context: &Context) -> anyhow::Result<Done> {
    let ended = ended_by_signal()?;
    let kind = args.kind.as_str();
    let name = args.name.as_deref().unwrap_or(kind);
    let session = context.reader()?;
    if args.name.is_none() && session.kind_hash(kind).is_none() {
        // A misspelt kind is answered first.
        session.recipe().template(kind).map_err(wrong)?;
        return Err(SessionError::BadRequest {
            what: format!("'{kind}' is a built-in kind of garment, which stays as it is"),
            hint: format!(
                "name the new kind: `{}`",
                context.overcoat(&format!("templates paint {kind} --page --name my-{kind}"))
            ),
        }
        .into());
    }
    let painting = Painting::of_kind(&context.session, kind, name, args.port)?;
    let changes = serve(&painting, args.no_browser, &ended, context);
    let json = json!({ "session": context.session.display().to_string(), "kind": name, "changes": changes });
    let used_by = context.reader()?.steps_of_kind(name);
    let next = if used_by.is_empty() { format!("scan NAME FILE --template {name}") } else { "build".into() };
    let done = Done::new("templates paint", json).line(format!("{}: the kind {name}", in_words(changes)));
    Ok(if changes > 0 { done.next(context.overcoat(&next)) } else { done })
}

fn add(kind: &str, file: PathBuf, like: Option<&str>, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let file = context.input(file);
    let report = context.writer()?.add_template(kind, &file, like)?;
    let mut json = json!(report);
    json["session"] = context.session.display().to_string().into();
    json["file"] = file.display().to_string().into();
    json["secs"] = began.elapsed().as_secs_f64().into();
    let otherwise = if report.like == kind { "before".to_string() } else { format!("in {}", report.like) };
    let line = format!(
        "{} the kind {kind}: {} of {} vertices are covered, everything else is as {otherwise}, in {}",
        if report.replaced { "replaced" } else { "added" },
        report.covered_vertices,
        report.vertices,
        secs(began.elapsed())
    );
    let next = match report.used_by.is_empty() {
        true => format!("scan NAME FILE --template {kind}"),
        false => "build".into(),
    };
    Ok(Done::new("templates add", json).line(line).next(context.overcoat(&next)))
}

fn as_json(template: &GarmentTemplate) -> Value {
    json!({
        "name": template.name,
        "about": template.about,
        "hems": template.hems,
        "pieces": template.pieces,
        "opens_in_front": template.opens_in_front,
        "bridges_legs": template.bridges_legs,
        "leaves_face_free": template.leaves_face_free,
        "grows": template.grows,
        "fabric": template.fabric,
        "rank": template.rank,
        "painted": template.is_painted(),
    })
}

fn wrong(error: crate::segment::SegmentError) -> SessionError {
    SessionError::BadRequest { what: error.to_string(), hint: error.hint().unwrap_or_default() }
}
