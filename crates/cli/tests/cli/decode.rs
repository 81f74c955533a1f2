//! `busbar decode`.

use serde_json::json;

use crate::support::busbar;

#[test]
fn json_is_the_contracts_example() {
    busbar("decode datakom-d 10246 08FE 0000 --json").ok().silently().prints(
        "[{\"id\":\"genset_l1_voltage\",\"address\":10246,\"value\":230.2,\"unit\":\"V\",\"quality\":\"good\",\"raw\":[2302,0]}]\n",
    );
}

#[test]
fn addresses_are_decimal_or_hex() {
    let decimal = busbar("decode datakom-d 10246 08FE 0000 --json").ok().out();
    busbar("decode datakom-d 0x2806 8fe 0 --json").ok().prints(&decimal);
    busbar("decode datakom-d 0X2806 0x08FE 0X0000 --json").ok().prints(&decimal);
}

#[test]
fn word_order_can_be_set() {
    let value = |order: &str| {
        busbar(&format!("decode datakom-d 10246 0001 0002 --json --word-order {order}")).ok().json()[0]["value"].clone()
    };
    assert_eq!(value("low-first"), json!(13107.3));
    assert_eq!(value("high-first"), json!(6553.8));
}

#[test]
fn codes_have_labels() {
    let readings = busbar("decode datakom-d 10604 0008 0004 --json").ok().json();
    assert_eq!(readings[0]["value"], json!("Running off load"));
    assert_eq!(readings[0]["code"], json!(8));
    assert_eq!(readings[1]["value"], json!("AUTO"));
    let unknown = busbar("decode datakom-d 10604 001A --json").ok().json();
    assert_eq!(unknown[0]["value"], json!("unknown (26)"));
    assert_eq!(unknown[0]["quality"], json!("good"));
}

#[test]
fn the_model_decides_where_a_label_depends_on_it() {
    let mode = |arguments: &str| {
        busbar(&format!("decode datakom-d {arguments} --json")).ok().json()[0]["value"].clone()
    };
    assert_eq!(mode("10605 2"), json!("MANUAL / RUN"));
    assert_eq!(mode("10605 2 0 0 0 D500"), json!("RUN"));
    assert_eq!(mode("10605 2 0 0 0 D700"), json!("MANUAL"));
}

#[test]
fn bits_have_labels_and_numbers() {
    let mut registers = vec!["0000"; 16];
    registers[0] = "0001";
    registers[3] = "0001";
    registers[8] = "4000";
    let reading = &busbar(&format!("decode datakom-d 10504 {} --json", registers.join(" "))).ok().json()[0];
    // Bits 142 to 255 are documented as reserved and never reported.
    assert_eq!(reading["set"], json!([0, 48]));
    assert_eq!(reading["value"][1], json!("Genset low frequency"));
}

#[test]
fn sentinels_are_no_value() {
    let reading = &busbar("decode datakom-d 10362 7FFF --json").ok().json()[0];
    assert_eq!(
        (&reading["value"], &reading["quality"], &reading["raw"]),
        (&json!(null), &json!("invalid"), &json!([32767]))
    );
}

#[test]
fn write_only_points_are_decoded_too() {
    let readings = busbar("decode datakom-d 8194 0005 --json").ok().json();
    assert_eq!(readings[0]["code"], json!(5));
}

#[test]
fn what_holds_no_point_is_an_empty_list_and_a_note() {
    busbar("decode datakom-d 1 0000 --json")
        .ok()
        .prints("[]\n")
        .says_in_one_sentence("no point of datakom-d");
    busbar("decode datakom-d 10246 08FE").ok().prints("").says_in_one_sentence("no point of datakom-d");
}

#[test]
fn people_get_a_table() {
    insta::assert_snapshot!(busbar("decode datakom-d 10604 0008 0004 0012").ok().silently().out());
    insta::assert_snapshot!(busbar("decode datakom-d 10360 0 002D FFC9 03E8 7FFF").ok().silently().out());
    let alarms =
        ["0001", "0", "0", "0003", "0", "0", "0", "0", "0", "0", "0", "0", "0", "0", "0", "0"].join(" ");
    insta::assert_snapshot!(busbar(&format!("decode datakom-d 10504 {alarms}")).ok().silently().out());
}
