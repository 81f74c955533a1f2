//! Faults at work on one endpoint: which request is struck, and what becomes of its answer.

use std::time::Duration;

use busbar_modbus::stream::Frame;
use busbar_modbus::{ExceptionCode, Framing, Response, mbap, rtu};

use super::{Faults, Kind, Often, Rule};
use crate::random::Random;

/// Stray bytes before an answer.
const STRAY: usize = 3;
/// Bytes of a check sum, and of a header before the unit id.
const CHECK_SUM: usize = 2;
const HEADER: usize = 6;

/// The faults of one endpoint and what has been of them so far.
#[derive(Debug)]
pub(crate) struct Mischief {
    rules: Vec<(Rule, Record)>,
    random: Random,
    /// The last sound answer.
    before: Vec<u8>,
}

/// What a rule has seen and done.
#[derive(Clone, Copy, Debug, Default)]
struct Record {
    met: u64,
    struck: u64,
}

/// A request that a fault has struck.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Struck(Kind);

impl Struck {
    /// Whether the controller gets the request at all.
    pub(crate) fn is_heard(self) -> bool {
        !matches!(self.0, Kind::Unheard | Kind::Exception(_))
    }

    /// By how much the answer is late.
    pub(crate) fn delay(self) -> Duration {
        match self.0 {
            Kind::Late(by) => by,
            _ => Duration::ZERO,
        }
    }

    /// Whether the connection ends in place of an answer.
    pub(crate) fn hangs_up(self) -> bool {
        self.0 == Kind::HangUp
    }
}

impl Mischief {
    pub(crate) fn new(faults: &Faults) -> Self {
        let rules = faults.rules.iter().map(|rule| (rule.clone(), Record::default()));
        Self { rules: rules.collect(), random: Random::new(faults.seed ^ 0x00FA_0175), before: Vec::new() }
    }

    /// The fault that strikes a request, if one does: the first whose turn it is. `now` is simulated time since power-on.
    pub(crate) fn strike(&mut self, request: &Frame<'_>, now: Duration) -> Option<Struck> {
        let Self { rules, random, .. } = self;
        let mut struck = None;
        for (rule, record) in rules.iter_mut().filter(|(rule, _)| rule.is_about(request, now)) {
            record.met += 1;
            let is_due = match rule.often {
                Often::Every(count) => record.met % count == 0,
                Often::Chance(chance) => random.between(0.0, 1.0) < chance,
            };
            let is_left = rule.times.is_none_or(|times| record.struck < times);
            if struck.is_none() && is_due && is_left {
                record.struck += 1;
                struck = Some(Struck(rule.kind));
            }
        }
        struck
    }

    /// Makes of a sound answer in `out`, from `start` on, what leaves; an answer that nobody disturbs is remembered.
    pub(crate) fn spoil(
        &mut self,
        struck: Option<Struck>,
        framing: Framing,
        request: &Frame<'_>,
        out: &mut Vec<u8>,
        start: usize,
    ) {
        let answer = out.split_off(start);
        let Some(Struck(kind)) = struck else {
            out.extend(&answer);
            self.before = answer;
            return;
        };
        match kind {
            Kind::Unheard | Kind::Unanswered | Kind::HangUp => {}
            Kind::Late(_) => out.extend(&answer),
            Kind::Exception(code) => exception(framing, request, code, out),
            Kind::Garbled => out.extend(garbled(framing, answer, self.random.bits())),
            Kind::Cut => out.extend(answer.get(..answer.len() / 2).unwrap_or_default()),
            Kind::Noise => {
                let stray = self.random.bits().to_le_bytes();
                out.extend(stray.iter().take(STRAY).chain(&answer));
            }
            Kind::OtherUnit => out.extend(forged(framing, answer, 0, |unit| (unit % 247) + 1)),
            Kind::OtherFunction => out.extend(forged(framing, answer, 1, |function| function ^ 0x07)),
            Kind::AnswerBefore => out.extend(&self.before),
            Kind::Twice => out.extend(answer.iter().chain(&answer)),
            Kind::Echo => {
                echo(framing, request, out);
                out.extend(&answer);
            }
        }
    }
}

impl Rule {
    fn is_about(&self, request: &Frame<'_>, now: Duration) -> bool {
        let function = request.pdu.first().copied();
        let address = match request.pdu {
            [1..=6 | 15 | 16, high, low, ..] => Some(u16::from_be_bytes([*high, *low])),
            _ => None,
        };
        self.from <= now
            && self.until.is_none_or(|until| now < until)
            && self.unit.is_none_or(|unit| unit == request.unit)
            && self.function.is_none_or(|wanted| function == Some(wanted))
            && self.address.is_none_or(|wanted| address == Some(wanted))
    }
}

fn exception(framing: Framing, request: &Frame<'_>, code: u8, out: &mut Vec<u8>) {
    let function = request.pdu.first().copied().unwrap_or_default();
    let response = Response::Exception { function, code: ExceptionCode(code) };
    // A function that cannot be refused is answered by nobody.
    let _ = match framing {
        Framing::Tcp => mbap::encode_response(request.transaction, request.unit, &response, out),
        Framing::Rtu => rtu::encode_response(request.unit, &response, out),
    };
}

/// One bit is turned, where the receiver can find out.
fn garbled(framing: Framing, mut answer: Vec<u8>, chance: u64) -> Vec<u8> {
    let place = match framing {
        // The protocol id: nothing behind the header is checked.
        Framing::Tcp => 2,
        Framing::Rtu => usize::try_from(chance >> 3).unwrap_or_default() % answer.len().max(1),
    };
    if let Some(byte) = answer.get_mut(place) {
        *byte ^= 1 << (chance & 7);
    }
    answer
}

/// The byte so far behind the unit id is another one, and the rest is sound.
fn forged(framing: Framing, mut answer: Vec<u8>, place: usize, other: impl Fn(u8) -> u8) -> Vec<u8> {
    let head = match framing {
        Framing::Tcp => HEADER,
        Framing::Rtu => 0,
    };
    if let Some(byte) = answer.get_mut(head + place) {
        *byte = other(*byte);
    }
    if framing == Framing::Rtu && !answer.is_empty() {
        answer.truncate(answer.len().saturating_sub(CHECK_SUM));
        let check_sum = rtu::crc16(&answer);
        answer.extend(check_sum.to_le_bytes());
    }
    answer
}

/// The request as it came.
fn echo(framing: Framing, request: &Frame<'_>, out: &mut Vec<u8>) {
    let start = out.len();
    if framing == Framing::Tcp {
        let length = u16::try_from(request.pdu.len() + 1).unwrap_or(u16::MAX);
        out.extend(request.transaction.to_be_bytes());
        out.extend([0, 0]);
        out.extend(length.to_be_bytes());
    }
    out.push(request.unit);
    out.extend(request.pdu);
    if framing == Framing::Rtu {
        let check_sum = rtu::crc16(out.get(start..).unwrap_or_default());
        out.extend(check_sum.to_le_bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const READ: Frame<'_> = Frame { transaction: 7, unit: 1, pdu: &[3, 0x28, 0, 0, 1] };
    const WRITE: Frame<'_> = Frame { transaction: 8, unit: 2, pdu: &[6, 0x20, 1, 0, 8] };
    /// Register 10240 is 2302.
    const ANSWER: [u8; 7] = [1, 3, 2, 0x08, 0xFE, 0x3F, 0xC4];
    const SECOND: Duration = Duration::from_secs(1);

    fn mischief(text: &str) -> Mischief {
        Mischief::new(&Faults::parse("f.toml", text).unwrap_or_else(|findings| panic!("{findings}")))
    }

    fn sealed(body: &[u8]) -> Vec<u8> {
        [body, &rtu::crc16(body).to_le_bytes()].concat()
    }

    /// What leaves on a serial line in place of an answer.
    fn leaves(kind: &str) -> Vec<u8> {
        let mut mischief = mischief(&format!("[[faults]]\nkind = {kind}\nevery = 2\n"));
        let mut out = Vec::new();
        for answer in [sealed(&[1, 3, 2, 0, 1]), sealed(&ANSWER[..5])] {
            out = answer;
            let struck = mischief.strike(&READ, SECOND);
            mischief.spoil(struck, Framing::Rtu, &READ, &mut out, 0);
        }
        out
    }

    #[test]
    fn each_kind_does_to_an_answer_what_it_says() {
        let sound = sealed(&ANSWER[..5]);
        for (kind, expected) in [
            ("\"unheard\"", vec![]),
            ("\"unanswered\"", vec![]),
            ("\"hang_up\"", vec![]),
            ("\"late\"\nby = \"2s\"", sound.clone()),
            ("\"exception\"\ncode = 4", sealed(&[1, 0x83, 4])),
            ("\"cut\"", sound[..3].to_vec()),
            ("\"other_unit\"", sealed(&[2, 3, 2, 0x08, 0xFE])),
            ("\"other_function\"", sealed(&[1, 4, 2, 0x08, 0xFE])),
            ("\"answer_before\"", sealed(&[1, 3, 2, 0, 1])),
            ("\"twice\"", [sound.clone(), sound.clone()].concat()),
            ("\"echo\"", [sealed(&[1, 3, 0x28, 0, 0, 1]), sound.clone()].concat()),
        ] {
            assert_eq!(leaves(kind), expected, "{kind}");
        }
        let noise = leaves("\"noise\"");
        assert_eq!((noise.len(), &noise[3..]), (sound.len() + 3, &sound[..]));
        let garbled = leaves("\"garbled\"");
        let wrong: u32 = garbled.iter().zip(&sound).map(|(a, b)| (a ^ b).count_ones()).sum();
        assert_eq!((garbled.len(), wrong), (sound.len(), 1));
    }

    #[test]
    fn over_tcp_a_receiver_can_find_out_too() {
        let header = |unit, body: &[u8]| [&[0, 7, 0, 0, 0, 1 + body.len() as u8, unit], body].concat();
        let spoiled = |kind: &str| {
            let mut mischief = mischief(&format!("[[faults]]\nkind = \"{kind}\"\nevery = 1\n"));
            let mut out = [&[9, 9][..], &header(1, &[3, 2, 8, 0xFE])].concat();
            let struck = mischief.strike(&READ, SECOND);
            mischief.spoil(struck, Framing::Tcp, &READ, &mut out, 2);
            assert_eq!(out[..2], [9, 9], "what came before is not touched");
            out.split_off(2)
        };
        assert_ne!(spoiled("garbled")[2], 0, "the protocol id");
        assert_eq!(spoiled("other_unit"), header(2, &[3, 2, 8, 0xFE]));
        assert_eq!(spoiled("other_function"), header(1, &[4, 2, 8, 0xFE]));
        let echo = header(1, READ.pdu);
        assert_eq!(spoiled("echo"), [echo, header(1, &[3, 2, 8, 0xFE])].concat());
    }

    #[test]
    fn a_rule_is_about_some_requests_at_some_times() {
        let mut rule = mischief(
            "[[faults]]\nkind = \"unheard\"\nevery = 1\nunit = 2\nfunction = 6\naddress = 8193\nfrom = \"2s\"\nuntil = \"4s\"\ntimes = 2\n",
        );
        let struck = |rule: &mut Mischief, request, seconds| rule.strike(request, seconds * SECOND).is_some();
        assert!(!struck(&mut rule, &WRITE, 1) && !struck(&mut rule, &READ, 2));
        let elsewhere = Frame { pdu: &[6, 0x20, 2, 0, 8], ..WRITE };
        assert!(!struck(&mut rule, &elsewhere, 2));
        assert!(!struck(&mut rule, &Frame { unit: 1, ..WRITE }, 2));
        assert!(struck(&mut rule, &WRITE, 2) && struck(&mut rule, &WRITE, 3));
        assert!(!struck(&mut rule, &WRITE, 3), "twice was enough");
        assert!(!struck(&mut rule, &WRITE, 4));
    }

    #[test]
    fn chance_repeats_itself_and_comes_as_often_as_it_says() {
        let strikes = |seed: u64| -> Vec<bool> {
            let mut mischief =
                mischief(&format!("seed = {seed}\n[[faults]]\nkind = \"cut\"\nchance = 0.1\n"));
            (0..10_000).map(|_| mischief.strike(&READ, SECOND).is_some()).collect()
        };
        let count = strikes(1).iter().filter(|struck| **struck).count();
        assert!((900..1100).contains(&count), "{count}");
        assert_eq!(strikes(1), strikes(1));
        assert_ne!(strikes(1), strikes(2));
    }
}
