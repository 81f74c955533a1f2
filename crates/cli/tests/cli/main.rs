//! The binary as its users call it: what it prints, where, and with which exit status.

// Helpers of tests may fail as tests do; clippy's exception for tests stops at functions marked as such.
#![allow(clippy::unwrap_used, clippy::panic)]

mod command;
mod control;
mod decode;
mod faults;
mod fleet;
mod frame;
mod guide;
mod help;
mod peer;
mod plan;
mod profile;
#[cfg(unix)]
mod pty;
#[cfg(target_os = "linux")]
mod run;
mod scenario;
#[cfg(target_os = "linux")]
mod serial;
mod services;
mod support;
mod verdicts;
mod watch;
mod wire;
