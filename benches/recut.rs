//! How much sooner a garment is cut anew after a mask file is saved than it is segmented and cut from nothing: a ratio, so
//! that it can be compared between machines. On the demo's scans, or on any built session:
//!
//! ```sh
//! cargo bench --bench recut                      # the T-shirt of the demo
//! cargo bench --bench recut -- SESSION GARMENT   # another one's; the session is copied, not changed
//! ```

use overcoat::session::{BODY_STEP, Forced, Memory, NewScan, NewSession, SessionError, Stage, Writer, create};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Strokes that are measured, each in another place of the garment; the median counts.
const STROKES: usize = 9;

fn demo(dir: &Path) -> Result<PathBuf, SessionError> {
    let scans = Path::new(env!("CARGO_MANIFEST_DIR")).join("scans/demo");
    let session = dir.join("session");
    create(&session, &NewSession::default())?;
    let mut writer = Writer::open(&session)?;
    for (name, file, template) in [(BODY_STEP, "0-body.ply", None), ("tshirt", "1-tshirt.ply", Some("tshirt"))] {
        let scan = NewScan {
            name: name.into(),
            file: scans.join(file),
            template: template.map(String::from),
            ..NewScan::default()
        };
        writer.add_scan(&scan, &mut |_| {})?;
    }
    writer.build(&Forced::Nothing, &mut |_| {})?;
    Ok(session)
}

fn copy_folder(from: &Path, to: &Path) -> std::io::Result<()> {
    std::fs::create_dir_all(to)?;
    for entry in std::fs::read_dir(from)? {
        let entry = entry?;
        let (path, target) = (entry.path(), to.join(entry.file_name()));
        if path.is_dir() { copy_folder(&path, &target)? } else { std::fs::copy(&path, target).map(drop)? }
    }
    Ok(())
}

/// Processor time of this process so far, where the system tells: on a busy machine it says more than the clock.
fn cpu_secs() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    let after_name: Vec<&str> = stat.rsplit(") ").next()?.split(' ').collect();
    let ticks = |at: usize| after_name.get(at)?.parse::<f64>().ok();
    /// Linux counts in hundredths of a second for every program.
    const TICKS_PER_SEC: f64 = 100.0;
    Some((ticks(11)? + ticks(12)?) / TICKS_PER_SEC)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let dir = tempfile::tempdir()?;
    let (session, layer) = match args.as_slice() {
        [] => (demo(dir.path())?, "tshirt".to_string()),
        [session, layer] => {
            copy_folder(Path::new(session), &dir.path().join("session"))?;
            (dir.path().join("session"), layer.clone())
        }
        _ => return Err("name a session and a garment, or neither".into()),
    };
    let mut writer = Writer::open(&session)?;
    writer.build(&Forced::Nothing, &mut |_| {})?;
    let again = Forced::Named([Stage::Evidence, Stage::Segment, Stage::Cut].map(|s| (layer.clone(), Some(s))).into());
    let began = Instant::now();
    let built = writer.build(&again, &mut |_| {})?;
    let of_build: f64 = built.reports.iter().filter(|r| r.ran).filter_map(|r| r.secs).sum();
    let first = writer.recut(&layer, &mut |_| {})?.garment;
    println!(
        "{layer}: {} vertices; from its posed scan to its cut {of_build:.3} s ({:.3} s with the walk)",
        first.mesh.vertex_count(),
        began.elapsed().as_secs_f64()
    );
    drop(writer);

    let mask = session.join("bench.jsonl");
    // As `watch` does: the session is opened for each change, what was loaded stays at hand.
    let memory = Memory::default();
    let mut secs = Vec::new();
    let cpu_before = cpu_secs();
    for k in 0..STROKES {
        let points = first.mesh.points();
        let p = points.as_slice()[points.len() * (2 * k + 1) / (2 * STROKES)];
        let stroke = serde_json::json!({
            "layer": layer, "op": "erase", "radius": 0.02, "points": [[p.x, p.y, p.z]], "frame": "world"
        });
        std::fs::write(&mask, format!("{stroke}\n"))?;
        let began = Instant::now();
        let mut writer = Writer::open(&session)?;
        writer.remember(&memory);
        let recut = writer.recut_with(&layer, &mask, &mut |_| {})?;
        secs.push(began.elapsed().as_secs_f64());
        assert!(recut.garment != first, "the stroke has cut something");
        let stages = recut.reports.iter().filter(|r| r.ran);
        let stages: Vec<String> =
            stages.map(|r| format!("{} {:.0} ms", r.stage, 1e3 * r.secs.unwrap_or(0.0))).collect();
        println!("  stroke {k}: {:.0} ms ({})", 1e3 * secs[k], stages.join(", "));
    }
    if let (Some(before), Some(after)) = (cpu_before, cpu_secs()) {
        println!("processor time: {:.0} ms a stroke", 1e3 * (after - before) / STROKES as f64);
    }
    secs.sort_by(f64::total_cmp);
    let median = secs[STROKES / 2];
    println!(
        "saved to recut: median {:.0} ms, least {:.0} ms; {:.2} of the time from the posed scan",
        1e3 * median,
        1e3 * secs[0],
        median / of_build
    );
    Ok(())
}
