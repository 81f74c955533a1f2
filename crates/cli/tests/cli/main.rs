//! The binary as its users call it: what it prints, where, and with which exit status.

// Helpers of tests may fail as tests do; clippy's exception for tests stops at functions marked as such.
#![allow(clippy::unwrap_used, clippy::panic)]

mod decode;
mod frame;
mod guide;
mod help;
mod peer;
mod plan;
mod profile;
mod services;
mod support;
mod wire;
