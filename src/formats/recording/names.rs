//! Frames of a recording without a list: which depth image belongs to which colour image, by their names.

use std::collections::HashMap;

/// Which files make a frame.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Listed {
    pub secs: Option<f64>,
    pub depth: String,
    pub color: Option<String>,
}

/// What an image shows, by its name.
#[derive(Clone, Copy, PartialEq)]
enum Shows {
    Depth,
    Color,
}

/// Folders and parts of names that say what an image shows.
const WORDS: [(&str, Shows); 7] = [
    ("depth", Shows::Depth),
    ("depths", Shows::Depth),
    ("rgb", Shows::Color),
    ("color", Shows::Color),
    ("colour", Shows::Color),
    ("image", Shows::Color),
    ("images", Shows::Color),
];
const PICTURES: [&str; 3] = ["png", "jpg", "jpeg"];

/// What an image shows and what else its name says, such as its number: of `depth/X.png`, `X_depth.png`, `depth_X.png` and
/// `X.depth.png`, in lower case.
fn parsed(name: &str) -> Option<(Shows, String)> {
    let lower = name.to_lowercase();
    let (path, extension) = lower.rsplit_once('.')?;
    if !PICTURES.contains(&extension) {
        return None;
    }
    let (folder, stem) = path.rsplit_once('/').unwrap_or(("", path));
    let word = |text: &str| WORDS.iter().find(|(word, _)| *word == text).map(|(_, shows)| *shows);
    if let Some(shows) = word(folder) {
        // Names may say it again.
        let rest = split_off(stem).filter(|(said, _)| *said == shows).map_or(stem, |(_, rest)| rest);
        return Some((shows, rest.into()));
    }
    let (shows, rest) = split_off(stem)?;
    folder.is_empty().then(|| (shows, rest.into()))
}

/// The word at the beginning or the end of a name, and the rest.
fn split_off(stem: &str) -> Option<(Shows, &str)> {
    const BETWEEN: [char; 3] = ['_', '-', '.'];
    WORDS.iter().find_map(|(word, shows)| {
        let rest = stem.strip_suffix(word).and_then(|rest| rest.strip_suffix(BETWEEN));
        let rest = rest.or_else(|| stem.strip_prefix(word).and_then(|rest| rest.strip_prefix(BETWEEN)));
        rest.map(|rest| (*shows, rest))
    })
}

/// The frames of a folder in the order of their numbers. Where names are times, each depth image has the colour image nearest in
/// time.
pub(super) fn by_name(names: &[String]) -> Vec<Listed> {
    let images: Vec<(&String, Shows, String)> =
        names.iter().filter_map(|name| parsed(name).map(|(shows, key)| (name, shows, key))).collect();
    let of = |wanted: Shows| images.iter().filter(move |(_, shows, _)| *shows == wanted);
    let mut colors: HashMap<&str, &String> = HashMap::new();
    for (name, _, key) in of(Shows::Color) {
        colors.entry(key).or_insert(name);
    }
    let is_png = |name: &str| name.to_lowercase().ends_with(".png");
    let mut frames: Vec<(&str, Listed)> = of(Shows::Depth)
        .filter(|(name, ..)| is_png(name))
        .map(|(name, _, key)| {
            let color = colors.get(key.as_str()).map(|name| name.to_string());
            (key.as_str(), Listed { secs: None, depth: name.to_string(), color })
        })
        .collect();
    if !colors.is_empty() && frames.iter().filter(|(_, frame)| frame.color.is_some()).count() * 2 < frames.len() {
        let stamped = |wanted: Shows| -> Option<Vec<(f64, String)>> {
            let times = of(wanted).map(|(name, _, key)| Some((secs_of(key)?, name.to_string())));
            let mut times = times.collect::<Option<Vec<_>>>()?;
            times.sort_by(|a, b| a.0.total_cmp(&b.0));
            Some(times)
        };
        if let (Some(mut depth), Some(color)) = (stamped(Shows::Depth), stamped(Shows::Color)) {
            depth.retain(|(_, name)| is_png(name));
            return by_time(depth, &color);
        }
    }
    frames.sort_by_key(|f| natural(f.0));
    frames.into_iter().map(|f| f.1).collect()
}

/// Each depth image with the colour image nearest in time, within half a frame.
pub(super) fn by_time(depth: Vec<(f64, String)>, color: &[(f64, String)]) -> Vec<Listed> {
    let mut gaps: Vec<f64> = depth.windows(2).map(|w| w[1].0 - w[0].0).collect();
    gaps.sort_by(f64::total_cmp);
    let within = gaps.get(gaps.len() / 2).map_or(0.02, |g| 0.51 * g);
    depth
        .into_iter()
        .map(|(secs, depth)| {
            let near = color.iter().min_by(|a, b| (a.0 - secs).abs().total_cmp(&(b.0 - secs).abs()));
            let color = near.filter(|c| (c.0 - secs).abs() <= within).map(|c| c.1.clone());
            Listed { secs: Some(secs), depth, color }
        })
        .collect()
}

/// A name that is a time: seconds with decimals, or a long number of milli-, micro- or nanoseconds since 1970.
fn secs_of(key: &str) -> Option<f64> {
    let value: f64 = key.parse().ok().filter(|value: &f64| value.is_finite())?;
    match (key.contains('.'), key.len()) {
        (true, _) => Some(value),
        (false, 13) => Some(value * 1e-3),
        (false, 16) => Some(value * 1e-6),
        (false, 19) => Some(value * 1e-9),
        _ => None,
    }
}

/// Words and numbers of a name, so that 10 comes after 9.
fn natural(name: &str) -> Vec<(String, u128)> {
    let mut parts = vec![(String::new(), 0u128)];
    let mut in_number = false;
    for c in name.chars() {
        match c.to_digit(10) {
            Some(digit) => {
                if let Some(part) = parts.last_mut() {
                    part.1 = part.1.saturating_mul(10).saturating_add(u128::from(digit));
                }
                in_number = true;
            }
            None => {
                if in_number {
                    parts.push((String::new(), 0));
                    in_number = false;
                }
                if let Some(part) = parts.last_mut() {
                    part.0.push(c);
                }
            }
        }
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frames(names: &[&str]) -> Vec<(String, Option<String>)> {
        let names: Vec<String> = names.iter().map(|name| name.to_string()).collect();
        by_name(&names).into_iter().map(|frame| (frame.depth, frame.color)).collect()
    }

    #[test]
    fn names_of_each_layout_are_paired() {
        for [depth, color] in [
            ["depth/7.png", "rgb/7.jpg"],
            ["depth/000007.png", "color/000007.jpg"],
            ["depth/000007.png", "image/000007.png"],
            ["frame-000007.depth.png", "frame-000007.color.png"],
            ["7_depth.png", "7_rgb.png"],
            ["depth_7.png", "color_7.jpg"],
            ["depth/7_depth.png", "rgb/7_rgb.png"],
            ["Depth/7.PNG", "RGB/7.JPG"],
        ] {
            assert_eq!(frames(&[color, depth, "notes.txt"]), [(depth.to_string(), Some(color.to_string()))]);
        }
        assert_eq!(frames(&["10_depth.png", "9_depth.png"]).len(), 2);
        assert_eq!(frames(&["10_depth.png", "9_depth.png"])[0].0, "9_depth.png");
        assert!(frames(&["scan/skin_color.png", "depth.png", "masks/1.png"]).is_empty());
    }

    #[test]
    fn times_as_names_are_paired_by_the_nearest() {
        let found =
            frames(&["depth/100.00.png", "depth/100.10.png", "rgb/99.99.jpg", "rgb/100.11.jpg", "rgb/100.06.jpg"]);
        let color = |name: &str| Some(format!("rgb/{name}.jpg"));
        assert_eq!(found, [("depth/100.00.png".into(), color("99.99")), ("depth/100.10.png".into(), color("100.11"))]);
        let found = frames(&["depth/1305031102175304.png", "depth/1305031102275304.png", "rgb/1305031102270000.png"]);
        assert_eq!(found[0].1, None);
        assert_eq!(found[1].1.as_deref(), Some("rgb/1305031102270000.png"));
    }
}
