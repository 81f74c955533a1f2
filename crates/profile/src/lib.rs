//! What a controller is, as data: points, scales, alarms and commands, read from one TOML file a family.
//!
//! [`Profile::parse`] checks such a file and reports every mistake with its place and a remedy; what comes out can be
//! relied on. [`builtins`] holds the profiles that are compiled in. A [`Point`] decodes registers to exact values and
//! encodes values to registers; an [`Image`] holds one device's registers and tells which points a read has changed;
//! a [`Reading`] puts labels and units to a value.
//!
//! ```
//! use busbar_profile::{builtin, decode_window, reading};
//!
//! let profile = builtin("datakom-d").unwrap();
//! let registers = [2302, 0];
//! let decoded = decode_window(profile, 10246, &registers, profile.wire.word_order);
//! let (point, value) = &decoded[0];
//! let shown = serde_json::to_string(&reading(point, value, &registers, None)).unwrap();
//! assert!(shown.contains(r#""value":230.2,"unit":"V""#));
//! ```
//!
//! There is no I/O in here but the compiled-in text, and no clock.

mod builtin;
mod clock;
mod codec;
pub mod command;
mod file;
mod findings;
mod image;
mod joined;
pub mod lcd;
mod load;
mod number;
pub mod page;
pub mod plan;
mod point;
mod profile;
mod reading;
mod schema;
pub mod show;
pub mod signature;
mod suggest;
mod terms;
pub mod text;
mod units;
mod value;
pub mod vocabulary;

pub use builtin::{builtin, builtins};
pub use clock::{DateTime, ParseDateTimeError};
pub use codec::EncodeError;
pub use command::Command;
pub use findings::{Collector, Finding, Findings};
pub use image::Image;
pub use joined::{Joined, JoinedParts, JoinedReading, JoinedValue};
pub use number::{Number, ParseNumberError, Scale};
pub use point::{Bit, Choice, Clear, Point};
pub use profile::{
    Coil, ExceptionName, Group, Identity, IdentityModel, Manual, Profile, SerialSettings, Setting, UnitRange,
    Wire,
};
pub use reading::{Reading, Shown, decode_window, no_reading, reading};
pub use schema::json_schema;
pub use suggest::nearest;
pub use terms::{
    Access, ArgKind, Class, Confirm, DataType, DeviceProof, Kind, OverRead, Parity, Quality, Rate, Risk,
    Role, SignalKind, TimePart, Transport, UnknownWord, WordOrder,
};
pub use value::{BitSet, Decoded, Value};
