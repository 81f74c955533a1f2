//! How a device shows on the wire that it is of one family: a few short reads that no other family answers.

use crate::plan::Read;
use crate::{OverRead, Point, Profile};

/// A longer point is no short read.
const SHORT: u16 = 4;

/// Short reads that a device of one profile answers and a device of any other does not.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Signature {
    /// Asked first. The point that names the model is among them where the profile has one.
    pub first: Vec<Read>,
    /// Other registers that say the same, for a device that does not know one of the first; may be empty.
    pub second: Vec<Read>,
}

/// The fewest short reads by which a device of `profile` is told from devices of `others`.
///
/// A profile of the same key is passed over. Where another map holds all of this profile's, nothing tells the two apart.
pub fn signature(profile: &Profile, others: &[Profile]) -> Signature {
    let others: Vec<&Profile> = others.iter().filter(|other| other.key != profile.key).collect();
    let candidates: Vec<Read> =
        profile.points.iter().filter(|point| is_short(point)).map(|point| whole(profile, point)).collect();
    let identity = profile.identity.as_ref().and_then(|identity| profile.points.get(identity.point));
    let named = identity.filter(|point| is_short(point)).map(|point| whole(profile, point));
    let first = fewest(named, &candidates, &others, |_| true);

    let overlaps = |one: &Read, other: &Read| one.covers(other.address, 1) || other.covers(one.address, 1);
    let unused: Vec<Read> =
        candidates.into_iter().filter(|read| !first.iter().any(|used| overlaps(used, read))).collect();
    // What is missing in a device is more likely missing together with its neighbours.
    let range = |read: &Read| profile.wire.readable.partition_point(|(_, last)| *last < read.address);
    let elsewhere = |read: &Read| !first.iter().any(|used| range(used) == range(read));
    let second = fewest(None, &unused, &others, elsewhere);
    Signature { first, second }
}

/// Whether a device of `profile` answers a read with all its registers.
pub fn answers(profile: &Profile, read: Read) -> bool {
    let wire = &profile.wire;
    let is_whole = read.count <= wire.max_read || wire.over_read != OverRead::Truncate;
    is_whole && wire.functions.contains(&read.function) && wire.is_readable(read.address, read.count)
}

/// `begun` and the candidates that are needed besides, until every other profile refuses one of them.
fn fewest(
    begun: Option<Read>,
    candidates: &[Read],
    others: &[&Profile],
    preferred: impl Fn(&Read) -> bool,
) -> Vec<Read> {
    let mut chosen: Vec<Read> = begun.into_iter().collect();
    loop {
        let left: Vec<&&Profile> =
            others.iter().filter(|other| chosen.iter().all(|read| answers(other, *read))).collect();
        let refusals = |read: &Read| left.iter().filter(|other| !answers(other, *read)).count();
        let best = candidates.iter().min_by_key(|read| {
            (std::cmp::Reverse(refusals(read)), !preferred(read), read.count, read.address)
        });
        match best {
            Some(best) if refusals(best) > 0 || chosen.is_empty() => chosen.push(*best),
            _ => return chosen,
        }
    }
}

fn is_short(point: &Point) -> bool {
    point.access.is_readable() && point.registers <= SHORT
}

fn whole(profile: &Profile, point: &Point) -> Read {
    Read { function: profile.wire.read_function(), address: point.address, count: point.registers }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{builtin, builtins};

    fn of(key: &str) -> Signature {
        signature(builtin(key).unwrap(), builtins())
    }

    #[test]
    fn one_read_tells_each_built_in_profile_from_the_others() {
        for profile in builtins() {
            let Signature { first, second } = of(&profile.key);
            assert_eq!((first.len(), second.len()), (1, 1), "{}", profile.key);
        }
        // 10609 names the model.
        assert_eq!(of("datakom-d").first, [Read { function: 3, address: 10_609, count: 1 }]);
    }

    #[test]
    fn what_says_it_again_lies_elsewhere_where_it_can() {
        let ranges = |key: &str| {
            let readable = &builtin(key).unwrap().wire.readable;
            let Signature { first, second } = of(key);
            [first[0], second[0]].map(|read| readable.partition_point(|(_, last)| *last < read.address))
        };
        for key in ["datakom-d", "datakom-dkg705", "smartgen-hat821si"] {
            let [first, second] = ranges(key);
            assert_ne!(first, second, "{key}");
        }
    }

    #[test]
    fn several_reads_are_taken_where_one_is_not_enough() {
        let text = include_str!("../tests/sound.toml");
        let sound = Profile::parse("sound.toml", text).unwrap_or_else(|findings| panic!("{findings}"));
        // Two others, each of which has all but a part of its map.
        let lacking = |key: &str, end: (u16, u16)| {
            let mut other = sound.clone();
            other.key = key.to_owned();
            other.wire.readable = vec![end];
            other
        };
        let (low, high) = (lacking("low", (0, 10)), lacking("high", (5, 65_535)));
        let read = signature(&sound, &[low.clone(), high.clone()]).first;
        assert!(read.iter().any(|read| !answers(&low, *read)), "{read:?}");
        assert!(read.iter().any(|read| !answers(&high, *read)), "{read:?}");
        // Nothing tells it from itself, and something is asked all the same.
        assert_eq!(signature(&sound, &[lacking("same", (0, 65_535))]).first.len(), 1);
        assert_eq!(signature(&sound, std::slice::from_ref(&sound)).first.len(), 1);
    }
}
