//! Which seeds may judge: fresh ones are taken from the hash of a commit, so that nobody chooses them.

use super::error::StudioError;
use crate::numerics::Rng;

/// Seeds below this are for tuning and tests. Those from 1000 to 1105 were first used for judging and later for tuning,
/// so they are spent too; `docs/evaluation.md` lists them. Fresh seeds are never below it.
pub const FRESH_SEEDS_FROM: u64 = 1 << 32;

/// `count` different seeds that follow from the hash of a commit: seeds on which nothing can have been tuned before that
/// commit was made.
///
/// **Requires** the hash as git prints it, 40 hexadecimal digits.
///
/// **Errors** [`StudioError::BadCommitHash`].
///
/// **Guarantees** deterministic; the first seeds do not depend on `count`; each is in `2^32 .. 2^53`, so that it is exact
/// in JSON and cannot be one of the spent seeds.
pub fn seeds_of(commit_hash: &str, count: usize) -> Result<Vec<u64>, StudioError> {
    let text = commit_hash.trim();
    let bad = || StudioError::BadCommitHash { text: text.to_owned() };
    if text.len() != 40 || !text.bytes().all(|b| b.is_ascii_hexdigit()) {
        return Err(bad());
    }
    let mut state = 0;
    for chunk in [0..16, 16..32, 32..40] {
        let word = u64::from_str_radix(&text[chunk], 16).map_err(|_| bad())?;
        state = Rng::new(state ^ word).bits();
    }
    let mut rng = Rng::new(state);
    let mut seeds = Vec::with_capacity(count);
    while seeds.len() < count {
        let seed = rng.bits() >> 11;
        if seed >= FRESH_SEEDS_FROM && !seeds.contains(&seed) {
            seeds.push(seed);
        }
    }
    Ok(seeds)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HASH: &str = "ed82fd8f2c1a4b5d6e7f8091a2b3c4d5e6f70819";

    #[test]
    fn seeds_follow_from_the_hash_and_none_is_spent() {
        let seeds = seeds_of(HASH, 200).unwrap();
        assert_eq!(seeds[..20], seeds_of(&format!("{}\n", HASH.to_uppercase()), 20).unwrap()[..]);
        assert!(seeds.iter().all(|s| (FRESH_SEEDS_FROM..1 << 53).contains(s)));
        let different: std::collections::BTreeSet<_> = seeds.iter().collect();
        assert_eq!(different.len(), 200);
        let other = seeds_of(&HASH.replace('9', "8"), 200).unwrap();
        assert!(other.iter().all(|s| !different.contains(s)));
    }

    #[test]
    fn what_is_no_hash_is_refused() {
        for text in ["", "ed82fd8", &HASH[1..], &HASH.replace('e', "g"), &"é".repeat(20)] {
            assert!(matches!(seeds_of(text, 1), Err(StudioError::BadCommitHash { .. })), "{text}");
        }
    }
}
