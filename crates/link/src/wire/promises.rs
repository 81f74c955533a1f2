//! A play with chance: whatever happens on a wire, it keeps its promises.

use proptest::prelude::*;

use super::script::*;
use super::*;

/// What may happen next in the play with chance.
#[derive(Clone, Debug)]
enum Turn {
    Read(u16),
    Write,
    Cancel(usize),
    Answer,
    Late(u16),
    Refuse(u8),
    Noise(Vec<u8>),
    Drop,
    Connect,
    FailConnect,
    Pass(u64),
}

fn turn() -> impl Strategy<Value = Turn> {
    prop_oneof![
        4 => (0_u16..50).prop_map(Turn::Read),
        3 => Just(Turn::Write),
        1 => (0_usize..8).prop_map(Turn::Cancel),
        6 => Just(Turn::Answer),
        2 => (1_u16..4).prop_map(Turn::Late),
        1 => (1_u8..12).prop_map(Turn::Refuse),
        1 => proptest::collection::vec(any::<u8>(), 1..20).prop_map(Turn::Noise),
        1 => Just(Turn::Drop),
        4 => Just(Turn::Connect),
        1 => Just(Turn::FailConnect),
        3 => (1_u64..1500).prop_map(Turn::Pass),
    ]
}

/// A caller and what it asked: the address of a read or the value of a write.
struct Caller {
    ticket: Option<Ticket>,
    asked: Result<u16, u16>,
}

/// What a device that holds `address + transaction` in each register answers; echoes writes.
fn device(transaction: u16, sent: &[u8]) -> Vec<u8> {
    let address = u16::from_be_bytes([sent[8], sent[9]]);
    match sent[7] {
        0x03 => {
            let [high, low] = address.to_be_bytes();
            let [h, l] = transaction.to_be_bytes();
            frame(transaction, &[0x03, 4, high, low, h, l])
        }
        _ => frame(transaction, &sent[7..12]),
    }
}

proptest! {
    /// Whatever happens: a caller has its own answer, in answer to its own last request, or an error; no write leaves
    /// twice; a write that failed with anything but `Lost` or an exception never left.
    #[test]
    fn keeps_its_promises(turns in proptest::collection::vec(turn(), 1..120)) {
        let mut script = Script::new();
        let mut callers: Vec<Caller> = Vec::new();
        let mut written: Vec<u16> = Vec::new();
        // Frames that left, and the connection's end.
        let mut sent: Vec<Vec<u8>> = Vec::new();
        let mut now = 0;
        let mut connecting = false;
        let mut up = false;
        let mut next_value = 0;

        // In the end the device is switched off: nobody may wait for ever.
        let switched_off = [Turn::Pass(10_000), Turn::FailConnect].into_iter().cycle().take(400);
        for turn in turns.into_iter().chain(switched_off) {
            let last = u16::try_from(sent.len()).unwrap();
            match turn {
                Turn::Read(address) => {
                    let ticket = script.submit(now, Priority::Poll, read(address)).ok();
                    callers.push(Caller { ticket, asked: Ok(address) });
                }
                Turn::Write => {
                    let ticket = script.submit(now, Priority::Command, write(next_value)).ok();
                    callers.push(Caller { ticket, asked: Err(next_value) });
                    next_value += 1;
                }
                Turn::Cancel(index) => {
                    if let Some(ticket) = callers.get_mut(index).and_then(|caller| caller.ticket.take()) {
                        script.wire.cancel(ticket);
                    }
                }
                Turn::Answer if up && last > 0 => {
                    let bytes = device(last, &sent[sent.len() - 1]);
                    script.hears(now, &bytes);
                }
                Turn::Late(by) if up && last > by => {
                    let bytes = device(last - by, &sent[usize::from(last - by) - 1]);
                    script.hears(now, &bytes);
                }
                Turn::Refuse(code) if up && last > 0 => {
                    let function = sent[sent.len() - 1][7] | 0x80;
                    script.hears(now, &frame(last, &[function, code]));
                }
                Turn::Noise(bytes) if up => script.hears(now, &bytes),
                Turn::Drop if up => {
                    up = false;
                    script.loses(now, Cause::Reset);
                }
                Turn::Connect if connecting => {
                    connecting = false;
                    up = true;
                    script.wire.connected(ms(now));
                }
                Turn::FailConnect if connecting => {
                    connecting = false;
                    script.refuses(now, Cause::Refused);
                }
                Turn::Pass(millis) => now += millis,
                _ => {}
            }
            loop {
                match script.step(now) {
                    Step::Send(_) => {
                        prop_assert!(up);
                        if script.out[7] == 0x06 {
                            let value = u16::from_be_bytes([script.out[10], script.out[11]]);
                            prop_assert!(!written.contains(&value), "write {} left twice", value);
                            written.push(value);
                        }
                        sent.push(script.out.clone());
                        prop_assert_eq!(script.out[..2].to_vec(), u16::try_from(sent.len()).unwrap().to_be_bytes());
                        break;
                    }
                    Step::Connect => connecting = true,
                    Step::Disconnect => up = false,
                    Step::Wait(until) => {
                        prop_assert!(until.is_none_or(|until| until > ms(now)), "a wait that is over");
                        break;
                    }
                    Step::End => prop_assert!(false, "ended by itself"),
                }
            }
            for caller in &mut callers {
                let Some(ticket) = &caller.ticket else { continue };
                let Some(outcome) = script.outcome(ticket) else { continue };
                caller.ticket = None;
                match (caller.asked, outcome) {
                    (Ok(address), Ok(registers)) => {
                        let last = u16::try_from(sent.len()).unwrap();
                        // Noise may forge an answer only by guessing the transaction: it does not in these runs.
                        prop_assert_eq!(registers[0], address);
                        prop_assert!(registers[1] == last || registers[1] + 1 == last);
                    }
                    (Ok(_), Err(error)) => {
                        let never = matches!(error, LinkError::Lost { .. });
                        prop_assert!(!never, "a read is never lost");
                    }
                    (Err(value), Ok(_) | Err(LinkError::Lost { .. } | LinkError::Exception { .. })) => {
                        prop_assert!(written.contains(&value));
                    }
                    (Err(value), Err(error)) => {
                        prop_assert!(!written.contains(&value), "{} but it left", error);
                    }
                }
            }
        }
        prop_assert!(callers.iter().all(|caller| caller.ticket.is_none()), "somebody still waits");
    }
}
