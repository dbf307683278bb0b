//! `overcoat templates`: the kinds of garment.

use super::console::{Context, Done};
use crate::segment::GarmentTemplate;
use crate::session::SessionError;
use serde_json::{Value, json};

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
}

pub(super) fn run(args: TemplatesArgs, context: &Context) -> anyhow::Result<Done> {
    match args.action.unwrap_or(TemplatesAction::List) {
        TemplatesAction::List => list(context),
        TemplatesAction::Show { name } => show(&name, context),
    }
}

fn list(context: &Context) -> anyhow::Result<Done> {
    let templates =
        GarmentTemplate::names().map(GarmentTemplate::built_in).collect::<Result<Vec<_>, _>>().map_err(wrong)?;
    let json = json!({ "templates": templates.iter().map(as_json).collect::<Vec<_>>() });
    Ok(Done::new("templates", json)
        .lines(templates.iter().map(|t| format!("{:<12} {}", t.name, t.about)))
        .next(context.overcoat("scan NAME FILE --template KIND")))
}

fn show(name: &str, context: &Context) -> anyhow::Result<Done> {
    let template = GarmentTemplate::built_in(name).map_err(wrong)?;
    Ok(Done::new("templates", json!({ "template": as_json(&template) }))
        .line(format!("{}: {}", template.name, template.about))
        .line(format!("  hems            {}", template.hems.join(", ")))
        .line(format!("  pieces          {}", template.pieces))
        .line(format!("  opens in front  {}", if template.opens_in_front { "yes" } else { "no" }))
        .line(format!("  bridges legs    {}", if template.bridges_legs { "yes" } else { "no" }))
        .line(format!("  fabric          {}", template.fabric))
        .line(format!("  rank            {}", template.rank))
        .next(context.overcoat(&format!("scan NAME FILE --template {}", template.name))))
}

fn as_json(template: &GarmentTemplate) -> Value {
    json!({
        "name": template.name,
        "about": template.about,
        "hems": template.hems,
        "pieces": template.pieces,
        "opens_in_front": template.opens_in_front,
        "bridges_legs": template.bridges_legs,
        "fabric": template.fabric,
        "rank": template.rank,
    })
}

fn wrong(error: crate::segment::SegmentError) -> SessionError {
    SessionError::BadRequest { what: error.to_string(), hint: error.hint().unwrap_or_default() }
}
