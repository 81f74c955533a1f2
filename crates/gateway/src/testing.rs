//! What the unit tests share: a small profile, a device of it, and rounds as the wire would bring them.

use std::sync::Arc;
use std::time::Duration;

use busbar_link::{Cause, LinkError, Outage};
use busbar_profile::plan::Read;
use busbar_profile::{Profile, Rate};

use crate::api::types::{DiagramView, Time};
use crate::device::{Device, Round};
use crate::failure::Failure;
use crate::hub::Hub;
use crate::rates::Rates;
use crate::site::{Nameplate, Poll, SiteDevice};
use crate::stop::Stop;
use crate::table::{Slot, Table};

const PROFILE: &str = r#"
format = 1
key = "tiny"
vendor = "Acme"
models = ["T-1", "T-2"]
kind = "genset"

[manual]
title = "Tiny"

[identity]
point = "identity"
models = [{ value = 1, model = "T-1" }, { value = 2, model = "T-2" }]

[wire]
transports = ["tcp"]
unit = { min = 1, max = 10, default = 1 }
functions = [3]
max_read = 16
over_read = "truncate"
spacing_ms = 0
answer_delay_ms = 0
timeout_ms = 1000
word_order = "low-first"
serial = { baud = [9600], parity = ["none"], stop = [1] }
readable = [[100, 159]]
exceptions = [{ code = 10, name = "write protection" }]

[choices.status]
values = [
  { value = 0, id = "rest", label = "At rest", state = "stopped", timed = false },
  { value = 5, id = "cranking", label = "Cranking", state = "cranking" },
]

[choices.mode]
values = [
  { value = 1, id = "off", label = "OFF", state = "off" },
  { value = 2, id = "run", label = "MANUAL / RUN", state = "manual", by_model = { "T-2" = "RUN" } },
]

[bits.alarms]
bits = [
  { bit = 0, id = "low_oil", label = "Low oil pressure" },
  { bit = 3, id = "ready", label = "Ready", class = "status" },
]

[[groups]]
id = "state"
title = "State"
page = 1
rate = "fast"
points = [
  { at = 100, id = "status", type = "choice", choices = "status", signal = "state.engine", timer = "timer", name = "Status" },
  { at = 101, id = "mode", type = "choice", choices = "mode", signal = "mode", name = "Mode" },
  { at = 102, id = "timer", type = "u16", coeff = 1, unit = "s", signal = "state.engine.timer", name = "Timer" },
  { at = 104, id = "voltage", type = "u32", coeff = 10, unit = "V", signal = "genset.l1.voltage", name = "Voltage" },
  { at = 106, id = "temperature", type = "i16", coeff = 10, unit = "degC", sentinels = [0x7FFF], name = "Temperature" },
  { at = 110, id = "shutdowns", type = "bits", size = 16, bits = "alarms", class = "shutdown", name = "Shutdowns" },
  { at = 111, id = "warnings", type = "bits", size = 16, bits = "alarms", class = "warning", name = "Warnings" },
]

[[groups]]
id = "service"
title = "Service"
page = 2
rate = "slow"
points = [
  { at = 108, id = "hours", type = "u32", coeff = 100, unit = "h", signal = "engine.hours", name = "Hours" },
  { at = 126, id = "starts", type = "u32", coeff = 1, name = "Starts" },
]

[[groups]]
id = "identity"
title = "Identity"
page = 3
rate = "once"
points = [
  { at = 130, id = "identity", type = "u16", coeff = 1, name = "Identity" },
  { at = 131, id = "curve", type = "trace", count = 20, name = "Curve" },
]

[[groups]]
id = "display"
title = "Display"
page = 4
rate = "on_demand"
points = [{ at = 152, id = "picture", type = "image", size = 128, name = "Picture" }]
"#;

/// The small profile; read once, kept for good.
pub(crate) fn profile() -> &'static Profile {
    static TINY: std::sync::LazyLock<Profile> = std::sync::LazyLock::new(|| {
        Profile::parse("tiny.toml", PROFILE).unwrap_or_else(|findings| panic!("{findings}"))
    });
    &TINY
}

pub(crate) fn site_device(id: &str) -> SiteDevice {
    SiteDevice {
        id: id.to_owned(),
        name: "Genset 1".to_owned(),
        profile: profile(),
        wire: 0,
        unit: 1,
        word_order: profile().wire.word_order,
        poll: Poll::default(),
        model: None,
        desired_mode: None,
        nameplate: Nameplate::default(),
    }
}

pub(crate) fn device() -> Device {
    Device::new(site_device("gen1"), "w1".to_owned())
}

/// A round in which these registers came and nothing failed.
pub(crate) fn answered(rates: impl Into<Rates>, answers: &[(u16, &[u16])]) -> Round {
    let answers = answers.iter().map(|(address, registers)| (*address, registers.to_vec())).collect();
    Round { rates: rates.into(), answers, ..Round::default() }
}

/// A round in which one read failed.
pub(crate) fn failed(rates: impl Into<Rates>, address: u16, count: u16, failure: Failure) -> Round {
    let read = Read { function: 3, address, count };
    Round { rates: rates.into(), failures: vec![(read, failure)], ..Round::default() }
}

/// A round that the device left unanswered.
pub(crate) fn silence() -> Round {
    Round { rates: Rate::Fast.into(), silence: Some(timeout()), ..Round::default() }
}

pub(crate) fn timeout() -> Failure {
    Failure::Link(LinkError::Timeout {
        unit: 1,
        after: Duration::from_secs(1),
        tries: 2,
        heard: busbar_link::Heard::Nothing { serial: false },
    })
}

pub(crate) fn outage(cause: Cause) -> Failure {
    let endpoint = Arc::new("tcp://192.0.2.7:502".parse().unwrap());
    Failure::Link(LinkError::Down { reason: Outage { endpoint, cause } })
}

pub(crate) fn refusal(code: u8) -> Failure {
    let error = LinkError::Exception { unit: 1, function: 3, code: busbar_modbus::ExceptionCode(code) };
    Failure::new(error, profile())
}

/// Seconds since the gateway started.
pub(crate) fn at(seconds: u64) -> Duration {
    Duration::from_secs(seconds)
}

/// The same on the wall: 10:00:00 and so many seconds.
pub(crate) fn ts(seconds: i64) -> Time {
    Time::new(jiff::Timestamp::from_second(1_795_428_000 + seconds).unwrap())
}

/// A site of small devices on no wire at all.
pub(crate) fn hub(devices: &[&str], stop: Stop) -> Hub {
    Hub::new(table(devices), stop)
}

/// The same, before it is live.
pub(crate) fn table(devices: &[&str]) -> Table {
    let slot = |id: &&str| Arc::new(Slot::new(Device::new(site_device(id), "w1".to_owned())));
    Table {
        name: "Test".to_owned(),
        time_zone: None,
        hosts: Vec::new(),
        devices: devices.iter().map(slot).collect(),
        wires: Vec::new(),
        diagram: DiagramView::default(),
    }
}
