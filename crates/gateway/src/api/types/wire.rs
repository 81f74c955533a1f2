//! The shapes of wires: their state, what went over them, their units and what they are polled with.

use serde::Serialize;
use utoipa::ToSchema;

use super::Rate;

/// One wire and how it does.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct WireView {
    /// Its id in the site file.
    #[schema(examples("gen1"))]
    pub id: String,
    /// Where it leads.
    #[schema(examples("tcp://192.0.2.20:502"))]
    pub endpoint: String,
    /// Whether it is connected.
    pub state: WireState,
    /// Why it is down; null otherwise.
    #[schema(
        required,
        examples(
            "tcp://192.0.2.20:502: connection refused: check the port, and that the device is on and takes Modbus connections"
        )
    )]
    pub reason: Option<String>,
    /// What went over it since the gateway started.
    pub statistics: WireStatistics,
}

/// Whether a wire is connected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum WireState {
    /// Being connected.
    Connecting,
    /// Connected.
    Connected,
    /// Not connected; tried again by itself.
    Down,
}

/// What went over a wire since the gateway started.
#[derive(Debug, Clone, Default, PartialEq, Serialize, ToSchema)]
pub struct WireStatistics {
    /// Requests sent, repeats included.
    pub requests: u64,
    /// Answers taken, exceptions included.
    pub answers: u64,
    /// Requests that nobody answered in time.
    pub timeouts: u64,
    /// Reads that were sent once more.
    pub retries: u64,
    /// Exceptions, by code.
    pub exceptions: Vec<ExceptionCount>,
    /// Answers that came after their time was up.
    pub late: u64,
    /// Answers from another unit than the one that was asked.
    pub wrong_unit: u64,
    /// Answers with another function than the request.
    pub wrong_function: u64,
    /// Answers with more or less data than was asked for.
    pub wrong_length: u64,
    /// Confirmations of another write than was sent.
    pub wrong_echo: u64,
    /// Frames of another protocol than Modbus.
    pub wrong_protocol: u64,
    /// Frames whose checksum was wrong.
    pub crc_errors: u64,
    /// Bytes that belonged to no frame: noise.
    pub garbage: u64,
    /// Own requests that a converter sent back.
    pub echoes: u64,
    /// Polls of silent units that were held back, so that the others keep their pace.
    pub held: u64,
    /// Times the wire was connected again.
    pub reconnects: u64,
    /// Bytes received.
    pub bytes_in: u64,
    /// Bytes sent.
    pub bytes_out: u64,
    /// Mean time from request to answer, in milliseconds; null before the first answer.
    #[schema(required, examples(3.2))]
    pub latency_ms: Option<f64>,
}

/// How often a device answered with one exception code.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
pub struct ExceptionCount {
    /// The code on the wire.
    #[schema(examples(2))]
    pub code: u8,
    /// How often it came.
    pub count: u64,
}

/// One wire in detail.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct WireDetailView {
    /// The wire as the list of wires has it.
    pub wire: WireView,
    /// How long answers took, all units together.
    pub latency: LatencyView,
    /// Seconds since it was opened.
    #[schema(examples(3600.0))]
    pub open_s: f64,
    /// How its time was used, all units together.
    pub time: WireTime,
    /// The units that were asked, by unit id.
    pub units: Vec<UnitView>,
    /// What the devices on it are polled with, in the order of the site file.
    pub plans: Vec<PlanView>,
}

/// How long answers took.
#[derive(Debug, Clone, Default, PartialEq, Serialize, ToSchema)]
pub struct LatencyView {
    /// Answers measured.
    pub count: u64,
    /// The shortest time, in milliseconds; null before the first answer.
    #[schema(required, examples(1.9))]
    pub min_ms: Option<f64>,
    /// The mean.
    #[schema(required, examples(3.2))]
    pub mean_ms: Option<f64>,
    /// The longest.
    #[schema(required, examples(41.5))]
    pub max_ms: Option<f64>,
    /// How many answers took how long, the shortest first.
    pub buckets: Vec<LatencyBucket>,
}

/// The answers that took longer than the bucket before allows, and no longer than this one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct LatencyBucket {
    /// The longest time that belongs here, in milliseconds; null for the last bucket, which has no end.
    #[schema(required, examples(5.0))]
    pub up_to_ms: Option<f64>,
    /// How many there were.
    pub count: u64,
}

/// How much of a wire's time was used, and how.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, ToSchema)]
pub struct WireTime {
    /// Seconds in which characters were on the line; null where its speed is not known, as over TCP.
    #[schema(required, examples(812.4))]
    pub busy_s: Option<f64>,
    /// Seconds in which an answer was waited for.
    #[schema(examples(96.1))]
    pub waiting_s: f64,
    /// Share of the time since the wire was opened in which characters were on the line, 0 to 1.
    #[schema(required, examples(0.23))]
    pub busy_share: Option<f64>,
    /// Share of the time since the wire was opened in which an answer was waited for, 0 to 1.
    #[schema(examples(0.03))]
    pub waiting_share: f64,
}

/// What went to and from one unit of a wire.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct UnitView {
    /// Its unit id.
    #[schema(examples(1))]
    pub unit: u8,
    /// Id of the device; null for a unit that is none of the site.
    #[schema(required, examples("gen1"))]
    pub device: Option<String>,
    /// What it did when it was asked last.
    pub state: UnitState,
    /// Seconds until a silent unit is polled again; null for the others.
    #[schema(required, examples(12.5))]
    pub next_probe_s: Option<f64>,
    /// Requests sent, repeats included.
    pub requests: u64,
    /// Answers taken, exceptions included.
    pub answers: u64,
    /// Requests that it did not answer in time.
    pub timeouts: u64,
    /// Reads that were sent once more.
    pub retries: u64,
    /// Polls that were held back while it was silent, so that the others keep their pace.
    pub held: u64,
    /// Exceptions, by code.
    pub exceptions: Vec<ExceptionCount>,
    /// Answers that came after their time was up.
    pub late: u64,
    /// Frames whose checksum was wrong, while its answer was due.
    pub crc_errors: u64,
    /// Bytes that belonged to no frame, while its answer was due.
    pub garbage: u64,
    /// Bytes received.
    pub bytes_in: u64,
    /// Bytes sent.
    pub bytes_out: u64,
    /// How long its answers took.
    pub latency: LatencyView,
    /// How much of the wire's time went to it.
    pub time: WireTime,
}

/// What a unit did when it was asked last.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum UnitState {
    /// It was not asked yet, or its first answer is still due.
    Unknown,
    /// It answered.
    Answering,
    /// It did not answer.
    Missing,
    /// It has not answered for several times, and is polled only now and then.
    Silent,
}

/// What one device is polled with.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct PlanView {
    /// Id of the device.
    #[schema(examples("gen1"))]
    pub device: String,
    /// Its unit id.
    #[schema(examples(1))]
    pub unit: u8,
    /// The pause it wants after each of its reads, in milliseconds.
    #[schema(examples(500))]
    pub spacing_ms: u32,
    /// The rounds, the most frequent first; each reads what the one before it does, and more.
    pub rounds: Vec<PlannedRound>,
    /// Reads that the device refuses however small they are; they are tried again once a minute.
    pub refused: Vec<PlannedRead>,
    /// The least time in which all of it can be read anew, its pauses included, in milliseconds; null where the line's
    /// speed is not known.
    #[schema(required, examples(553.7))]
    pub refresh_ms: Option<f64>,
    /// Share of the wire's time that polling it takes, 0 to 1; above 1 its rates cannot be kept. Null where the line's
    /// speed is not known.
    #[schema(required, examples(0.41))]
    pub load: Option<f64>,
}

/// The reads of one round.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct PlannedRound {
    /// The rates that are due in it.
    pub rates: Vec<Rate>,
    /// Seconds from one such round to the next; null for one that comes at the start and after the device was away.
    #[schema(required, examples(1.0))]
    pub every_s: Option<f64>,
    /// Its reads, in address order.
    pub reads: Vec<PlannedRead>,
    /// Characters of all its requests and answers; over TCP, bytes.
    #[schema(examples(410))]
    pub characters: u64,
    /// What it takes of the wire's time, in milliseconds; null where the line's speed is not known.
    #[schema(required, examples(521.4))]
    pub ms: Option<f64>,
}

/// One read of a plan.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct PlannedRead {
    /// Function code.
    #[schema(examples(3))]
    pub function: u8,
    /// First register.
    #[schema(examples(10246))]
    pub address: u16,
    /// How many registers.
    #[schema(examples(16))]
    pub count: u16,
    /// The rates of the points that it is for.
    pub rates: Vec<Rate>,
    /// Characters of the request and its full answer; over TCP, bytes.
    #[schema(examples(45))]
    pub characters: u64,
    /// What it takes of the wire's time, with the silences before and after its answer, in milliseconds; null where the
    /// line's speed is not known.
    #[schema(required, examples(54.2))]
    pub ms: Option<f64>,
}
