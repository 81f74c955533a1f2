//! What the services tell about their work, on standard error.

use std::{env, io};

use tracing_subscriber::EnvFilter;

use crate::{failure::Failure, terminal};

/// Names what is told, for example `debug` or `busbar_link=trace`.
const VARIABLE: &str = "BUSBAR_LOG";

/// Starts to tell: what `BUSBAR_LOG` says, else what `level` says.
pub(crate) fn start(level: &str) -> Result<(), Failure> {
    let directives = env::var(VARIABLE).unwrap_or_else(|_| level.to_owned());
    let filter = EnvFilter::try_new(&directives).map_err(|error| {
        Failure::Call(format!(
            "{VARIABLE} cannot be \"{directives}\": {error}; write error, warn, info, debug or trace"
        ))
    })?;
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(io::stderr)
        .with_ansi(terminal::error_is_coloured())
        .with_target(false)
        .try_init()
        .map_err(|error| Failure::Failed(format!("nothing can be logged: {error}")))
}
