//! Checks of the vocabulary file.

use super::{FORMAT, shape};
use crate::file::{At, SignalFile, VocabularyFile};
use crate::findings::{Collector, Findings};
use crate::terms::SignalKind;
use crate::units;
use crate::vocabulary::Signal;

const PRUNES: &[shape::Prune] =
    &[|table, collector| shape::prune::<SignalFile>(table, &["signals"], collector)];

/// Reads and checks a vocabulary.
pub(crate) fn parse(file_name: &str, text: &str) -> Result<Vec<Signal>, Findings> {
    let mut collector = Collector::new(file_name, text);
    let Some(file) = shape::read::<VocabularyFile>(text, PRUNES, &mut collector) else {
        return Err(collector.into_findings());
    };
    if *file.format != FORMAT {
        collector.add(
            file.format.span.clone(),
            format!("format {} is not known to this version", *file.format),
            format!("write format = {FORMAT}"),
        );
    }
    let mut signals: Vec<Signal> = Vec::with_capacity(file.signals.len());
    for signal in &file.signals {
        if signals.iter().any(|other| other.id == *signal.id) {
            collector.add(
                signal.id.span.clone(),
                format!("the signal `{}` is there twice", *signal.id),
                "keep one of the two",
            );
        }
        check(signal, &mut collector);
        signals.push(Signal {
            id: signal.id.clone(),
            kind: signal.kind,
            unit: signal.unit.as_deref().cloned(),
            words: signal.words.clone(),
            meaning: signal.meaning.clone(),
        });
    }
    if collector.is_empty() { Ok(signals) } else { Err(collector.into_findings()) }
}

fn check(signal: &At<SignalFile>, collector: &mut Collector<'_>) {
    let is_part = |part: &str| {
        !part.is_empty() && part.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'_')
    };
    if !signal.id.split('.').all(is_part) {
        collector.add(
            signal.id.span.clone(),
            format!("`{}` is not a signal", *signal.id),
            "write lower-case parts joined by dots, such as genset.l1.voltage",
        );
    }
    if signal.meaning.trim().is_empty() {
        collector.add(signal.span.clone(), "the meaning is empty", "write what the signal means");
    }
    if let Some(unit) = &signal.unit {
        if signal.kind != SignalKind::Number {
            collector.add(
                unit.span.clone(),
                format!("a unit means nothing for a signal of kind {}", signal.kind),
                "remove it",
            );
        }
        if !units::is_known(unit) {
            let names: Vec<_> = units::names().collect();
            collector.add(
                unit.span.clone(),
                format!("the unit `{}` is not known", **unit),
                format!("write one of: {}", names.join(", ")),
            );
        }
    }
    match (signal.kind, signal.words.is_empty()) {
        (SignalKind::Words, true) => {
            collector.add(signal.span.clone(), "a signal of kind words has no words", "list its words");
        }
        (SignalKind::Number | SignalKind::Flag | SignalKind::Clock, false) => collector.add(
            signal.span.clone(),
            format!("words mean nothing for a signal of kind {}", signal.kind),
            "remove them, or write kind = \"words\"",
        ),
        _ => {}
    }
    if signal.words.iter().enumerate().any(|(i, word)| signal.words[..i].contains(word)) {
        collector.add(signal.span.clone(), "a word is there twice", "keep one of the two");
    }
}
