//! Reads OpenSim's track row column text (TRC), row by row.
//!
//! **Source** OpenSim's documentation of marker (.trc) files. Writers differ: names with or without empty cells between
//! them, a blank line or none before the rows, lost markers as empty cells, missing cells or zeros.

use super::error::StreamError;
use super::lines::{Line, Lines};
use super::marker_names::uses_of_marker;
use super::record::{Record, Sample, Use, finite_place, not_a_frame};
use crate::scan::Unit;
use std::io::BufRead;

/// The first word of a file.
const MAGIC: &str = "PathFileType";

/// Most markers of a file: the largest published sets for the whole body with hands have 250.
const MOST_MARKERS: usize = 2_000;

/// Columns of a frame number and a time, before the coordinates.
const COLUMNS_BEFORE: usize = 2;

/// Whether a line begins a TRC file.
pub fn is_trc(line: &str) -> bool {
    line.trim_start().get(..MAGIC.len()).is_some_and(|start| start.eq_ignore_ascii_case(MAGIC))
}

/// The header of a file.
pub struct Trc {
    /// Frames per second, where stated.
    rate: Option<f64>,
    /// The unit, where stated.
    pub unit: Option<Unit>,
    /// The uses of the markers; samples refer to them by index.
    pub uses: Vec<Use>,
    /// The names that are not used.
    pub unused: Vec<String>,
    /// For each marker the first of its uses, and how many it has.
    markers: Vec<(usize, usize)>,
    /// The first row, where the header ended early.
    row: Option<Line>,
}

impl Trc {
    /// Reads the header, the first line of which was read before.
    ///
    /// **Errors** a header that is incomplete.
    pub fn read<R: BufRead>(first: &Line, lines: &mut Lines<R>) -> Result<Self, StreamError> {
        let keys = next(lines, first.number)?;
        let values = next(lines, keys.number)?;
        let stated = |key: &str| {
            let column = cells(&keys.text).position(|cell| cell.eq_ignore_ascii_case(key))?;
            cells(&values.text).nth(column)
        };
        let rate = stated("DataRate").and_then(|text| text.parse().ok()).filter(|rate: &f64| rate.is_finite());
        let unit = stated("Units").and_then(unit_of);
        let rate = rate.filter(|rate| *rate > 0.0);

        let names = next(lines, values.number)?;
        let named: Vec<(usize, &str)> =
            cells(&names.text).enumerate().skip(COLUMNS_BEFORE).filter(|(_, name)| !name.is_empty()).collect();
        if named.is_empty() || named.len() > MOST_MARKERS {
            let expected = format!("1 to {MOST_MARKERS} marker names, separated by tabs");
            return Err(not_a_frame(names.number, expected, &names.text));
        }
        let (mut uses, mut unused, mut markers) = (Vec::new(), Vec::new(), Vec::new());
        for (_, name) in &named {
            let of_marker = uses_of_marker(name);
            if of_marker.is_empty() {
                unused.push((*name).to_owned());
            }
            markers.push((uses.len(), of_marker.len()));
            uses.extend(of_marker);
        }
        let mut trc = Self { rate, unit, uses, unused, markers, row: None };
        let axes = next(lines, names.number)?;
        // The line "X1 Y1 Z1 …" begins with empty cells.
        if cells(&axes.text).next().is_some_and(|cell| cell.parse::<f64>().is_ok()) {
            trc.row = Some(axes);
        }
        Ok(trc)
    }

    /// A row that was read with the header.
    pub fn take_row(&mut self) -> Option<Line> {
        self.row.take()
    }

    /// Reads a row.
    pub fn read_row(&self, line: &Line) -> Result<Record, StreamError> {
        let cells: Vec<&str> = cells(&line.text).collect();
        let is_short = cells.len() < COLUMNS_BEFORE + 3 * self.markers.len();
        if is_short && !line.is_ended {
            return Err(StreamError::Truncated { line: line.number });
        }
        let number = |column: usize| -> Result<Option<f64>, StreamError> {
            match cells.get(column) {
                None | Some(&"") => Ok(None),
                Some(text) => text.parse().map(Some).map_err(|_| match line.is_ended {
                    true => not_a_frame(line.number, "numbers, separated by tabs", text),
                    false => StreamError::Truncated { line: line.number },
                }),
            }
        };
        let frame = number(0)?;
        let time = number(1)?.or_else(|| Some((frame? - 1.0) / self.rate?));
        let time_secs = time.filter(|time| time.is_finite());
        let mut record = Record { line: line.number, time_secs, ..Record::default() };
        for (marker, &(first, count)) in self.markers.iter().enumerate() {
            let column = COLUMNS_BEFORE + 3 * marker;
            let coordinates = [number(column)?, number(column + 1)?, number(column + 2)?];
            let place = match coordinates {
                // Cortex and others write zeros for a marker that was lost.
                [Some(x), Some(y), Some(z)] if [x, y, z] != [0.0; 3] => {
                    let place = finite_place([x, y, z]);
                    record.not_finite += usize::from(place.is_none() && count > 0);
                    place
                }
                _ => None,
            };
            record.samples.extend((first..first + count).map(|point| Sample { point, place, confidence: 1.0 }));
        }
        Ok(record)
    }
}

fn cells(line: &str) -> impl Iterator<Item = &str> {
    line.split('\t').map(str::trim)
}

fn next<R: BufRead>(lines: &mut Lines<R>, before: usize) -> Result<Line, StreamError> {
    match lines.next_line() {
        Some(line) => line,
        None => Err(StreamError::Truncated { line: before }),
    }
}

fn unit_of(text: &str) -> Option<Unit> {
    Some(match text.to_ascii_lowercase().as_str() {
        "m" | "meter" | "meters" | "metre" | "metres" => Unit::Metre,
        "dm" => Unit::Decimetre,
        "cm" | "centimeters" | "centimetres" => Unit::Centimetre,
        "mm" | "millimeters" | "millimetres" => Unit::Millimetre,
        "in" | "inch" | "inches" => Unit::Inch,
        _ => return None,
    })
}
