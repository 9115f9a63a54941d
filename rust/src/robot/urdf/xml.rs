//! The elements of a URDF that are read, out of its XML: no other element is looked into, so that nothing in it refuses a file.

use std::borrow::Cow;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use crate::error::{Error, Result};

/// Larger files are refused \[bytes\].
const LARGEST: u64 = 1 << 30;

/// Letters of a wrong text in a message.
const SHOWN: usize = 60;

/// What is read of each element; the rest is skipped. As no element is under itself, a tree of them is at most five deep.
const READ: [(&str, &[&str]); 6] = [
    ("", &["robot"]),
    ("robot", &["link", "joint"]),
    ("joint", &["parent", "child", "origin", "axis", "limit", "mimic"]),
    ("link", &["collision"]),
    ("collision", &["origin", "geometry"]),
    ("geometry", &["box", "cylinder", "capsule", "sphere", "mesh"]),
];

/// An element, its line counted from 1, and those in it that are read.
#[derive(Debug)]
pub(crate) struct Element {
    pub name: String,
    pub line: usize,
    attributes: Vec<(String, String)>,
    pub children: Vec<Element>,
}

impl Element {
    /// The first element of a name in this one.
    pub fn child(&self, name: &str) -> Option<&Self> {
        self.children.iter().find(|child| child.name == name)
    }

    /// An attribute without blanks around it.
    pub fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(key, _)| key == name).map(|(_, value)| value.trim())
    }
}

/// The bytes of a file.
pub(crate) fn read_bytes(path: &Path) -> Result<Vec<u8>> {
    let failed = |why: String| Error::Model(format!("{}: {why}", path.display()));
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(|e| failed(e.to_string()))?;
    file.take(LARGEST + 1).read_to_end(&mut bytes).map_err(|e| failed(e.to_string()))?;
    if bytes.len() as u64 > LARGEST { Err(failed(format!("larger than {LARGEST} bytes"))) } else { Ok(bytes) }
}

/// The text of a file: UTF-8, UTF-16 with a byte order mark, or Latin-1, which every other file can be taken for.
pub(crate) fn decoded(bytes: &[u8]) -> Cow<'_, str> {
    let utf16 = |number: fn([u8; 2]) -> u16| {
        let units = bytes[2..].chunks_exact(2).map(|pair| number([pair[0], pair[1]]));
        char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)).collect()
    };
    match bytes {
        [0xff, 0xfe, ..] => Cow::Owned(utf16(u16::from_le_bytes)),
        [0xfe, 0xff, ..] => Cow::Owned(utf16(u16::from_be_bytes)),
        _ => std::str::from_utf8(bytes).map_or_else(|_| Cow::Owned(bytes.iter().map(|b| char::from(*b)).collect()), Cow::Borrowed),
    }
}

/// An error at a line.
pub(crate) fn fault(source: &str, line: usize, why: impl std::fmt::Display) -> Error {
    Error::Model(format!("{source}:{line}: {why}"))
}

/// A text between quotes, the beginning of it if it is long.
pub(crate) fn shown(text: &str) -> String {
    let first: String = text.chars().take(SHOWN).collect();
    if first.len() < text.len() { format!("{first:?}...") } else { format!("{text:?}") }
}

/// The root of a document. Once through the text, without recursion; entities are not expanded.
pub(crate) fn parse(source: &str, text: &str) -> Result<Element> {
    let text = text.trim_start_matches('\u{feff}');
    let mut reader = Reader::from_str(text);
    reader.config_mut().expand_empty_elements = true;
    let mut lines = Lines { text: text.as_bytes(), at: 0, line: 1 };
    let (mut root, mut open): (Option<Element>, Vec<Element>) = (None, Vec::new());
    // The element that is skipped: how many are open in it, its name and line.
    let mut skipped: Option<(usize, String, usize)> = None;
    loop {
        let start = reader.buffer_position() as usize;
        let event = match reader.read_event() {
            Ok(event) => event,
            Err(e) => return Err(fault(source, lines.of(reader.error_position() as usize), format!("not well-formed XML: {e}"))),
        };
        match event {
            Event::Start(tag) => match &mut skipped {
                Some((depth, ..)) => *depth += 1,
                None => {
                    let line = lines.of(start);
                    let name = tag.name().into_inner().to_owned();
                    let parent = open.last().map_or("", |element| element.name.as_str());
                    if open.is_empty() && root.is_some() {
                        return Err(fault(source, line, format!("a second root element <{name}>, expected the end of the file")));
                    }
                    if name.starts_with("xacro:") {
                        return Err(fault(source, line, format!("<{name}> is a macro, expected a URDF: expand it with xacro first")));
                    }
                    if READ.iter().any(|(above, read)| *above == parent && read.contains(&name.as_str())) {
                        open.push(element(source, name, line, &tag)?);
                    } else if open.is_empty() {
                        return Err(fault(source, line, format!("the root element is <{name}>, expected <robot>: not a URDF")));
                    } else {
                        skipped = Some((0, name, line));
                    }
                }
            },
            Event::End(_) => match &mut skipped {
                Some((0, ..)) => skipped = None,
                Some((depth, ..)) => *depth -= 1,
                None => {
                    let Some(closed) = open.pop() else { continue };
                    match open.last_mut() {
                        Some(parent) => parent.children.push(closed),
                        None => root = Some(closed),
                    }
                }
            },
            Event::Eof => break,
            _ => {}
        }
    }
    let unclosed = skipped.map(|(_, name, line)| (name, line)).or_else(|| open.pop().map(|element| (element.name, element.line)));
    match (unclosed, root) {
        (Some((name, line)), _) => Err(fault(source, line, format!("<{name}> is not closed: not a whole URDF"))),
        (None, Some(root)) => Ok(root),
        (None, None) => Err(fault(source, 1, "no element <robot>: not a URDF")),
    }
}

fn element(source: &str, name: String, line: usize, tag: &BytesStart) -> Result<Element> {
    let malformed = |why: String| fault(source, line, format!("<{name}> is not well-formed XML: {why}"));
    let mut attributes = Vec::new();
    for attribute in tag.attributes() {
        let attribute = attribute.map_err(|e| malformed(e.to_string()))?;
        let value = quick_xml::escape::unescape(&attribute.value).map_err(|e| malformed(e.to_string()))?;
        attributes.push((attribute.key.into_inner().to_owned(), value.into_owned()));
    }
    Ok(Element { name, line, attributes, children: Vec::new() })
}

/// Lines by place, for places that come in order.
struct Lines<'a> {
    text: &'a [u8],
    at: usize,
    line: usize,
}

impl Lines<'_> {
    fn of(&mut self, place: usize) -> usize {
        let place = place.min(self.text.len());
        if place > self.at {
            self.line += self.text[self.at..place].iter().filter(|byte| **byte == b'\n').count();
            self.at = place;
        }
        self.line
    }
}
