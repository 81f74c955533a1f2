//! The command line as text: what was asked for, before any file, profile or wire is looked at.

use std::{net::SocketAddr, path::PathBuf, time::Duration};

use busbar_link::Endpoint;
use busbar_profile::WordOrder;
use clap::{Parser, Subcommand};

use crate::logging::Format;

/// Reads, commands, imitates and serves standby-power controllers over Modbus.
#[derive(Debug, Parser)]
#[command(name = "busbar", version, disable_help_subcommand = true, arg_required_else_help = true)]
#[command(
    after_help = "An endpoint is a URL: tcp://HOST:PORT, rtu:///dev/ttyUSB0?baud=9600&parity=none&stop=1, rtu+tcp://HOST:PORT.\n\
    KEY is a built-in profile ('busbar profile list') or a path to a profile file.\n\
    Exit status: 0 done, 1 the thing asked for failed, 2 the call itself is wrong.\n\
    BUSBAR_LOG=debug makes demo, run and emulate tell more on standard error; NO_COLOR=1 takes colour away."
)]
pub(crate) struct Args {
    #[command(subcommand)]
    pub(crate) command: Command,
    /// Print one JSON document instead of text for people
    #[arg(long, global = true)]
    pub(crate) json: bool,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// A whole site on this machine: every controller imitated, a gateway that polls them, the page
    Demo(Demo),
    /// The gateway on a real site
    Run(Run),
    /// One imitated controller on one or more ports
    Emulate(Emulate),
    /// The profiles: list them, show one, check a file
    #[command(subcommand, disable_help_subcommand = true)]
    Profile(Profile),
    /// Registers to values
    Decode(Decode),
    /// One frame, RTU or TCP, taken apart
    Frame(Frame),
    /// The reads that would be sent, and what they cost
    Plan(Plan),
    /// Read points once
    Read(Read),
    /// Read points again and again, live in the terminal
    Watch(Watch),
    /// Raw registers without a profile: proves the wiring
    Registers(Registers),
    /// Send one remote command, watch for its effect, print the verdict
    #[command(
        name = "command",
        after_help = "The verdict is done (the state asked for shows), refused (nothing was changed), no_effect (it did not come)\n\
        or unknown (nothing shows it, or the device fell silent). A write is sent once and never repeated."
    )]
    Order(Order),
}

#[derive(Debug, clap::Args)]
pub(crate) struct Demo {
    /// Where the page is served; port 0 takes a free one [default: 127.0.0.1:8080]
    #[arg(long, value_name = "ADDR:PORT", value_parser = socket_address)]
    pub(crate) listen: Option<SocketAddr>,
    /// Folder for what must outlive a restart (nothing is kept yet)
    #[arg(long, value_name = "DIR")]
    pub(crate) data: Option<PathBuf>,
}

#[derive(Debug, clap::Args)]
#[command(
    after_help = "SIGHUP reads the site file again; a wrong one is reported and changes nothing. Ctrl-C and SIGTERM end it in good\n\
    order, a second one at once. docs/operation.md tells more."
)]
pub(crate) struct Run {
    /// The site file: wires, devices, where to listen
    #[arg(long, value_name = "FILE")]
    pub(crate) config: PathBuf,
    /// Where the page is served, in place of what the site file says; port 0 takes a free one
    #[arg(long, value_name = "ADDR:PORT", value_parser = socket_address)]
    pub(crate) listen: Option<SocketAddr>,
    /// Log every frame of a wire, both ways; may be repeated
    #[arg(long, value_name = "WIRE")]
    pub(crate) trace: Vec<String>,
    /// The log on standard error: text for people, json for programs
    #[arg(long, value_name = "FORMAT", default_value = "text", value_parser = log_format)]
    pub(crate) log: Format,
    /// Folder for what must outlive a restart (nothing is kept yet)
    #[arg(long, value_name = "DIR")]
    pub(crate) data: Option<PathBuf>,
}

#[derive(Debug, clap::Args)]
pub(crate) struct Emulate {
    /// The profile to imitate
    #[arg(value_name = "KEY", required_unless_present = "fleet")]
    pub(crate) key: Option<String>,
    /// Where to answer: tcp://127.0.0.1:1502 or rtu+tcp:// (port 0 takes a free one), rtu:///dev/ttyUSB0, or rtu://pty
    /// for a new pseudo-terminal; may be repeated
    #[arg(long, value_name = "URL", required_unless_present = "fleet", value_parser = endpoint)]
    pub(crate) listen: Vec<Endpoint>,
    /// Further URLs after the first, as if --listen stood before each.
    #[arg(value_name = "URL", hide = true, requires = "listen", value_parser = endpoint)]
    pub(crate) more: Vec<Endpoint>,
    /// Unit id to answer to [default: the profile's]
    #[arg(long, value_name = "N", value_parser = device_unit)]
    pub(crate) unit: Option<u8>,
    /// Model of the family [default: the emulator's choice]
    #[arg(long, value_name = "M")]
    pub(crate) model: Option<String>,
    /// How many times faster than real time the plant runs
    #[arg(long, value_name = "X", default_value_t = 1.0, allow_negative_numbers = true, value_parser = speed)]
    pub(crate) speed: f64,
    /// Seed of everything that is left to chance; a calendar then starts at a fixed time instead of now [default: 1]
    #[arg(long, value_name = "N")]
    pub(crate) seed: Option<u64>,
    /// Hold a point at a value; may be repeated
    #[arg(long, value_name = "POINT=VALUE", value_parser = pin)]
    pub(crate) set: Vec<(String, String)>,
    /// Where its control is served, an HTTP API with a page: levers, alarms, clock; port 0 takes a free one. Beyond this
    /// machine BUSBAR_CONTROL_TOKEN must hold a token of 16 characters or more
    #[arg(long, value_name = "ADDR:PORT", value_parser = socket_address)]
    pub(crate) control: Option<SocketAddr>,
    /// Play a scenario and end with it: 0 when all that it expects came, 1 when not, 2 when the file is wrong
    #[arg(long, value_name = "FILE")]
    pub(crate) scenario: Option<PathBuf>,
    /// What goes wrong on the wires: requests that nobody hears, answers that come late, spoiled, forged or not at all
    #[arg(long, value_name = "FILE")]
    pub(crate) faults: Option<PathBuf>,
    /// Several controllers with their wires, and what joins their plants, in place of KEY and --listen
    #[arg(long, value_name = "FILE", conflicts_with_all = ["key", "listen", "unit", "model", "set", "scenario"])]
    pub(crate) fleet: Option<PathBuf>,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Profile {
    /// The built-in profiles
    List,
    /// One profile: wire rules, points, bits, coils, commands
    Show {
        /// A built-in profile or a path to a profile file
        #[arg(value_name = "KEY")]
        key: String,
    },
    /// Check a profile file
    Check {
        /// The profile file
        #[arg(value_name = "FILE")]
        file: PathBuf,
    },
}

#[derive(Debug, clap::Args)]
pub(crate) struct Decode {
    /// A built-in profile or a path to a profile file
    #[arg(value_name = "KEY")]
    pub(crate) key: String,
    /// Address of the first register, decimal or 0x hex
    #[arg(value_name = "ADDRESS", value_parser = address)]
    pub(crate) address: u16,
    /// Registers, hex
    #[arg(value_name = "REG", required = true, value_parser = register)]
    pub(crate) registers: Vec<u16>,
    /// Order of the words of a 32-bit value [default: the profile's]
    #[arg(long, value_name = "ORDER", value_parser = word_order)]
    pub(crate) word_order: Option<WordOrder>,
}

#[derive(Debug, clap::Args)]
pub(crate) struct Frame {
    /// The bytes of the frame, hex, with or without spaces
    #[arg(value_name = "HEX", required = true)]
    pub(crate) hex: Vec<String>,
    /// The controller's profile: names its exceptions and points
    #[arg(long, value_name = "KEY")]
    pub(crate) profile: Option<String>,
}

#[derive(Debug, clap::Args)]
pub(crate) struct Plan {
    /// A built-in profile or a path to a profile file
    #[arg(value_name = "KEY")]
    pub(crate) key: String,
    /// Points to read; all readable ones but image and trace when none is named
    #[arg(value_name = "POINT")]
    pub(crate) points: Vec<String>,
    /// The wire to plan for, which is not opened [default: a serial line, 9600 8N1]
    #[arg(long, value_name = "URL", value_parser = endpoint)]
    pub(crate) endpoint: Option<Endpoint>,
}

#[derive(Debug, clap::Args)]
pub(crate) struct Read {
    /// A built-in profile or a path to a profile file
    #[arg(value_name = "KEY")]
    pub(crate) key: String,
    /// The wire, for example tcp://192.0.2.10:502
    #[arg(long, value_name = "URL", value_parser = endpoint)]
    pub(crate) from: Endpoint,
    /// Unit id of the controller [default: the profile's]
    #[arg(long, value_name = "N", value_parser = unit)]
    pub(crate) unit: Option<u8>,
    /// Points to read; all readable ones when none is named
    #[arg(value_name = "POINT")]
    pub(crate) points: Vec<String>,
    #[command(flatten)]
    pub(crate) wire: Wire,
}

#[derive(Debug, clap::Args)]
pub(crate) struct Watch {
    /// A built-in profile or a path to a profile file
    #[arg(value_name = "KEY")]
    pub(crate) key: String,
    /// The wire, for example tcp://192.0.2.10:502
    #[arg(long, value_name = "URL", value_parser = endpoint)]
    pub(crate) from: Endpoint,
    /// Unit id of the controller [default: the profile's]
    #[arg(long, value_name = "N", value_parser = unit)]
    pub(crate) unit: Option<u8>,
    /// Points to read in every round; when none is named, each as often as its profile says
    #[arg(value_name = "POINT")]
    pub(crate) points: Vec<String>,
    /// From the start of one round to the next, where the wire is fast enough: 500ms, 5s
    #[arg(long, value_name = "TIME", default_value = "1s", value_parser = duration)]
    pub(crate) every: Duration,
    #[command(flatten)]
    pub(crate) wire: Wire,
}

#[derive(Debug, clap::Args)]
pub(crate) struct Order {
    /// A built-in profile or a path to a profile file
    #[arg(value_name = "KEY")]
    pub(crate) key: String,
    /// The command, as "busbar profile show KEY" lists it
    #[arg(value_name = "NAME")]
    pub(crate) name: String,
    /// Its arguments, for example press=long
    #[arg(value_name = "ARG=VALUE", value_parser = argument)]
    pub(crate) arguments: Vec<(String, String)>,
    /// The wire, for example tcp://192.0.2.10:502
    #[arg(long, value_name = "URL", value_parser = endpoint)]
    pub(crate) to: Endpoint,
    /// Unit id of the controller [default: the profile's]
    #[arg(long, value_name = "N", value_parser = unit)]
    pub(crate) unit: Option<u8>,
    /// Send it without asking, whatever it may do; stands for a typed confirmation too, and is needed without a terminal
    #[arg(long)]
    pub(crate) yes: bool,
    #[command(flatten)]
    pub(crate) wire: Wire,
}

#[derive(Debug, clap::Args)]
pub(crate) struct Registers {
    /// The wire, for example tcp://192.0.2.10:502
    #[arg(value_name = "URL", value_parser = endpoint)]
    pub(crate) endpoint: Endpoint,
    /// Address of the first register, decimal or 0x hex
    #[arg(value_name = "ADDRESS", value_parser = address)]
    pub(crate) address: u16,
    /// How many registers, 1 to 125
    #[arg(value_name = "COUNT", value_parser = count)]
    pub(crate) count: u16,
    /// Unit id of the controller
    #[arg(long, value_name = "N", default_value = "1", value_parser = unit)]
    pub(crate) unit: u8,
    /// 3 reads holding registers, 4 input registers
    #[arg(long, value_name = "F", default_value = "3", value_parser = read_function)]
    pub(crate) function: u8,
    #[command(flatten)]
    pub(crate) wire: Wire,
}

/// What every command on a wire takes.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Wire")]
pub(crate) struct Wire {
    /// How long to wait for an answer: 500ms, 2s; a bare number is milliseconds
    #[arg(long, value_name = "TIME", value_parser = duration)]
    pub(crate) timeout: Option<Duration>,
    /// Least time between an answer and the next request: 500ms
    #[arg(long, value_name = "TIME", value_parser = duration_or_zero)]
    pub(crate) spacing: Option<Duration>,
    /// Order of the words of a 32-bit value: low-first or high-first
    #[arg(long, value_name = "ORDER", value_parser = word_order)]
    pub(crate) word_order: Option<WordOrder>,
    /// Print every frame, both ways, with its time, on standard error
    #[arg(long)]
    pub(crate) trace: bool,
}

fn endpoint(text: &str) -> Result<Endpoint, String> {
    text.parse().map_err(|error: busbar_link::EndpointError| error.to_string())
}

fn socket_address(text: &str) -> Result<SocketAddr, String> {
    let address = match text.strip_prefix("localhost:") {
        Some(port) => format!("127.0.0.1:{port}"),
        None => text.to_owned(),
    };
    address.parse().map_err(|_| "write ADDRESS:PORT, for example 127.0.0.1:8080".to_owned())
}

fn log_format(text: &str) -> Result<Format, String> {
    match text {
        "text" => Ok(Format::Text),
        "json" => Ok(Format::Json),
        _ => Err("a log is written as text or json".to_owned()),
    }
}

/// Decimal, or hex behind `0x`.
fn number(text: &str) -> Option<u32> {
    let digits = |text: &str, radix| {
        let plain = !text.is_empty() && text.chars().all(|c| c.is_digit(radix));
        plain.then(|| u32::from_str_radix(text, radix).ok()).flatten()
    };
    match text.strip_prefix("0x").or_else(|| text.strip_prefix("0X")) {
        Some(hex) => digits(hex, 16),
        None => digits(text, 10),
    }
}

fn address(text: &str) -> Result<u16, String> {
    number(text)
        .and_then(|number| u16::try_from(number).ok())
        .ok_or_else(|| "an address is 0 to 65535, decimal or hex behind 0x".to_owned())
}

fn register(text: &str) -> Result<u16, String> {
    let digits = text.strip_prefix("0x").or_else(|| text.strip_prefix("0X")).unwrap_or(text);
    let hex = (1..=4).contains(&digits.len()) && digits.chars().all(|c| c.is_ascii_hexdigit());
    hex.then(|| u16::from_str_radix(digits, 16).ok())
        .flatten()
        .ok_or_else(|| "a register is one to four hex digits, for example 08FE".to_owned())
}

fn count(text: &str) -> Result<u16, String> {
    number(text)
        .and_then(|number| u16::try_from(number).ok())
        .filter(|count| (1..=125).contains(count))
        .ok_or_else(|| "one request reads 1 to 125 registers".to_owned())
}

fn unit(text: &str) -> Result<u8, String> {
    number(text)
        .and_then(|number| u8::try_from(number).ok())
        .ok_or_else(|| "a unit id is 0 to 255".to_owned())
}

fn device_unit(text: &str) -> Result<u8, String> {
    unit(text)
        .ok()
        .filter(|unit| *unit > 0)
        .ok_or_else(|| "a unit id is 1 to 255; 0 is the broadcast address".to_owned())
}

fn read_function(text: &str) -> Result<u8, String> {
    match number(text) {
        Some(3) => Ok(3),
        Some(4) => Ok(4),
        _ => Err("function 3 reads holding registers and 4 input registers".to_owned()),
    }
}

fn speed(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|speed: &f64| speed.is_finite() && *speed > 0.0)
        .ok_or_else(|| "a speed is a number above 0, where 1 is real time".to_owned())
}

fn pin(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((point, value)) if !point.trim().is_empty() && !value.trim().is_empty() => {
            Ok((point.trim().to_owned(), value.trim().to_owned()))
        }
        _ => Err("write POINT=VALUE, for example fuel_level=12.5".to_owned()),
    }
}

fn argument(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.is_empty() && !value.is_empty() => {
            Ok((name.to_owned(), value.to_owned()))
        }
        _ => Err("write ARG=VALUE, for example press=long".to_owned()),
    }
}

fn word_order(text: &str) -> Result<WordOrder, String> {
    match text {
        "low-first" => Ok(WordOrder::LowFirst),
        "high-first" => Ok(WordOrder::HighFirst),
        _ => Err("a word order is low-first or high-first".to_owned()),
    }
}

fn duration(text: &str) -> Result<Duration, String> {
    duration_or_zero(text)
        .ok()
        .filter(|duration| !duration.is_zero())
        .ok_or_else(|| "write a time above zero and at most one hour, for example 500ms or 2s".to_owned())
}

fn duration_or_zero(text: &str) -> Result<Duration, String> {
    let (digits, scale) = if let Some(digits) = text.strip_suffix("ms") {
        (digits, 1e-3)
    } else if let Some(digits) = text.strip_suffix('s') {
        (digits, 1.0)
    } else {
        (text, 1e-3)
    };
    let digits = digits.trim_end();
    let plain = digits.starts_with(|c: char| c.is_ascii_digit())
        && digits.chars().all(|c| c.is_ascii_digit() || c == '.');
    plain
        .then(|| digits.parse::<f64>().ok())
        .flatten()
        .map(|number| number * scale)
        .filter(|seconds| *seconds <= 3600.0)
        .map(Duration::from_secs_f64)
        .ok_or_else(|| "write a time of at most one hour, for example 500ms or 2s".to_owned())
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_definition_is_sound() {
        Args::command().debug_assert();
    }

    #[test]
    fn reads_addresses() {
        assert_eq!(address("10246"), Ok(10246));
        assert_eq!(address("0x2806"), Ok(0x2806));
        assert_eq!(address("0X2806"), Ok(0x2806));
        assert_eq!(address("0020"), Ok(20), "leading zeros are decimal, as the manuals print them");
        for wrong in ["", "0x", "65536", "0x10000", "-1", "+1", "12h", "2806.5", "0x+1", " 1"] {
            assert!(address(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn reads_registers() {
        assert_eq!(register("08FE"), Ok(0x08FE));
        assert_eq!(register("0"), Ok(0));
        assert_eq!(register("0xffff"), Ok(0xFFFF));
        for wrong in ["", "0x", "12345", "08FE0000", "-1", "+1", "xyz"] {
            assert!(register(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn reads_times() {
        assert_eq!(duration("500ms"), Ok(Duration::from_millis(500)));
        assert_eq!(duration("250"), Ok(Duration::from_millis(250)));
        assert_eq!(duration("1.5s"), Ok(Duration::from_millis(1500)));
        assert_eq!(duration_or_zero("0"), Ok(Duration::ZERO));
        for wrong in ["", "0", "s", "ms", "-1s", "1h", "1.2.3s", "4000s", "inf", "nan", "1e9"] {
            assert!(duration(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn takes_several_urls_behind_one_listen() {
        let args = Args::try_parse_from([
            "busbar",
            "emulate",
            "datakom-d",
            "--listen",
            "tcp://127.0.0.1:0",
            "tcp://127.0.0.1:1502",
            "--listen",
            "tcp://127.0.0.1:1503",
        ]);
        let Ok(Args { command: Command::Emulate(emulate), .. }) = args else { panic!("{args:?}") };
        assert_eq!(emulate.listen.len() + emulate.more.len(), 3);
    }
}
