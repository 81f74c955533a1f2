//! The wire over real loopback sockets, against a peer whose every byte the test decides.
#![cfg(test)]

mod answers;
mod callers;
mod outages;
mod peer;
