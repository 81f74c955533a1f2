//! The imitated controllers from outside: registers, time and sockets.
#![cfg(test)]

mod acc1700;
mod control;
mod datakom_d;
mod dkg705;
mod fleet;
mod golden;
mod hat821si;
mod identities;
mod laws;
mod levers;
#[cfg(target_os = "linux")]
mod lines;
mod openapi;
mod pins;
mod prop;
mod push_buttons;
mod scenarios;
mod server;
mod site;
mod wire_rules;
