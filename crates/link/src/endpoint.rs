//! Where a wire ends: endpoint URLs, parsed once and printed back the same way.

use std::fmt;
use std::net::{Ipv6Addr, SocketAddr};
use std::str::FromStr;

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use thiserror::Error;

const MODBUS_PORT: u16 = 502;
const SECURE_PORT: u16 = 802;
/// Those that can be spoken.
const EXAMPLES: &str =
    "tcp://HOST:502, rtu:///dev/ttyUSB0?baud=9600&parity=none&stop=1 or rtu+tcp://HOST:502";

/// One end of a wire, as a URL names it.
///
/// The printed form is canonical: port and serial settings always stand there, so two endpoints are
/// the same exactly when their URLs are.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Endpoint {
    /// `tcp://HOST:PORT`, Modbus TCP; the port is 502 when none is given.
    Tcp {
        /// Name or address; an IPv6 address without its brackets.
        host: String,
        /// Port; 0 lets the system choose, for listening only.
        port: u16,
    },
    /// `rtu:///dev/ttyUSB0?baud=9600&parity=none&stop=1`, Modbus RTU on a serial device.
    Rtu {
        /// The device, `/dev/ttyUSB0` or `COM3`.
        path: String,
        /// How the line is set.
        serial: Serial,
    },
    /// `rtu+tcp://HOST:PORT`, RTU frames through a TCP connection to a converter.
    RtuTcp {
        /// Name or address; an IPv6 address without its brackets.
        host: String,
        /// Port; 502 when none is given.
        port: u16,
    },
    /// `tls://HOST:PORT`, Modbus TCP Security; the port is 802 when none is given.
    Tls {
        /// Name or address; an IPv6 address without its brackets.
        host: String,
        /// Port.
        port: u16,
    },
}

impl Endpoint {
    /// The scheme as the URL has it: `tcp`, `rtu`, `rtu+tcp` or `tls`.
    pub fn scheme(&self) -> &'static str {
        match self {
            Self::Tcp { .. } => "tcp",
            Self::Rtu { .. } => "rtu",
            Self::RtuTcp { .. } => "rtu+tcp",
            Self::Tls { .. } => "tls",
        }
    }

    fn serial(text: &str) -> Result<Self, EndpointProblem> {
        let (path, query) = split_query(text);
        if path.is_empty() {
            return Err(EndpointProblem::NoPath);
        }
        if path.contains('/') && !path.starts_with('/') {
            return Err(EndpointProblem::RelativePath { path: path.into() });
        }
        Ok(Self::Rtu { path: path.into(), serial: Serial::from_query(query)? })
    }
}

impl FromStr for Endpoint {
    type Err = EndpointError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let parse = || {
            let Some((scheme, rest)) = text.split_once("://") else {
                return Err(EndpointProblem::NoScheme {
                    remedy: match text.starts_with('/') {
                        true => format!("rtu://{text}"),
                        false => format!("tcp://{text}"),
                    },
                });
            };
            match scheme.to_ascii_lowercase().as_str() {
                "tcp" => authority(rest, MODBUS_PORT).map(|(host, port)| Self::Tcp { host, port }),
                "rtu" => Self::serial(rest),
                "rtu+tcp" => authority(rest, MODBUS_PORT).map(|(host, port)| Self::RtuTcp { host, port }),
                "tls" => authority(rest, SECURE_PORT).map(|(host, port)| Self::Tls { host, port }),
                _ => Err(EndpointProblem::UnknownScheme { scheme: scheme.into() }),
            }
        };
        parse().map_err(|problem| EndpointError { endpoint: text.into(), problem })
    }
}

impl fmt::Display for Endpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let scheme = self.scheme();
        match self {
            Self::Rtu { path, serial } => write!(f, "{scheme}://{path}?{serial}"),
            Self::Tcp { host, port } | Self::RtuTcp { host, port } | Self::Tls { host, port } => {
                match host.contains(':') {
                    true => write!(f, "{scheme}://[{host}]:{port}"),
                    false => write!(f, "{scheme}://{host}:{port}"),
                }
            }
        }
    }
}

/// A bound or known socket address as a Modbus TCP endpoint.
impl From<SocketAddr> for Endpoint {
    fn from(address: SocketAddr) -> Self {
        Self::Tcp { host: address.ip().to_string(), port: address.port() }
    }
}

impl Serialize for Endpoint {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Endpoint {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(D::Error::custom)
    }
}

/// How a serial line is set. Modbus RTU has 8 data bits always.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Serial {
    /// Bits a second, 300 to 4,000,000.
    pub baud: u32,
    /// The parity bit.
    pub parity: Parity,
    /// Stop bits.
    pub stop: StopBits,
    /// Whether the kernel switches the direction of an RS-485 line, for adapters that do not do so by themselves.
    pub rs485: bool,
}

impl Serial {
    fn from_query(query: Option<&str>) -> Result<Self, EndpointProblem> {
        let mut serial = Self::default();
        let mut seen: Vec<&str> = Vec::new();
        for pair in query.unwrap_or("").split('&').filter(|pair| !pair.is_empty()) {
            let (key, value) = pair.split_once('=').unwrap_or((pair, ""));
            if seen.contains(&key) {
                return Err(EndpointProblem::RepeatedKey { key: key.into() });
            }
            seen.push(key);

            let refused =
                |expected| EndpointProblem::BadValue { key: key.into(), value: value.into(), expected };
            match key {
                "baud" => {
                    serial.baud = number(value)
                        .filter(|baud| (300..=4_000_000).contains(baud))
                        .ok_or(refused("a number from 300 to 4000000"))?;
                }
                "parity" => {
                    serial.parity = match value {
                        "none" => Parity::None,
                        "even" => Parity::Even,
                        "odd" => Parity::Odd,
                        _ => return Err(refused("none, even or odd")),
                    };
                }
                "stop" => {
                    serial.stop = match value {
                        "1" => StopBits::One,
                        "2" => StopBits::Two,
                        _ => return Err(refused("1 or 2")),
                    };
                }
                "rs485" => {
                    serial.rs485 = match value {
                        "off" => false,
                        "on" => true,
                        _ => return Err(refused("off or on")),
                    };
                }
                _ => return Err(EndpointProblem::UnknownKey { key: key.into() }),
            }
        }
        Ok(serial)
    }

    /// Bits of one character on the line: start, 8 data, parity, stop.
    pub fn bits_per_character(&self) -> u8 {
        9 + u8::from(self.parity != Parity::None) + self.stop.count()
    }
}

/// 9600 baud, no parity, one stop bit.
impl Default for Serial {
    fn default() -> Self {
        Self { baud: 9600, parity: Parity::None, stop: StopBits::One, rs485: false }
    }
}

impl fmt::Display for Serial {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "baud={}&parity={}&stop={}", self.baud, self.parity, self.stop)?;
        match self.rs485 {
            true => f.write_str("&rs485=on"),
            false => Ok(()),
        }
    }
}

/// The parity bit of a serial character. Exhaustive: Modbus RTU knows no other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Parity {
    /// No parity bit.
    None,
    /// Even parity.
    Even,
    /// Odd parity.
    Odd,
}

impl fmt::Display for Parity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::None => "none",
            Self::Even => "even",
            Self::Odd => "odd",
        })
    }
}

/// Stop bits of a serial character. Exhaustive: Modbus RTU knows no other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum StopBits {
    /// One.
    One,
    /// Two.
    Two,
}

impl StopBits {
    fn count(self) -> u8 {
        match self {
            Self::One => 1,
            Self::Two => 2,
        }
    }
}

impl fmt::Display for StopBits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.count().fmt(f)
    }
}

/// A text that is no endpoint. Whoever wrote the URL is at fault.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("endpoint \"{endpoint}\": {problem}")]
pub struct EndpointError {
    /// The text as it was given.
    pub endpoint: String,
    /// What is wrong with it, and what to write instead.
    pub problem: EndpointProblem,
}

/// What is wrong with an endpoint URL.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum EndpointProblem {
    /// The text has no `SCHEME://`.
    #[error("no scheme; write {remedy} or another of {EXAMPLES}")]
    NoScheme {
        /// The URL that was probably meant.
        remedy: String,
    },
    /// The scheme is none of the four.
    #[error("unknown scheme \"{scheme}\"; write {EXAMPLES}")]
    UnknownScheme {
        /// The scheme as it was given.
        scheme: String,
    },
    /// Nothing stands where the host should.
    #[error("no host; write its name or address after the two slashes")]
    NoHost,
    /// The host is neither a name nor an address.
    #[error("\"{host}\" is neither a host name nor an address; write a name, 192.0.2.7 or [2001:db8::7]")]
    BadHost {
        /// The host as it was given.
        host: String,
    },
    /// The port is no number from 0 to 65535.
    #[error("port \"{port}\" is no number from 0 to 65535; leave it out for the usual one")]
    BadPort {
        /// The port as it was given.
        port: String,
    },
    /// Something follows host and port.
    #[error("\"{rest}\" follows the port; the URL ends after host and port")]
    TrailingText {
        /// What follows.
        rest: String,
    },
    /// `rtu://` without a device.
    #[error("no serial device; write rtu:///dev/ttyUSB0 or rtu://COM3")]
    NoPath,
    /// A device path with slashes that does not start with one.
    #[error("\"{path}\" is no device path; write three slashes: rtu:///{path}")]
    RelativePath {
        /// The path as it was given.
        path: String,
    },
    /// A key in the query that means nothing.
    #[error("unknown setting \"{key}\"; a serial line has baud, parity, stop and rs485")]
    UnknownKey {
        /// The key as it was given.
        key: String,
    },
    /// A key that stands there twice.
    #[error("\"{key}\" is set twice; set it once")]
    RepeatedKey {
        /// The key.
        key: String,
    },
    /// A setting with a value it cannot have.
    #[error("{key} cannot be \"{value}\"; write {expected}")]
    BadValue {
        /// The key.
        key: String,
        /// The value as it was given.
        value: String,
        /// What may stand there.
        expected: &'static str,
    },
}

/// Parses `HOST[:PORT]` and nothing after it.
fn authority(text: &str, default_port: u16) -> Result<(String, u16), EndpointProblem> {
    let end = text.find(['/', '?', '#']).unwrap_or(text.len());
    let (authority, rest) = text.split_at(end);
    if !matches!(rest, "" | "/") {
        return Err(EndpointProblem::TrailingText { rest: rest.into() });
    }

    let bad = || EndpointProblem::BadHost { host: authority.into() };
    let (host, port) = match authority.strip_prefix('[') {
        Some(inner) => {
            let (literal, after) = inner.split_once(']').ok_or_else(bad)?;
            let address: Ipv6Addr = literal.parse().map_err(|_| bad())?;
            let port = match after {
                "" => None,
                _ => Some(after.strip_prefix(':').ok_or_else(bad)?),
            };
            (address.to_string(), port)
        }
        // Without brackets its last group would pass for a port.
        None if authority.parse::<Ipv6Addr>().is_ok() => return Err(bad()),
        None => match authority.split_once(':') {
            Some((host, port)) => (name(host)?, Some(port)),
            None => (name(authority)?, None),
        },
    };

    let port = match port {
        None => default_port,
        Some(port) => number(port).ok_or_else(|| EndpointProblem::BadPort { port: port.into() })?,
    };
    Ok((host, port))
}

fn name(host: &str) -> Result<String, EndpointProblem> {
    if host.is_empty() {
        return Err(EndpointProblem::NoHost);
    }
    match host.chars().all(|c| c.is_alphanumeric() || matches!(c, '.' | '-' | '_')) {
        true => Ok(host.into()),
        false => Err(EndpointProblem::BadHost { host: host.into() }),
    }
}

/// Digits only: `parse` alone would take `+502`.
fn number<T: FromStr>(text: &str) -> Option<T> {
    match text.bytes().all(|byte| byte.is_ascii_digit()) {
        true => text.parse().ok(),
        false => None,
    }
}

fn split_query(text: &str) -> (&str, Option<&str>) {
    match text.split_once('?') {
        Some((path, query)) => (path, Some(query)),
        None => (text, None),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn parses_what_it_prints() {
        for (text, printed) in [
            ("tcp://10.0.0.7:1502", "tcp://10.0.0.7:1502"),
            ("tcp://10.0.0.7", "tcp://10.0.0.7:502"),
            ("TCP://genset-1.site", "tcp://genset-1.site:502"),
            ("tcp://genset/", "tcp://genset:502"),
            ("tcp://127.0.0.1:0", "tcp://127.0.0.1:0"),
            ("tcp://[::1]:1502", "tcp://[::1]:1502"),
            ("tcp://[2001:DB8:0::7]", "tcp://[2001:db8::7]:502"),
            ("rtu+tcp://converter", "rtu+tcp://converter:502"),
            ("tls://10.0.0.7", "tls://10.0.0.7:802"),
            ("rtu:///dev/ttyUSB0", "rtu:///dev/ttyUSB0?baud=9600&parity=none&stop=1"),
            ("rtu:///dev/ttyS1?", "rtu:///dev/ttyS1?baud=9600&parity=none&stop=1"),
            ("rtu:///dev/ttyS1?rs485=on&baud=4800", "rtu:///dev/ttyS1?baud=4800&parity=none&stop=1&rs485=on"),
            ("rtu:///dev/ttyS1?rs485=off", "rtu:///dev/ttyS1?baud=9600&parity=none&stop=1"),
            ("rtu://COM3?stop=2", "rtu://COM3?baud=9600&parity=none&stop=2"),
            (
                "rtu:///dev/serial/by-id/usb-FTDI?parity=even&baud=19200",
                "rtu:///dev/serial/by-id/usb-FTDI?baud=19200&parity=even&stop=1",
            ),
        ] {
            let endpoint: Endpoint = text.parse().unwrap();
            assert_eq!(endpoint.to_string(), printed);
            assert_eq!(printed.parse::<Endpoint>().unwrap(), endpoint, "{text}");
        }
    }

    #[test]
    fn names_every_part() {
        assert_eq!("tcp://[fe80::1]:5020".parse(), Ok(Endpoint::Tcp { host: "fe80::1".into(), port: 5020 }));
        assert_eq!(
            "rtu:///dev/ttyUSB0?baud=38400&parity=odd&stop=2".parse(),
            Ok(Endpoint::Rtu {
                path: "/dev/ttyUSB0".into(),
                serial: Serial { baud: 38400, parity: Parity::Odd, stop: StopBits::Two, rs485: false }
            })
        );
        assert_eq!(
            Endpoint::from(SocketAddr::from(([127, 0, 0, 1], 1502))).to_string(),
            "tcp://127.0.0.1:1502"
        );
    }

    #[test]
    fn counts_the_bits_of_a_character() {
        for (query, bits) in [("", 10), ("stop=2", 11), ("parity=even", 11), ("parity=odd&stop=2", 12)] {
            let serial = Serial::from_query(Some(query)).unwrap();
            assert_eq!(serial.bits_per_character(), bits, "{query}");
        }
    }

    #[test]
    fn refuses_with_a_remedy() {
        for (text, said) in [
            ("10.0.0.7:502", "no scheme; write tcp://10.0.0.7:502 or"),
            ("/dev/ttyUSB0", "no scheme; write rtu:///dev/ttyUSB0 or"),
            ("", "no scheme"),
            ("udp://10.0.0.7", "unknown scheme \"udp\"; write tcp://HOST:502"),
            ("tcp://", "no host"),
            ("tcp://:502", "no host"),
            ("tcp://gen set:502", "\"gen set\" is neither a host name nor an address"),
            ("tcp://user@host", "\"user@host\" is neither"),
            ("tcp://::1", "write a name, 192.0.2.7 or [2001:db8::7]"),
            ("tcp://[::1", "is neither"),
            ("tcp://[::1]502", "is neither"),
            ("tcp://[genset]:502", "is neither"),
            ("tcp://host:", "port \"\" is no number"),
            ("tcp://host:+502", "port \"+502\" is no number"),
            ("tcp://host:65536", "port \"65536\" is no number from 0 to 65535"),
            ("tcp://host:502:503", "port \"502:503\" is no number"),
            ("tcp://host:502/unit/1", "\"/unit/1\" follows the port"),
            ("tcp://host?unit=1", "\"?unit=1\" follows the port"),
            ("tls://host#x", "\"#x\" follows the port"),
            ("rtu://", "no serial device; write rtu:///dev/ttyUSB0"),
            ("rtu://?baud=9600", "no serial device"),
            ("rtu://dev/ttyUSB0", "write three slashes: rtu:///dev/ttyUSB0"),
            ("rtu:///dev/a?baudrate=9600", "unknown setting \"baudrate\"; a serial line has"),
            ("rtu:///dev/a?baud=9600&baud=9600", "\"baud\" is set twice"),
            ("rtu:///dev/a?baud=fast", "baud cannot be \"fast\"; write a number"),
            ("rtu:///dev/a?baud=+9600", "baud cannot be \"+9600\""),
            ("rtu:///dev/a?baud=0", "baud cannot be \"0\""),
            ("rtu:///dev/a?parity=N", "parity cannot be \"N\"; write none, even or odd"),
            ("rtu:///dev/a?stop=3", "stop cannot be \"3\"; write 1 or 2"),
            ("rtu:///dev/a?rs485=1", "rs485 cannot be \"1\"; write off or on"),
            ("rtu:///dev/a?stop", "stop cannot be \"\""),
        ] {
            let error = text.parse::<Endpoint>().unwrap_err();
            assert_eq!(error.endpoint, text);
            let sentence = error.to_string();
            assert!(sentence.contains(said), "{text}: {sentence}");
        }
    }

    #[test]
    fn is_a_string_in_files() {
        let endpoint: Endpoint = serde_json::from_str("\"tcp://10.0.0.7\"").unwrap();
        assert_eq!(serde_json::to_string(&endpoint).unwrap(), "\"tcp://10.0.0.7:502\"");
        let refused = serde_json::from_str::<Endpoint>("\"10.0.0.7\"").unwrap_err();
        assert!(refused.to_string().contains("no scheme"));
    }

    proptest! {
        #[test]
        fn any_text_is_refused_or_printed_back(text in "(tcp|rtu|rtu\\+tcp|tls)?(://)?[a-z0-9:/?&=.\\[\\]]{0,24}") {
            if let Ok(endpoint) = text.parse::<Endpoint>() {
                prop_assert_eq!(endpoint.to_string().parse::<Endpoint>(), Ok(endpoint));
            }
        }
    }
}
