//! An invariant of ARCHITECTURE.md: the files of a crate do not import each other in a circle.

mod reader;
mod source;
mod tokens;

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
};

use anyhow::{Context, Result, ensure};
use reader::Module;
use source::Crate;

/// The circles that there are, each with its reason in ARCHITECTURE.md: a crate, and its modules that import each other.
const KNOWN: [(&str, &[&str]); 1] = [("store", &["error", "key"])];

#[test]
fn files_do_not_import_each_other_in_a_circle() -> Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().context("no folder above tests")?;
    let mut found = BTreeSet::new();
    let mut files = 0;
    for folder in ["crates", "services"] {
        for entry in fs::read_dir(root.join(folder))? {
            let folder = entry?.path();
            let sources = sources(&folder.join("src"))?;
            files += sources.len();
            let name = folder.file_name().context("no name")?.to_string_lossy().into_owned();
            let circles = Crate::parse(&sources).with_context(|| name.clone())?.circles();
            found.extend(circles.into_iter().map(|circle| (name.clone(), circle)));
        }
    }
    ensure!(files > 300, "read {files} files, expected all of them");
    let known =
        KNOWN.map(|(name, modules)| (name.to_owned(), modules.iter().map(|m| (*m).to_owned()).collect()));
    let known = BTreeSet::from(known);
    let new: Vec<_> = found.difference(&known).collect();
    ensure!(new.is_empty(), "these modules import each other in a circle: {new:#?}");
    let gone: Vec<_> = known.difference(&found).collect();
    ensure!(gone.is_empty(), "these circles are no more, and can leave KNOWN and ARCHITECTURE.md: {gone:#?}");
    Ok(())
}

/// The source files below `folder` by their modules; the crate's root is the module without a name.
fn sources(folder: &Path) -> Result<BTreeMap<Module, String>> {
    let mut sources = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(&next).with_context(|| next.display().to_string())? {
            let path = entry?.path();
            if path.is_dir() {
                folders.push(path);
            } else if let Some(module) = module(folder, &path)? {
                sources.insert(module, fs::read_to_string(&path)?);
            }
        }
    }
    Ok(sources)
}

/// The module that a file is; none for other files, and for programs, which are crates of their own.
fn module(folder: &Path, file: &Path) -> Result<Option<Module>> {
    let inside = file.strip_prefix(folder)?;
    if inside.extension().is_none_or(|e| e != "rs")
        || inside.starts_with("bin")
        || inside == Path::new("main.rs")
    {
        return Ok(None);
    }
    let mut module: Module =
        inside.with_extension("").iter().map(|part| part.to_string_lossy().into_owned()).collect();
    let is_its_folders = module.last().is_some_and(|last| last == "mod") || inside == Path::new("lib.rs");
    if is_its_folders {
        module.pop();
    }
    Ok(Some(module))
}

fn circles(sources: &[(&str, &str)]) -> Result<Vec<Vec<String>>> {
    let module = |path: &str| path.split("::").filter(|part| !part.is_empty()).map(str::to_owned).collect();
    let sources = sources.iter().map(|(path, text)| (module(path), (*text).to_owned())).collect();
    Ok(Crate::parse(&sources)?.circles().into_iter().collect())
}

#[test]
fn a_circle_is_found_however_it_is_written() -> Result<()> {
    let circle = vec![vec!["a".to_owned(), "b".to_owned()]];
    for (root, a, b) in [
        ("", "use crate::b::B;", "use crate::a::A;"),
        ("", "use crate::{b::{B as C}, c};", "use super::a::{self};"),
        ("", "pub use crate::b::B; fn f(b: B) {}", "fn f() { crate::a::f() }"),
        ("", "fn f() -> crate::b::B { loop {} }", "fn f() { assert!(crate::a::yes()); }"),
        ("", "told! { yes, no => crate::b::B }", "macro_rules! m { ($x:ident) => { $crate::a::A }; }"),
        (
            "",
            "told! { use crate::{c, b::{B as C}}; }",
            "fn f() { select! { x = super::a::A::<u8>::new() => {} } }",
        ),
        ("", "#[derive(crate::b::B)] struct S;", "struct S { #[serde(with = \"crate::a\")] at: u8 }"),
        (
            "",
            "#[serde(default = \"super::b::B::c\")] struct S;",
            "#[cfg_attr(no, derive(super::a::A))] struct S;",
        ),
        ("pub use a::A; pub(crate) use b::B;", "use crate::B;", "mod inner { use super::super::A; }"),
        ("pub use a::*; pub use b::*;", "pub struct A; use crate::B;", "pub struct B; use crate::A;"),
        ("", "use crate::b::*;", "fn f() { crate::a::f() }"),
    ] {
        assert_eq!(circles(&[("", root), ("a", a), ("b", b)])?, circle, "{root} {a} {b}");
    }
    let through_a_re_export = [
        ("", ""),
        ("a", "use crate::m;\nfn f() { m::x() }"),
        ("m", "mod part; mod other; pub use {other::y, part::x};"),
        ("m::other", "pub fn y() {}"),
        ("m::part", "use crate::a::A; pub fn x() {}"),
    ];
    assert_eq!(circles(&through_a_re_export)?, [["a", "m::part"]]);
    let through_all_of_a_module = [
        ("", ""),
        ("a", "use crate::m::*;"),
        ("m", "mod part; pub use part::x;"),
        ("m::part", "use crate::a::A; pub fn x() {}"),
    ];
    assert_eq!(circles(&through_all_of_a_module)?, [["a", "m::part"]]);
    let through_all_of_an_enum = [
        ("", "pub use m::*;"),
        ("a", "fn f() { crate::One; }"),
        ("m", "mod part; pub use part::Number::*;"),
        ("m::part", "pub enum Number { One } fn f() { crate::a::f() }"),
    ];
    assert_eq!(circles(&through_all_of_an_enum)?, [["a", "m::part"]]);
    Ok(())
}

#[test]
fn parts_and_tests_may_use_the_modules_they_stand_in() -> Result<()> {
    let none = [
        ("", "pub mod m; pub use m::part::B;"),
        ("m", "mod part; mod other; use part::B; pub struct A; #[cfg(test)] mod tests { use crate::n::N; }"),
        ("m::part", "use super::A; pub struct B;"),
        ("m::other", "use super::{A, part::B}; use crate::m;"),
        ("n", "use crate::m::A; use std::m::B; pub struct N;"),
    ];
    assert!(circles(&none)?.is_empty());
    let of_another_crate_or_a_type = [
        ("", ""),
        ("m", "mod b; fn f() { told!(::b::B, <T>::b::B, x::b::B); }"),
        ("m::b", "use crate::n::N;"),
        ("n", "use crate::m::A;"),
    ];
    assert!(circles(&of_another_crate_or_a_type)?.is_empty());
    Ok(())
}
