//! Fuses an RGB-D folder and holds the result against what is known: `measure_fusion FOLDER [--truth BODY.ply …]
//! [--every N] [--voxel M] [--no-color]
//! [-o OUT.ply] [--clean OUT.ply]`, or `--mesh FILE.ply --truth …` for a mesh that is there. Several `--truth` are one surface.
//! `groundtruth.txt` in the folder is read for the camera's path; nothing of it goes into the fusion.

use anyhow::{Context, Result, bail};
use nalgebra::{Isometry3, Matrix3, Matrix6, Quaternion, UnitQuaternion, Vector3, Vector6};
use overcoat::formats::{
    MeshKind, PlyOptions, RawMesh, read_mesh, read_recording, recording_files, write_ply, write_recording,
};
use overcoat::geometry::{Point, SurfaceIndex, TriMesh};
use overcoat::scan::{FusionParams, FusionReport, FusionStep, ScanParams, clean, fuse};
use std::path::{Path, PathBuf};
use std::time::Instant;

fn main() -> Result<()> {
    let (mut folder, mut truth, mut out, mut cleaned) = (None, Vec::new(), None, None);
    let mut given = None;
    let (mut every, mut with_color, mut params) = (1, true, FusionParams::default());
    let mut args = std::env::args().skip(1);
    while let Some(arg) = args.next() {
        let mut value = || args.next().with_context(|| format!("{arg} needs a value"));
        match arg.as_str() {
            "--truth" => truth.push(PathBuf::from(value()?)),
            "--every" => every = value()?.parse()?,
            "--voxel" => params.voxel = value()?.parse()?,
            "--truncation" => params.truncation = value()?.parse()?,
            "--evidence" => params.least_evidence = value()?.parse()?,
            "--tracking" => params.tracking_voxel = value()?.parse()?,
            "--rounds" => params.settling_rounds = value()?.parse()?,
            "--denoise" => params.denoise_rounds = value()?.parse()?,
            "--no-color" => with_color = false,
            "--mesh" => given = Some(PathBuf::from(value()?)),
            "-o" => out = Some(PathBuf::from(value()?)),
            "--clean" => cleaned = Some(PathBuf::from(value()?)),
            _ if folder.is_none() => folder = Some(PathBuf::from(arg)),
            _ => bail!("'{arg}' is one argument too many"),
        }
    }
    if let Some(file) = given {
        // Some other program's mesh, in the truth's frame.
        measure_surface(
            &file.display().to_string(),
            &joined(std::slice::from_ref(&file))?,
            &joined(&truth)?,
            &Isometry3::identity(),
        );
        return Ok(());
    }
    let folder = folder.context("which folder?")?;
    let mut recording = read_recording(&packed(&folder)?)?;
    let mut k = 0;
    recording.frames.retain(|_| {
        k += 1;
        (k - 1) % every == 0
    });
    if !with_color {
        recording.frames.iter_mut().for_each(|frame| frame.color = None);
    }
    let (began, at_first) = (Instant::now(), processor_secs());
    let mut last = (began, at_first);
    let mut laps: Vec<(String, [f64; 2])> = Vec::new();
    let fusion = fuse(&recording, &params, &mut |step| {
        let name = format!("{step:?}").split([' ', '{']).next().unwrap_or_default().to_string();
        let now = (Instant::now(), processor_secs());
        let secs = [(now.0 - last.0).as_secs_f64(), now.1 - last.1];
        last = now;
        match laps.last_mut().filter(|l| l.0 == name) {
            Some((_, lap)) => *lap = [lap[0] + secs[0], lap[1] + secs[1]],
            None => laps.push((name, secs)),
        }
        match step {
            FusionStep::Tracked { frame, residual: None, .. } => println!("  lost {frame}"),
            FusionStep::Integrated { so_far } => println!("  {so_far:?} of {} mm voxels", 1e3 * params.voxel),
            _ => {}
        }
    })?;
    println!("{}: {:.2} s in all", folder.display(), began.elapsed().as_secs_f64());
    for (name, [wall, processor]) in laps {
        let a_frame = 1e3 / recording.frames.len() as f64;
        println!(
            "  {name:10} {:.0} ms, {:.2} a frame, {:.2} of processor time",
            1e3 * wall,
            a_frame * wall,
            a_frame * processor
        );
    }
    for finding in &fusion.findings {
        println!("  {finding}");
    }
    let mut truth_from_model = None;
    if let Ok(text) = std::fs::read_to_string(folder.join("groundtruth.txt")) {
        truth_from_model = Some(measure_path(&fusion.report, &ground_truth(&text)?));
    }
    let mesh = mesh_of(&fusion.mesh)?;
    if let Some(path) = out {
        write_ply(&fusion.mesh, &PlyOptions::default(), std::fs::File::create(&path)?)?;
    }
    let scan = clean(&fusion.mesh, &ScanParams::default(), &mut |_| {})?;
    if let Some(path) = cleaned {
        let raw = RawMesh {
            points: scan.mesh.points().iter().map(|p| [p.x, p.y, p.z]).collect(),
            faces: scan.mesh.faces().iter().map(|f| f.map(|v| v.0)).collect(),
            colors: scan.colors.clone().map(|c| c.0),
            ..RawMesh::default()
        };
        write_ply(&raw, &PlyOptions::default(), std::fs::File::create(&path)?)?;
    }
    println!(
        "  whole with cleaning {:.2} s, {:.2} of processor time; peak {} MiB",
        began.elapsed().as_secs_f64(),
        processor_secs() - at_first,
        peak_mib()
    );
    if !truth.is_empty() {
        let truth = joined(&truth)?;
        let guess = truth_from_model.unwrap_or_else(Isometry3::identity);
        measure_surface("fused", &mesh, &truth, &guess);
        measure_surface("cleaned", &scan.mesh, &truth, &guess);
    }
    Ok(())
}

fn packed(folder: &Path) -> Result<Vec<u8>> {
    let mut names = Vec::new();
    for (prefix, dir) in [("", folder.to_path_buf()), ("depth/", folder.join("depth")), ("rgb/", folder.join("rgb"))] {
        for entry in std::fs::read_dir(dir).into_iter().flatten().flatten().filter(|e| e.path().is_file()) {
            names.push(format!("{prefix}{}", entry.file_name().to_string_lossy()));
        }
    }
    let files = recording_files(&names, &mut |name| std::fs::read(folder.join(name)).ok())?;
    let files: Vec<(String, Vec<u8>)> =
        files.into_iter().map(|n| Ok((n.clone(), std::fs::read(folder.join(&n))?))).collect::<Result<_>>()?;
    let mut bytes = Vec::new();
    write_recording(&files, &mut bytes)?;
    Ok(bytes)
}

/// Processor time of all threads so far, to 10 ms; 0 where the system does not tell.
fn processor_secs() -> f64 {
    let status = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // After the program's name, which may hold anything, user and system time are the 12th and 13th.
    let after_name = status.rsplit(')').next().unwrap_or_default();
    let ticks = after_name.split_whitespace().skip(11).take(2).filter_map(|n| n.parse::<f64>().ok());
    ticks.sum::<f64>() / 100.0
}

fn peak_mib() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|l| l.starts_with("VmHWM")).unwrap_or("0 0");
    line.split_whitespace().nth(1).and_then(|n| n.parse::<u64>().ok()).unwrap_or(0) / 1024
}

fn mesh_of(raw: &RawMesh) -> Result<TriMesh> {
    Ok(TriMesh::try_from_indices(raw.points.iter().map(|&p| Point::from(p)).collect(), &raw.faces)?)
}

fn joined(files: &[PathBuf]) -> Result<TriMesh> {
    let (mut points, mut faces) = (Vec::new(), Vec::new());
    for file in files {
        let raw = read_mesh(MeshKind::Ply, std::fs::File::open(file).with_context(|| file.display().to_string())?)?;
        let offset = points.len() as u32;
        points.extend(raw.points.iter().map(|&p| Point::from(p)));
        faces.extend(raw.faces.iter().map(|f| f.map(|v| v + offset)));
    }
    Ok(TriMesh::try_from_indices(points, &faces)?)
}

fn ground_truth(text: &str) -> Result<Vec<(f64, Isometry3<f64>)>> {
    let rows = text.lines().filter(|l| !l.starts_with('#') && !l.trim().is_empty());
    rows.map(|line| {
        let n: Vec<f64> = line.split_whitespace().map(str::parse).collect::<Result<_, _>>()?;
        let q = UnitQuaternion::from_quaternion(Quaternion::new(n[7], n[4], n[5], n[6]));
        Ok((n[0], Isometry3::from_parts(Vector3::new(n[1], n[2], n[3]).into(), q)))
    })
    .collect()
}

/// Root mean square of the camera's place and direction after the best rigid motion (Umeyama 1991, no scale).
fn measure_path(report: &FusionReport, truth: &[(f64, Isometry3<f64>)]) -> Isometry3<f64> {
    let pairs: Vec<(Isometry3<f64>, Isometry3<f64>)> = report
        .poses
        .iter()
        .filter_map(|p| truth.iter().find(|t| (t.0 - p.secs).abs() < 1e-3).map(|t| (p.model_from_camera, t.1)))
        .collect();
    let n = pairs.len() as f64;
    let a = pairs.iter().map(|p| p.0.translation.vector).sum::<Vector3<f64>>() / n;
    let b = pairs.iter().map(|p| p.1.translation.vector).sum::<Vector3<f64>>() / n;
    let spread: Matrix3<f64> =
        pairs.iter().map(|p| (p.1.translation.vector - b) * (p.0.translation.vector - a).transpose()).sum();
    let svd = spread.svd(true, true);
    let (u, v) = (svd.u.unwrap_or_else(Matrix3::identity), svd.v_t.unwrap_or_else(Matrix3::identity));
    let sign = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, (u * v).determinant().signum()));
    let rotation = UnitQuaternion::from_matrix(&(u * sign * v));
    let truth_from_model = Isometry3::from_parts((b - rotation * a).into(), rotation);
    let (mut shift, mut turn, mut most) = (0.0f64, 0.0f64, 0.0f64);
    for (ours, theirs) in &pairs {
        let mapped = truth_from_model * ours;
        let off = (mapped.translation.vector - theirs.translation.vector).norm();
        shift += off * off;
        most = most.max(off);
        turn += mapped.rotation.angle_to(&theirs.rotation).powi(2);
    }
    println!(
        "  path over {} frames: {:.2} mm (most {:.2}), {:.3}° root mean square",
        pairs.len(),
        1e3 * (shift / n).sqrt(),
        1e3 * most,
        (turn / n).sqrt().to_degrees()
    );
    truth_from_model
}

fn measure_surface(name: &str, scan: &TriMesh, truth: &TriMesh, guess: &Isometry3<f64>) {
    let index = SurfaceIndex::prepare(truth);
    let mut pose = *guess;
    let points: Vec<Point> = scan.points().iter().step_by(scan.vertex_count() / 8000 + 1).copied().collect();
    for _ in 0..15 {
        let (mut matrix, mut vector) = (Matrix6::zeros(), Vector6::zeros());
        for p in &points {
            let q = pose * p;
            let near = index.closest(&q);
            if near.distance > 0.01 {
                continue;
            }
            let n = truth.face_normal(near.face);
            let arm = q.coords.cross(&n);
            let row = Vector6::new(arm.x, arm.y, arm.z, n.x, n.y, n.z);
            matrix += row * row.transpose();
            vector += row * n.dot(&(q - near.point));
        }
        let Some(step) = matrix.cholesky().map(|c| -c.solve(&vector)) else { break };
        let rotation = UnitQuaternion::from_scaled_axis(step.fixed_rows::<3>(0).into_owned());
        pose = Isometry3::from_parts(step.fixed_rows::<3>(3).into_owned().into(), rotation) * pose;
    }
    let moved = scan.map_points(|p| pose * p);
    let there = distances(&samples(&moved), &index);
    // Truth that no view can see (soles, the inside of folds) counts all the same.
    let back = distances(&samples(truth), &SurfaceIndex::prepare(&moved));
    println!(
        "  {name}: {} faces; scan to truth {:.2} mm mean, {:.2} at 95 %; truth to scan {:.2}, {:.2}",
        scan.face_count(),
        there[0],
        there[1],
        back[0],
        back[1]
    );
}

/// Points spread evenly: the middles of equal shares of the area.
fn samples(mesh: &TriMesh) -> Vec<Point> {
    let step = mesh.area() / 40_000.0;
    let (mut passed, mut next) = (0.0, 0.5 * step);
    let mut points = Vec::new();
    for f in mesh.face_ids() {
        passed += mesh.face_area(f);
        let [a, b, c] = mesh.triangle(f);
        let mut k = 0u32;
        while next < passed {
            k += 1;
            let (s, t) = (f64::from(k) * 0.7549 % 1.0, f64::from(k) * 0.5698 % 1.0);
            let (s, t) = if s + t > 1.0 { (1.0 - s, 1.0 - t) } else { (s, t) };
            points.push(a + (b - a) * s + (c - a) * t);
            next += step;
        }
    }
    points
}

fn distances(points: &[Point], index: &SurfaceIndex) -> [f64; 2] {
    let mut off: Vec<f64> = points.iter().map(|p| 1e3 * index.closest(p).distance).collect();
    off.sort_by(f64::total_cmp);
    [off.iter().sum::<f64>() / off.len() as f64, off[off.len() * 95 / 100]]
}
