//! What a site file may ask of a profile: its models, modes, breakers, and the things that its signals describe.

use std::collections::BTreeSet;

use busbar_profile::Profile;
use busbar_profile::vocabulary::vocabulary;

/// Objects of the vocabulary, but for their numbers, that no node of a diagram is.
const NOT_DRAWN: &[&str] = &[
    "alarm", "ambient", "battery", "breaker", "canopy", "charger", "clock", "control", "dc", "fuel", "mode",
    "position", "sensor", "service", "state",
];

/// The models that the profile is for or that its identity point can name.
pub(super) fn models(profile: &Profile) -> Vec<&str> {
    let mut models: Vec<&str> = profile.models.iter().map(String::as_str).collect();
    let named = profile.identity.iter().flat_map(|identity| &identity.models);
    for model in named.map(|known| known.model.as_str()) {
        if !models.contains(&model) {
            models.push(model);
        }
    }
    models
}

/// The modes that the controller can show, in the order of the vocabulary.
pub(super) fn modes(profile: &Profile) -> Vec<&'static str> {
    let Some(point) = profile.signal("mode") else { return Vec::new() };
    let choices = point.choices.iter().filter_map(|choice| choice.state.as_deref());
    let bits = point.bits.iter().flat_map(|bit| {
        bit.state.as_deref().into_iter().chain(bit.clear.iter().map(|clear| clear.state.as_str()))
    });
    let shown: BTreeSet<&str> = choices.chain(bits).collect();
    let words = vocabulary().signal("mode").map(|mode| mode.words.as_slice()).unwrap_or_default();
    words.iter().map(String::as_str).filter(|word| shown.contains(word)).collect()
}

/// The signals that tell the position of a breaker.
pub(super) fn breakers(profile: &Profile) -> BTreeSet<&str> {
    signals(profile).filter(|signal| signal.starts_with("breaker.")).collect()
}

/// The things of a diagram that its signals describe: `mains`, `genset`, `src1` and so on.
pub(super) fn objects(profile: &Profile) -> BTreeSet<&str> {
    signals(profile)
        .filter_map(|signal| Some(signal.split_once('.')?.0))
        .filter(|object| !NOT_DRAWN.contains(&object.trim_end_matches(|c: char| c.is_ascii_digit())))
        .collect()
}

fn signals(profile: &Profile) -> impl Iterator<Item = &str> {
    let points = profile.points.iter().flat_map(|point| {
        point.signal.as_deref().into_iter().chain(point.bits.iter().filter_map(|bit| bit.signal.as_deref()))
    });
    points.chain(profile.joined().iter().map(|joined| joined.signal.as_str()))
}
