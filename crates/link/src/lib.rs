//! Transports, and the one task that owns a wire.
//!
//! A [`Link`] is a handle on one wire, and one task behind it owns the connection. Whoever wants something of a device
//! asks the link, so two users of one wire cannot collide. The wire connects at once and again after a drop, sends one
//! request at a time, and takes nothing for an answer that does not answer that request.
//!
//! - **Reads are retried, writes never.** A write leaves at most once. If its answer is lost, the caller learns just
//!   that ([`LinkError::Lost`]) and finds out by reading.
//! - **A dead connection holds nobody up.** While a wire is down requests fail at once with the reason; while it is
//!   being connected they wait as long as they would wait for an answer.
//! - **A silent unit holds nobody up either.** It is polled again behind everybody else, and the connection is not
//!   blamed for it while others on the wire answer.
//! - **Commands go first**, then what a person waits for, then polling ([`Priority`]).
//!
//! [`command`] drives a remote command of a profile over a link.
//!
//! Inside, `wire` holds every rule as a pure state machine that is given the time; `shared` puts it and the connection
//! behind one lock; `task` connects and keeps time.

pub mod command;
mod endpoint;
mod error;
mod job;
mod link;
mod options;
mod port;
mod queue;
mod shared;
mod silence;
mod statistics;
mod task;
mod trace;
mod wire;

pub use endpoint::{Endpoint, EndpointError, EndpointProblem, Parity, Serial, StopBits};
pub use error::{Cause, Fault, LinkError, Loss, OpenError, Outage};
pub use job::{Priority, Write};
pub use link::{Link, WireState};
pub use options::{Backoff, Options};
pub use statistics::{Latency, Statistics};
pub use trace::{Direction, Trace, TraceEvent};
