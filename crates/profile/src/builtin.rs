//! The profiles that are compiled in.

use std::sync::LazyLock;

use crate::profile::Profile;

/// File name and text of each built-in profile.
const SOURCES: &[(&str, &str)] = &[
    ("profiles/datakom-d/profile.toml", include_str!("../../../profiles/datakom-d/profile.toml")),
    ("profiles/datakom-dkg705/profile.toml", include_str!("../../../profiles/datakom-dkg705/profile.toml")),
    (
        "profiles/smartgen-acc1700/profile.toml",
        include_str!("../../../profiles/smartgen-acc1700/profile.toml"),
    ),
    (
        "profiles/smartgen-hat821si/profile.toml",
        include_str!("../../../profiles/smartgen-hat821si/profile.toml"),
    ),
];

/// Every built-in profile, in the order of their keys.
///
/// A built-in profile that has findings is left out; a test holds that none has.
pub fn builtins() -> &'static [Profile] {
    static PROFILES: LazyLock<Vec<Profile>> =
        LazyLock::new(|| SOURCES.iter().filter_map(|(file, text)| Profile::parse(file, text).ok()).collect());
    &PROFILES
}

/// The built-in profile of that key.
pub fn builtin(key: &str) -> Option<&'static Profile> {
    builtins().iter().find(|profile| profile.key == key)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_built_in_profile_is_sound() {
        for (file, text) in SOURCES {
            if let Err(findings) = Profile::parse(file, text) {
                panic!("{findings}");
            }
        }
    }
}
