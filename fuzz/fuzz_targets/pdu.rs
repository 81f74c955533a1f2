//! Any bytes as a request and as a response.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| busbar_fuzz::frames::pdu(bytes));
