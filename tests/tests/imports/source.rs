//! What the source files of a crate import.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Context, Result};

use crate::reader::{Module, Names, Reader};

/// The files of a crate and what they name of each other.
#[derive(Debug, Default)]
pub struct Crate {
    files: BTreeMap<Module, Names>,
}

impl Crate {
    /// Reads the `sources` of a crate.
    ///
    /// # Errors
    /// Text that is no Rust.
    pub fn parse(sources: &BTreeMap<Module, String>) -> Result<Self> {
        let mut files = BTreeMap::new();
        for (module, text) in sources {
            let file = syn::parse_file(text).with_context(|| module.join("::"))?;
            files.insert(module.clone(), Reader::new(sources, module).read(&file));
        }
        let mut parsed = Self { files };
        parsed.expand_globs();
        Ok(parsed)
    }

    /// Groups of files that import each other, each in order.
    pub fn circles(&self) -> BTreeSet<Vec<String>> {
        let imports: BTreeMap<_, _> =
            self.files.keys().map(|module| (module, self.imports(module))).collect();
        let reached: BTreeMap<_, _> =
            imports.keys().map(|module| (*module, reached(&imports, module))).collect();
        let in_circle = reached.keys().filter(|module| reached[**module].contains(**module));
        let group = |module: &&&Module| {
            let group = reached[**module].iter().filter(|other| reached[*other].contains(**module));
            group.map(|module| module.join("::")).collect()
        };
        in_circle.map(|module| group(&module)).collect()
    }

    /// The files that a file imports. A part may use what the modules it stands in hold for all of their parts; what these
    /// only re-export is imported from where it is.
    fn imports(&self, module: &Module) -> BTreeSet<Module> {
        let used = self.files[module].used.iter();
        used.filter_map(|path| self.holder(path)).filter(|other| !module.starts_with(other)).collect()
    }

    /// The file that holds what `path` names.
    fn holder(&self, path: &[String]) -> Option<Module> {
        self.file(&self.resolved(path))
    }

    /// Where what `path` names is itself, and not re-exported.
    fn resolved(&self, path: &[String]) -> Module {
        let mut path = path.to_vec();
        // a re-export may be of a re-export, but not without end
        for _ in 0..8 {
            let Some(file) = self.file(&path) else { break };
            let re_export = path.get(file.len()).and_then(|name| self.files[&file].re_exports.get(name));
            let Some(re_export) = re_export else { break };
            path = [re_export, path.get(file.len() + 1..).unwrap_or_default()].concat();
        }
        path
    }

    /// Names one by one what `use module::*` brings.
    fn expand_globs(&mut self) {
        // what a glob re-exports may be had from another by a glob
        loop {
            let mut new = Vec::new();
            for (file, names) in &self.files {
                let items = names.glob_re_exports.iter().flat_map(|module| self.items(module));
                let is_new = |name: &String| {
                    let own = [&file[..], std::slice::from_ref(name)].concat();
                    !names.re_exports.contains_key(name) && !names.items.contains(&own)
                };
                let items = items.filter_map(|item| Some((item.last().cloned()?, item)));
                new.extend(items.filter(|(name, _)| is_new(name)).map(|item| (file.clone(), item)));
            }
            if new.is_empty() {
                break;
            }
            for (file, (name, item)) in new {
                self.files.entry(file).or_default().re_exports.insert(name, item);
            }
        }
        let imported = |names: &Names| -> Vec<Module> {
            names.glob_imports.iter().flat_map(|module| self.items(module)).collect()
        };
        let imported: Vec<_> = self.files.values().map(imported).collect();
        for (names, imported) in self.files.values_mut().zip(imported) {
            names.used.extend(imported);
        }
    }

    /// What is in a module or an enum, re-exports too.
    fn items(&self, path: &[String]) -> Vec<Module> {
        let path = self.resolved(path);
        let Some(file) = self.file(&path) else { return Vec::new() };
        let names = &self.files[&file];
        let own = names.items.iter().filter(|item| item.len() == path.len() + 1 && item.starts_with(&path));
        let re_exports = names.re_exports.keys().filter(|_| file == path);
        own.cloned().chain(re_exports.map(|name| [&path[..], std::slice::from_ref(name)].concat())).collect()
    }

    fn file(&self, path: &[String]) -> Option<Module> {
        (0..=path.len()).rev().map(|n| path[..n].to_vec()).find(|module| self.files.contains_key(module))
    }
}

/// All that can be reached from `start`; itself only in a circle.
fn reached(imports: &BTreeMap<&Module, BTreeSet<Module>>, start: &Module) -> BTreeSet<Module> {
    let mut reached = BTreeSet::new();
    let mut next = vec![start];
    while let Some(module) = next.pop() {
        next.extend(imports[module].iter().filter(|module| reached.insert((*module).clone())));
    }
    reached
}
