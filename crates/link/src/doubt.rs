//! RTU: requests that had no answer in time and may still be answered.
//!
//! Nothing but unit, function and length tells RTU answers apart. So while the answer to a lost request may still come,
//! its unit is asked nothing else whose answer looks the same: the late answer would be taken for that one's.

use std::time::Duration;

use busbar_modbus::Stray;
use busbar_modbus::client::DEFAULT_QUIET;

use crate::job::Question;

/// The lost requests of one wire.
#[derive(Debug, Default)]
pub(crate) struct Doubts(Vec<Doubt>);

/// One question whose answer may still come.
#[derive(Debug)]
struct Doubt {
    question: Question,
    /// No answer comes after this.
    until: Duration,
    /// How many answers may come.
    open: u8,
    /// Something else waits for this to be over.
    contended: bool,
    /// An answer that comes before this may be a copy of the one before it.
    copies_until: Duration,
}

impl Doubts {
    /// A request had no answer; it may come until then.
    pub(crate) fn lost(&mut self, now: Duration, question: Question, until: Duration) {
        self.0.retain(|doubt| doubt.until > now);
        match self.0.iter_mut().find(|doubt| doubt.question == question) {
            Some(doubt) => {
                doubt.open = doubt.open.saturating_add(1);
                doubt.until = doubt.until.max(until);
            }
            None => self.0.push(Doubt {
                question,
                until,
                open: 1,
                contended: false,
                copies_until: Duration::ZERO,
            }),
        }
    }

    /// A question has its answer. If it was asked before in vain, as many answers are still to come as before, and the
    /// last of them may come until then.
    pub(crate) fn answered(&mut self, now: Duration, question: &Question, until: Duration) {
        for doubt in self.0.iter_mut().filter(|doubt| doubt.until > now && doubt.question == *question) {
            doubt.until = doubt.until.max(until);
            doubt.copies_until = now + DEFAULT_QUIET;
        }
    }

    /// A frame came that answered nothing under way. What comes close behind an answer is not counted: it may be the
    /// same one again.
    pub(crate) fn seen(&mut self, now: Duration, stray: &Stray) {
        let mut alike =
            self.0.iter_mut().enumerate().filter(|(_, doubt)| doubt.question.may_be_answered_by(stray));
        let (Some((index, doubt)), None) = (alike.next(), alike.next()) else {
            // None, or nobody can say which: then all of them stay.
            return;
        };
        let copy = now < doubt.copies_until;
        doubt.copies_until = now + DEFAULT_QUIET;
        doubt.open -= u8::from(!copy);
        if doubt.open == 0 {
            self.0.swap_remove(index);
        }
    }

    /// Until when a question has to wait. The same read may be asked again: either answer is right. But once others
    /// wait, only its retries go on, so that the others' turn comes.
    pub(crate) fn hold(&mut self, now: Duration, question: &Question, retry: bool) -> Option<Duration> {
        let alike = self.0.iter_mut().filter(|doubt| doubt.until > now && doubt.question.is_like(question));
        let mut until = None;
        for doubt in alike {
            if doubt.question == *question && !question.write {
                if retry || !doubt.contended {
                    continue;
                }
            } else {
                doubt.contended = true;
            }
            until = until.max(Some(doubt.until));
        }
        until
    }

    /// Whether an answer may still come that is not this question's, but would be taken for it if it is an exception.
    pub(crate) fn may_refuse(&self, now: Duration, question: &Question) -> bool {
        self.0.iter().any(|doubt| {
            let Question { unit, function, .. } = doubt.question;
            doubt.until > now
                && (unit, function) == (question.unit, question.function)
                && doubt.question != *question
        })
    }

    /// Whether any answer may still come.
    pub(crate) fn is_any(&self, now: Duration) -> bool {
        self.0.iter().any(|doubt| doubt.until > now)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(millis: u64) -> Duration {
        Duration::from_millis(millis)
    }

    fn read(unit: u8, address: u16, count: u16) -> Question {
        Question { unit, function: 3, address, count, short: false, write: false }
    }

    fn answer(unit: u8, count: usize) -> Stray {
        Stray { unit, function: 3, pdu_len: 2 + 2 * count, exception: false }
    }

    #[test]
    fn holds_up_what_looks_the_same_and_nothing_else() {
        let mut doubts = Doubts::default();
        doubts.lost(ms(0), read(1, 100, 4), ms(3000));
        let write = Question { function: 6, write: true, ..read(1, 100, 1) };
        doubts.lost(ms(0), write, ms(4000));
        for (label, question, until) in [
            ("another address", read(1, 200, 4), Some(3000)),
            ("another unit", read(2, 200, 4), None),
            ("another length", read(1, 100, 5), None),
            ("another function", Question { function: 4, ..read(1, 200, 4) }, None),
            ("one that takes short answers", Question { short: true, ..read(1, 200, 9) }, Some(3000)),
            ("the same write", write, Some(4000)),
            ("another write", Question { address: 7, ..write }, Some(4000)),
        ] {
            assert_eq!(doubts.hold(ms(1), &question, false), until.map(ms), "{label}");
        }
        assert_eq!(doubts.hold(ms(3000), &read(1, 200, 4), false), None, "its time is over");
    }

    #[test]
    fn the_same_read_goes_on_until_others_wait() {
        let mut doubts = Doubts::default();
        doubts.lost(ms(0), read(1, 100, 4), ms(3000));
        assert_eq!(doubts.hold(ms(1), &read(1, 100, 4), false), None);
        doubts.answered(ms(2), &read(1, 100, 4), ms(3002));
        assert_eq!(doubts.hold(ms(3), &read(1, 200, 4), false), Some(ms(3002)));
        assert_eq!(doubts.hold(ms(4), &read(1, 100, 4), false), Some(ms(3002)));
        assert_eq!(doubts.hold(ms(4), &read(1, 100, 4), true), None, "a retry");
    }

    #[test]
    fn ends_when_every_answer_has_come() {
        let mut doubts = Doubts::default();
        let other = read(1, 200, 4);
        doubts.lost(ms(0), read(1, 100, 4), ms(3000));
        doubts.lost(ms(200), read(1, 100, 4), ms(3200));
        for stray in
            [answer(1, 4), answer(1, 4), answer(1, 5), answer(2, 4), Stray { function: 4, ..answer(1, 4) }]
        {
            doubts.seen(ms(290), &stray);
            assert_eq!(doubts.hold(ms(300), &other, false), Some(ms(3200)), "{stray:?}");
        }
        doubts.seen(ms(340), &Stray { pdu_len: 2, exception: true, ..answer(1, 0) });
        assert_eq!(doubts.hold(ms(340), &other, false), None);
        assert!(!doubts.is_any(ms(340)));

        // Two lengths are in doubt: an exception says nothing about which.
        doubts.lost(ms(400), read(1, 100, 4), ms(3000));
        doubts.lost(ms(400), read(1, 100, 5), ms(3000));
        doubts.seen(ms(450), &Stray { pdu_len: 2, exception: true, ..answer(1, 0) });
        assert_eq!(doubts.hold(ms(500), &other, false), Some(ms(3000)));
        assert!(doubts.may_refuse(ms(500), &other) && !doubts.may_refuse(ms(500), &read(2, 100, 4)));
    }
}
