//! Which profile a KEY means: one that is compiled in, or a file.

use std::{
    fs::File,
    io::{self, ErrorKind, Read},
    ops::Deref,
    path::Path,
};

use busbar_profile::{Command, Findings, Point, Profile, builtin, builtins};

use crate::{
    excerpt::{Excerpt, Excerpts},
    failure::Failure,
};

/// More commands than this are not listed in a sentence.
const MOST_LISTED: usize = 24;

/// More bytes than this are no profile or site file.
const LARGEST: u64 = 16 << 20;

/// A profile, wherever it came from.
#[derive(Debug)]
pub(crate) enum Resolved {
    Builtin(&'static Profile),
    File(Box<Profile>),
}

impl Deref for Resolved {
    type Target = Profile;

    fn deref(&self) -> &Profile {
        match self {
            Self::Builtin(profile) => profile,
            Self::File(profile) => profile,
        }
    }
}

/// The profile that KEY names: a path when it holds a slash or ends in `.toml`, else a built-in one.
pub(crate) fn resolve(key: &str) -> Result<Resolved, Failure> {
    if key.contains('/') || key.ends_with(".toml") {
        return load(Path::new(key)).map(|profile| Resolved::File(Box::new(profile)));
    }
    builtin(key).map(Resolved::Builtin).ok_or_else(|| {
        let keys: Vec<&str> = builtins().iter().map(|profile| profile.key.as_str()).collect();
        Failure::Call(format!(
            "there is no profile \"{key}\"; the built-in ones are {}, and a profile of your own is given as a path (./{key}.toml)",
            keys.join(", ")
        ))
    })
}

/// The model that the identity point's registers name, where `registers` has them.
pub(crate) fn model<'a, 'r>(
    profile: &'a Profile,
    registers: impl FnOnce(&Point) -> Option<&'r [u16]>,
) -> Option<&'a str> {
    let identity = profile.points.get(profile.identity.as_ref()?.point)?;
    let code = identity.raw_code(registers(identity)?, profile.wire.word_order)?;
    profile.model(u16::try_from(code).ok()?)
}

/// The readable points of these ids as indexes in address order; KEY as the caller wrote it.
pub(crate) fn points(profile: &Profile, ids: &[String], key: &str) -> Result<Vec<usize>, Failure> {
    let mut indexes = ids.iter().map(|id| readable(profile, id, key)).collect::<Result<Vec<_>, _>>()?;
    indexes.sort_unstable();
    indexes.dedup();
    Ok(indexes)
}

fn readable(profile: &Profile, id: &str, key: &str) -> Result<usize, Failure> {
    let Some((index, point)) =
        profile.point_index(id).and_then(|index| Some((index, profile.points.get(index)?)))
    else {
        let like: Vec<&str> = profile
            .points
            .iter()
            .filter(|point| !id.is_empty() && point.id.contains(id))
            .map(|point| point.id.as_str())
            .take(3)
            .collect();
        let remedy = match like.as_slice() {
            [] => format!("\"busbar profile show {key}\" lists them"),
            like => format!("did you mean {}?", like.join(", ")),
        };
        return Err(Failure::Call(format!("{} has no point \"{id}\"; {remedy}", profile.key)));
    };
    if !point.access.is_readable() {
        return Err(Failure::Call(format!(
            "{id} of {} can be written and not read; leave it out",
            profile.key
        )));
    }
    Ok(index)
}

/// The command of that id; KEY as the caller wrote it.
pub(crate) fn command<'p>(profile: &'p Profile, id: &str, key: &str) -> Result<&'p Command, Failure> {
    if let Some(command) = profile.command(id) {
        return Ok(command);
    }
    let ids: Vec<&str> = profile.commands.iter().map(|command| command.id.as_str()).collect();
    let like: Vec<&str> =
        ids.iter().copied().filter(|other| !id.is_empty() && resembles(id, other)).take(3).collect();
    let meant = match like.as_slice() {
        [] => String::new(),
        like => format!("did you mean {}? ", like.join(", ")),
    };
    let known = match ids.len() {
        0 => "it has none".to_owned(),
        1..=MOST_LISTED => format!("it has {}", ids.join(", ")),
        _ => format!("\"busbar profile show {key}\" lists them"),
    };
    Err(Failure::Call(format!("{} has no command \"{id}\"; {meant}{known}", profile.key)))
}

/// Whether one is a part of the other, or they differ by a letter that is wrong, missing or too many.
fn resembles(word: &str, other: &str) -> bool {
    if word.contains(other) || other.contains(word) {
        return true;
    }
    let same = |a: &mut dyn Iterator<Item = char>, b: &mut dyn Iterator<Item = char>| {
        a.zip(b).take_while(|(a, b)| a == b).count()
    };
    let (a, b) = (word.chars().count(), other.chars().count());
    let start = same(&mut word.chars(), &mut other.chars());
    let end = same(&mut word.chars().rev(), &mut other.chars().rev());
    a.abs_diff(b) <= 1 && start + end + 1 >= a.max(b)
}

/// Reads and checks a profile file.
pub(crate) fn load(path: &Path) -> Result<Profile, Failure> {
    let text = read(path, "profile file")?;
    let name = path.display().to_string();
    match Profile::parse(&name, &text) {
        Ok(profile) => Ok(profile),
        Err(findings) => Err(Failure::Findings(Box::new(excerpts(&name, text, &findings)))),
    }
}

/// The text of a file that the caller named.
pub(crate) fn read(path: &Path, what: &str) -> Result<String, Failure> {
    let file = path.display();
    let mut bytes = Vec::new();
    let read = File::open(path).and_then(|file| file.take(LARGEST + 1).read_to_end(&mut bytes));
    if let Err(error) = read {
        return Err(Failure::Failed(format!("{what} {file} cannot be read: {}", reason(&error))));
    }
    if bytes.len() as u64 > LARGEST {
        return Err(Failure::Failed(format!(
            "{what} {file} is larger than {} MiB, which none needs; check that it is the right file",
            LARGEST >> 20
        )));
    }
    String::from_utf8(bytes).map_err(|error| {
        let valid = error.utf8_error().valid_up_to();
        let line = 1 + error.as_bytes().iter().take(valid).filter(|byte| **byte == b'\n').count();
        Failure::Failed(format!(
            "{what} {file} is not UTF-8 text: line {line} has other bytes; save it as UTF-8"
        ))
    })
}

/// Why a file cannot be read, and what to do.
fn reason(error: &io::Error) -> String {
    match error.kind() {
        ErrorKind::NotFound => "there is no such file; check the path".to_owned(),
        ErrorKind::PermissionDenied => {
            "this user may not read it; give the right, or start as another user".to_owned()
        }
        ErrorKind::IsADirectory => "it is a folder; name the file in it".to_owned(),
        _ => format!("{error}; check the path"),
    }
}

pub(crate) fn excerpts(file: &str, text: String, findings: &Findings) -> Excerpts {
    let excerpts = findings
        .iter()
        .map(|finding| Excerpt {
            sentence: format!("{}:{}:{}: {}", finding.file, finding.line, finding.column, finding.message),
            help: finding.help.clone(),
            offset: finding.offset,
            length: finding.length,
        })
        .collect();
    Excerpts::new(file, text, excerpts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_cannot_be_read_says_why() {
        for (kind, expected) in [
            (ErrorKind::NotFound, "there is no such file; check the path"),
            (
                ErrorKind::PermissionDenied,
                "this user may not read it; give the right, or start as another user",
            ),
            (ErrorKind::IsADirectory, "it is a folder; name the file in it"),
            (ErrorKind::TimedOut, "timed out; check the path"),
        ] {
            assert_eq!(reason(&kind.into()), expected);
        }
    }
}
