//! The echo filter: takes what the adapter sends back of our own request out of what is received.
//!
//! Two-wire adapters and converters may hear themselves. A request that comes back is shaped like a frame, and the
//! confirmation of functions 5 and 6 is the very same bytes as the request, so somebody has to know which is which:
//!
//! - bytes that begin with exactly our request are its echo, taken out once, and the wire is known to echo from then;
//! - behind noise it is found too, but left in: what it looks like is garbage to whoever waits for the answer;
//! - for functions 5 and 6 a first copy is the echo only where the wire is known to echo; there it is the client that
//!   drops it, wherever it stands. Where it is not known, the copy is the confirmation. Reads come before writes in
//!   practice, so the wire is known by then;
//! - a wire that has answered [`DOUBTS`] times in a row without an echo is no longer known to echo. A damaged echo cannot
//!   make it so, for only whole answers count; nor can a new connection, which most likely has the same adapter.

const WRITE_SINGLE_COIL: u8 = 5;
const WRITE_SINGLE_REGISTER: u8 = 6;
/// Bytes of the shortest frame that answers: an exception.
const SHORTEST_ANSWER: usize = 5;

/// Answers without an echo until the wire is taken for one that does not echo.
const DOUBTS: u8 = 3;

/// What the filter makes of received bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Heard<'a> {
    /// Held back before, and no echo after all: to be taken in first.
    pub(crate) held: &'a [u8],
    /// To be taken in.
    pub(crate) rest: &'a [u8],
    /// How long the echo is that was found, if one was.
    pub(crate) echo: Option<usize>,
}

/// The filter of one RTU wire.
#[derive(Debug, Default)]
pub(crate) struct EchoFilter {
    /// The last request.
    request: Vec<u8>,
    /// What has become of its echo.
    state: State,
    /// The wire is known to echo.
    echoes: bool,
    doubts: u8,
}

#[derive(Debug, Default)]
enum State {
    /// It has come, or is nothing to look for.
    #[default]
    Over,
    /// So many bytes of it have come so far and are held.
    Matched(usize),
    /// Something else came first. These are the last bytes of it.
    Missed(Vec<u8>),
}

impl EchoFilter {
    /// A request leaves. Says whether the first copy of it that comes will be no confirmation.
    pub(crate) fn sent(&mut self, request: &[u8]) -> bool {
        self.request.clear();
        self.request.extend_from_slice(request);
        let confirmed_by_itself =
            matches!(self.request.get(1), Some(&(WRITE_SINGLE_COIL | WRITE_SINGLE_REGISTER)));
        self.state = match confirmed_by_itself {
            true => State::Over,
            false => State::Matched(0),
        };
        confirmed_by_itself && self.echoes
    }

    /// Nothing is asked any more, or the connection ended: what is held makes no echo.
    pub(crate) fn give_up(&mut self) -> &[u8] {
        let held = match std::mem::take(&mut self.state) {
            State::Matched(held) => held,
            State::Missed(_) | State::Over => 0,
        };
        self.request.get(..held).unwrap_or_default()
    }

    /// The request was answered. Without an echo this wire may echo no more.
    pub(crate) fn answered(&mut self) {
        if matches!(self.state, State::Missed(_)) {
            self.doubts = self.doubts.saturating_add(1);
            self.echoes &= self.doubts < DOUBTS;
        }
    }

    /// Bytes came.
    pub(crate) fn received<'a>(&'a mut self, bytes: &'a [u8]) -> Heard<'a> {
        match &mut self.state {
            State::Over => Heard { held: &[], rest: bytes, echo: None },
            State::Matched(held) => {
                let held = *held;
                self.compare(held, bytes)
            }
            State::Missed(last) => {
                last.extend_from_slice(bytes);
                let echo = self.search();
                Heard { held: &[], rest: bytes, echo }
            }
        }
    }

    /// Compares bytes behind so many that were the same.
    fn compare<'a>(&'a mut self, held: usize, bytes: &'a [u8]) -> Heard<'a> {
        let awaited = self.request.get(held..).unwrap_or_default();
        let same = awaited.iter().zip(bytes).take_while(|(sent, came)| sent == came).count();
        let whole = held + same;
        if whole == self.request.len() {
            self.found();
            return Heard { held: &[], rest: bytes.get(same..).unwrap_or_default(), echo: Some(whole) };
        }
        let so_far = self.request.get(..whole).unwrap_or_default();
        if same == bytes.len() && (self.echoes || !is_answer(so_far)) {
            self.state = State::Matched(whole);
            return Heard { held: &[], rest: &[], echo: None };
        }
        self.state = State::Missed([self.request.get(..held).unwrap_or_default(), bytes].concat());
        let echo = self.search();
        Heard { held: self.request.get(..held).unwrap_or_default(), rest: bytes, echo }
    }

    /// Looks for the echo behind what came first, and says how long it is.
    fn search(&mut self) -> Option<usize> {
        let len = self.request.len();
        let State::Missed(last) = &mut self.state else { return None };
        if last.windows(len.max(1)).any(|bytes| bytes == self.request) {
            self.found();
            return Some(len);
        }
        // What is left may be the beginning of it.
        last.drain(..last.len().saturating_sub(len.saturating_sub(1)));
        None
    }

    fn found(&mut self) {
        self.state = State::Over;
        self.echoes = true;
        self.doubts = 0;
    }
}

/// Whether the beginning of an echo is a whole frame in itself. By chance an answer begins like its question; it must
/// not be held until its time is up.
fn is_answer(bytes: &[u8]) -> bool {
    bytes.len() >= SHORTEST_ANSWER && busbar_modbus::rtu::crc16(bytes) == 0
}

#[cfg(test)]
mod tests {
    use busbar_modbus::rtu::crc16;

    use super::*;

    fn frame(body: &[u8]) -> Vec<u8> {
        [body, &crc16(body).to_le_bytes()].concat()
    }

    fn read() -> Vec<u8> {
        frame(&[1, 3, 0x28, 0x06, 0, 2])
    }

    fn answer() -> Vec<u8> {
        frame(&[1, 3, 4, 0x08, 0xFE, 0, 0])
    }

    fn write() -> Vec<u8> {
        frame(&[1, 6, 0x20, 0x01, 0, 4])
    }

    /// What passes when a request was sent and `pieces` come, and how many echoes were found.
    fn pass(filter: &mut EchoFilter, request: &[u8], pieces: &[&[u8]]) -> (Vec<u8>, usize) {
        filter.sent(request);
        let mut passed = Vec::new();
        let mut echoes = 0;
        for piece in pieces {
            let heard = filter.received(piece);
            passed.extend_from_slice(heard.held);
            passed.extend_from_slice(heard.rest);
            echoes += usize::from(heard.echo.is_some());
        }
        passed.extend_from_slice(filter.give_up());
        (passed, echoes)
    }

    #[test]
    fn takes_an_echo_out_once_however_it_is_cut() {
        let (read, answer) = (read(), answer());
        let both = [read.clone(), answer.clone()].concat();
        let twice = [read.clone(), read.clone()].concat();
        for cut in 0..=both.len() {
            let mut filter = EchoFilter::default();
            assert_eq!(pass(&mut filter, &read, &[&both[..cut], &both[cut..]]), (answer.clone(), 1), "{cut}");
            assert!(filter.echoes);
        }
        for cut in 0..=twice.len() {
            let mut filter = EchoFilter::default();
            assert_eq!(pass(&mut filter, &read, &[&twice[..cut], &twice[cut..]]), (read.clone(), 1), "{cut}");
        }
    }

    #[test]
    fn loses_nothing_that_is_no_echo() {
        let (read, answer) = (read(), answer());
        for came in [&answer[..], &read[..5], &read[..7], &[1, 3, 0x28, 0x07], &[]] {
            for cut in 0..=came.len() {
                let mut filter = EchoFilter::default();
                let passed = pass(&mut filter, &read, &[&came[..cut], &came[cut..]]);
                assert_eq!(passed, (came.to_vec(), 0), "{came:02X?} cut at {cut}");
                assert!(!filter.echoes);
            }
        }
    }

    #[test]
    fn an_echo_behind_noise_makes_the_wire_known() {
        // Transceivers that switch over often add a byte in front.
        for noise in [&[0xFF][..], &[0x00, 1, 3], &[1], &[1, 3, 0x28]] {
            let came = [noise, &read(), &answer()].concat();
            for cut in 0..=came.len() {
                let mut filter = EchoFilter::default();
                let passed = pass(&mut filter, &read(), &[&came[..cut], &came[cut..]]);
                assert_eq!(passed, (came.clone(), 1), "{came:02X?} cut at {cut}");
                assert!(filter.echoes && filter.sent(&write()));
            }
        }
    }

    #[test]
    fn a_copy_of_a_write_is_its_confirmation_until_the_wire_is_known_to_echo() {
        let (read, write) = (read(), write());
        let mut filter = EchoFilter::default();
        assert!(!filter.sent(&write));
        assert_eq!(pass(&mut filter, &write, &[&write]), (write.clone(), 0));
        pass(&mut filter, &read, &[&read]);
        assert!(filter.sent(&write));
        assert_eq!(pass(&mut filter, &write, &[&write, &write]), ([write.clone(), write].concat(), 0));
        assert!(!filter.sent(&read), "which only the client could tell from an answer");
    }

    #[test]
    fn a_wire_that_answers_without_echo_is_believed_the_third_time() {
        let (read, answer) = (read(), answer());
        let mut filter = EchoFilter::default();
        let mut ask = |came: &[u8], answered: bool| {
            filter.sent(&read);
            filter.received(came);
            if answered {
                filter.answered();
            }
            filter.give_up();
            filter.echoes
        };
        assert!(ask(&[&read[..], &answer].concat(), true));
        let mut damaged = read.clone();
        damaged[5] ^= 1;
        for _ in 0..5 {
            assert!(ask(&damaged, false), "a damaged echo says nothing");
        }
        assert!(ask(&answer, true) && ask(&answer, true));
        assert!(ask(&[&[0xFF], &read[..], &answer].concat(), true), "an echo ends the doubts");
        assert!(ask(&answer, true) && ask(&answer, true) && !ask(&answer, true));
    }

    #[test]
    fn an_answer_that_begins_like_the_question_is_not_held_up() {
        // An answer to function 16 whose check sum happens to be the question's byte count and first data byte.
        let confirmation = (0..=u16::MAX)
            .map(|address| frame(&[1, 16, address.to_be_bytes()[0], address.to_be_bytes()[1], 0, 1]))
            .find(|frame| frame[6] == 2)
            .unwrap();
        let request = frame(&[&confirmation[..], &[7]].concat());
        let mut filter = EchoFilter::default();
        filter.sent(&request);
        for byte in &confirmation[..7] {
            assert_eq!(filter.received(&[*byte]).rest, [] as [u8; 0]);
        }
        let heard = filter.received(&confirmation[7..]);
        assert_eq!((heard.held, heard.rest), (&confirmation[..7], &confirmation[7..]));
    }
}
