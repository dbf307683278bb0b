//! Common names of motion capture markers, and what each is used for.
//!
//! **Source** Vicon's Plug-in Gait, OpenSim's gait2354 model, the Human Body Model, OpenCap, Pose2Sim.

use super::record::{Target, Use};
use crate::body::Side::{self, Left, Right};
use crate::drive::landmark::Landmark::{
    self, Ankle, Chest, Elbow, Hand, Head, Hip, Knee, Neck, Pelvis, Shoulder, Toe, Wrist,
};

/// What a marker with a side is used for.
#[derive(Clone, Copy)]
enum Sided {
    Of(fn(Side) -> Landmark),
    Middle(Landmark),
    Front,
    Back,
}

/// Markers with a side, without it: lower case, no separators. Rank 0 are markers on the skin and computed joint centres,
/// which come together; rank 1 the points of video trackers, of which OpenCap writes both.
const SIDED: &[(&str, Sided, u8)] = &[
    ("fhd", Sided::Middle(Head), 0),
    ("bhd", Sided::Middle(Head), 0),
    ("head", Sided::Middle(Head), 0),
    ("ear", Sided::Middle(Head), 1),
    ("sho", Sided::Of(Shoulder), 0),
    ("acr", Sided::Of(Shoulder), 0),
    ("acromion", Sided::Of(Shoulder), 0),
    ("acromium", Sided::Of(Shoulder), 0),
    ("sjc", Sided::Of(Shoulder), 0),
    ("shoulderstudy", Sided::Of(Shoulder), 0),
    ("shoulder", Sided::Of(Shoulder), 1),
    ("elb", Sided::Of(Elbow), 0),
    ("elbl", Sided::Of(Elbow), 0),
    ("elbm", Sided::Of(Elbow), 0),
    ("elblat", Sided::Of(Elbow), 0),
    ("elbmed", Sided::Of(Elbow), 0),
    ("elbowlat", Sided::Of(Elbow), 0),
    ("elbowmed", Sided::Of(Elbow), 0),
    ("lelbow", Sided::Of(Elbow), 0),
    ("melbow", Sided::Of(Elbow), 0),
    ("lelbowstudy", Sided::Of(Elbow), 0),
    ("melbowstudy", Sided::Of(Elbow), 0),
    ("lee", Sided::Of(Elbow), 0),
    ("mee", Sided::Of(Elbow), 0),
    ("ejc", Sided::Of(Elbow), 0),
    ("elbow", Sided::Of(Elbow), 1),
    ("wra", Sided::Of(Wrist), 0),
    ("wrb", Sided::Of(Wrist), 0),
    ("wristlat", Sided::Of(Wrist), 0),
    ("wristmed", Sided::Of(Wrist), 0),
    ("lwrist", Sided::Of(Wrist), 0),
    ("mwrist", Sided::Of(Wrist), 0),
    ("lwriststudy", Sided::Of(Wrist), 0),
    ("mwriststudy", Sided::Of(Wrist), 0),
    ("lw", Sided::Of(Wrist), 0),
    ("mw", Sided::Of(Wrist), 0),
    ("radius", Sided::Of(Wrist), 0),
    ("ulna", Sided::Of(Wrist), 0),
    ("wjc", Sided::Of(Wrist), 0),
    ("wri", Sided::Of(Wrist), 0),
    ("wrist", Sided::Of(Wrist), 1),
    ("fin", Sided::Of(Hand), 0),
    ("mcp3", Sided::Of(Hand), 0),
    ("hand", Sided::Of(Hand), 1),
    ("index", Sided::Of(Hand), 1),
    ("pinky", Sided::Of(Hand), 1),
    ("asi", Sided::Front, 0),
    ("asis", Sided::Front, 0),
    ("asisstudy", Sided::Front, 0),
    ("psi", Sided::Back, 0),
    ("psis", Sided::Back, 0),
    ("psisstudy", Sided::Back, 0),
    ("hjc", Sided::Of(Hip), 0),
    ("hjcstudy", Sided::Of(Hip), 0),
    ("hip", Sided::Of(Hip), 1),
    ("gtr", Sided::Of(Hip), 2),
    ("gtro", Sided::Of(Hip), 2),
    ("trochanter", Sided::Of(Hip), 2),
    ("kne", Sided::Of(Knee), 0),
    ("knem", Sided::Of(Knee), 0),
    ("knel", Sided::Of(Knee), 0),
    ("mkne", Sided::Of(Knee), 0),
    ("kneelat", Sided::Of(Knee), 0),
    ("kneemed", Sided::Of(Knee), 0),
    ("lknee", Sided::Of(Knee), 0),
    ("mknee", Sided::Of(Knee), 0),
    ("kneestudy", Sided::Of(Knee), 0),
    ("mkneestudy", Sided::Of(Knee), 0),
    ("lke", Sided::Of(Knee), 0),
    ("lek", Sided::Of(Knee), 0),
    ("mek", Sided::Of(Knee), 0),
    ("kjc", Sided::Of(Knee), 0),
    ("knee", Sided::Of(Knee), 1),
    ("ank", Sided::Of(Ankle), 0),
    ("ankm", Sided::Of(Ankle), 0),
    ("mank", Sided::Of(Ankle), 0),
    ("anklelat", Sided::Of(Ankle), 0),
    ("anklemed", Sided::Of(Ankle), 0),
    ("lankle", Sided::Of(Ankle), 0),
    ("mankle", Sided::Of(Ankle), 0),
    ("anklestudy", Sided::Of(Ankle), 0),
    ("manklestudy", Sided::Of(Ankle), 0),
    ("lm", Sided::Of(Ankle), 0),
    ("mm", Sided::Of(Ankle), 0),
    ("ajc", Sided::Of(Ankle), 0),
    ("ankle", Sided::Of(Ankle), 1),
    ("toe", Sided::Of(Toe), 0),
    ("toetip", Sided::Of(Toe), 0),
    ("toestudy", Sided::Of(Toe), 0),
    ("bigtoe", Sided::Of(Toe), 1),
    ("smalltoe", Sided::Of(Toe), 1),
    ("footindex", Sided::Of(Toe), 1),
    ("toelat", Sided::Of(Toe), 1),
    ("toemed", Sided::Of(Toe), 1),
];

/// Markers in the middle of the body. The names that name the landmark itself are better than markers on the skin near it.
const MIDDLE: &[(&str, &[Target], u8)] = &[
    ("head", &[Target::Landmark(Head)], 0),
    ("thead", &[Target::Landmark(Head)], 0),
    ("fhead", &[Target::Landmark(Head)], 0),
    ("tophead", &[Target::Landmark(Head)], 0),
    ("headtop", &[Target::Landmark(Head)], 0),
    ("nose", &[Target::Landmark(Head)], 2),
    ("neck", &[Target::Landmark(Neck)], 0),
    ("c7", &[Target::Landmark(Neck)], 1),
    ("c7study", &[Target::Landmark(Neck)], 1),
    ("clav", &[Target::Landmark(Neck)], 1),
    ("chest", &[Target::Landmark(Chest)], 0),
    ("strn", &[Target::Landmark(Chest)], 1),
    ("sternum", &[Target::Landmark(Chest)], 1),
    ("xyph", &[Target::Landmark(Chest)], 1),
    ("t10", &[Target::Landmark(Chest)], 1),
    ("pelvis", &[Target::Landmark(Pelvis)], 0),
    ("midhip", &[Target::Landmark(Pelvis)], 0),
    ("chip", &[Target::Landmark(Pelvis)], 0),
    ("hip", &[Target::Landmark(Pelvis)], 0),
    ("sacr", &BOTH_BACKS, 1),
    ("sacrum", &BOTH_BACKS, 1),
    ("sacral", &BOTH_BACKS, 1),
    ("vsacral", &BOTH_BACKS, 1),
    ("vsacrum", &BOTH_BACKS, 1),
];

/// The sacrum is the middle of both.
const BOTH_BACKS: [Target; 2] = [Target::BackOfPelvis(Left), Target::BackOfPelvis(Right)];

/// What the marker of that name is used for; nothing where the name is not known.
///
/// Case and separators do not matter, nor does the name of a subject before a colon or an underscore.
pub fn uses_of_marker(name: &str) -> Vec<Use> {
    let after = |separator: char| name.rsplit_once(separator).map(|(_, rest)| rest);
    let after_first = |separator: char| name.split_once(separator).map(|(_, rest)| rest);
    let candidates = [Some(name), after(':'), after_first('_'), after('_')];
    candidates.into_iter().flatten().map(uses_of_plain).find(|uses| !uses.is_empty()).unwrap_or_default()
}

fn uses_of_plain(name: &str) -> Vec<Use> {
    let plain = name.chars().filter(char::is_ascii_alphanumeric).collect::<String>().to_ascii_lowercase();
    if let Some((_, targets, rank)) = MIDDLE.iter().find(|(known, ..)| *known == plain) {
        return targets.iter().map(|&target| Use { target, rank: *rank }).collect();
    }
    let sides = [("left", Left), ("right", Right), ("l", Left), ("r", Right)];
    let prefixed = sides.iter().filter_map(|(prefix, side)| Some((plain.strip_prefix(prefix)?, *side)));
    let suffixed = sides.iter().filter_map(|(suffix, side)| Some((plain.strip_suffix(suffix)?, *side)));
    let known = |(part, side): (&str, Side)| {
        let (_, of, rank) = SIDED.iter().find(|(known, ..)| *known == part)?;
        let target = match of {
            Sided::Of(landmark) => Target::Landmark(landmark(side)),
            Sided::Middle(landmark) => Target::Landmark(*landmark),
            Sided::Front => Target::FrontOfPelvis(side),
            Sided::Back => Target::BackOfPelvis(side),
        };
        Some(Use { target, rank: *rank })
    };
    prefixed.chain(suffixed).find_map(known).into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_all_marker_sets_are_known() {
        let cases = [
            ("LSHO", Target::Landmark(Shoulder(Left))),
            ("R.Acromium", Target::Landmark(Shoulder(Right))),
            ("L.Shoulder", Target::Landmark(Shoulder(Left))),
            ("r_shoulder_study", Target::Landmark(Shoulder(Right))),
            ("RElbow", Target::Landmark(Elbow(Right))),
            ("r_lelbow_study", Target::Landmark(Elbow(Right))),
            ("Subject36_LASI", Target::FrontOfPelvis(Left)),
            ("actor:RPSI", Target::BackOfPelvis(Right)),
            ("r.ASIS_study", Target::FrontOfPelvis(Right)),
            ("L_HJC_study", Target::Landmark(Hip(Left))),
            ("midHip", Target::Landmark(Pelvis)),
            ("Neck", Target::Landmark(Neck)),
            ("LWRB", Target::Landmark(Wrist(Left))),
            ("R.Knee.Med", Target::Landmark(Knee(Right))),
            ("LANK", Target::Landmark(Ankle(Left))),
            ("LBigToe", Target::Landmark(Toe(Left))),
            ("Knee_R", Target::Landmark(Knee(Right))),
            ("STRN", Target::Landmark(Chest)),
            ("RFHD", Target::Landmark(Head)),
        ];
        for (name, target) in cases {
            assert_eq!(uses_of_marker(name).first().map(|used| used.target), Some(target), "{name}");
        }
        assert_eq!(uses_of_marker("V.Sacral").len(), 2);
        for name in ["LTHI", "r_thigh1_study", "L.Heel", "", ":", "_", "é"] {
            assert_eq!(uses_of_marker(name), [], "{name}");
        }
    }

    #[test]
    fn no_name_is_listed_twice() {
        let mut names: Vec<&str> = SIDED.iter().map(|(name, ..)| *name).collect();
        names.sort_unstable();
        assert!(names.windows(2).all(|pair| pair[0] != pair[1]));
    }
}
