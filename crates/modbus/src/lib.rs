//! Modbus as pure functions over bytes: frames, PDUs and transactions, for both ends of a wire and for a listener.
//!
//! Nothing here does I/O, reads a clock or allocates once its buffers have grown to the size of the first
//! exchange. Every function is total: whatever bytes come in, a frame, a count of what was dropped or a typed error
//! comes out, never a panic. Time is an argument, a [`Duration`](std::time::Duration) since any origin the caller
//! keeps.
//!
//! From the inside out:
//! - [`pdu`]: requests and responses without addressing or checks (Modbus Application Protocol V1.1b3);
//! - [`rtu`] and [`mbap`]: the two framings around a PDU (Modbus over Serial Line V1.02, Modbus Messaging on TCP/IP
//!   V1.0b);
//! - [`stream`]: frames cut out of a stream of bytes, for a server and for a listener who sees both directions;
//! - [`client`] and [`server`]: who asked what, until when, and what may be taken for the answer.
//!
//! ```
//! use std::time::Duration;
//! use busbar_modbus::{Client, Framing, Progress, Request, Response, Server};
//!
//! let (mut client, mut server) = (Client::new(Framing::Tcp), Server::new(Framing::Tcp));
//! let (mut question, mut answer) = (Vec::new(), Vec::new());
//! let now = Duration::ZERO;
//!
//! let request = Request::ReadHoldingRegisters { address: 10246, count: 2 };
//! client.start(now, 1, &request, Duration::from_secs(1), &mut question)?;
//!
//! server.receive(now, &question);
//! while let Some(incoming) = server.next_request() {
//!     incoming.respond(&Response::ReadHoldingRegisters((&[2302, 0]).into()), &mut answer)?;
//! }
//!
//! assert_eq!(client.receive(now, &answer), Progress::Answered);
//! assert_eq!(client.response(), Some(Response::ReadHoldingRegisters((&[2302, 0]).into())));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod client;
pub mod error;
pub mod mbap;
pub mod pdu;
pub mod rtu;
pub mod server;
pub mod stream;

pub use client::{Client, Counters, Progress, Stray};
pub use error::{DecodeError, EncodeError, Fault, FrameError, Mismatch, StartError};
pub use pdu::{Bits, ExceptionCode, MAX_PDU, Registers, Request, Response};
pub use server::{Incoming, Server};
pub use stream::{Framing, Heard, Kind, ListenerDecoder, Losses, ServerDecoder};
