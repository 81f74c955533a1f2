//! What is told of every device besides its signals.

use std::fmt;

use super::Out;
use crate::api::types::{DeviceView, Identity, Kind};
use crate::device::Device;

/// One device at the time of the scrape.
#[derive(Debug)]
pub(super) struct DeviceSample {
    pub(super) view: DeviceView,
    /// Seconds since it last answered.
    age: Option<f64>,
}

impl DeviceSample {
    pub(super) fn of(device: &Device) -> Self {
        let view = device.view();
        let age = view.last_seen.map(|seen| seen.age().as_secs_f64());
        Self { view, age }
    }

    pub(super) fn id(&self) -> [(&'static str, &str); 1] {
        [("device", self.view.id.as_str())]
    }

    /// Its id and one of several words.
    pub(super) fn labelled<'a>(&'a self, label: &'static str, word: &'a str) -> [(&'static str, &'a str); 2] {
        [("device", self.view.id.as_str()), (label, word)]
    }
}

const VERDICTS: [(Identity, &str); 4] = [
    (Identity::Unknown, "unknown"),
    (Identity::Plausible, "plausible"),
    (Identity::Confirmed, "confirmed"),
    (Identity::Wrong, "wrong"),
];

pub(super) fn encode(devices: &[DeviceSample], out: &mut Out<'_>) -> fmt::Result {
    out.info("device", "What a device is", devices.iter().map(facts))?;
    let online = devices.iter().map(|device| (device.id(), u64::from(device.view.online)));
    out.gauges("device_online", "Whether the device answers", None, online)?;
    let ages = devices.iter().filter_map(|device| Some((device.id(), device.age?)));
    out.gauges("device_age", "Time since the device last answered", Some("seconds"), ages)?;
    let verdicts = devices.iter().flat_map(|device| {
        VERDICTS.iter().map(move |(verdict, word)| {
            (device.labelled("verdict", word), u64::from(device.view.identity.verdict == *verdict))
        })
    });
    out.gauges("device_identity", "Whether it is the device that the site file says", None, verdicts)?;
    let met = devices.iter().filter_map(|device| {
        Some((device.id(), u64::from(device.view.desired.as_ref().and_then(|desired| desired.met)?)))
    });
    out.gauges(
        "device_mode_desired",
        "Whether the device is in the mode that the site file wants",
        None,
        met,
    )?;
    let readable = devices.iter().map(|device| (device.id(), u64::from(device.view.alarms_fault.is_none())));
    out.gauges("device_alarms_known", "Whether all alarms of the device are read well", None, readable)?;
    let alarms = devices.iter().filter(|device| device.view.alarms_fault.is_none()).flat_map(|device| {
        let counts = &device.view.alarms;
        [
            ("shutdown", counts.shutdown),
            ("load_dump", counts.load_dump),
            ("trip", counts.trip),
            ("warning", counts.warning),
            ("indication", counts.indication),
        ]
        .map(|(class, count)| (device.labelled("class", class), u64::from(count)))
    });
    out.gauges("device_alarms", "Active alarms by class, where they are known", None, alarms)
}

/// Names are for people and may be anything; they are no labels.
fn facts(device: &DeviceSample) -> Vec<(&'static str, String)> {
    let view = &device.view;
    let kind = match view.kind {
        Kind::Genset => "genset",
        Kind::TransferSwitch => "transfer_switch",
        Kind::Compressor => "compressor",
    };
    vec![
        ("device", view.id.clone()),
        ("profile", view.profile.clone()),
        ("vendor", view.vendor.clone()),
        ("model", view.model.clone().unwrap_or_default()),
        ("kind", kind.to_owned()),
        ("wire", view.wire.clone()),
        ("unit", view.unit.to_string()),
    ]
}
