//! Any bytes from a TCP connection, in any pieces, to a server.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| busbar_fuzz::frames::tcp_stream(bytes));
