//! What one source file names.

use std::collections::{BTreeMap, BTreeSet};

use syn::{
    Attribute, File, Ident, Item, ItemMod, ItemUse, Macro, MetaList, UseTree, Visibility,
    visit::{self, Visit},
};

use crate::tokens;

/// The names of a module and of those it stands in, outermost first; the crate's root has none.
pub type Module = Vec<String>;

/// What one file names. Paths begin at the crate's root.
#[derive(Debug, Default)]
pub struct Names {
    pub used: BTreeSet<Module>,
    /// by the name that is exported
    pub re_exports: BTreeMap<String, Module>,
    /// modules and enums of which all is brought into the file
    pub glob_imports: Vec<Module>,
    /// modules and enums of which all is exported
    pub glob_re_exports: Vec<Module>,
    /// what the file defines, and the variants of its enums
    pub items: BTreeSet<Module>,
}

/// Reads the names of one file.
pub struct Reader<'s> {
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
    pub fn new(sources: &'s BTreeMap<Module, String>, module: &Module) -> Self {
        let (imported, relative) = Default::default();
        Self { sources, module: module.clone(), names: Names::default(), imported, relative }
    }

    pub fn read(mut self, file: &File) -> Names {
        self.visit_file(file);
        for path in &self.relative {
            let first = &path[0];
            if let Some(start) = self.imported.get(first).or_else(|| self.names.re_exports.get(first)) {
                self.names.used.insert([start, &path[1..]].concat());
            }
        }
        self.names
    }

    fn name(&mut self, path: Vec<String>) {
        match self.path_from_root(&path) {
            Some(path) => drop(self.names.used.insert(path)),
            None => self.relative.push(path),
        }
    }

    fn define(&mut self, names: &[&Ident]) {
        let names = names.iter().map(ToString::to_string);
        self.names.items.insert(self.module.iter().cloned().chain(names).collect());
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
            UseTree::Name(name) => (name.ident.to_string(), name.ident.to_string()),
            UseTree::Rename(rename) => (rename.ident.to_string(), rename.rename.to_string()),
            UseTree::Glob(_) => {
                // one name alone would not be looked at as a path
                before.push("*".to_owned());
                let module = self.path_from_root(before).map(|path| path[..path.len() - 1].to_vec());
                before.pop();
                let Names { used, glob_imports, glob_re_exports, .. } = &mut self.names;
                if is_re_export {
                    glob_re_exports.extend(module);
                } else {
                    glob_imports.extend(module.clone());
                    used.extend(module);
                }
                return;
            }
        };
        let path: Vec<String> =
            before.iter().cloned().chain(Some(name).filter(|name| name != "self")).collect();
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

    fn visit_item(&mut self, item: &'ast Item) {
        match item {
            Item::Const(item) => self.define(&[&item.ident]),
            Item::Enum(item) => {
                self.define(&[&item.ident]);
                item.variants.iter().for_each(|variant| self.define(&[&item.ident, &variant.ident]));
            }
            Item::Fn(item) => self.define(&[&item.sig.ident]),
            Item::Macro(item) => item.ident.iter().for_each(|name| self.define(&[name])),
            Item::Mod(item) => self.define(&[&item.ident]),
            Item::Static(item) => self.define(&[&item.ident]),
            Item::Struct(item) => self.define(&[&item.ident]),
            Item::Trait(item) => self.define(&[&item.ident]),
            Item::Type(item) => self.define(&[&item.ident]),
            Item::Union(item) => self.define(&[&item.ident]),
            _ => {}
        }
        visit::visit_item(self, item);
    }

    fn visit_item_use(&mut self, item: &'ast ItemUse) {
        let is_re_export = !matches!(item.vis, Visibility::Inherited);
        self.read_use(&item.tree, &mut Vec::new(), is_re_export);
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        self.name(path.segments.iter().map(|segment| segment.ident.to_string()).collect());
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, call: &'ast Macro) {
        tokens::paths(call.tokens.clone()).into_iter().for_each(|path| self.name(path));
        visit::visit_macro(self, call);
    }

    fn visit_meta_list(&mut self, list: &'ast MetaList) {
        let paths = tokens::paths(list.tokens.clone());
        let quoted = tokens::quoted_paths(list.tokens.clone());
        paths.into_iter().chain(quoted).for_each(|path| self.name(path));
        visit::visit_meta_list(self, list);
    }
}

fn is_for_tests(attribute: &Attribute) -> bool {
    attribute.path().is_ident("cfg")
        && attribute.parse_args::<syn::Path>().is_ok_and(|condition| condition.is_ident("test"))
}
