//! What goes wrong on the wires of an imitation, by a file: requests that nobody hears, answers that come late, spoiled,
//! forged or not at all. The controller behind them is sound.

mod file;
mod mischief;

use std::time::Duration;

use busbar_profile::Findings;

pub(crate) use mischief::{Mischief, Struck};

/// Everything that goes wrong, in the order in which it is looked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Faults {
    /// Of all chance in it.
    seed: u64,
    rules: Vec<Rule>,
}

/// One thing that goes wrong, and with which requests.
#[derive(Clone, Debug, PartialEq)]
struct Rule {
    kind: Kind,
    often: Often,
    /// It goes wrong so many times and no more.
    times: Option<u64>,
    unit: Option<u8>,
    function: Option<u8>,
    /// The first register or coil that the request names.
    address: Option<u16>,
    /// Simulated time since power-on.
    from: Duration,
    until: Option<Duration>,
}

/// With how many of the requests that a rule is about.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Often {
    /// Each time with this chance.
    Chance(f64),
    /// Each time after so many.
    Every(u64),
}

/// What goes wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// The request is lost: nothing is obeyed, nothing is answered.
    Unheard,
    /// The answer is lost: what was asked for is done.
    Unanswered,
    /// The answer comes so much later.
    Late(Duration),
    /// An exception in place of the answer; nothing is obeyed.
    Exception(u8),
    /// A bit is wrong: the check sum does not fit, over TCP the protocol id.
    Garbled,
    /// The last bytes are missing.
    Cut,
    /// Stray bytes come before the answer.
    Noise,
    /// The answer has another unit id, and is sound otherwise.
    OtherUnit,
    /// The answer has another function code, and is sound otherwise.
    OtherFunction,
    /// The answer before comes again in place of this one.
    AnswerBefore,
    /// The answer comes twice.
    Twice,
    /// The request comes back before the answer, as an adapter echoes it.
    Echo,
    /// The connection is closed in place of an answer; a serial line is silent.
    HangUp,
}

impl Faults {
    /// Reads and checks a file of faults; `file` only serves the findings.
    ///
    /// # Errors
    /// Everything that is wrong with the text, with line, column and remedy.
    pub fn parse(file: &str, text: &str) -> Result<Self, Findings> {
        file::faults(file, text)
    }
}
