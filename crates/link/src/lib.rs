//! Transports, and the one task that owns a wire.
//!
//! A [`Link`] is a handle on one wire, and one task behind it owns the connection. Whoever wants something of a device
//! asks the link, so two users of one wire cannot collide. The wire connects at once and again after a drop, sends one
//! request at a time, and takes nothing for an answer that does not answer that request.
//!
//! - **Reads are retried, writes never.** A write leaves at most once. If its answer is lost, the caller learns just
//!   that ([`LinkError::Lost`]) and finds out by reading. Writes that [belong together](Link::write_together) leave with
//!   nothing between them, and the first failure ends them.
//! - **A dead connection holds nobody up.** While a wire is down requests fail at once with the reason; while it is
//!   being connected they wait as long as they would wait for an answer.
//! - **A silent unit holds nobody up either.** After three time-outs in a row it is polled only in slots of its own that
//!   grow from one second to thirty ([`Options::probes`]); other polls of it fail at once ([`LinkError::Silent`]).
//!   What a person or a command asks goes through at once and waits as it always would, and any answer, even a late one, ends the silence. The
//!   connection is not blamed for a silent unit while others on the wire answer. Where nobody answers, there is nobody
//!   to protect and the connection is made anew.
//! - **Commands go first**, then what a person waits for, then polling ([`Priority`]). Within one of these the unit that
//!   was served longest ago goes first.
//! - **A unit has its pause** ([`Link::with_spacing`]) from the end of its last exchange; others use the time.
//! - **A read waits as long as its unit's latency suggests**, from [`Options::timeout_floor`] to the time-out of the
//!   request, twice as long after each time-out. Its second try waits the whole time-out, and a write always does: who
//!   is slow at times is not given up early. On a serial line the time of the characters comes on top.
//! - **A serial line is kept legal and tight.** A request leaves 3.5 characters after the last byte heard, whoever it
//!   was from, and no later. The gaps inside what is received mean nothing, because adapters deliver in pieces. Where it
//!   is never silent for so long, nobody waits for longer than for an answer ([`LinkError::NeverSilent`]).
//! - **A late answer is nobody else's.** Over TCP its transaction tells. On RTU only unit, function and length do: so
//!   while the answer to a lost request may still come, for twice the time-out, its unit is asked nothing else whose
//!   answer looks the same. The same read may be asked again: either answer is right.
//!
//! [`command`] drives a remote command of a profile over a link.
//!
//! Inside, `wire` holds every rule as a pure state machine that is given the time; `shared` puts it and the connection
//! behind one lock; `task` connects and keeps time. `stream` is the connection, whatever it is made of; on RTU wires
//! `echo` stands between it and the rules.

mod clock;
pub mod command;
mod doubt;
mod echo;
mod endpoint;
mod error;
mod heard;
mod job;
mod line;
mod link;
mod options;
mod port;
mod queue;
mod serial;
mod shared;
mod silence;
mod statistics;
mod stream;
mod task;
mod timer;
mod timing;
mod trace;
mod unit;
mod wire;

pub use endpoint::{Endpoint, EndpointError, EndpointProblem, Parity, Serial, StopBits};
pub use error::{Cause, Fault, LinkError, Loss, OpenError, Outage};
pub use heard::Heard;
pub use job::{Interrupted, Priority, Write};
pub use link::{Link, WireState};
pub use options::{Backoff, Options};
pub use serial::{SerialError, SerialPort};
pub use statistics::{Latency, Statistics, UnitState, UnitStatistics};
pub use timer::LineTimer;
pub use trace::{Direction, Trace, TraceEvent};
