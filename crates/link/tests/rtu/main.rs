//! RTU wires over real pseudo-terminals and through a converter, against a slave whose every byte the test decides.
#![cfg(test)]
#![cfg(target_os = "linux")]

mod devices;
mod exchanges;
mod noise;
mod slave;
