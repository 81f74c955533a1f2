//! Any bytes of both directions, in any pieces, to a listener.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| busbar_fuzz::frames::listener(bytes));
