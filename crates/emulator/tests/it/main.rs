//! The imitated controllers from outside: registers, time and sockets.
#![cfg(test)]

mod golden;
mod identities;
#[cfg(target_os = "linux")]
mod lines;
mod pins;
mod prop;
mod push_buttons;
mod server;
mod site;
mod wire_rules;
