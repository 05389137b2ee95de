use model::{Axis, Channel};
use nalgebra::Vector3;

use crate::{
    Error, Result,
    read::Warnings,
    text::{Lines, Names, finite, name, quote},
};

/// A `ROOT` or `JOINT`, in file units.
#[derive(Debug)]
pub(super) struct RawJoint {
    pub(super) line: usize,
    pub(super) name: String,
    pub(super) parent: Option<usize>,
    pub(super) offset: Vector3<f64>,
    pub(super) tip: Option<Vector3<f64>>,
    pub(super) channels: Vec<Channel>,
}

/// What a brace belongs to.
enum Scope {
    Joint(usize),
    EndSite(usize),
}

/// Words and braces, with the line of the word read last.
struct Tokens<'a, 'l> {
    lines: &'l mut Lines<'a>,
    rest: &'a [u8],
}

impl<'a> Iterator for Tokens<'a, '_> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        while self.rest.is_empty() {
            self.rest = self.lines.next()?.text;
        }
        let ends = |b: &u8| b.is_ascii_whitespace() || matches!(b, b'{' | b'}');
        let length = self.rest.iter().position(ends).unwrap_or(self.rest.len()).max(1);
        let (token, rest) = self.rest.split_at(length);
        self.rest = rest.trim_ascii_start();
        Some(token)
    }
}

impl<'a> Tokens<'a, '_> {
    fn expect(&mut self, expected: &str) -> Result<&'a [u8]> {
        self.next().ok_or_else(|| Error::at_line(self.lines.number(), "the end of the file", expected))
    }

    fn unexpected(&self, token: &[u8], expected: &str) -> Error {
        Error::at_line(self.lines.number(), quote(token), expected)
    }

    fn number(&mut self) -> Result<f64> {
        let token = self.expect("a finite number")?;
        finite(token).ok_or_else(|| self.unexpected(token, "a finite number"))
    }

    fn vector(&mut self) -> Result<Vector3<f64>> {
        Ok(Vector3::new(self.number()?, self.number()?, self.number()?))
    }

    /// What stands before the next `{`: a name, which may have blanks.
    fn until_brace(&mut self) -> Result<String> {
        let mut found = String::new();
        loop {
            match self.expect("{")? {
                b"{" => return Ok(found),
                b"}" => return Err(self.unexpected(b"}", "{")),
                token if found.len() + token.len() > 1000 => {
                    return Err(self.unexpected(token, "a name of at most 1000 bytes"));
                }
                token => {
                    if !found.is_empty() {
                        found.push(' ');
                    }
                    found.push_str(&name(token));
                }
            }
        }
    }
}

/// Reads from the beginning up to and including the line `MOTION`; joints come parents first.
pub(super) fn read(lines: &mut Lines<'_>, warnings: &mut Warnings) -> Result<Vec<RawJoint>> {
    let mut tokens = Tokens { lines, rest: b"" };
    let first = tokens.expect("HIERARCHY")?;
    if !first.eq_ignore_ascii_case(b"HIERARCHY") {
        return Err(tokens.unexpected(first, "HIERARCHY"));
    }
    let mut joints = Vec::<RawJoint>::new();
    let mut names = Names::default();
    let mut open = Vec::<Scope>::new();
    loop {
        let token = tokens.expect("the rest of the hierarchy")?;
        match (token.to_ascii_uppercase().as_slice(), open.last()) {
            (b"ROOT", None) if joints.is_empty() => {
                open.push(Scope::Joint(0));
                joints.push(joint(&mut tokens, None, &mut names, warnings)?);
            }
            (b"JOINT", Some(Scope::Joint(parent))) => {
                let parent = *parent;
                open.push(Scope::Joint(joints.len()));
                joints.push(joint(&mut tokens, Some(parent), &mut names, warnings)?);
            }
            (b"END", Some(Scope::Joint(parent))) => {
                let parent = *parent;
                tokens.until_brace()?;
                open.push(Scope::EndSite(parent));
            }
            (b"OFFSET", Some(Scope::Joint(index))) => joints[*index].offset = tokens.vector()?,
            (b"OFFSET", Some(Scope::EndSite(index))) => {
                let tip = tokens.vector()?;
                let joint = &mut joints[*index];
                if joint.tip.replace(tip).is_some() {
                    let message = format!("joint {} has several end sites; the last is its tip", joint.name);
                    warnings.line(tokens.lines.number(), message);
                }
            }
            (b"CHANNELS", Some(Scope::Joint(index))) => joints[*index].channels = channels(&mut tokens)?,
            (b"}", Some(_)) => {
                open.pop();
            }
            (b"MOTION", None) if !joints.is_empty() => return Ok(joints),
            (_, scope) => {
                let expected = match scope {
                    None if joints.is_empty() => "ROOT",
                    None => "MOTION",
                    Some(Scope::Joint(_)) => "OFFSET, CHANNELS, JOINT, End Site or }",
                    Some(Scope::EndSite(_)) => "OFFSET or }",
                };
                return Err(tokens.unexpected(token, expected));
            }
        }
    }
}

fn joint(
    tokens: &mut Tokens<'_, '_>,
    parent: Option<usize>,
    names: &mut Names,
    warnings: &mut Warnings,
) -> Result<RawJoint> {
    let line = tokens.lines.number();
    let given = tokens.until_brace()?;
    if given.is_empty() {
        return Err(tokens.unexpected(b"{", "the name of a joint"));
    }
    let name = names.unique(&given);
    if name != given {
        warnings.line(line, format!("two joints are named {given}; the second was renamed {name}"));
    }
    Ok(RawJoint { line, name, parent, offset: Vector3::zeros(), tip: None, channels: Vec::new() })
}

fn channels(tokens: &mut Tokens<'_, '_>) -> Result<Vec<Channel>> {
    let expected = "a number of channels from 0 to 6";
    let count = tokens.expect(expected)?;
    let number = std::str::from_utf8(count).ok().and_then(|c| c.parse().ok()).filter(|n: &usize| *n <= 6);
    let number = number.ok_or_else(|| tokens.unexpected(count, expected))?;
    let mut channels = Vec::with_capacity(number);
    for _ in 0..number {
        let expected = "a channel: Xposition … Zposition, Xrotation … Zrotation, each once";
        let word = tokens.expect(expected)?;
        let channel = channel(word).filter(|c| !channels.contains(c));
        channels.push(channel.ok_or_else(|| tokens.unexpected(word, expected))?);
    }
    Ok(channels)
}

fn channel(word: &[u8]) -> Option<Channel> {
    let (first, rest) = word.split_first()?;
    let axis = match first.to_ascii_uppercase() {
        b'X' => Axis::X,
        b'Y' => Axis::Y,
        b'Z' => Axis::Z,
        _ => return None,
    };
    match rest.to_ascii_lowercase().as_slice() {
        b"position" => Some(Channel::translation(axis)),
        b"rotation" => Some(Channel::rotation(axis)),
        _ => None,
    }
}
