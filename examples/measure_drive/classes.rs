//! Recognition of poses with whole clips and whole bodies left out, and its pictures. The poses that no clip contains are always
//! learned; of the clips, those of the library are left out one by one, and the given ones are never learned.

use crate::drawing::{Svg, color};
use crate::synthetic::places;
use overcoat::body::{Figure, embedded_model};
use overcoat::drive::{
    Angle, Confusion, Places, PoseClasses, Recognizer, SalientAngle, complete_descriptor, embedded_library, mirrored,
    pose_features, pose_of, principal_plane, select_angles,
};
use overcoat::motion::{MotionParams, follow};
use overcoat::session::read_clip;
use std::path::Path;

/// Classes of poses, as in the library that comes with the program.
const CLASSES: usize = 24;

pub fn measure(out: &Path, figures: &[Figure], clips: &[&Path]) {
    let model = embedded_model().expect("the embedded body");
    let generic = Figure::mean(&model);
    let library = embedded_library().unwrap();
    let on = |figure: &Figure| -> Vec<Places> {
        library.poses().iter().map(|pose| places(figure, &pose_of(&figure.skeleton, pose))).collect()
    };
    let ours = on(&generic);
    let features: Vec<Vec<f64>> = ours.iter().map(|p| pose_features(p).expect("all are seen")).collect();
    let classes = PoseClasses::cluster(&features, CLASSES);
    let labels = &classes.labels;
    let of_mirrored: Vec<usize> =
        ours.iter().map(|p| classes.nearest(&pose_features(&mirrored(p)).expect("all are seen"))).collect();
    let others: Vec<Vec<Places>> = figures.iter().map(on).collect();
    let unknown = |figure: &Figure| -> Vec<Places> { clips.iter().flat_map(|clip| of_clip(figure, clip)).collect() };
    let [unknown, on_others] = [vec![unknown(&generic)], figures.iter().map(unknown).collect()];
    let truth: Vec<Option<usize>> = unknown[0].iter().map(|p| Some(classes.nearest(&pose_features(p)?))).collect();
    println!("{} poses of {} sources, {CLASSES} classes", ours.len(), library.sources().len());
    println!("{} poses of {} clips that are not in the library", truth.len(), clips.len());
    println!(
        "| d | clips left out | other clips | bodies left out | other clips and bodies | binary, as the paper counts |"
    );
    println!("|---|---|---|---|---|---|");
    let mut kept = None;
    for d in [20, 30, 40, 50, 60, 70] {
        let [mut clips, mut strange, mut bodies, mut both] = std::array::from_fn(|_| Confusion::new(CLASSES));
        let angles: Vec<SalientAngle> = select_angles(&ours, labels, &of_mirrored, d).unwrap();
        let all: Vec<usize> = (0..ours.len()).collect();
        let whole = trained(&ours, labels, &all, &plain(&angles));
        for body in &others {
            all.iter().for_each(|&i| count(&whole, &body[i], labels[i], &mut bodies));
        }
        for (people, into) in [(&unknown, &mut strange), (&on_others, &mut both)] {
            let poses = people.iter().flat_map(|body| body.iter().zip(&truth));
            poses.for_each(|(places, truth)| truth.iter().for_each(|&truth| count(&whole, places, truth, into)));
        }
        for clip in (0..library.sources().len()).filter(|&clip| library.sources()[clip] != "random") {
            let (rest, left): (Vec<usize>, Vec<usize>) = all.iter().partition(|&&i| library.source_of()[i] != clip);
            let pick = |of: &[usize]| rest.iter().map(|&i| of[i]).collect::<Vec<_>>();
            let seen: Vec<Places> = rest.iter().map(|&i| ours[i]).collect();
            let angles = select_angles(&seen, &pick(labels), &pick(&of_mirrored), d).unwrap();
            let recognizer = trained(&ours, labels, &rest, &plain(&angles));
            for &i in &left {
                count(&recognizer, &ours[i], labels[i], &mut clips);
            }
        }
        let percent = |c: &Confusion| c.accuracy() * 100.0;
        let binary = both.binary_accuracy() * 100.0;
        let [left, strangers, on_bodies, on_both] = [&clips, &strange, &bodies, &both].map(percent);
        println!(
            "| {} | {left:.1} % | {strangers:.1} % | {on_bodies:.1} % | {on_both:.1} % | {binary:.1} % |",
            angles.len()
        );
        if d == 40 {
            kept = Some((angles, both));
        }
    }
    let Some((angles, confusion)) = kept else { return };
    let write = |name: &str, text: String| std::fs::write(out.join(name), text).expect("the pictures' folder");
    write("tree.svg", draw_angles(&angles));
    write("confusion.svg", draw_confusion(&confusion));
    let descriptors: Vec<Vec<f64>> = ours.iter().map(|p| complete_descriptor(&plain(&angles), p).unwrap()).collect();
    write("classes.svg", draw_plane(&principal_plane(&descriptors), labels));
    let all_bodies: Vec<&Vec<Places>> = std::iter::once(&ours).chain(&others).collect();
    write("descriptor.svg", draw_descriptors(&plain(&angles), &all_bodies, labels));
}

/// Every tenth of a second of a clip on a figure.
fn of_clip(figure: &Figure, path: &Path) -> Vec<Places> {
    let clip = read_clip(path, &std::fs::read(path).expect("a file"), None, None).expect("a clip");
    let (track, _) = follow(&clip, figure, Some(10.0), None, &MotionParams::default()).expect("a person");
    track.poses.iter().map(|pose| places(figure, pose)).collect()
}

fn plain(angles: &[SalientAngle]) -> Vec<Angle> {
    angles.iter().map(|a| a.angle).collect()
}

fn trained(places: &[Places], labels: &[usize], of: &[usize], angles: &[Angle]) -> Recognizer {
    let samples: Vec<Places> = of.iter().map(|&i| places[i]).collect();
    let classes: Vec<usize> = of.iter().map(|&i| labels[i]).collect();
    Recognizer::train(&samples, &classes, angles).unwrap()
}

fn count(recognizer: &Recognizer, places: &Places, truth: usize, into: &mut Confusion) {
    if let Some(found) = recognizer.recognize(places) {
        into.add(truth, found.class);
    }
}

/// The angles that the decision trees use, most important first, coloured by tree.
fn draw_angles(angles: &[SalientAngle]) -> String {
    let shown = &angles[..angles.len().min(24)];
    let mut svg = Svg::new(560.0, 40.0 + 18.0 * shown.len() as f64);
    svg.text([10.0, 22.0], 14.0, "start", "Angles of the decision trees, by decrease of the Gini impurity");
    let greatest = shown.iter().map(|a| a.importance).fold(1e-9, f64::max);
    for (k, salient) in shown.iter().enumerate() {
        let y = 34.0 + 18.0 * k as f64;
        let Angle { marker, from, to } = salient.angle;
        svg.text([300.0, y + 12.0], 11.0, "end", &format!("{} – {} – {}", from.name(), marker.name(), to.name()));
        svg.rect([308.0, y + 2.0], [180.0 * salient.importance / greatest, 12.0], color(salient.tree));
        svg.text(
            [314.0 + 180.0 * salient.importance / greatest, y + 12.0],
            10.0,
            "start",
            &format!("tree {}", salient.tree + 1),
        );
    }
    svg.end()
}

fn draw_confusion(confusion: &Confusion) -> String {
    const CELL: f64 = 18.0;
    let size = confusion.counts.len();
    let side = CELL * size as f64;
    let mut svg = Svg::new(side + 60.0, side + 70.0);
    svg.text(
        [40.0, 20.0],
        14.0,
        "start",
        &format!("Recognised ({:.1} %): row true, column found", confusion.accuracy() * 100.0),
    );
    for (row, counts) in confusion.counts.iter().enumerate() {
        let total: usize = counts.iter().sum();
        svg.text([34.0, 52.0 + CELL * row as f64], 9.0, "end", &(row + 1).to_string());
        svg.text([49.0 + CELL * row as f64, 36.0], 9.0, "middle", &(row + 1).to_string());
        for (column, &count) in counts.iter().enumerate() {
            let share = count as f64 / total.max(1) as f64;
            let light = |from: f64| (255.0 - (255.0 - from) * share.sqrt()) as u8;
            let fill = format!("#{:02x}{:02x}{:02x}", light(0.0), light(114.0), light(178.0));
            svg.rect([40.0 + CELL * column as f64, 40.0 + CELL * row as f64], [CELL - 1.0, CELL - 1.0], &fill);
        }
    }
    svg.end()
}

fn draw_plane(plane: &[[f64; 2]], labels: &[usize]) -> String {
    let mut svg = Svg::new(520.0, 460.0);
    svg.text([16.0, 22.0], 14.0, "start", "Descriptors on their two principal components, coloured by class");
    let reach = plane.iter().flatten().fold(1e-9_f64, |most, x| most.max(x.abs()));
    for (p, &label) in plane.iter().zip(labels) {
        svg.dot([260.0 + 240.0 * p[0] / reach, 240.0 - 210.0 * p[1] / reach], 2.5, color(label));
    }
    svg.end()
}

/// The descriptor of two poses, of different classes, on each body: lines of one colour coincide.
fn draw_descriptors(angles: &[Angle], bodies: &[&Vec<Places>], labels: &[usize]) -> String {
    let other = labels.iter().position(|&l| l != labels[0]).unwrap_or(0);
    let mut svg = Svg::new(640.0, 300.0);
    svg.text([16.0, 22.0], 14.0, "start", "Descriptor (angles in degrees) of two poses, on several bodies each");
    for degrees in [0, 60, 120, 180] {
        let y = 280.0 - 240.0 * f64::from(degrees) / 180.0;
        svg.line(&[[40.0, y], [630.0, y]], "#ddd", 1.0);
        svg.text([34.0, y + 4.0], 10.0, "end", &degrees.to_string());
    }
    let (mut same, mut different) = (0.0, 0.0);
    for (k, pose) in [0, other].into_iter().enumerate() {
        for body in bodies {
            let values = complete_descriptor(angles, &body[pose]).unwrap();
            let at = |(i, x): (usize, &f64)| {
                [40.0 + 590.0 * i as f64 / angles.len() as f64, 280.0 - 240.0 * x / std::f64::consts::PI]
            };
            let line: Vec<[f64; 2]> = values.iter().enumerate().map(at).collect();
            svg.line(&line, color(k), 1.5);
        }
    }
    let rms = |a: &Places, b: &Places| {
        let [a, b] = [a, b].map(|p| complete_descriptor(angles, p).unwrap());
        (a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / a.len() as f64).sqrt().to_degrees()
    };
    let count = labels.len();
    for i in 0..count {
        bodies[1..].iter().for_each(|body| same += rms(&bodies[0][i], &body[i]) / (count * (bodies.len() - 1)) as f64);
        different += rms(&bodies[0][i], &bodies[0][(i + count / 3) % count]) / count as f64;
    }
    println!(
        "the descriptor differs by {same:.1}° between bodies in one pose, by {different:.1}° between poses on one body"
    );
    svg.end()
}
