//! `busbar frame`.

use crate::support::busbar;

#[test]
fn json_of_each_kind() {
    for (frame, expected) in [
        (
            "01 03 00 20 00 10 45 CC",
            r#"{"transport":"rtu","unit":1,"function":3,"kind":"request","crc_ok":true,"address":32,"count":16}"#,
        ),
        (
            "010600400010 89D2",
            r#"{"transport":"rtu","unit":1,"function":6,"kind":"request_or_response","crc_ok":true,"address":64,"value":16}"#,
        ),
        (
            "00:07:00:00:00:07:01:03:04:08:FE:00:00",
            r#"{"transport":"tcp","unit":1,"function":3,"kind":"response","crc_ok":null,"transaction":7,"registers":[2302,0]}"#,
        ),
        (
            "0007 0000 0003 01 83 0A",
            r#"{"transport":"tcp","unit":1,"function":3,"kind":"exception","crc_ok":null,"transaction":7,"exception":{"code":10,"name":"gateway path unavailable"}}"#,
        ),
    ] {
        busbar(&format!("frame {frame} --json")).ok().silently().prints(&format!("{expected}\n"));
    }
}

#[test]
fn exceptions_have_the_makers_name() {
    let frame = busbar("frame 0007 0000 0003 01 86 0A --profile datakom-d --json").ok().json();
    assert_eq!(frame["exception"]["name"], "write protection");
    let standard = busbar("frame 0007 0000 0003 01 86 06 --profile datakom-d --json").ok().json();
    assert_eq!(standard["exception"]["name"], "server device busy");
}

#[test]
fn a_wrong_crc_prints_the_rest_and_fails() {
    let call = busbar("frame 01 03 00 20 00 10 45 CD --json").fails();
    assert_eq!(call.json()["crc_ok"], false);
    assert_eq!(call.json()["count"], 16);
    call.says_in_one_sentence("ends in 45 CD and its bytes give 45 CC");
    insta::assert_snapshot!(busbar("frame 01 03 00 20 00 10 45 CD").fails().out());
}

#[test]
fn what_is_no_frame_is_told_with_the_byte() {
    busbar("frame DEAD").fails().prints("").says_in_one_sentence("no frame: byte 2, the bytes end here");
    busbar("frame 0001 0000 0006 01 03 2806 00 --json")
        .fails()
        .prints("")
        .says_in_one_sentence("no frame: byte 4, the MBAP header announces 6 bytes and 5 follow");
}

#[test]
fn people_get_fields() {
    insta::assert_snapshot!(busbar("frame 01 03 00 20 00 10 45 CC").ok().silently().out());
    insta::assert_snapshot!(
        busbar("frame 0001 0000 0006 01 03 2806 0004 --profile datakom-d").ok().silently().out()
    );
    insta::assert_snapshot!(
        busbar("frame 0007 0000 0003 01 86 0A --profile datakom-d").ok().silently().out()
    );
    insta::assert_snapshot!(busbar("frame 0007 0000 0007 01 03 04 08FE 0000").ok().silently().out());
    insta::assert_snapshot!(busbar("frame 0007 0000 0006 01 01 03 CD6B05").ok().silently().out());
}
