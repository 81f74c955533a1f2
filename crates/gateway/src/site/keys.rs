//! Every key that a site file can have, by table; `docs/site-file.md` says what they mean.

pub(super) const FILE: &[&str] = &["site", "server", "wires", "devices", "nodes", "connections"];
pub(super) const SITE: &[&str] = &["name", "time_zone"];
pub(super) const SERVER: &[&str] = &["listen", "hosts"];
pub(super) const WIRE: &[&str] = &["id", "endpoint", "timeout", "spacing", "trace"];
pub(super) const DEVICE: &[&str] = &[
    "id",
    "name",
    "profile",
    "model",
    "wire",
    "unit",
    "word_order",
    "poll",
    "desired_mode",
    "nameplate_kw",
    "tank_litres",
    "battery_volts",
];
pub(super) const POLL: &[&str] = &["fast", "slow"];
pub(super) const NODE: &[&str] = &["id", "kind", "name", "device", "signals"];
pub(super) const CONNECTION: &[&str] = &["from", "to", "device", "breaker"];
