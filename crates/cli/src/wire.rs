//! A wire opened as the command line says.

use std::time::Duration;

use busbar_link::{Cause, Direction, Endpoint, Link, LinkError, Options, StopBits, Trace};
use busbar_profile::{OverRead, Parity, Profile, builtin, plan::Cost};
use jiff::{SignedDuration, Timestamp};

use crate::{args, failure::Failure, terminal};

/// Unit ids above which a manual contradicts itself.
const DOUBTFUL_UNITS: [(&str, u8); 1] = [("datakom-dkg705", 144)];

/// The path of a pseudo-terminal that is still to be made.
const PTY: &str = "pty";

/// Opens the wire. What the command line leaves open, the profile says; without one the defaults of the link hold.
///
/// Answers may be short where the profile says that the device cuts long reads, and where no profile tells.
pub(crate) fn open(
    endpoint: &Endpoint,
    args: &args::Wire,
    profile: Option<&Profile>,
) -> Result<Link, Failure> {
    let defaults = Options::default();
    let ms = |ms: u32| Duration::from_millis(u64::from(ms));
    let options = Options {
        timeout: args
            .timeout
            .or(profile.map(|profile| ms(profile.wire.timeout_ms)))
            .unwrap_or(defaults.timeout),
        spacing: args
            .spacing
            .or(profile.map(|profile| ms(profile.wire.spacing_ms)))
            .unwrap_or(defaults.spacing),
        trace: args.trace.then(trace),
        ..defaults
    };
    if let Endpoint::Rtu { path, .. } = endpoint
        && path == PTY
    {
        return Err(Failure::Call(format!(
            "{endpoint} is a place to listen for \"busbar emulate\"; write the URL that it prints, as rtu:///dev/pts/3"
        )));
    }
    let short = profile.is_none_or(|profile| profile.wire.over_read == OverRead::Truncate);
    Ok(Link::open(endpoint.clone(), options).map_err(Failure::failed)?.with_short_answers(short))
}

/// The unit id to ask: the caller's, else the profile's.
pub(crate) fn unit(profile: &Profile, given: Option<u8>) -> Result<u8, Failure> {
    let range = profile.wire.unit;
    let (key, min, max) = (&profile.key, range.min, range.max);
    let Some(unit) = given.or(range.default) else {
        return Err(Failure::Call(format!(
            "the manual of {key} gives no unit id as delivered; write --unit N, {min} to {max}"
        )));
    };
    if !(min..=max).contains(&unit) {
        return Err(Failure::Call(format!(
            "{key} cannot be set to unit {unit}; write --unit N, {min} to {max}, as it is set at the controller"
        )));
    }
    let doubtful = DOUBTFUL_UNITS.iter().find(|(doubtful, last)| doubtful == key && unit > *last);
    if let Some((_, last)) = doubtful {
        terminal::message(&format!(
            "the manual of {key} allows unit {unit} in one place and ends at {last} in others; if it does not answer, set one up to {last}"
        ));
    }
    Ok(unit)
}

/// Refuses a serial line that the controller cannot be set to.
pub(crate) fn check_line(profile: &Profile, endpoint: &Endpoint) -> Result<(), Failure> {
    let Endpoint::Rtu { serial, .. } = endpoint else { return Ok(()) };
    let own = &profile.wire.serial;
    let parity = match serial.parity {
        busbar_link::Parity::None => Parity::None,
        busbar_link::Parity::Even => Parity::Even,
        busbar_link::Parity::Odd => Parity::Odd,
    };
    let stop = match serial.stop {
        StopBits::One => 1,
        StopBits::Two => 2,
    };
    let refuse = |setting: &str, has: Vec<String>| {
        Err(Failure::Call(format!(
            "{} cannot be set to {setting}; it has {}, write the one that is set at the controller",
            profile.key,
            has.join(", ")
        )))
    };
    if !own.baud.contains(&serial.baud) {
        return refuse(&format!("baud={}", serial.baud), own.baud.iter().map(u32::to_string).collect());
    }
    if !own.parity.contains(&parity) {
        return refuse(&format!("parity={parity}"), own.parity.iter().map(Parity::to_string).collect());
    }
    if !own.stop.contains(&stop) {
        return refuse(&format!("stop={stop}"), own.stop.iter().map(u8::to_string).collect());
    }
    Ok(())
}

/// What a read costs on this wire. Networks are taken for slow ones: there a request costs more than some bytes.
pub(crate) fn cost(endpoint: &Endpoint, profile: &Profile) -> Cost {
    match endpoint {
        Endpoint::Rtu { serial, .. } => {
            Cost::rtu(serial.baud, serial.bits_per_character().into(), profile.wire.answer_delay())
        }
        _ => Cost::tcp(Duration::from_millis(20), 100_000),
    }
}

/// Every frame on standard error: when, which way (`>` leaves, `<` comes), its bytes.
fn trace() -> Trace {
    let opened = Timestamp::now();
    Trace::new(move |event| {
        let since = SignedDuration::try_from(event.at).unwrap_or_default();
        let at = opened.saturating_add(since).unwrap_or(opened);
        let way = match event.direction {
            Direction::Sent => '>',
            Direction::Received => '<',
        };
        let bytes: Vec<String> = event.bytes.iter().map(|byte| format!("{byte:02X}")).collect();
        terminal::error_text(&format!("{at:.6} {way} {}\n", bytes.join(" ")));
    })
}

/// Why a read has no result, with the maker's name of an exception where the profile gives one, and where there was no
/// answer with the page that says what to check.
pub(crate) fn sentence(error: &LinkError, profile: Option<&Profile>) -> String {
    match error {
        LinkError::Exception { unit, function, code } => {
            let own = profile.and_then(|profile| profile.exception_name(code.0));
            format!(
                "unit {unit} answered function {function} with exception {} ({})",
                code.0,
                own.unwrap_or(code.name())
            )
        }
        _ => {
            let text = error.to_string();
            // Where the link points at the folder, the page is named in its place.
            match text.strip_suffix(" (docs/connect/)") {
                Some(text) => format!("{text}; {}", advice(profile)),
                None if is_no_answer(error) => format!("{text}; {}", advice(profile)),
                None => text,
            }
        }
    }
}

/// Whether setting up the controller or its wiring may be what is wrong.
fn is_no_answer(error: &LinkError) -> bool {
    match error {
        LinkError::Timeout { .. } | LinkError::NeverSilent { .. } => true,
        LinkError::Down { reason } => matches!(
            reason.cause,
            Cause::Refused
                | Cause::Unreachable
                | Cause::ConnectTimedOut { .. }
                | Cause::StillConnecting { .. }
                | Cause::Silent { .. }
                | Cause::Garbage
        ),
        _ => false,
    }
}

/// Where it stands what to set at the controller, and what to check on the wire.
fn advice(profile: Option<&Profile>) -> String {
    match profile.filter(|profile| builtin(&profile.key).is_some()) {
        Some(profile) => format!("docs/connect/{}.md tells more", profile.key),
        None => "docs/connect/ has a page for each controller".to_owned(),
    }
}
