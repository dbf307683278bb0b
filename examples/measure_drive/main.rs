//! Measures `drive`: `measure_drive streams SESSION=STREAM …`, `measure_drive classes OUT SESSION … CLIP.bvh …`,
//! `measure_drive speed SESSION`, `measure_drive trackers SESSION`, `measure_drive keys SESSION`. `just drive-table` runs all.

mod classes;
mod drawing;
mod keys;
mod sorkine;
mod speed;
#[path = "../../benches/kernels/split_in_four.rs"]
mod split_in_four;
mod synthetic;
mod trackers;
mod truth;

use overcoat::body::Figure;
use overcoat::session::Session;
use std::path::Path;

fn figure(session: &str) -> Figure {
    let session = Session::open(Path::new(session)).expect("a session");
    session.figure_of_last_step().expect("a session that is built")
}

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let Some((what, rest)) = args.split_first() else { panic!("streams, classes, speed, trackers or keys") };
    match what.as_str() {
        "streams" => {
            println!(
                "| person | method | joints, fixed at calibration, mm | joints, mm | surface, mm | ms a frame | steps |"
            );
            println!("|---|---|---|---|---|---|---|");
            for pair in rest {
                let (session, stream) = pair.split_once('=').expect("SESSION=STREAM");
                let name = Path::new(stream).file_name().map_or_else(String::new, |n| n.to_string_lossy().into());
                truth::measure(&figure(session), Path::new(stream), &name);
            }
        }
        "classes" => {
            let (clips, sessions): (Vec<&String>, Vec<&String>) =
                rest[1..].iter().partition(|arg| arg.ends_with(".bvh"));
            let figures: Vec<Figure> = sessions.into_iter().map(|session| figure(session)).collect();
            let clips: Vec<&Path> = clips.into_iter().map(Path::new).collect();
            classes::measure(Path::new(&rest[0]), &figures, &clips);
        }
        "speed" => speed::measure(&figure(&rest[0])),
        "trackers" => trackers::measure(&figure(&rest[0])),
        "keys" => keys::measure(&figure(&rest[0])),
        other => panic!("no table '{other}'"),
    }
}
