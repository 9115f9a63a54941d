//! A URDF as a tree of links and joints. Whatever is wrong with the tree is told by name; what a joint says is read when it is asked for.

use std::collections::HashMap;

use super::names::{instead, listed};
use super::xml::{Element, fault, parse};
use crate::error::{Error, Result};

/// Links and joints by number.
pub(crate) struct Document {
    /// What errors call the file.
    pub source: String,
    /// Name of the robot.
    pub name: String,
    pub links: Vec<Link>,
    pub joints: Vec<JointElement>,
    joint_numbers: HashMap<String, usize>,
    link_numbers: HashMap<String, usize>,
}

/// A link.
pub(crate) struct Link {
    pub name: String,
    pub element: Element,
    /// The joint that carries it; none carries the root.
    pub above: Option<usize>,
    /// The joints that it carries.
    pub below: Vec<usize>,
}

/// A joint.
pub(crate) struct JointElement {
    pub name: String,
    pub element: Element,
    pub parent: usize,
    pub child: usize,
}

impl Document {
    /// Reads the text of a URDF.
    pub fn read(source: &str, text: &str) -> Result<Self> {
        let root = parse(source, text)?;
        let name = root.attribute("name").unwrap_or("robot").to_owned();
        let (links, joints): (Vec<Element>, Vec<Element>) = root.children.into_iter().partition(|element| element.name == "link");
        let (names, link_numbers) = numbered(source, &links)?;
        if links.is_empty() {
            return Err(fault(source, root.line, "a URDF without links"));
        }
        let links = names.into_iter().zip(links).map(|(name, element)| Link { name, element, above: None, below: Vec::new() }).collect();
        let mut document = Self { source: source.into(), name, links, joints: Vec::new(), joint_numbers: HashMap::new(), link_numbers };
        let (names, numbers) = numbered(source, &joints)?;
        document.joint_numbers = numbers;
        for (name, element) in names.into_iter().zip(joints) {
            document.attach(name, element)?;
        }
        document.check_tree()?;
        Ok(document)
    }

    fn attach(&mut self, name: String, element: Element) -> Result<()> {
        let [parent, child] = ["parent", "child"].map(|end| self.end_of(&name, &element, end));
        let (parent, child) = (parent?, child?);
        if let Some(other) = self.links[child].above {
            let (link, other) = (&self.links[child].name, &self.joints[other]);
            let why = format!(
                "link {link:?} is the child of two joints, {:?} (line {}) and {name:?}: a URDF is a tree",
                other.name, other.element.line
            );
            return Err(fault(&self.source, element.line, why));
        }
        let number = self.joints.len();
        self.links[child].above = Some(number);
        self.links[parent].below.push(number);
        self.joints.push(JointElement { name, element, parent, child });
        Ok(())
    }

    fn end_of(&self, joint: &str, element: &Element, end: &str) -> Result<usize> {
        let failed = |why: String| fault(&self.source, element.line, format!("joint {joint:?}: {why}"));
        let named = element.child(end).and_then(|end| end.attribute("link"));
        let link = named.ok_or_else(|| failed(format!("no <{end} link=\"...\"/>")))?;
        self.link_numbers.get(link).copied().ok_or_else(|| {
            failed(format!("its {end} link {link:?} does not exist; expected one of the links{}", instead(link, self.link_names())))
        })
    }

    /// One root, from which a way leads to every link.
    fn check_tree(&self) -> Result<()> {
        let roots = || self.links.iter().filter(|link| link.above.is_none());
        let reached = match roots().next() {
            Some(root) => self.below(self.link_numbers[&root.name]),
            None => vec![false; self.links.len()],
        };
        // Nothing is above a second root, and whatever has no root above it is in a loop or below one.
        let rootless = |start: usize| {
            let mut link = start;
            for _ in 0..self.links.len() {
                link = self.joints[self.links[link].above?].parent;
            }
            Some(link)
        };
        if let Some(inside) = (0..self.links.len()).find(|link| !reached[*link]).and_then(rootless) {
            let mut around = vec![inside];
            let mut link = inside;
            while let Some(joint) = self.links[link].above {
                link = self.joints[joint].parent;
                if link == inside {
                    break;
                }
                around.push(link);
            }
            around.reverse();
            let names = listed(around.iter().map(|link| self.links[*link].name.as_str()));
            return Err(fault(&self.source, self.links[inside].element.line, format!("the joints form a loop through the links {names}")));
        }
        if roots().count() > 1 {
            let names = listed(roots().map(|link| link.name.as_str()));
            let second = roots().nth(1).map_or(0, |link| link.element.line);
            return Err(fault(
                &self.source,
                second,
                format!("several links are no joint's child ({names}): a URDF is a tree with one root"),
            ));
        }
        Ok(())
    }

    /// Which links a link carries, itself among them.
    fn below(&self, link: usize) -> Vec<bool> {
        let mut reached = vec![false; self.links.len()];
        let mut waiting = vec![link];
        while let Some(link) = waiting.pop() {
            if !std::mem::replace(&mut reached[link], true) {
                waiting.extend(self.links[link].below.iter().map(|joint| self.joints[*joint].child));
            }
        }
        reached
    }

    /// Names of the links.
    pub fn link_names(&self) -> impl Iterator<Item = &str> + Clone {
        self.links.iter().map(|link| link.name.as_str())
    }

    /// Names of the joints.
    pub fn joint_names(&self) -> impl Iterator<Item = &str> + Clone {
        self.joints.iter().map(|joint| joint.name.as_str())
    }

    /// The number of a joint.
    pub fn joint(&self, name: &str) -> Option<usize> {
        self.joint_numbers.get(name).copied()
    }

    /// The first link of the chain between two links, and the joints on the way to the last one.
    pub fn path(&self, base: Option<&str>, tip: Option<&str>) -> Result<(usize, Vec<usize>)> {
        let find = |label: &str, name: &str| {
            let expected = || format!("one of the links{}", instead(name, self.link_names()));
            self.link_numbers.get(name).copied().ok_or_else(|| Error::value(label, format!("{name:?}"), &expected()))
        };
        let base = base.map(|name| find("base", name)).transpose()?;
        let tip = tip.map_or_else(|| self.only_end(base), |name| find("tip", name))?;
        let (mut link, mut joints) = (tip, Vec::new());
        while Some(link) != base {
            match self.links[link].above {
                Some(joint) => {
                    joints.push(joint);
                    link = self.joints[joint].parent;
                }
                None => break,
            }
        }
        if let Some(base) = base.filter(|base| *base != link) {
            let expected = format!("a link on the way from the root {:?} to the tip {:?}", self.links[link].name, self.links[tip].name);
            return Err(Error::value("base", format!("{:?}", self.links[base].name), &expected));
        }
        joints.reverse();
        Ok((link, joints))
    }

    /// The only link that carries none, of those that the base carries.
    fn only_end(&self, base: Option<usize>) -> Result<usize> {
        let carried = base.map(|base| self.below(base));
        let ends: Vec<usize> = (0..self.links.len())
            .filter(|link| self.links[*link].below.is_empty() && carried.as_ref().is_none_or(|carried| carried[*link]))
            .collect();
        match ends.as_slice() {
            [only] => Ok(*only),
            _ => Err(Error::Model(format!(
                "{}: {} end links ({}): name one as tip (tip=, --tip)",
                self.source,
                ends.len(),
                listed(ends.iter().map(|link| self.links[*link].name.as_str()))
            ))),
        }
    }
}

/// The names of elements, and their numbers by name.
fn numbered(source: &str, elements: &[Element]) -> Result<(Vec<String>, HashMap<String, usize>)> {
    let mut numbers: HashMap<String, usize> = HashMap::with_capacity(elements.len());
    let mut names = Vec::with_capacity(elements.len());
    for (i, element) in elements.iter().enumerate() {
        let kind = &element.name;
        let name = element.attribute("name").filter(|name| !name.is_empty()).ok_or_else(|| {
            let below = element.child("child").and_then(|child| child.attribute("link"));
            let where_to = below.map_or_else(String::new, |link| format!(" (its child is link {link:?})"));
            fault(source, element.line, format!("a {kind} without a name{where_to}"))
        })?;
        if let Some(first) = numbers.insert(name.into(), i) {
            let why = format!("a second {kind} {name:?}; the first is on line {}", elements[first].line);
            return Err(fault(source, element.line, why));
        }
        names.push(name.to_owned());
    }
    Ok((names, numbers))
}
