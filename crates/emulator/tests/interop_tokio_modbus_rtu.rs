//! A stranger's RTU client, tokio-modbus, on a pseudo-terminal with two imitated D-500.
#![cfg(target_os = "linux")]

use busbar_emulator::{Config, start_together};
use busbar_link::{Endpoint, SerialPort};
use tokio_modbus::client::rtu::attach_slave;
use tokio_modbus::prelude::*;

#[tokio::test]
async fn tokio_modbus_talks_to_two_units_on_one_line() {
    let units = [17, 18].map(|unit| Config { unit, ..Config::default() });
    let line = "rtu://pty?baud=115200".parse().unwrap();
    let emulation = start_together(units.to_vec(), vec![line]).await.unwrap();
    let Endpoint::Rtu { path, serial } = &emulation.urls()[0] else { panic!("not serial") };
    let mut client = attach_slave(SerialPort::open(path, serial).unwrap(), Slave(17));

    for (unit, channel) in [(17, 3), (18, 4)] {
        client.set_slave(Slave(unit));
        let identity = client.read_holding_registers(10609, 1).await.unwrap().unwrap();
        assert_eq!(identity, [0xD500]);
        let words = client.read_holding_registers(10240, 16).await.unwrap().unwrap();
        // Low word first: 230 V in tenths fits the first register.
        assert!((2200..2420).contains(&words[0]) && words[1] == 0, "{words:?}");
        client.write_single_register(8194, channel).await.unwrap().unwrap();
    }
    for (unit, channel) in [(17, 3), (18, 4)] {
        client.set_slave(Slave(unit));
        assert_eq!(client.read_holding_registers(10403, 1).await.unwrap().unwrap(), [channel]);
        client.write_multiple_registers(8194, &[7]).await.unwrap().unwrap();

        let code = |exception: ExceptionCode| u8::from(exception);
        assert_eq!(code(client.read_holding_registers(8193, 1).await.unwrap().unwrap_err()), 2);
        assert_eq!(code(client.write_single_register(10240, 1).await.unwrap().unwrap_err()), 10);
        assert_eq!(code(client.read_input_registers(10240, 1).await.unwrap().unwrap_err()), 1);
        assert_eq!(code(client.write_single_coil(0, true).await.unwrap().unwrap_err()), 1);
    }
    assert_eq!(emulation.statistics().collisions, 0);
    emulation.stop().await;
}
