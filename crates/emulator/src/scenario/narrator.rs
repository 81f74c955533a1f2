//! Tells what a person at the panel would see: states and modes, breakers, alarms that come and go.

use busbar_profile::{BitSet, Class, Profile, Value};

use crate::device::Device;
use crate::facts::{Fact, FactKind, Subject};

/// Flags of these objects are told.
const TOLD: [&str; 2] = ["breaker.", "mains.failed"];

/// What was told last.
#[derive(Clone, Debug)]
pub(crate) struct Narrator {
    flags: Vec<(Subject, Fact)>,
    /// Points with alarms, and those that are active; points that tell a state, by signal and what it was.
    alarms: Vec<(usize, BitSet)>,
    states: Vec<(usize, &'static str, String)>,
}

impl Narrator {
    /// Everything that stands now is known and not told.
    pub(crate) fn new(device: &Device) -> Self {
        let profile = device.profile();
        let told = |subject: &Subject| {
            *subject.kind() == FactKind::Flag && TOLD.iter().any(|start| subject.name().starts_with(start))
        };
        let flags = Subject::signals(profile).filter(told).map(|subject| (subject, Fact::Unknown));
        let points = || profile.points.iter().enumerate().filter(|(_, point)| point.access.is_readable());
        let is_alarm = |class: Option<Class>| class.is_some_and(|class| class != Class::Status);
        let alarms = points().filter(|(_, point)| point.bits.iter().any(|bit| is_alarm(bit.class)));
        let states = points()
            .filter(|(_, point)| !point.data_type.is_numeric())
            .filter_map(|(index, point)| Some((index, point.signal.as_deref()?, String::new())));
        let mut narrator = Self {
            flags: flags.collect(),
            alarms: alarms.map(|(index, _)| (index, BitSet::EMPTY)).collect(),
            states: states.collect(),
        };
        narrator.changes(device);
        narrator
    }

    /// What has changed since it was asked last.
    pub(crate) fn changes(&mut self, device: &Device) -> Vec<String> {
        let mut changes = Vec::new();
        for (index, signal, known) in &mut self.states {
            let now = value(device, *index).and_then(|value| state(device.profile(), *index, &value));
            if let Some(now) = now.filter(|now| now != known) {
                changes.push(format!("{signal} {now}"));
                *known = now;
            }
        }
        for (subject, known) in &mut self.flags {
            let now = subject.fact(device);
            if now != *known {
                let not = if now == Fact::Flag(false) { "not " } else { "" };
                changes.push(format!("{not}{}", subject.name()));
                *known = now;
            }
        }
        for (index, known) in &mut self.alarms {
            let Some(now) = value(device, *index).and_then(|value| value.as_bits().copied()) else {
                continue;
            };
            tell(device.profile(), *index, &now.difference(known), "", &mut changes);
            tell(device.profile(), *index, &known.difference(&now), " is gone", &mut changes);
            *known = now;
        }
        changes
    }
}

/// What a client would read; nothing of a controller that restarts.
fn value(device: &Device, index: usize) -> Option<Value> {
    let profile = device.profile();
    let point = profile.points.get(index).filter(|_| !device.is_silent())?;
    let registers = device.registers(point.address, point.registers)?;
    point.decode(registers, profile.wire.word_order).value
}

/// The word of the vocabulary, and how the controller calls it.
fn state(profile: &Profile, index: usize, value: &Value) -> Option<String> {
    let point = &profile.points[index];
    if let Some(choice) = value.as_code().and_then(|code| point.choice(code)) {
        let word = choice.state.as_ref().map(|word| format!("{word} ")).unwrap_or_default();
        return Some(format!("{word}({})", choice.label));
    }
    let bits = value.as_bits()?;
    point.bits.iter().find_map(|bit| match (bits.contains(bit.bit), &bit.clear) {
        (true, _) => Some(format!("{} ({})", bit.state.as_ref()?, bit.label)),
        (false, clear) => clear.as_ref().map(|clear| format!("{} ({})", clear.state, clear.label)),
    })
}

fn tell(profile: &Profile, index: usize, bits: &BitSet, what: &str, changes: &mut Vec<String>) {
    let point = &profile.points[index];
    for bit in bits.iter().filter_map(|bit| point.bit(bit)) {
        if let Some(class) = bit.class.filter(|class| *class != Class::Status) {
            changes.push(format!("{class} alarm: {}{what}", bit.label));
        }
    }
}
