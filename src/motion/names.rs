//! Recognises rigs by the names of their joints.

use super::alias_tables::{AliasTable, TABLES};
use super::clip::Clip;
use super::rig_map::{MIDDLE, OF_SIDE, RigMap};
use crate::body::Side;
use std::collections::BTreeMap;

/// The human joints by the table that recognises most of them; `None` if no table recognises a whole person.
pub(super) fn map_by_names(clip: &Clip) -> Option<RigMap> {
    let names: Vec<JointName> = clip.joints.iter().map(|joint| JointName::new(&joint.name)).collect();
    let each = TABLES.iter().flat_map(|table| table.sides.iter().map(move |sides| (table, sides)));
    let maps = each.map(|(table, sides)| mapped(table, *sides, &names));
    let whole = maps.filter(|map| map.gap(clip).is_none());
    // The first of several that recognise the same number.
    whole.reduce(|best, map| if map.len() > best.len() { map } else { best })
}

/// A joint's name in the forms that are compared.
struct JointName {
    /// Without a namespace.
    exact: String,
    /// Without namespace, case and separators.
    whole: String,
    /// What follows each separator: the name without a rig's prefix.
    parts: Vec<String>,
}

const SEPARATORS: [char; 6] = ['_', '.', '-', ' ', ':', '|'];

impl JointName {
    fn new(name: &str) -> Self {
        let name = name.rsplit([':', '|']).next().unwrap_or(name);
        // Mixamo's prefix may have lost its colon, and carry a digit.
        let bare = match name.get(..9).filter(|prefix| prefix.eq_ignore_ascii_case("mixamorig")) {
            Some(_) => name[9..].trim_start_matches(|c: char| c.is_ascii_digit()),
            None => name,
        };
        let parts = bare.char_indices().filter(|(_, c)| SEPARATORS.contains(c));
        Self {
            exact: name.into(),
            whole: plain(bare),
            parts: parts.map(|(at, c)| plain(&bare[at + c.len_utf8()..])).collect(),
        }
    }
}

/// Lower case, letters and digits alone.
pub(super) fn plain(name: &str) -> String {
    name.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

fn mapped(table: &AliasTable, (left, right): (&str, &str), names: &[JointName]) -> RigMap {
    let mut taken = vec![false; names.len()];
    let mut find = |alias: &str| {
        let word = plain(alias);
        let find = |matches: &dyn Fn(&JointName) -> bool| (0..names.len()).find(|&k| !taken[k] && matches(&names[k]));
        let found = find(&|name| name.exact.eq_ignore_ascii_case(alias))
            .or_else(|| find(&|name| name.whole == word))
            .or_else(|| find(&|name| name.parts.contains(&word)));
        found.inspect(|&k| taken[k] = true)
    };
    let mut joints = BTreeMap::new();
    // The sides first: their names are longer, so that `left_hip` is not taken as the `hip` of another rig.
    for (side, word) in [(Side::Left, left), (Side::Right, right)] {
        for (joint, aliases) in OF_SIDE.iter().zip(&table.names[MIDDLE.len()..]) {
            joints.insert(joint(side), aliases.iter().filter_map(|a| find(&a.replace('@', word))).collect());
        }
    }
    for (joint, aliases) in MIDDLE.into_iter().zip(&table.names) {
        joints.insert(joint, aliases.iter().filter_map(|alias| find(alias)).collect());
    }
    RigMap::new(Some(table.rig), joints)
}
