//! Whatever comes in, the device neither panics nor answers more than its manual allows.

use std::time::Duration;

use busbar_modbus::{Framing, Request, Response, Server};
use proptest::prelude::*;

use crate::site::Site;

/// Addresses around the edges of the map are where mistakes live.
fn address() -> impl Strategy<Value = u16> {
    prop_oneof![
        any::<u16>(),
        prop::sample::select(vec![
            8192, 8193, 8194, 8209, 8210, 10239, 10551, 10593, 10604, 11168, 11378, 11700
        ]),
        10200..11720_u16,
    ]
}

fn pdu() -> impl Strategy<Value = Vec<u8>> {
    let read = (1..=6_u8, address(), any::<u16>()).prop_map(|(function, address, word)| {
        let mut pdu = vec![function];
        pdu.extend(address.to_be_bytes());
        pdu.extend(word.to_be_bytes());
        pdu
    });
    let write = (address(), prop::collection::vec(any::<u16>(), 0..20)).prop_map(|(address, registers)| {
        let mut pdu = vec![16];
        pdu.extend(address.to_be_bytes());
        pdu.extend((registers.len() as u16).to_be_bytes());
        pdu.push(2 * registers.len() as u8);
        pdu.extend(registers.iter().flat_map(|register| register.to_be_bytes()));
        pdu
    });
    prop_oneof![read, write, prop::collection::vec(any::<u8>(), 0..260)]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn any_request_gets_a_lawful_answer_or_none(
        pdus in prop::collection::vec((pdu(), 0..20_u64), 1..40),
        unit in prop_oneof![4 => Just(1_u8), 1 => any::<u8>()],
    ) {
        let mut site = Site::quiet();
        for (pdu, tenths) in &pdus {
            site.pass(Duration::from_millis(100 * tenths));
            let Ok(request) = Request::decode(pdu) else { continue };
            let Some(response) = site.device.answer(unit, &request) else { continue };
            prop_assert_eq!(unit, 1);
            match response {
                Response::ReadHoldingRegisters(registers) => {
                    prop_assert!((1..=16).contains(&registers.len()));
                    response.answers(&request).unwrap();
                }
                Response::Exception { function, code } => {
                    prop_assert_eq!(function, request.function());
                    prop_assert!([1, 2, 10].contains(&code.0));
                }
                Response::WriteSingleRegister { .. } | Response::WriteMultipleRegisters { .. } => {
                    response.answers(&request).unwrap();
                }
                other => prop_assert!(false, "{other:?}"),
            }
        }
        prop_assert_eq!(site.device.misfits(), 0);
    }

    #[test]
    fn any_stream_of_bytes_is_survived(
        chunks in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..80), 1..20),
    ) {
        let mut site = Site::quiet();
        let mut server = Server::new(Framing::Tcp);
        let mut out = Vec::new();
        for chunk in &chunks {
            server.receive(Duration::ZERO, chunk);
            while let Some(incoming) = server.next_request() {
                if let Some(response) = site.device.answer(incoming.unit, &incoming.request) {
                    incoming.respond(&response, &mut out).unwrap();
                }
            }
        }
    }
}
