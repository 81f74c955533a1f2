//! Scenario files and what becomes of them: sound ones are played, wrong ones are refused with a remedy.

use super::*;
use crate::STEP;
use crate::device::Device;

const HEAD: &str = "[scenario]\ntitle = \"A test\"\ncontroller = \"datakom-d\"\n";

fn parse(steps: &str) -> Result<Scenario, Findings> {
    Scenario::parse("a.toml", &format!("{HEAD}{steps}"))
}

fn play(steps: &str) -> Report {
    parse(steps).unwrap_or_else(|findings| panic!("{findings}")).play().unwrap()
}

/// Time, verdict and text of every check.
fn checks(report: &Report) -> Vec<String> {
    let checks = report.checks.iter();
    checks
        .map(|check| {
            let held = check.verdict == CheckVerdict::Held;
            format!(
                "{:.1} {} {}",
                check.decided.as_secs_f64(),
                if held { "held" } else { "failed" },
                check.expected
            )
        })
        .collect()
}

#[test]
fn steps_are_taken_in_order_by_time_and_condition() {
    let report = play(
        r#"
        [[steps]]
        at = "2s"
        command = "test"
        [[steps]]
        when = "state.engine == cranking"
        within = "20s"
        note = "It cranks."
        [[steps]]
        after = "1s"
        expect = "state.engine == cranking or engine.running"
        [[steps]]
        when = "state.engine == loaded"
        expect = ["breaker.genset.closed for 5s", "genset.frequency > 49.5 and genset.frequency < 50.5"]
        "#,
    );
    assert_eq!(report.held, Some(true), "{report:#?}");
    assert_eq!((report.steps, report.taken), (4, 4));
    let told = |kind| {
        let events = report.events.iter().filter(move |event| event.kind == kind);
        events.map(|event| event.text.as_str()).collect::<Vec<_>>()
    };
    assert_eq!(told(EventKind::Action), ["command test"]);
    assert_eq!(told(EventKind::Note), ["It cranks."]);
    let changes = told(EventKind::Change);
    let states: Vec<_> = changes.iter().filter_map(|change| change.strip_prefix("state.engine ")).collect();
    assert_eq!(
        states,
        [
            "preheat (Wait before fuel)",
            "preheat (Engine preheat)",
            "preheat (Wait oil flash off)",
            "cranking (Cranking)",
            "warming (Engine run idle speed)",
            "warming (Engine heating)",
            "running (Running off load)",
            "running (Genset CB timer)",
            "running (Genset CB activation)",
            "loaded (Master genset on load)",
        ]
    );
    assert!(
        changes.contains(&"breaker.genset.closed") && changes.contains(&"mode test (TEST)"),
        "{changes:?}"
    );
    assert_eq!(report.lasted, report.checks.last().unwrap().decided);
}

#[test]
fn expectations_fail_when_their_time_is_up_or_they_break() {
    let report = play(
        r#"
        [[steps]]
        at = "0s"
        expect = ["state.engine == cranking", "state.engine == cranking within 2s", "not breaker.genset.closed for 3s"]
        [[steps]]
        at = "1s"
        set = { operation_status = "Cranking" }
        [[steps]]
        at = "1500ms"
        unset = "operation_status"
        expect = ["mode == test within 1s", "state.engine == cranking for 1s", "state.engine == stopped within 1s for 2s"]
        "#,
    );
    assert_eq!(
        checks(&report),
        [
            "0.0 failed state.engine == cranking",
            "1.1 held state.engine == cranking within 2s",
            "1.6 failed state.engine == cranking for 1s",
            "2.5 failed mode == test within 1s",
            "3.0 held not breaker.genset.closed for 3s",
            "3.6 held state.engine == stopped within 1s for 2s",
        ]
    );
    assert_eq!(report.held, Some(false));
    let sentences: Vec<_> = report.failures().map(|check| report.sentence(check)).collect();
    assert_eq!(
        sentences,
        [
            "a.toml:7:19: expected state.engine == cranking from 0.0 s on; at 0.0 s state.engine was stopped",
            "a.toml:14:45: expected state.engine == cranking for 1s from 1.5 s on; at 1.6 s state.engine was stopped",
            "a.toml:14:19: expected mode == test within 1s from 1.5 s on; at 2.5 s mode was auto",
        ]
    );
}

#[test]
fn a_step_that_cannot_be_taken_ends_the_story_with_what_was_seen() {
    let waits = "[[steps]]\nwhen = \"state.engine == cranking\"\nwithin = \"3s\"\n[[steps]]\nafter = \"1s\"\nmains = \"failed\"\n";
    let report = play(waits);
    assert_eq!(checks(&report), ["3.0 failed state.engine == cranking within 3s"]);
    assert_eq!((report.taken, report.lasted), (0, Duration::from_secs(3)));

    let report = play(
        r#"
        [[steps]]
        at = "0s"
        command = "test"
        [[steps]]
        when = "state.engine == cranking"
        [[steps]]
        at = "5s"
        mains = "failed"
        "#,
    );
    let late = checks(&report).pop().unwrap();
    assert!(late.ends_with("failed this step at 5s"), "{late}");
}

#[test]
fn the_time_of_a_scenario_ends_it() {
    let text = format!(
        "{HEAD}lasts = \"4s\"\n[[steps]]\nat = \"1s\"\nmains = \"failed\"\n[[steps]]\nwhen = \"engine.running and mode == off\"\n"
    );
    let report = Scenario::parse("a.toml", &text).unwrap().play().unwrap();
    assert_eq!(checks(&report), ["4.0 failed engine.running and mode == off"]);
    let sentence = report.sentence(&report.checks[0]);
    assert!(
        sentence.ends_with("at 4.0 s the scenario's time of 4s was up, engine.running was no, mode was auto"),
        "{sentence}"
    );
}

#[test]
fn what_nobody_can_tell_neither_holds_nor_fails() {
    let report = play(
        r#"
        [[steps]]
        at = "0s"
        set = { engine_temperature = "absent" }
        [[steps]]
        after = "1s"
        expect = [
            "engine.coolant.temperature < 200",
            "not engine.coolant.temperature < 200",
            "engine.coolant.temperature < 200 or mode == auto",
            "not (engine.coolant.temperature < 200 and mode == off)",
        ]
        "#,
    );
    let held: Vec<_> = report.checks.iter().map(|check| check.verdict == CheckVerdict::Held).collect();
    assert_eq!(held, [false, false, true, true]);
}

#[test]
fn conditions_bind_as_people_read_them() {
    let pins = [("fuel_level", "12.5"), ("unit_mode", "AUTO"), ("operation_status", "Cranking")];
    let pins = pins.map(|(point, value)| (point.to_owned(), value.to_owned())).to_vec();
    let device = Device::new(&Config { pins, ..Config::default() }).unwrap();
    for (text, holds) in [
        ("fuel.level == 12.50", true),
        ("fuel.level != 12.5", false),
        ("fuel.level < 12.5", false),
        ("fuel.level<=12.5", true),
        ("fuel.level > 12.49", true),
        ("fuel_level >= 12.51", false),
        ("mode == auto and state.engine == stopped", false),
        ("mode == auto and state.engine != stopped", true),
        ("mode == auto or mode == off and state.engine == stopped", true),
        ("(mode == auto or mode == off) and state.engine == stopped", false),
        ("not mode == off and operation_status == cranking", true),
        ("not (mode == off or operation_status == cranking)", false),
        ("not not breaker.mains.closed", true),
    ] {
        let condition = parse::condition(device.profile(), text).unwrap();
        assert_eq!(condition.holds(&device), holds, "{text}");
    }
}

#[test]
fn a_state_without_a_word_is_none_of_the_words() {
    let device = Device::new(&Config { profile: "datakom-dkg705".to_owned(), ..Config::default() }).unwrap();
    for (text, holds) in [
        ("state.engine == cranking", false),
        ("state.engine != cranking", true),
        ("not state.engine == cranking", true),
        ("operation_status == load_on_mains", true),
    ] {
        assert_eq!(parse::condition(device.profile(), text).unwrap().holds(&device), holds, "{text}");
    }
}

#[test]
fn a_command_is_judged_by_its_verdict() {
    let order = |lines: &str| checks(&play(&format!("[[steps]]\nat = \"1s\"\n{lines}\n")));
    assert_eq!(order("command = \"stop\""), ["1.1 held of the command stop that it is done"]);
    assert_eq!(order("command = \"gcb\"\nverdict = \"no_effect\"").len(), 1);
    let failed = order("command = \"stop\"\nverdict = \"refused\"");
    assert_eq!(failed, ["1.1 failed of the command stop the verdict refused"]);
}

#[test]
fn the_same_file_gives_the_same_report_however_time_is_let_pass() {
    let text = r#"
        [[steps]]
        at = "1s"
        command = "test"
        [[steps]]
        when = "state.engine == loaded"
        expect = "genset.power.active > 1 within 20s"
    "#;
    let scenario = parse(text).unwrap();
    let report = scenario.play().unwrap();
    let mut device = Device::new(&scenario.config()).unwrap();
    for step in 1..40 {
        device.advance(STEP * 37 * step);
    }
    assert_eq!(device.report(), Some(&report));
}

#[test]
fn a_scenario_belongs_to_its_controller() {
    let scenario = parse("[[steps]]\nat = \"1s\"\nmains = \"failed\"\n").unwrap();
    let config = Config { profile: "smartgen-hat821si".to_owned(), ..scenario.config() };
    assert_eq!(
        Device::new(&config).unwrap_err().to_string(),
        "a.toml:3:14: this scenario is for datakom-d, not for smartgen-hat821si; imitate datakom-d, or choose another one"
    );
}

#[test]
fn no_lever_is_called_like_a_key_of_a_step() {
    for profile in busbar_profile::builtins() {
        let device = Device::new(&Config { profile: profile.key.clone(), ..Config::default() }).unwrap();
        for lever in device.levers() {
            assert!(!step::KEYS.contains(&lever.id), "{}: {}", profile.key, lever.id);
        }
    }
}

/// Line for line as people write it who have read no list of words.
#[test]
fn a_step_is_written_as_a_person_tells_it() {
    let report = play(
        "[[steps]]\nat = \"10s\"\nmains = \"fails\"\nexpect = \"mains.failed within 12s\"\n\
         [[steps]]\nwhen = \"state.engine == cranking\"\ninject = \"coolant_temperature_high\"\n\
         expect = \"shutdown_alarms.high_engine_temperature within 1s\"\n\
         [[steps]]\nafter = \"5s\"\nmains = \"returns\"\n",
    );
    assert_eq!(report.held, Some(true), "{report:#?}");
    let actions = report.events.iter().filter(|event| event.kind == EventKind::Action);
    assert_eq!(
        actions.map(|event| event.text.as_str()).collect::<Vec<_>>(),
        ["mains = failed", "inject coolant_temperature_high", "mains = normal"]
    );
}

#[test]
fn a_file_full_of_mistakes_is_judged_at_once() {
    let many = |one: &str, count: usize| one.repeat(count);
    for steps in [
        many("[[steps]]\nat = \"1s\"\nmains = \"gone\"\n", 500),
        format!("[[steps]]\nat = \"1s\"\nexpect = [{}]", many("\"nope\", ", 50_000)),
        format!("[[steps]]\nat = \"1s\"\ninject = [{}]", many("\"nope\", ", 50_000)),
        (0..5_000).fold("[[steps]]\nat = \"1s\"\n".to_owned(), |text, key| text + &format!("k{key} = 1\n")),
    ] {
        let findings = parse(&steps).map(|_| ()).unwrap_err();
        assert!((100..=102).contains(&findings.iter().count()), "{}", findings.iter().count());
    }
}

/// Steps with a mistake each, and the finding: line within the steps, column, message and remedy.
#[test]
fn mistakes_are_found_with_their_place_and_remedy() {
    for (steps, expected) in [
        ("[[steps]]\nat = \"1s\"\nmains = \"gone\"", "6:9: `mains` cannot be `gone`; choose normal, failed"),
        (
            "[[steps]]\nat = \"1s\"\nmians = \"failed\"",
            "6:1: the plant of datakom-d has no `mians`; did you mean `mains`?",
        ),
        (
            "[[steps]]\nat = \"1s\"\nwarp.drive = \"on\"",
            "6:6: the plant of datakom-d has no `warp.drive`; it has mains",
        ),
        (
            "[[steps]]\nat = \"1s\"\nmains = true",
            "6:9: `mains` has the wrong type (boolean); write a text in quotes, or a number",
        ),
        (
            "[[steps]]\nat = \"1s\"\nlow_fuel_level = 1",
            "6:1: the plant of datakom-d has no `low_fuel_level`; it is an alarm: write inject = \"low_fuel_level\"",
        ),
        (
            "[[steps]]\nat = \"1s\"\nfuel_level = 1",
            "6:1: the plant of datakom-d has no `fuel_level`; it is a point: write set = { fuel_level = ... } to hold it at a value",
        ),
        (
            "[[steps]]\nmains = \"failed\"",
            "4:1: this step is never taken; add at = \"10s\", after = \"5s\", or when = \"state.engine == loaded\"",
        ),
        (
            "[[steps]]\nat = \"1s\"\nafter = \"1s\"\nmains = \"failed\"",
            "6:1: `at` and `after` in one step; leave one of them, or make two steps of it",
        ),
        (
            "[[steps]]\nat = \"1s\"",
            "4:1: nothing happens in this step; add what happens, such as mains = \"failed\", or `expect`",
        ),
        (
            "[[steps]]\nat = \"1s\"\nwithin = \"2s\"\nmains = \"failed\"",
            "6:1: `within` beside `at`; leave it out: only `when` is waited for",
        ),
        (
            "[[steps]]\nat = \"1\"\nmains = \"failed\"",
            "5:6: `1` is no duration; write a number and ms, s, min or h, such as \"500ms\" or \"10s\"",
        ),
        (
            "[[steps]]\nat = \"2h\"\nmains = \"failed\"",
            "5:6: this comes at 2h or later, the scenario lasts 1h; bring it forward, or give the scenario more time with `lasts`",
        ),
        (
            "[[steps]]\nat = \"59min\"\nmains = \"failed\"\n[[steps]]\nwhen = \"engine.running\"\nwithin = \"5min\"",
            "9:10: this comes at 64min or later, the scenario lasts 1h",
        ),
        (
            "[[steps]]\nat = \"1s\"\nnote = \"\"",
            "6:8: this is no note; write 1 to 500 characters on one line",
        ),
        (
            "[[steps]]\nat = \"1s\"\nnote = \"\\u001b[2J\"",
            "6:8: this is no note; write 1 to 500 characters on one line",
        ),
        (
            "[[steps]]\nat = \"1s\"\nmains = \"\\u001b[2J\\u202Egone\"",
            "6:9: `mains` cannot be `\\u{1b}[2J\\u{202e}gone`; choose normal",
        ),
        (
            "[[steps]]\nat = \"1s\"\nload = 99999999999999999999",
            "6:8: `load` is 99999999999999999999; write a smaller number",
        ),
        (
            "[[steps]]\nat = \"1s\"\nmains = \"failed\"\nmains = \"normal\"",
            "7:1: this is not TOML: duplicate key; leave one of them; what happens twice takes two steps",
        ),
        (
            "[[steps]]\nat = \"1s\"\nexpect = \"5 < fuel.level\"",
            "6:11: `5` stands where a name is expected; write the name first, such as `fuel.level > 5`",
        ),
        (
            "[[steps]]\nat = \"1s\"\nexpect = \"genset.power.active > 10 kW within 5s\"",
            "6:36: `kW` is one too many; leave a unit out, `genset.power.active` is in kW",
        ),
        (
            "[[steps]]\nat = \"1s\"\nexpect = \"engine.running within 0s\"",
            "6:33: `within` is 0s; give it 100ms or more, or leave it out",
        ),
        (
            "[[steps]]\nat = \"5s\"\nmains = \"failed\"\n[[steps]]\nat = \"4s\"\nmains = \"normal\"",
            "8:6: this step comes at 4s, those before it not before 5s; steps are taken in the order of the file: move it up, \
             or correct the time",
        ),
        (
            "[[steps]]\nat = \"1s\"\nexpect = \"state.engine == loadd\"",
            "6:27: `state.engine` is never `loadd`; did you mean `loaded`?",
        ),
        (
            "[[steps]]\nat = \"1s\"\nexpect = \"state.engine\"",
            "6:11: `state.engine` is a word and stands alone; compare it, such as `state.engine == stopped`",
        ),
        (
            "[[steps]]\nat = \"1s\"\nexpect = \"state.engine < loaded\"",
            "6:24: `state.engine` is a word, which has no order; write == or !=",
        ),
        (
            "[[steps]]\nat = \"1s\"\nexpect = \"engine.running == 1\"",
            "6:29: `engine.running` is a flag, which is compared with nothing; write `engine.running`, or `not engine.running`",
        ),
        (
            "[[steps]]\nat = \"1s\"\nexpect = \"fuel.level > low\"",
            "6:24: `fuel.level` is a number, `low` is none; write a number in %, without the unit",
        ),
        (
            "[[steps]]\nat = \"1s\"\nexpect = \"fuel.level > 5%\"",
            "6:25: `%` is one too many; leave a unit out, `fuel.level` is in %; join conditions with `and` or `or`",
        ),
        (
            "[[steps]]\nat = \"1s\"\nexpect = \"fuel.level = 5\"",
            "6:22: `=` compares nothing; write ==, !=, <, <=, > or >=; conditions are joined with `and` and `or`",
        ),
        (
            "[[steps]]\nat = \"1s\"\nexpect = \"engine.running && mode == auto\"",
            "6:26: `&&` compares nothing; write ==, !=, <, <=, > or >=; conditions are joined with `and` and `or`",
        ),
        (
            "[[steps]]\nat = \"1s\"\nexpect = \"breaker.gen.closed within 5s\"",
            "6:11: the controller has no `breaker.gen.closed`; did you mean `breaker.genset.closed`?",
        ),
        (
            "[[steps]]\nat = \"1s\"\nexpect = \"engine.running within soon\"",
            "6:33: `soon` is no duration; write a number and ms, s, min or h without a blank, such as 10s",
        ),
        (
            "[[steps]]\nat = \"1s\"\nexpect = \"engine.running within 2h\"",
            "6:10: this comes at 7201s or later, the scenario lasts 1h; bring it forward, or give the scenario more time with `lasts`",
        ),
        (
            "[[steps]]\nat = \"1s\"\nexpect = \"(engine.running or mode == off\"",
            "6:41: the condition ends too early; add the closing parenthesis",
        ),
        (
            "[[steps]]\nat = \"1s\"\nexpect = \"engine.running and\"",
            "6:29: the condition ends too early; add what is compared, such as `state.engine == loaded`",
        ),
        (
            "[[steps]]\nat = \"1s\"\nexpect = \"\"",
            "6:11: the condition ends too early; add what is compared, such as `state.engine == loaded`",
        ),
        (
            "[[steps]]\nwhen = \"engine.running within 5s\"\nmains = \"failed\"",
            "5:24: `within` belongs to expectations; write `within = \"30s\"` as a key of the step, or the condition as `expect`",
        ),
        (
            "[[steps]]\nat = \"1s\"\ninject = \"coolant_temperature_hgh\"",
            "6:10: the controller has no alarm `coolant_temperature_hgh`; did you mean coolant_temperature_high?",
        ),
        (
            "[[steps]]\nat = \"1s\"\nset = { fuel_levl = 5 }",
            "6:9: the controller has no point `fuel_levl`; did you mean `fuel_level`?",
        ),
        (
            "[[steps]]\nat = \"1s\"\nset = { fuel_level = \"full\" }",
            "6:22: `fuel_level` cannot be `full`; choose a number from 0 to 6553.5 %",
        ),
        (
            "[[steps]]\nat = \"1s\"\nunset = \"fuel\"",
            "6:9: the controller has no point `fuel`; `busbar profile show datakom-d` lists them",
        ),
        (
            "[[steps]]\nat = \"1s\"\ncommand = \"tset\"",
            "6:11: the controller has no command `tset`; did you mean `test`?",
        ),
        (
            "[[steps]]\nat = \"1s\"\ncommand = \"channel\"\nargs = { channel = 20 }",
            "7:8: `channel` cannot be `20`; write a number from 0 to 19",
        ),
        (
            "[[steps]]\nat = \"1s\"\nargs = { channel = 2 }\nmains = \"failed\"",
            "6:1: `args` without a command; add the command, or leave it out",
        ),
        (
            "[[steps]]\nat = \"1s\"\ncommand = \"test\"\nverdict = \"good\"",
            "7:11: there is no verdict `good`; write one of: done, refused, no_effect, unknown",
        ),
        (
            "[[steps]]\nat = \"1s\"\nsettings = { warp = 9 }",
            "6:14: the controller has no setting `warp`; docs/imitation/datakom-d.md lists them",
        ),
        (
            "[steps]\nat = \"1s\"",
            "4:1: `steps` has the wrong type (table); write a list of tables, each headed [[steps]]",
        ),
        (
            "",
            "1:2: this scenario has no steps; add [[steps]] with at = \"10s\" and what happens then, such as mains = \"failed\"",
        ),
        ("[[steps]]\nat = 10s", "5:6: this is not TOML"),
    ] {
        let findings = parse(steps).map(|_| ()).unwrap_err().to_string();
        assert!(
            findings.starts_with(&format!("a.toml:{expected}")),
            "{steps}\n  found  {findings}\n  wanted a.toml:{expected}"
        );
    }
}

#[test]
fn heads_are_checked_too() {
    for (head, expected) in [
        ("", "1:1: there is no [scenario]; begin the file with"),
        (
            "[scenario]\ncontroller = \"datakom-d\"",
            "1:2: `title` is missing in [scenario]; add `title = \"Mains failure\"`",
        ),
        (
            "[scenario]\ntitle = \"x\"",
            "1:2: `controller` is missing in [scenario]; add `controller = \"datakom-d\"`",
        ),
        (
            "[scenario]\ntitle = \"x\"\ncontroller = \"datakom\"",
            "3:14: there is no controller `datakom`; did you mean `datakom-d`?",
        ),
        (
            "[scenario]\ntitle = \"x\"\ncontroller = \"datakom-d\"\nmodel = \"D-900\"",
            "4:9: `D-900` is not a model of this controller; its models are D-300",
        ),
        (
            "[scenario]\ntitle = \"x\"\ncontroller = \"datakom-d\"\nseed = -1",
            "4:8: `seed` is -1; write a whole number from 0 to 18446744073709551615",
        ),
        ("[scenario]\ntitle = \"x\"\ncontroller = \"datakom-d\"\nlasts = \"1y\"", "4:9: `1y` is no duration"),
        (
            "[scenario]\ntitle = \"x\"\ncontroller = \"datakom-d\"\nclock = \"noon\"",
            "4:9: `noon` is no date with a time; write a local time",
        ),
        (
            "[scenario]\ntitle = \"\"\ncontroller = \"datakom-d\"",
            "2:9: this is no title; write 1 to 100 characters on one line",
        ),
        ("[scenario]\ntitel = \"x\"\ncontroller = \"datakom-d\"", "1:2: `title` is missing"),
        ("[secnario]\n", "1:1: there is no [scenario]"),
    ] {
        let findings = Scenario::parse("a.toml", head).map(|_| ()).unwrap_err().to_string();
        assert!(
            findings.contains(&format!("a.toml:{expected}")),
            "{head}\n  found  {findings}\n  wanted a.toml:{expected}"
        );
    }
}

/// Pieces that a condition may be made of, right or wrong.
const PIECES: [&str; 24] = [
    "state.engine",
    "mode",
    "fuel.level",
    "engine.running",
    "warning_alarms",
    "==",
    "!=",
    "<",
    ">=",
    "=",
    "loaded",
    "auto",
    "12.5",
    "-1",
    "not",
    "and",
    "or",
    "(",
    ")",
    "within",
    "for",
    "10s",
    "99999999999h",
    "é\u{202E}",
];

proptest::proptest! {
    #[test]
    fn any_condition_is_read_or_refused_at_a_place_in_it(picks in proptest::collection::vec(0..PIECES.len(), 0..12)) {
        let text = picks.iter().map(|pick| PIECES[*pick]).collect::<Vec<_>>().join(" ");
        let profile = busbar_profile::builtin("datakom-d").unwrap();
        if let Err(mistake) = parse::wish(profile, &text) {
            proptest::prop_assert!(text.get(mistake.span).is_some() && !mistake.help.is_empty());
        }
    }

    #[test]
    fn any_file_is_read_or_refused(at in 0_usize..400, length in 0_usize..30, with in "[ -~\n]{0,12}") {
        let text = format!(
            "{HEAD}[[steps]]\nat = \"1s\"\nmains = \"failed\"\ninject = [\"over_load\"]\nset = {{ fuel_level = 3 }}\n\
             expect = [\"engine.running within 5s\"]\n[[steps]]\nwhen = \"(mode == auto) or engine.running\"\n\
             within = \"3s\"\ncommand = \"channel\"\nargs = {{ channel = 2 }}\nverdict = \"done\"\n"
        );
        let mut changed = text.clone();
        changed.replace_range(at.min(text.len())..(at + length).min(text.len()), &with);
        let _ = Scenario::parse("a.toml", &changed);
    }
}
