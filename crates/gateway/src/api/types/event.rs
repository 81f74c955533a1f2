//! What the events of `/api/v1/events` hold.

use serde::Serialize;
use utoipa::ToSchema;

use super::{AlarmView, DeviceView, JoinedView, Rate, SiteInfo, Time, ValueView};

/// `event: snapshot`: the site and its devices. A `state` of each of them follows.
///
/// It comes first, and again when the site file in force has other devices or wires.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct SnapshotEvent {
    /// The site.
    pub site: SiteInfo,
    /// The devices asked for, in the order of the site file.
    pub devices: Vec<DeviceView>,
    /// Their active alarms, the gravest first.
    pub alarms: Vec<AlarmView>,
}

/// `event: state`: all values asked for of one device, in place of those before.
///
/// One of each device follows a `snapshot`. A reader that falls behind gets a `device`, an `alarms` and a `state` of
/// each device in place of the events it missed.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct StateEvent {
    /// Id of the device.
    #[schema(examples("gen1"))]
    pub device: String,
    /// Its values, in address order.
    pub values: Vec<ValueView>,
    /// What several of its points make up.
    pub joined: Vec<JoinedView>,
}

/// `event: resumed`: what the reader has still holds, and what it missed follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
pub struct ResumedEvent {}

/// `event: values`: a poll round of one device is finished.
///
/// Every point of that device and rate whose quality is `good` was read at `ts`, changed or not.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct ValuesEvent {
    /// Id of the device.
    #[schema(examples("gen1"))]
    pub device: String,
    /// Which of its points were read.
    pub rate: Rate,
    /// When the round was finished.
    pub ts: Time,
    /// The points whose value or quality changed, of those asked for.
    pub changed: Vec<ValueView>,
    /// The joined signals whose value or quality changed, of those asked for.
    pub joined: Vec<JoinedView>,
}

/// `event: alarms`: the active alarms of one device changed.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct AlarmsEvent {
    /// Id of the device.
    #[schema(examples("gen1"))]
    pub device: String,
    /// Its whole list, the gravest first.
    pub alarms: Vec<AlarmView>,
}
