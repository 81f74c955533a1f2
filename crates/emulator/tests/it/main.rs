//! The imitated controllers from outside: registers, time and sockets.
#![cfg(test)]

mod dkg705;
mod golden;
mod identities;
mod pins;
mod prop;
mod push_buttons;
mod server;
mod site;
mod wire_rules;
