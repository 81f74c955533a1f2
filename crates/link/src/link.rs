//! The handle on a wire: what callers hold, and how their requests reach the task.

use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::{Duration, SystemTime};

use tokio::runtime::Handle;
use tokio::sync::watch;

use crate::endpoint::Endpoint;
use crate::error::{LinkError, OpenError, Outage};
use crate::job::{Ask, Interrupted, Job, Outcome, Priority, Write};
use crate::line::Line;
use crate::options::Options;
use crate::queue::Ticket;
use crate::shared::Shared;
use crate::statistics::Statistics;
use crate::task::Task;
use crate::trace::Trace;
use crate::wire::Wire;

/// A handle on one wire. Clones share the wire; it is closed when the last one is gone.
#[derive(Clone, Debug)]
pub struct Link {
    owner: Arc<Owner>,
    priority: Priority,
    timeout: Duration,
    spacing: Duration,
    short: bool,
}

impl Link {
    /// Opens a wire and starts to connect. Whether it is up is seen from [`Self::state`] or the first request.
    ///
    /// # Errors
    /// [`OpenError::NotSpoken`] for `tls://` endpoints, [`OpenError::NoPort`] for port 0, [`OpenError::NoRuntime`]
    /// outside a tokio runtime.
    pub fn open(endpoint: Endpoint, options: Options) -> Result<Self, OpenError> {
        let line = match &endpoint {
            Endpoint::Tcp { port: 0, .. } | Endpoint::RtuTcp { port: 0, .. } => {
                return Err(OpenError::NoPort { endpoint });
            }
            Endpoint::Tcp { .. } => Line::tcp(),
            Endpoint::Rtu { serial, .. } => Line::rtu(serial),
            Endpoint::RtuTcp { .. } => Line::tunnelled(),
            Endpoint::Tls { .. } => return Err(OpenError::NotSpoken { endpoint }),
        };
        let runtime = Handle::try_current().map_err(|_| OpenError::NoRuntime)?;

        let endpoint = Arc::new(endpoint);
        let wire = Wire::new(Arc::clone(&endpoint), line, &options);
        let shared = Arc::new(Shared::new(wire, line));
        if options.trace.is_some() {
            shared.trace(options.trace.clone());
        }
        let timeout = options.timeout;
        runtime.spawn(Task::new(Arc::clone(&shared), Arc::clone(&endpoint), line, options));
        let owner = Arc::new(Owner { shared, endpoint });
        Ok(Self { owner, priority: Priority::Person, timeout, spacing: Duration::ZERO, short: false })
    }

    /// The same wire for requests of another priority. A link starts as [`Priority::Person`].
    #[must_use]
    pub fn with_priority(&self, priority: Priority) -> Self {
        Self { priority, ..self.clone() }
    }

    /// The same wire for requests with another time-out than [`Options::timeout`]: the longest that each of them waits.
    #[must_use]
    pub fn with_timeout(&self, timeout: Duration) -> Self {
        Self { timeout, ..self.clone() }
    }

    /// The same wire for a unit that wants to be left alone so long between the end of one exchange and the next
    /// request. It is kept by unit, whichever handle the exchange before was of; other units use the time. Commands
    /// keep it too, and go first when it is over.
    #[must_use]
    pub fn with_spacing(&self, spacing: Duration) -> Self {
        Self { spacing, ..self.clone() }
    }

    /// The same wire for reads that may also be answered by fewer registers than they ask for, where the device is
    /// known to cut long reads. A link starts without: there a short answer is dropped and counted as a wrong length.
    #[must_use]
    pub fn with_short_answers(&self, allowed: bool) -> Self {
        Self { short: allowed, ..self.clone() }
    }

    /// Reads registers side by side, 1 to 125, with function 3 (holding) or 4 (input).
    ///
    /// All that were asked for come, or at least one where [short answers](Self::with_short_answers) are allowed.
    ///
    /// # Errors
    /// Any [`LinkError`] but [`LinkError::Lost`].
    pub async fn read_registers(
        &self,
        unit: u8,
        function: u8,
        address: u16,
        count: u16,
    ) -> Result<Vec<u16>, LinkError> {
        let mut registers = Vec::with_capacity(usize::from(count.min(125)));
        self.read_registers_into(unit, function, address, count, &mut registers).await?;
        Ok(registers)
    }

    /// Like [`Self::read_registers`], into a buffer of the caller's: nothing is allocated once it has grown.
    ///
    /// The buffer holds what came, and nothing after an error.
    ///
    /// # Errors
    /// As [`Self::read_registers`].
    pub async fn read_registers_into(
        &self,
        unit: u8,
        function: u8,
        address: u16,
        count: u16,
        registers: &mut Vec<u16>,
    ) -> Result<(), LinkError> {
        registers.clear();
        let job = Job {
            unit,
            ask: Ask::read(function, address, count)?,
            priority: self.priority,
            timeout: self.timeout,
            spacing: self.spacing,
            short: self.short,
            registers: std::mem::take(registers),
        };
        let outcome = self.ask(job).await;
        *registers = outcome.registers;
        outcome.result
    }

    /// Changes a device. The request leaves at most once; it goes ahead of every read that waits.
    ///
    /// Dropped before it was sent, it is not sent.
    ///
    /// # Errors
    /// What is known after each, and [`LinkError::may_have_taken_effect`] says in short:
    /// - [`LinkError::Lost`]: at least a part of it left, and no answer came. It may have taken effect, or may still.
    /// - [`LinkError::Exception`]: the device, or a converter in front of it, answered. Codes 1, 2, 3, 6 and 10 say
    ///   that nothing was done. 4 says that it failed on the way, 5 that it was accepted and goes on, 11 that a
    ///   converter passed it on and heard nothing. After these, and after codes that the standard does not have, it may
    ///   have taken effect.
    /// - [`LinkError::Down`], [`LinkError::QueueFull`], [`LinkError::NotSent`], [`LinkError::Closed`]: nothing left.
    pub async fn write(&self, unit: u8, write: Write) -> Result<(), LinkError> {
        self.ask(self.command(unit, Ask::Write(write))).await.result
    }

    /// Sends writes that belong together: nothing else leaves between them, on the whole wire. Each leaves at most once,
    /// when the one before it was acknowledged; the first failure ends them. The unit has its
    /// [pause](Self::with_spacing) between them too.
    ///
    /// # Errors
    /// [`Interrupted`] says how many were acknowledged, and why the next one was not, as [`Self::write`] has it.
    pub async fn write_together(&self, unit: u8, writes: Vec<Write>) -> Result<(), Interrupted> {
        let of = writes.len();
        if of == 0 {
            return Ok(());
        }
        let outcome = self.ask(self.command(unit, Ask::Together { writes, done: 0 })).await;
        outcome.result.map_err(|error| Interrupted { acknowledged: outcome.done, of, error })
    }

    fn command(&self, unit: u8, ask: Ask) -> Job {
        Job {
            unit,
            ask,
            priority: Priority::Command,
            timeout: self.timeout,
            spacing: self.spacing,
            short: false,
            registers: Vec::new(),
        }
    }

    /// Everything the wire has counted so far.
    pub fn statistics(&self) -> Statistics {
        let shared = &self.owner.shared;
        let now = shared.now();
        shared.lock().wire.statistics(now)
    }

    /// The state of the connection, and its changes.
    pub fn state(&self) -> watch::Receiver<WireState> {
        self.owner.shared.subscribe()
    }

    /// Shows every frame of the wire to `trace` from now on, in place of who saw them before; to nobody with `None`,
    /// which costs nothing. It is the wire's, whichever handle it is set by.
    pub fn trace(&self, trace: Option<Trace>) {
        self.owner.shared.trace(trace);
    }

    /// Where the wire ends.
    pub fn endpoint(&self) -> &Endpoint {
        &self.owner.endpoint
    }

    fn ask(&self, job: Job) -> Asking<'_> {
        Asking { shared: &self.owner.shared, stage: Stage::New(job) }
    }
}

/// The state of a wire's connection.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum WireState {
    /// The first connection is being made, or one that has just dropped is made anew.
    Connecting,
    /// Requests can be sent.
    Connected,
    /// There is no connection; it is tried again in growing intervals, and requests fail until then.
    Down {
        /// Why, as a sentence that names the endpoint.
        reason: Outage,
        /// Since when it has been down, whatever the reason was at first.
        since: SystemTime,
    },
}

/// Closes the wire when the last handle goes.
#[derive(Debug)]
struct Owner {
    shared: Arc<Shared>,
    endpoint: Arc<Endpoint>,
}

impl Drop for Owner {
    fn drop(&mut self) {
        self.shared.close();
    }
}

/// One request on its way. Dropped early, it takes its job back.
struct Asking<'a> {
    shared: &'a Shared,
    stage: Stage,
}

enum Stage {
    New(Job),
    Queued(Ticket),
    Over,
}

impl Future for Asking<'_> {
    type Output = Outcome;

    fn poll(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<Outcome> {
        match std::mem::replace(&mut self.stage, Stage::Over) {
            Stage::New(job) => match self.shared.submit(cx, job) {
                Ok(ticket) => {
                    self.stage = Stage::Queued(ticket);
                    Poll::Pending
                }
                Err(outcome) => Poll::Ready(outcome),
            },
            Stage::Queued(ticket) => {
                let outcome = self.shared.poll(cx, &ticket);
                if outcome.is_pending() {
                    self.stage = Stage::Queued(ticket);
                }
                outcome
            }
            Stage::Over => Poll::Pending,
        }
    }
}

impl Drop for Asking<'_> {
    fn drop(&mut self) {
        if let Stage::Queued(ticket) = std::mem::replace(&mut self.stage, Stage::Over) {
            self.shared.cancel(ticket);
        }
    }
}
