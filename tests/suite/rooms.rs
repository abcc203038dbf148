//! The order of rooms holds: no file of `src/` imports from a room above its own, and nowhere in the
//! workspace do files import each other in a circle.
//!
//! The order is the list on the crate's front page. What is read is every path in the code, in a
//! `use` or in its midst, but for the tests at the foot of a file: they may read back what it wrote.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use walkdir::WalkDir;

/// The names on a path from the root of its crate.
type Names = Vec<String>;

/// The files of a crate by their modules.
struct Crate {
    files: BTreeMap<Names, PathBuf>,
}

impl Crate {
    fn read(folder: &str) -> Self {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
        let files =
            WalkDir::new(&root).into_iter().map(|entry| entry.expect("a folder").into_path());
        let is_code = |path: &PathBuf| {
            let stem = path.file_stem().unwrap_or_default();
            path.extension().is_some_and(|own| own == "rs") && stem != "tests" && stem != "testing"
        };
        let module = |path: PathBuf| {
            let inside = path.strip_prefix(&root).expect("a path below").with_extension("");
            let mut names: Names =
                inside.iter().map(|name| name.to_string_lossy().into_owned()).collect();
            names.pop_if(|last| ["mod", "lib"].contains(&last.as_str()));
            (names, path)
        };
        Self { files: files.filter(is_code).map(module).collect() }
    }

    /// The modules that each imports from, itself left out.
    fn imports(&self) -> BTreeMap<&Names, BTreeSet<&Names>> {
        let of = |(module, path): (&Names, &PathBuf)| {
            let text = std::fs::read_to_string(path).expect("a source file");
            let paths = paths(&tokens(&text));
            let found = paths.iter().filter_map(|path| self.resolve(module, path));
            found.filter(|other| *other != module).collect()
        };
        self.files.iter().map(|own| (own.0, of(own))).collect()
    }

    /// The module that a path in the code of another leads to, if it is one of this crate.
    fn resolve(&self, own: &Names, path: &[String]) -> Option<&Names> {
        let ups = path.iter().take_while(|name| *name == "super").count();
        let (start, rest) = match path[0].as_str() {
            "crate" | "seamwise" => (&[][..], &path[1..]),
            "self" => (&own[..], &path[1..]),
            "super" => (&own[..own.len().checked_sub(ups)?], &path[ups..]),
            _ => (&own[..], path),
        };
        let is_rooted = rest.len() < path.len();
        let path = [start, rest].concat();
        // Without a root it leads somewhere if it begins with a module within the own one.
        let least = if is_rooted { 0 } else { own.len() + 1 };
        let known =
            (least..=path.len()).rev().find_map(|length| self.files.get_key_value(&path[..length]));
        known.map(|(module, _)| module)
    }

    fn name(&self, module: &Names) -> String {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let path = &self.files[module];
        path.strip_prefix(root).unwrap_or(path).display().to_string()
    }
}

/// The words and signs of code, without comments and the tests at its foot.
fn tokens(text: &str) -> Vec<String> {
    let code = ["", "pub(super) "].iter().fold(text, |text, visible| {
        text.split(&format!("#[cfg(test)]\n{visible}mod tests {{")).next().unwrap_or_default()
    });
    let code: Vec<&str> =
        code.lines().map(|line| line.split("//").next().unwrap_or_default()).collect();
    let code = code.join("\n");
    let mut tokens: Vec<String> = Vec::new();
    let is_word = |character: char| character.is_alphanumeric() || character == '_';
    let mut before = ' ';
    for character in code.chars() {
        match tokens.last_mut() {
            Some(last) if is_word(before) && is_word(character) => last.push(character),
            Some(last) if before == ':' && character == ':' && last == ":" => last.push(':'),
            _ if character.is_whitespace() => {}
            _ => tokens.push(character.to_string()),
        }
        before = character;
    }
    tokens
}

/// Every path of two names or more, and every module that is imported by its name.
fn paths(tokens: &[String]) -> Vec<Names> {
    let mut found = Vec::new();
    let mut at = 0;
    while at < tokens.len() {
        let is_path = tokens.get(at + 1).is_some_and(|next| next == "::");
        if is_path && is_name(&tokens[at]) {
            at = take(tokens, at, &[], &mut found);
        } else {
            at += 1;
        }
    }
    found
}

fn is_name(token: &str) -> bool {
    token.starts_with(|first: char| first.is_alphabetic() || first == '_')
}

/// Takes the path that begins at a token, or the several of a tree in braces; returns where it ends.
fn take(tokens: &[String], mut at: usize, before: &[String], found: &mut Vec<Names>) -> usize {
    let mut path = before.to_vec();
    while tokens.get(at).is_some_and(|token| is_name(token)) {
        path.push(tokens[at].clone());
        at += 1;
        if tokens.get(at).is_none_or(|next| next != "::") {
            break;
        }
        at += 1;
    }
    if tokens[at - 1] != "::" || tokens.get(at).is_none_or(|next| next != "{") {
        found.push(path);
        return at;
    }
    at += 1;
    while tokens.get(at).is_some_and(|token| token != "}") {
        at = if is_name(&tokens[at]) { take(tokens, at, &path, found) } else { at + 1 };
    }
    at + 1
}

/// The rooms of `src/` from top to bottom.
fn rooms() -> Names {
    let page =
        include_str!("../../src/lib.rs").lines().filter_map(|line| line.strip_prefix("//! - "));
    page.filter_map(|line| Some(line.split('`').nth(1)?.to_owned())).collect()
}

/// Modules that import each other, from one to the next and back to the first.
fn circle<'a>(imports: &BTreeMap<&'a Names, BTreeSet<&'a Names>>) -> Option<Vec<&'a Names>> {
    fn search<'a>(
        own: &'a Names,
        imports: &BTreeMap<&'a Names, BTreeSet<&'a Names>>,
        way: &mut Vec<&'a Names>,
        done: &mut BTreeSet<&'a Names>,
    ) -> Option<Vec<&'a Names>> {
        if let Some(start) = way.iter().position(|known| *known == own) {
            return Some([&way[start..], &[own]].concat());
        }
        if !done.insert(own) {
            return None;
        }
        way.push(own);
        let found = imports[own].iter().find_map(|next| search(next, imports, way, done));
        way.pop();
        found
    }
    let mut done = BTreeSet::new();
    imports.keys().find_map(|own| search(own, imports, &mut Vec::new(), &mut done))
}

#[test]
fn every_room_stands_on_the_front_page() {
    let files = Crate::read("src").files;
    let there: BTreeSet<&str> =
        files.keys().filter_map(|module| Some(module.first()?.as_str())).collect();
    let rooms = rooms();
    let mut listed: BTreeSet<&str> = rooms.iter().map(String::as_str).collect();
    listed.insert("main");
    assert_eq!(there, listed, "src/ and the list in src/lib.rs");
}

#[test]
fn no_file_imports_from_a_room_above_its_own() {
    let code = Crate::read("src");
    let rooms = rooms();
    let floor = |module: &Names| rooms.iter().position(|room| module.first() == Some(room));
    let mut wrong = Vec::new();
    for (own, others) in code.imports() {
        let Some(floor_of_own) = floor(own) else { continue };
        for other in others {
            match floor(other) {
                Some(above) if above < floor_of_own => {
                    let (below, above) = (&rooms[floor_of_own], &rooms[above]);
                    wrong.push(format!(
                        "{} imports {}: {above} stands above {below}",
                        code.name(own),
                        code.name(other)
                    ));
                }
                Some(_) => {}
                None => wrong.push(format!("{} imports from {}", code.name(own), code.name(other))),
            }
        }
    }
    assert!(wrong.is_empty(), "\n{}\n", wrong.join("\n"));
}

#[test]
fn no_files_import_each_other_in_a_circle() {
    for folder in ["src", "texture/src", "attr/src"] {
        let code = Crate::read(folder);
        let mut imports = code.imports();
        if folder != "src" {
            // There the files of a folder take the types that it is about from its head.
            for (own, others) in &mut imports {
                others.retain(|head| head.is_empty() || !own.starts_with(head));
            }
        }
        if let Some(circle) = circle(&imports) {
            let names: Vec<String> = circle.into_iter().map(|module| code.name(module)).collect();
            panic!("files import each other: {}", names.join(" → "));
        }
    }
}
