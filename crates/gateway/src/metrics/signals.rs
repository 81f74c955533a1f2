//! The signals of the shared vocabulary: one family each, one sample a device that has it and reads it well.

use std::collections::BTreeMap;
use std::fmt;

use busbar_profile::vocabulary::{Signal, vocabulary};
use busbar_profile::{Profile, SignalKind, Value};

use super::Out;
use super::devices::DeviceSample;
use crate::api::types::{DeviceView, Identity, PointValue, Quality};
use crate::device::Device;

/// The good values of all devices, by signal. Devices are told apart by their place in the scrape.
#[derive(Debug, Default)]
pub(super) struct SignalSamples {
    families: BTreeMap<&'static str, Family>,
}

#[derive(Debug)]
struct Family {
    signal: &'static Signal,
    samples: Vec<(usize, Sample)>,
}

#[derive(Debug)]
enum Sample {
    Number(f64),
    /// Which of the signal's words it is; none when the code stands for none of them.
    Word(Option<usize>),
}

impl SignalSamples {
    /// Takes every good value of a device. What a wrong device says is nothing of this one's.
    pub(super) fn take(&mut self, index: usize, device: &Device, view: &DeviceView) {
        if view.identity.verdict == Identity::Wrong {
            return;
        }
        let profile = device.site().profile;
        for point in 0..profile.points.len() {
            if let Some(value) = device.good(point) {
                self.take_point(index, profile, point, value);
            }
        }
        for joined in device.joined_views().iter().filter(|joined| joined.quality == Quality::Good) {
            if let PointValue::Number(number) = joined.value {
                self.push(index, &joined.signal, |_| Some(Sample::Number(number.as_f64())));
            }
        }
        // The mode may stand in one register or in several bits; the device knows.
        if let Some(mode) = view.mode.as_ref().and_then(|mode| mode.canonical.as_deref()) {
            self.push(index, "mode", |signal| Some(word(signal, Some(mode))));
        }
    }

    fn take_point(&mut self, index: usize, profile: &Profile, point: usize, value: &Value) {
        let about = &profile.points[point];
        if let Some(bits) = value.as_bits() {
            for bit in &about.bits {
                if let Some(id) = &bit.signal {
                    let set = f64::from(u8::from(bits.contains(bit.bit)));
                    self.push(index, id, |_| Some(Sample::Number(set)));
                }
            }
        }
        let Some(id) = about.signal.as_deref().filter(|id| *id != "mode") else { return };
        self.push(index, id, |signal| match (signal.kind, value) {
            (SignalKind::Number, Value::Number(number)) => {
                Some(Sample::Number(about.in_signal_unit(*number)?.as_f64()))
            }
            (SignalKind::Words, Value::Choice { code }) => {
                Some(word(signal, about.choice(*code).and_then(|choice| choice.state.as_deref())))
            }
            _ => None,
        });
    }

    fn push(&mut self, index: usize, id: &str, sample: impl FnOnce(&Signal) -> Option<Sample>) {
        let Some(signal) = vocabulary().signal(id) else { return };
        if let Some(sample) = sample(signal) {
            let family = self.families.entry(&signal.id);
            let family = family.or_insert_with(|| Family { signal, samples: Vec::new() });
            family.samples.push((index, sample));
        }
    }

    pub(super) fn encode(&self, devices: &[DeviceSample], out: &mut Out<'_>) -> fmt::Result {
        self.families.values().try_for_each(|family| family.encode(devices, out))
    }
}

impl Family {
    fn encode(&self, devices: &[DeviceSample], out: &mut Out<'_>) -> fmt::Result {
        let (name, help) = (name(&self.signal.id), self.signal.meaning.as_str());
        if self.signal.kind == SignalKind::Words {
            let words = self.samples.iter().flat_map(|(index, sample)| {
                let now = match sample {
                    Sample::Word(now) => *now,
                    Sample::Number(_) => None,
                };
                let words = self.signal.words.iter().enumerate();
                words.map(move |(at, word)| {
                    (devices[*index].labelled("state", word), u64::from(now == Some(at)))
                })
            });
            return out.gauges(&name, help, None, words);
        }
        let unit = self.signal.unit.as_deref().map(unit);
        let numbers = self.samples.iter().filter_map(|(index, sample)| match sample {
            Sample::Number(number) => Some((devices[*index].id(), *number)),
            Sample::Word(_) => None,
        });
        out.gauges(&name, help, unit.as_deref(), numbers)
    }
}

fn word(signal: &Signal, word: Option<&str>) -> Sample {
    Sample::Word(signal.words.iter().position(|known| Some(known.as_str()) == word))
}

/// `genset.power.active` as a metric is called.
fn name(signal: &str) -> String {
    signal.replace('.', "_")
}

/// A unit as the end of a name: the vocabulary's own in small letters, so that a number here is the page's number.
fn unit(unit: &str) -> String {
    match unit {
        "%" => "percent".to_owned(),
        unit => unit.replace('/', "_per_").to_lowercase(),
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn every_signal_has_a_name_of_its_own_that_openmetrics_allows() {
        let mut names = BTreeSet::new();
        for signal in vocabulary().iter() {
            let unit = signal.unit.as_deref().map(|text| format!("_{}", unit(text))).unwrap_or_default();
            let name = format!("{}{unit}", name(&signal.id));
            assert!(
                name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_'),
                "{name} of {}",
                signal.id
            );
            for reserved in ["_total", "_info", "_count", "_sum", "_bucket", "_created", "_gcount", "_gsum"] {
                assert!(!name.ends_with(reserved), "{name} ends as another kind of metric does");
            }
            for own in ["device_", "wire_", "unit_", "site_", "build_"] {
                assert!(!name.starts_with(own), "{name}");
            }
            assert!(!signal.meaning.contains(['\n', '\\', '"']), "{} needs escapes", signal.id);
            assert!(names.insert(name), "two signals have the name of {}", signal.id);
        }
        assert!(names.contains("genset_power_active_kw") && names.contains("fuel_level_percent"));
    }
}
