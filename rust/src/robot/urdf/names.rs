//! Names that people mistype.

/// Names listed in a message.
const LISTED: usize = 24;

/// Longer names are not compared.
const LONGEST: usize = 80;

/// Names as a list for people, the first of them if they are many.
pub(crate) fn listed<'a>(names: impl Iterator<Item = &'a str> + Clone) -> String {
    let first: Vec<&str> = names.clone().take(LISTED).collect();
    let count = names.count();
    if count > LISTED { format!("{}, ... ({count} in all)", first.join(", ")) } else { first.join(", ") }
}

/// What there is instead of a name that does not exist: ", did you mean ...?" if one is near, else ": " and a list.
pub(crate) fn instead<'a>(name: &str, known: impl Iterator<Item = &'a str> + Clone) -> String {
    match nearest(name, known.clone()) {
        Some(near) => format!(", perhaps {near:?}: {}", listed(known)),
        None => format!(": {}", listed(known)),
    }
}

/// The name that the fewest changes of a letter lead to, if these are at most half of its letters.
fn nearest<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let letters = |text: &str| text.to_lowercase().chars().collect::<Vec<char>>();
    let wanted = letters(name);
    known
        .filter(|other| other.len() <= LONGEST && name.len() <= LONGEST)
        .map(|other| (changes(&wanted, &letters(other)), other))
        .min_by_key(|(count, _)| *count)
        .filter(|(count, other)| 2 * count <= other.len().min(name.len()))
        .map(|(_, other)| other)
}

/// The fewest letters to insert, remove or replace on the way from one word to another (Levenshtein's distance).
fn changes(a: &[char], b: &[char]) -> usize {
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.iter().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(x != y);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}
