//! What the services tell about their work, on standard error.

use std::{env, io};

use tracing_subscriber::EnvFilter;

use crate::{failure::Failure, terminal};

/// Names what is told, for example `debug` or `busbar_link=trace`.
const VARIABLE: &str = "BUSBAR_LOG";

/// Frames are told only of wires that somebody asked for, and then always.
const FRAMES: &str = "busbar::frames=info";

/// How it is told: lines for people, or one JSON document a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Format {
    Text,
    Json,
}

/// Starts to tell: what `BUSBAR_LOG` says, else what `level` says.
pub(crate) fn start(level: &str, format: Format) -> Result<(), Failure> {
    let directives = env::var(VARIABLE).unwrap_or_else(|_| level.to_owned());
    let filter = EnvFilter::try_new(&directives).map_err(|error| {
        Failure::Call(format!(
            "{VARIABLE} cannot be \"{directives}\": {error}; write error, warn, info, debug or trace"
        ))
    })?;
    let filter = match FRAMES.parse() {
        Ok(frames) => filter.add_directive(frames),
        Err(_) => filter,
    };
    let log = tracing_subscriber::fmt().with_env_filter(filter).with_writer(io::stderr);
    let started = match format {
        Format::Text => log.with_ansi(terminal::error_is_coloured()).with_target(false).try_init(),
        Format::Json => {
            log.json().flatten_event(true).with_current_span(false).with_span_list(false).try_init()
        }
    };
    started.map_err(|error| Failure::Failed(format!("nothing can be logged: {error}")))
}
