//! A device made of a closure: bytes of a request in, bytes of the answer out.

use std::{
    io::{Read, Write},
    net::{TcpListener, TcpStream},
    thread,
};

/// A listener on loopback that answers each request with what `answer` returns; nothing returned is silence.
pub(crate) struct Peer {
    pub(crate) url: String,
}

impl Peer {
    pub(crate) fn new(answer: impl Fn(Request) -> Vec<u8> + Clone + Send + 'static) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let url = format!("tcp://{}", listener.local_addr().unwrap());
        thread::spawn(move || {
            for stream in listener.incoming() {
                let answer = answer.clone();
                thread::spawn(move || serve(stream.unwrap(), answer));
            }
        });
        Self { url }
    }
}

/// A read request as it came.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Request {
    pub(crate) transaction: u16,
    pub(crate) unit: u8,
    pub(crate) function: u8,
    pub(crate) address: u16,
    pub(crate) count: u16,
}

impl Request {
    /// The full answer: each register holds its own address.
    pub(crate) fn addresses(self) -> Vec<u8> {
        let registers: Vec<u16> = (0..self.count).map(|offset| self.address.wrapping_add(offset)).collect();
        self.registers(&registers)
    }

    pub(crate) fn registers(self, registers: &[u16]) -> Vec<u8> {
        let mut pdu = vec![self.function, 2 * registers.len() as u8];
        pdu.extend(registers.iter().flat_map(|register| register.to_be_bytes()));
        self.pdu(&pdu)
    }

    pub(crate) fn exception(self, code: u8) -> Vec<u8> {
        self.pdu(&[self.function | 0x80, code])
    }

    pub(crate) fn pdu(self, pdu: &[u8]) -> Vec<u8> {
        let [high, low] = self.transaction.to_be_bytes();
        let mut frame = vec![high, low, 0, 0, 0, pdu.len() as u8 + 1, self.unit];
        frame.extend(pdu);
        frame
    }
}

/// Ends when the client does.
fn serve(mut stream: TcpStream, answer: impl Fn(Request) -> Vec<u8>) {
    let mut bytes = [0; 12];
    while stream.read_exact(&mut bytes).is_ok() {
        let word = |at: usize| u16::from_be_bytes([bytes[at], bytes[at + 1]]);
        let request = Request {
            transaction: word(0),
            unit: bytes[6],
            function: bytes[7],
            address: word(8),
            count: word(10),
        };
        if stream.write_all(&answer(request)).is_err() {
            return;
        }
    }
}
