//! Time on a serial line, as the devices at its end see it: when a request has come, what collides, what leaves when.
//!
//! Neither a clock nor a port: bytes and instants in, requests and bytes with instants out.

use std::collections::VecDeque;
use std::time::Duration;

use busbar_link::Serial;
use busbar_modbus::rtu::{self, MAX_FRAME};
use busbar_modbus::server::DEFAULT_QUIET;
use busbar_modbus::{Framing, ServerDecoder};

use super::door::dropped;

/// Bytes that reach a reader together, as the FIFO of a serial port hands them over.
const FIFO: usize = 4;
/// What came in faster than the line carries it waits so long at most, then it is lost.
const BACKLOG: Duration = Duration::from_secs(4);
/// Bytes of a frame around its PDU: unit id and check sum.
const AROUND_PDU: usize = 3;

/// One serial line with everything that is on it.
///
/// Call [`receive`](Self::receive) with what has come, [`transmit`](Self::transmit) for what has to leave,
/// [`next_request`](Self::next_request) until it yields `None`, and all that again at the [`deadline`](Self::deadline).
#[derive(Debug)]
pub(super) struct Line {
    /// One character with its start, parity and stop bits.
    character: Duration,
    /// 3.5 characters, 1.75 ms above 19200 baud.
    silence: Duration,
    /// There is no hardware that takes the time of a character: it is taken here.
    imitated: bool,
    /// How long half a frame waits for its rest.
    quiet: Duration,
    decoder: ServerDecoder,
    /// The end of the last character that came.
    heard: Duration,
    /// When each of the last characters began.
    begun: VecDeque<Duration>,
    /// Requests, the earliest first; those that are still on the line too.
    arriving: VecDeque<Arrival>,
    /// Pieces of answers, and when the last character of each is through.
    leaving: VecDeque<(Duration, Vec<u8>)>,
    /// The line is free of answers from here on.
    free: Duration,
    collisions: u64,
    overrun: u64,
}

/// A request that came.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Arrival {
    pub(super) unit: u8,
    pub(super) pdu: Vec<u8>,
    /// When its first character began.
    began: Duration,
    /// When its last character was through.
    ended: Duration,
    /// When a device knows that it is whole: at its end, or by silence where nothing else tells.
    whole: Duration,
}

impl Line {
    /// A line that is nothing but a pseudo-terminal, which delivers at once whatever is written.
    pub(super) fn imitated(serial: &Serial) -> Self {
        Self::new(serial, true)
    }

    /// A line with hardware at this end: characters take their time by themselves.
    pub(super) fn real(serial: &Serial) -> Self {
        Self::new(serial, false)
    }

    fn new(serial: &Serial, imitated: bool) -> Self {
        let bits = serial.bits_per_character();
        let nanoseconds = (1_000_000_000 * u64::from(bits)).div_ceil(u64::from(serial.baud.max(1)));
        let silence = rtu::silence(serial.baud, bits);
        Self {
            character: Duration::from_nanos(nanoseconds),
            silence,
            imitated,
            quiet: DEFAULT_QUIET.max(silence),
            decoder: ServerDecoder::new(Framing::Rtu),
            heard: Duration::ZERO,
            begun: VecDeque::with_capacity(MAX_FRAME),
            arriving: VecDeque::new(),
            leaving: VecDeque::new(),
            free: Duration::ZERO,
            collisions: 0,
            overrun: 0,
        }
    }

    /// Takes bytes that a client wrote, or that the hardware delivered.
    pub(super) fn receive(&mut self, now: Duration, bytes: &[u8]) {
        self.fall_silent(now);
        for byte in bytes {
            // An imitated character begins when it is written, at the earliest when the one before is through.
            let (began, ended) = match self.imitated {
                true => (now.max(self.heard), now.max(self.heard) + self.character),
                false => (now.saturating_sub(self.character), now),
            };
            if began > now + BACKLOG {
                self.overrun += 1;
                continue;
            }
            self.heard = ended;
            if self.begun.len() == MAX_FRAME {
                self.begun.pop_front();
            }
            self.begun.push_back(began);
            self.decoder.push(&[*byte]);
            self.collect(ended);
        }
    }

    /// The next request that is through by `now`. One that came while an answer was on the line is lost to both.
    pub(super) fn next_request(&mut self, now: Duration) -> Option<Arrival> {
        self.fall_silent(now);
        loop {
            let arrival = self.arriving.pop_front_if(|arrival| arrival.whole <= now)?;
            if arrival.began >= self.free {
                return Some(arrival);
            }
            self.collisions += 1;
        }
    }

    /// Puts the answer to a request on the line, of a device that takes `delay` for it.
    pub(super) fn answer(&mut self, arrival: &Arrival, frame: &[u8], delay: Duration) {
        let start = (arrival.ended + delay.max(self.silence)).max(arrival.whole);
        let mut through = start;
        match self.imitated {
            false => {
                self.leaving.push_back((start, frame.to_vec()));
                through += self.characters(frame.len());
            }
            true => {
                for piece in frame.chunks(FIFO) {
                    through += self.characters(piece.len());
                    self.leaving.push_back((through, piece.to_vec()));
                }
            }
        }
        self.free = through;
    }

    /// Appends what has to leave by `now`.
    pub(super) fn transmit(&mut self, now: Duration, out: &mut Vec<u8>) {
        while let Some((_, piece)) = self.leaving.pop_front_if(|(due, _)| *due <= now) {
            out.extend(piece);
        }
    }

    /// When there is something to do, if no bytes come until then.
    pub(super) fn deadline(&self) -> Option<Duration> {
        let leaving = self.leaving.front().map(|(due, _)| *due);
        let arriving = self.arriving.front().map(|arrival| arrival.whole);
        [leaving, arriving, self.silence_ends()].into_iter().flatten().min()
    }

    /// Requests that were lost because an answer was on the line.
    pub(super) fn collisions(&self) -> u64 {
        self.collisions
    }

    /// Bytes and frames that were no requests, and bytes that came faster than any line carries them.
    pub(super) fn garbage(&self) -> u64 {
        dropped(self.decoder.losses()) + self.overrun
    }

    fn characters(&self, count: usize) -> Duration {
        self.character * u32::try_from(count).unwrap_or(u32::MAX)
    }

    /// When half a frame has waited long enough, if there is one.
    fn silence_ends(&self) -> Option<Duration> {
        self.decoder.is_waiting().then(|| self.heard + self.quiet)
    }

    fn fall_silent(&mut self, now: Duration) {
        if let Some(end) = self.silence_ends().filter(|end| *end <= now) {
            self.decoder.silence();
            self.collect(end);
        }
    }

    fn collect(&mut self, whole: Duration) {
        while let Some(Ok(frame)) = self.decoder.next_frame() {
            let first = self.begun.len().saturating_sub(frame.pdu.len() + AROUND_PDU);
            self.arriving.push_back(Arrival {
                unit: frame.unit,
                pdu: frame.pdu.to_vec(),
                began: self.begun.get(first).copied().unwrap_or(whole),
                ended: self.heard,
                whole,
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const READ: [u8; 8] = [0x01, 0x03, 0x00, 0x20, 0x00, 0x10, 0x45, 0xCC];
    const WRITE: [u8; 8] = [0x01, 0x06, 0x00, 0x40, 0x00, 0x10, 0x89, 0xD2];
    /// 10 bits at 10,000 baud: one character a millisecond, so that scripts are easy to read.
    const ROUND: Serial = Serial { baud: 10_000, ..NINE_SIX };
    const NINE_SIX: Serial = Serial {
        baud: 9600,
        parity: busbar_link::Parity::None,
        stop: busbar_link::StopBits::One,
        rs485: false,
    };

    fn us(microseconds: u64) -> Duration {
        Duration::from_micros(microseconds)
    }

    fn ms(milliseconds: u64) -> Duration {
        Duration::from_millis(milliseconds)
    }

    fn sealed(body: &[u8]) -> Vec<u8> {
        [body, &rtu::crc16(body).to_le_bytes()].concat()
    }

    /// Everything that leaves, each piece at the instant when it does.
    fn leave(line: &mut Line) -> Vec<(Duration, Vec<u8>)> {
        let mut pieces = Vec::new();
        while let Some(due) = line.deadline() {
            let mut out = Vec::new();
            line.transmit(due, &mut out);
            assert!(!out.is_empty(), "a deadline is kept");
            pieces.push((due, out));
        }
        pieces
    }

    #[test]
    fn a_request_has_come_when_its_characters_have_crossed_the_line() {
        let mut line = Line::imitated(&ROUND);
        line.receive(ms(100), &READ);
        assert_eq!(line.deadline(), Some(ms(108)));
        assert_eq!(line.next_request(us(107_999)), None);
        let request = line.next_request(ms(108)).unwrap();
        assert_eq!((request.unit, request.pdu.as_slice()), (1, &READ[1..6]));
        assert_eq!((line.next_request(ms(999)), line.deadline()), (None, None));
    }

    #[test]
    fn bytes_that_come_one_by_one_take_their_time_once() {
        let mut line = Line::imitated(&ROUND);
        for (at, byte) in (0..).zip(READ) {
            line.receive(ms(at), &[byte]);
        }
        assert!(line.next_request(ms(8)).is_some());

        // Slower than the line: the last byte decides.
        for (at, byte) in (0..).zip(READ) {
            line.receive(ms(100 + 20 * at), &[byte]);
        }
        assert_eq!(line.next_request(us(240_999)), None);
        assert!(line.next_request(ms(241)).is_some());
    }

    #[test]
    fn an_answer_begins_after_the_silence_and_its_last_byte_leaves_at_its_instant() {
        let mut line = Line::imitated(&ROUND);
        line.receive(ms(0), &READ);
        let request = line.next_request(ms(8)).unwrap();
        line.answer(&request, &[1, 2, 3, 4, 5, 6, 7, 8, 9, 10], Duration::ZERO);
        // 8 ms of request, 3.5 ms of silence, a millisecond a character, four at a time.
        assert_eq!(
            leave(&mut line),
            [(us(15_500), vec![1, 2, 3, 4]), (us(19_500), vec![5, 6, 7, 8]), (us(21_500), vec![9, 10]),]
        );
    }

    #[test]
    fn the_turnaround_is_the_longer_of_silence_and_delay() {
        let delay = us(4300);
        for (baud, delay, first_byte) in [
            (9600, Duration::ZERO, 8 * 1_041_667 + 3_645_834),
            (9600, delay, 8 * 1_041_667 + 4_300_000),
            (2400, delay, 8 * 4_166_667 + 14_583_334),
            (38_400, Duration::ZERO, 8 * 260_417 + 1_750_000),
            (115_200, delay, 8 * 86_806 + 4_300_000),
        ] {
            let mut line = Line::imitated(&Serial { baud, ..NINE_SIX });
            line.receive(ms(0), &READ);
            let request = line.next_request(ms(100)).unwrap();
            line.answer(&request, &[0xAA], delay);
            let due = line.deadline().unwrap() - line.character;
            assert_eq!(due, Duration::from_nanos(first_byte), "{baud}");
        }
    }

    #[test]
    fn an_answer_is_late_no_more_than_its_request_was_judged_late() {
        let mut line = Line::imitated(&ROUND);
        line.receive(ms(0), &READ);
        let request = line.next_request(ms(50)).unwrap();
        line.answer(&request, &[1, 2], Duration::ZERO);
        let mut out = Vec::new();
        line.transmit(ms(50), &mut out);
        assert_eq!(out, [1, 2]);
    }

    #[test]
    fn who_does_not_wait_for_the_answer_loses_the_second_request() {
        let mut line = Line::imitated(&ROUND);
        line.receive(ms(0), &[READ, WRITE].concat());
        let request = line.next_request(ms(8)).unwrap();
        line.answer(&request, &[0xAA; 4], Duration::ZERO);
        assert_eq!((line.next_request(ms(16)), line.collisions()), (None, 1));
        assert_eq!(leave(&mut line), [(us(15_500), vec![0xAA; 4])], "the first is answered all the same");
    }

    #[test]
    fn a_request_collides_from_the_request_before_to_the_end_of_its_answer() {
        // The answer is on the line until 15.5 ms.
        for (at, collides) in [(us(8_000), true), (us(12_000), true), (us(15_499), true), (us(15_500), false)]
        {
            let mut line = Line::imitated(&ROUND);
            line.receive(ms(0), &READ);
            let request = line.next_request(ms(8)).unwrap();
            line.answer(&request, &[0xAA; 4], Duration::ZERO);
            line.receive(at, &WRITE);
            assert_eq!(line.next_request(ms(50)).is_none(), collides, "{at:?}");
            assert_eq!(line.collisions(), u64::from(collides));
        }
    }

    #[test]
    fn a_request_that_began_under_an_answer_collides_even_if_its_rest_comes_later() {
        let mut line = Line::imitated(&ROUND);
        line.receive(ms(0), &READ);
        let request = line.next_request(ms(8)).unwrap();
        line.answer(&request, &[0xAA; 4], Duration::ZERO);
        line.receive(ms(14), &WRITE[..1]);
        line.receive(ms(30), &WRITE[1..]);
        assert_eq!((line.next_request(ms(50)), line.collisions()), (None, 1));
    }

    #[test]
    fn where_nobody_answers_glued_requests_all_come_in_turn() {
        let mut line = Line::imitated(&ROUND);
        line.receive(ms(0), &[READ, WRITE, READ].concat());
        for end in [8, 16, 24] {
            assert_eq!(line.next_request(us(1000 * end - 1)), None);
            assert!(line.next_request(ms(end)).is_some());
        }
        assert_eq!(line.collisions(), 0);
    }

    #[test]
    fn a_function_without_a_length_ends_by_silence() {
        let mut line = Line::imitated(&ROUND);
        line.receive(ms(0), &sealed(&[0x01, 0x2B, 0x0E, 0x01, 0x00]));
        assert_eq!(line.next_request(ms(56)), None);
        assert_eq!(line.deadline(), Some(ms(7) + DEFAULT_QUIET));
        let request = line.next_request(ms(57)).unwrap();
        assert_eq!(request.pdu, [0x2B, 0x0E, 0x01, 0x00]);
        line.answer(&request, &[0xAA], Duration::ZERO);
        assert_eq!(leave(&mut line), [(ms(58), vec![0xAA])], "the silence is over already");
    }

    #[test]
    fn noise_half_frames_and_wrong_check_sums_are_garbage() {
        let mut line = Line::imitated(&ROUND);
        line.receive(ms(0), &[0xFF, 0x00]);
        line.receive(ms(2), &READ);
        assert!(line.next_request(ms(10)).is_some());
        assert!(line.garbage() > 0, "noise in front of a frame");

        let before = line.garbage();
        line.receive(ms(100), &READ[..5]);
        line.receive(ms(300), &WRITE);
        assert_eq!(line.next_request(ms(308)).unwrap().pdu, WRITE[1..6]);
        assert_eq!(line.garbage() - before, 5, "half a frame, given up");

        let mut broken = READ;
        broken[3] ^= 1;
        line.receive(ms(400), &broken);
        assert_eq!(line.next_request(ms(900)), None);
        assert_eq!(line.deadline(), None);
    }

    #[test]
    fn a_frame_that_is_too_long_is_none() {
        let mut line = Line::imitated(&ROUND);
        // Function 16 with 248 bytes would be 257 long.
        let body: Vec<u8> = [&[1, 16, 0, 0, 0, 124, 248][..], &[0; 248]].concat();
        line.receive(ms(0), &sealed(&body));
        assert_eq!(line.next_request(ms(2000)), None);
        line.receive(ms(2000), &READ);
        assert!(line.next_request(ms(2008)).is_some());
    }

    #[test]
    fn a_flood_is_lost_beyond_what_the_line_carries_in_time() {
        let mut line = Line::imitated(&ROUND);
        line.receive(ms(0), &[0xFF; 10_000]);
        assert!(line.garbage() >= 5_999, "{}", line.garbage());
        assert!(line.heard <= BACKLOG + ms(1));
        line.receive(ms(5000), &READ);
        assert!(line.next_request(ms(5008)).is_some());
    }

    #[test]
    fn hardware_keeps_the_time_of_characters_by_itself() {
        let mut line = Line::real(&ROUND);
        line.receive(ms(20), &READ);
        let request = line.next_request(ms(20)).unwrap();
        line.answer(&request, &[1, 2, 3, 4, 5, 6], us(4300));
        assert_eq!(leave(&mut line), [(us(24_300), vec![1, 2, 3, 4, 5, 6])]);
        // The six characters are on the line until 30.3 ms.
        line.receive(ms(31), &WRITE);
        assert_eq!((line.next_request(ms(31)), line.collisions()), (None, 1));
        line.receive(ms(45), &WRITE);
        assert!(line.next_request(ms(45)).is_some());
    }
}
