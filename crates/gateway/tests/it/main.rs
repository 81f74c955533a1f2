//! Tests of the gateway from outside: a real controller's answers over TCP come in, HTTP goes out. One module a topic.

// A failed expectation may panic in a test's helpers as it may in the test.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod bad_line;
mod beside;
mod events;
mod faults;
mod hostile;
mod http;
mod identity;
mod live;
mod on_demand;
mod openapi;
mod readers;
mod reload;
mod sharing;
mod start;
mod support;
