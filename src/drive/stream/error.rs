//! Errors of streams.

/// Why a stream of landmarks cannot be used.
///
/// Lines are counted from 1.
#[derive(Debug, thiserror::Error)]
pub enum StreamError {
    /// The input could not be read.
    #[error("the stream cannot be read after line {line}: {cause}")]
    Read {
        /// The last line that was read.
        line: usize,
        /// What the system reports.
        cause: String,
    },
    /// There are no frames.
    #[error("the stream has no frames")]
    Empty,
    /// The text is in UTF-16.
    #[error("the stream is UTF-16 text, not UTF-8")]
    Utf16,
    /// The text has none of the known formats.
    #[error("line {line} begins no known stream format: '{found}'")]
    NotAStream {
        /// The line.
        line: usize,
        /// How it begins.
        found: String,
    },
    /// One JSON document spans several lines.
    #[error("the JSON document that begins in line {line} spans several lines; one frame per line is expected")]
    SeveralLinesPerFrame {
        /// The line.
        line: usize,
    },
    /// A line that is too long.
    #[error("line {line} is longer than {most} bytes")]
    LineTooLong {
        /// The line.
        line: usize,
        /// The limit.
        most: usize,
    },
    /// The last line is incomplete.
    #[error("the stream ends in the middle of line {line}")]
    Truncated {
        /// The line.
        line: usize,
    },
    /// A line that is no JSON.
    #[error("line {line} is not JSON: {cause}")]
    NotJson {
        /// The line.
        line: usize,
        /// What the parser reports.
        cause: String,
    },
    /// A line that holds something other than a frame.
    #[error("line {line}: expected {expected}, found {found}")]
    NotAFrame {
        /// The line.
        line: usize,
        /// What was expected.
        expected: String,
        /// What was found.
        found: String,
    },
    /// Names of landmarks or markers that are not known, and too few that are.
    #[error("line {line} names {known} known landmarks, but {least} are needed; not known: {}", names.join(", "))]
    UnknownLandmarks {
        /// The line.
        line: usize,
        /// How many landmarks follow from the known names.
        known: usize,
        /// How many are needed.
        least: usize,
        /// The names that are not known, the first of them.
        names: Vec<String>,
    },
    /// More than one person in a frame.
    #[error("line {line} holds {people} people, but one figure can follow only one person")]
    SeveralPeople {
        /// The line.
        line: usize,
        /// How many people there are.
        people: usize,
    },
    /// Landmarks in the plane of the image instead of in space.
    #[error("line {line} holds image coordinates between 0 and 1, not places in space")]
    ImageCoordinates {
        /// The line.
        line: usize,
    },
    /// The unit does not follow from the size of the person.
    #[error("the unit is unknown: the person is {stature:.3} units tall, which fits no person in m, cm, mm or in")]
    UnknownUnit {
        /// The person's height, estimated from the lengths of arms and legs, in units of the stream.
        stature: f64,
    },
    /// The unit is not stated, and no frame shows enough of the person to recognise it.
    #[error("the unit is unknown: none of the first {frames} frames shows an arm or a leg")]
    NoSize {
        /// How many frames were searched.
        frames: usize,
    },
    /// The time does not advance.
    #[error("the time does not advance in {skipped} of the first {frames} frames")]
    TimeStandsStill {
        /// Frames whose time is not after that of the frame before.
        skipped: usize,
        /// Frames so far.
        frames: usize,
    },
    /// Too few landmarks in every frame.
    #[error("no frame shows {least} landmarks: the best of {frames} shows {most}")]
    TooFewLandmarks {
        /// Frames so far.
        frames: usize,
        /// How many landmarks a frame needs.
        least: usize,
        /// The most that a frame has.
        most: usize,
    },
    /// A packet that is not Open Sound Control.
    #[error("a packet of {bytes} bytes is not OSC: {cause}")]
    NotOsc {
        /// The length of the packet.
        bytes: usize,
        /// What is wrong.
        cause: String,
    },
}

impl StreamError {
    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        Some(match self {
            Self::Read { .. } => return None,
            Self::Empty => "check that the tracker sends frames to this file or to standard input".into(),
            Self::Utf16 => "convert it: iconv -f UTF-16 -t UTF-8 FILE; in PowerShell write with -Encoding utf8".into(),
            Self::NotAStream { .. } => {
                "give JSON lines, one frame per line, or a .trc file; see the list of stream formats in the README"
                    .into()
            }
            Self::SeveralLinesPerFrame { .. } => {
                "rewrite it with one frame per line, for example with: jq -c '.frames[]' FILE".into()
            }
            Self::LineTooLong { .. } => "write one frame per line, with the landmarks only".into(),
            Self::Truncated { .. } => {
                "the frames before it are usable; record or copy the stream again for the rest".into()
            }
            Self::NotJson { .. } | Self::NotAFrame { .. } => {
                "each line holds one frame, such as {\"t\":0.0,\"landmarks\":{\"leftWrist\":[x,y,z]}}".into()
            }
            Self::UnknownLandmarks { .. } => {
                let ours = crate::drive::landmark::Landmark::ALL.map(|landmark| landmark.name()).join(", ");
                format!("rename them to the names of MediaPipe, Kinect or common marker sets, or to ours: {ours}")
            }
            Self::SeveralPeople { .. } => "let the tracker follow one person, or write one person per stream".into(),
            Self::ImageCoordinates { .. } => {
                "write MediaPipe's world landmarks (pose_world_landmarks) instead of its image landmarks".into()
            }
            Self::UnknownUnit { .. } | Self::NoSize { .. } => "give --unit m, dm, cm, mm or in".into(),
            Self::TimeStandsStill { .. } => "write the time of each frame in seconds as \"t\", increasing".into(),
            Self::TooFewLandmarks { .. } => "let the tracker see the whole person".into(),
            Self::NotOsc { .. } => {
                "check that the sender uses the VMC protocol and that no other program uses this port".into()
            }
        })
    }

    /// Whether only one line or packet is at fault, so that the frames after it can still be read.
    pub fn is_of_one_line(&self) -> bool {
        matches!(
            self,
            Self::LineTooLong { .. }
                | Self::NotJson { .. }
                | Self::NotAFrame { .. }
                | Self::SeveralPeople { .. }
                | Self::NotOsc { .. }
        )
    }
}

/// The beginning of a text, fit for a message: at most 40 characters, without control characters.
pub fn beginning(text: &str) -> String {
    /// Characters; longer texts push the rest of a message out of sight.
    const MOST: usize = 40;
    let mut start: String =
        text.chars().take(MOST).map(|c| if c.is_control() { ' ' } else { c }).collect::<String>().trim().into();
    if text.chars().nth(MOST).is_some() {
        start.push('…');
    }
    start
}
