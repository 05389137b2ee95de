//! What the source files of a crate import.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Context, Result};
use syn::{
    Attribute, Expr, File, ItemMod, ItemUse, Macro, Token, UseTree, Visibility,
    punctuated::Punctuated,
    visit::{self, Visit},
};

/// The names of a module and of those it stands in, outermost first; the crate's root has none.
pub type Module = Vec<String>;

/// The files of a crate and what they name of each other.
#[derive(Debug, Default)]
pub struct Crate {
    files: BTreeMap<Module, Names>,
}

/// What one file names. Paths begin at the crate's root.
#[derive(Debug, Default)]
struct Names {
    used: BTreeSet<Module>,
    /// by the name that is exported
    re_exports: BTreeMap<String, Module>,
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
        Ok(Self { files })
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
        let mut path = path.to_vec();
        // a re-export may be of a re-export, but not without end
        for _ in 0..8 {
            let file = self.file(&path)?;
            let re_export = path.get(file.len()).and_then(|name| self.files[&file].re_exports.get(name));
            let Some(re_export) = re_export else { return Some(file) };
            path = [re_export, path.get(file.len() + 1..).unwrap_or_default()].concat();
        }
        self.file(&path)
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

/// Reads the names of one file.
struct Reader<'s> {
    sources: &'s BTreeMap<Module, String>,
    /// where it is: the file's module, or one inside it
    module: Module,
    names: Names,
    /// what `use` brings into the file, by the name that it has there
    imported: BTreeMap<String, Module>,
    /// paths that begin with another name
    relative: Vec<Vec<String>>,
}

impl<'s> Reader<'s> {
    fn new(sources: &'s BTreeMap<Module, String>, module: &Module) -> Self {
        let (imported, relative) = Default::default();
        Self { sources, module: module.clone(), names: Names::default(), imported, relative }
    }

    fn read(mut self, file: &File) -> Names {
        self.visit_file(file);
        for path in &self.relative {
            if let Some(start) = self.imported.get(&path[0]) {
                self.names.used.insert([start, &path[1..]].concat());
            }
        }
        self.names
    }

    /// A path from the crate's root; none for what is of another crate, or is named without a module.
    fn path_from_root(&self, path: &[String]) -> Option<Module> {
        let mut at = self.module.clone();
        let mut rest = path;
        match path.first()?.as_str() {
            "crate" => {
                at.clear();
                rest = &path[1..];
            }
            "self" => rest = &path[1..],
            "super" => {
                while let Some((_, after)) = rest.split_first().filter(|(first, _)| *first == "super") {
                    at.pop()?;
                    rest = after;
                }
            }
            first => {
                at.push(first.to_owned());
                if path.len() < 2 || !self.sources.contains_key(&at) {
                    return None;
                }
                at.pop();
            }
        }
        at.extend(rest.iter().cloned());
        Some(at)
    }

    fn read_use(&mut self, tree: &UseTree, before: &mut Vec<String>, is_re_export: bool) {
        let (name, exported) = match tree {
            UseTree::Path(path) => {
                before.push(path.ident.to_string());
                self.read_use(&path.tree, before, is_re_export);
                before.pop();
                return;
            }
            UseTree::Group(group) => {
                group.items.iter().for_each(|tree| self.read_use(tree, before, is_re_export));
                return;
            }
            UseTree::Name(name) => (Some(name.ident.to_string()), name.ident.to_string()),
            UseTree::Rename(rename) => (Some(rename.ident.to_string()), rename.rename.to_string()),
            UseTree::Glob(_) => (None, String::new()),
        };
        let path: Vec<String> = before.iter().cloned().chain(name.filter(|name| name != "self")).collect();
        let Some(path) = self.path_from_root(&path) else { return };
        if is_re_export {
            self.names.re_exports.insert(exported, path);
        } else {
            self.imported.insert(exported, path.clone());
            self.names.used.insert(path);
        }
    }
}

impl<'ast> Visit<'ast> for Reader<'_> {
    fn visit_item_mod(&mut self, item: &'ast ItemMod) {
        if item.attrs.iter().any(is_for_tests) {
            return;
        }
        self.module.push(item.ident.to_string());
        visit::visit_item_mod(self, item);
        self.module.pop();
    }

    fn visit_item_use(&mut self, item: &'ast ItemUse) {
        let is_re_export = !matches!(item.vis, Visibility::Inherited);
        self.read_use(&item.tree, &mut Vec::new(), is_re_export);
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let names: Vec<String> = path.segments.iter().map(|segment| segment.ident.to_string()).collect();
        match self.path_from_root(&names) {
            Some(path) => drop(self.names.used.insert(path)),
            None => self.relative.push(names),
        }
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, call: &'ast Macro) {
        if let Ok(arguments) = call.parse_body_with(Punctuated::<Expr, Token![,]>::parse_terminated) {
            arguments.iter().for_each(|argument| Visit::visit_expr(self, argument));
        }
        visit::visit_macro(self, call);
    }
}

fn is_for_tests(attribute: &Attribute) -> bool {
    attribute.path().is_ident("cfg")
        && attribute.parse_args::<syn::Path>().is_ok_and(|condition| condition.is_ident("test"))
}
