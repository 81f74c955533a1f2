//! A wire opened as the command line says.

use std::time::Duration;

use busbar_link::{Direction, Endpoint, Link, LinkError, Options, Trace};
use busbar_profile::{OverRead, Profile, plan::Cost};
use jiff::{SignedDuration, Timestamp};

use crate::{args, failure::Failure, terminal};

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
    let short = profile.is_none_or(|profile| profile.wire.over_read == OverRead::Truncate);
    Ok(Link::open(endpoint.clone(), options).map_err(Failure::failed)?.with_short_answers(short))
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

/// Why a read has no result, with the maker's name of an exception where the profile gives one.
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
        _ => error.to_string(),
    }
}
