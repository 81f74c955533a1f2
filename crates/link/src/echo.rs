//! The echo filter: takes what the adapter sends back of our own request out of what is received.
//!
//! Two-wire adapters and converters may hear themselves. A request that comes back is shaped like a frame, and the
//! confirmation of functions 5 and 6 is the very same bytes as the request, so somebody has to know which is which:
//!
//! - bytes that begin with exactly our request are its echo, taken out once, and the wire is known to echo from then;
//! - for functions 5 and 6 a first copy is the echo only where the wire is known to echo. Where it is not, the copy is
//!   the confirmation. Reads come before writes in practice, so the wire is known by then;
//! - a wire that has answered [`DOUBTS`] times in a row without an echo is no longer known to echo. Noise in front of
//!   an echo cannot make it so: only bytes that begin like an answer count.

const WRITE_SINGLE_COIL: u8 = 5;
const WRITE_SINGLE_REGISTER: u8 = 6;
const EXCEPTION_BIT: u8 = 0x80;
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
    /// How long the echo is that was taken out, if one was.
    pub(crate) echo: Option<usize>,
}

/// The filter of one RTU wire.
#[derive(Debug, Default)]
pub(crate) struct EchoFilter {
    /// The last request.
    request: Vec<u8>,
    /// So many bytes of it have come back so far and are held; none once it is decided what they are.
    matched: Option<usize>,
    /// The wire is known to echo.
    echoes: bool,
    doubts: u8,
}

impl EchoFilter {
    /// A request leaves.
    pub(crate) fn sent(&mut self, request: &[u8]) {
        self.request.clear();
        self.request.extend_from_slice(request);
        let confirmed_by_itself =
            matches!(self.request.get(1), Some(&(WRITE_SINGLE_COIL | WRITE_SINGLE_REGISTER)));
        self.matched = (self.echoes || !confirmed_by_itself).then_some(0);
    }

    /// Nothing is asked any more, or the connection ended: what is held makes no echo.
    pub(crate) fn give_up(&mut self) -> &[u8] {
        let held = self.matched.take().unwrap_or(0);
        self.request.get(..held).unwrap_or_default()
    }

    /// Bytes came.
    pub(crate) fn received<'a>(&'a mut self, bytes: &'a [u8]) -> Heard<'a> {
        let Some(held) = self.matched else {
            return Heard { held: &[], rest: bytes, echo: None };
        };
        let awaited = self.request.get(held..).unwrap_or_default();
        let same = awaited.iter().zip(bytes).take_while(|(sent, came)| sent == came).count();
        let whole = held + same;

        if whole == self.request.len() {
            self.matched = None;
            self.echoes = true;
            self.doubts = 0;
            return Heard { held: &[], rest: bytes.get(same..).unwrap_or_default(), echo: Some(whole) };
        }
        let so_far = self.request.get(..whole).unwrap_or_default();
        if same == bytes.len() && (self.echoes || !is_answer(so_far)) {
            self.matched = Some(whole);
            return Heard { held: &[], rest: &[], echo: None };
        }
        self.matched = None;
        self.doubt(held, bytes);
        Heard { held: self.request.get(..held).unwrap_or_default(), rest: bytes, echo: None }
    }

    /// Something else than an echo came. If it begins like an answer, this wire may echo no more.
    fn doubt(&mut self, held: usize, bytes: &[u8]) {
        let mut came = self.request.iter().take(held).chain(bytes);
        let begins_like_an_answer = came.next() == self.request.first()
            && came.next().map(|function| function & !EXCEPTION_BIT) == self.request.get(1).copied();
        if begins_like_an_answer {
            self.doubts = self.doubts.saturating_add(1);
            self.echoes &= self.doubts < DOUBTS;
        }
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
        let noisy = [&[0xFF][..], &read].concat();
        for came in [&answer[..], &noisy, &read[..5], &read[..7], &[1, 3, 0x28, 0x07], &[]] {
            for cut in 0..=came.len() {
                let mut filter = EchoFilter::default();
                let passed = pass(&mut filter, &read, &[&came[..cut], &came[cut..]]);
                assert_eq!(passed, (came.to_vec(), 0), "{came:02X?} cut at {cut}");
                assert!(!filter.echoes);
            }
        }
    }

    #[test]
    fn the_first_copy_of_a_write_is_the_answer_until_the_wire_is_known_to_echo() {
        let (read, write) = (read(), write());
        let twice = [write.clone(), write.clone()].concat();
        let mut filter = EchoFilter::default();
        assert_eq!(pass(&mut filter, &write, &[&write]), (write.clone(), 0));

        pass(&mut filter, &read, &[&read]);
        assert_eq!(pass(&mut filter, &write, &[&write]), (Vec::new(), 1), "the echo alone is no answer");
        assert_eq!(pass(&mut filter, &write, &[&twice]), (write.clone(), 1));
        let refused = frame(&[1, 0x86, 2]);
        assert_eq!(pass(&mut filter, &write, &[&write, &refused]), (refused.clone(), 1));
    }

    #[test]
    fn a_wire_that_answers_without_echo_is_believed_the_third_time() {
        let (read, answer, write) = (read(), answer(), write());
        let refused = frame(&[1, 0x83, 2]);
        let mut filter = EchoFilter::default();
        pass(&mut filter, &read, &[&read, &answer]);
        for came in [&answer, &refused] {
            pass(&mut filter, &read, &[came]);
            assert_eq!(pass(&mut filter, &read, &[&[0xFF], &read]).1, 0, "noise decides nothing");
            assert!(filter.echoes);
        }
        pass(&mut filter, &read, &[&answer]);
        assert!(!filter.echoes);
        assert_eq!(pass(&mut filter, &write, &[&write]), (write.clone(), 0));

        pass(&mut filter, &read, &[&read, &answer]);
        pass(&mut filter, &read, &[&answer]);
        assert!(filter.echoes, "an echo ends the doubts");
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
