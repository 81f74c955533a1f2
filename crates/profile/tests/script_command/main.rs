//! Commands as sequences of messages: what is asked of the wire, what comes of it, and the verdict.
#![cfg(test)]

mod every_row;
mod harness;
mod procedures;
mod random;
mod scripts;
