//! Paths in what only a macro can read: what it is called with, and attributes.

use proc_macro2::{Delimiter, TokenStream, TokenTree};
use syn::{Lit, Path};

/// The paths in `tokens`, and those in the braces of a `use` one by one.
pub fn paths(tokens: TokenStream) -> Vec<Vec<String>> {
    let mut paths = Vec::new();
    read(tokens, &[], &mut paths);
    paths
}

/// Adds the paths in `tokens`, each after the names `before` it.
fn read(tokens: TokenStream, before: &[String], paths: &mut Vec<Vec<String>>) {
    let tokens: Vec<TokenTree> = tokens.into_iter().collect();
    let is_colon = |at: usize| matches!(tokens.get(at), Some(TokenTree::Punct(p)) if p.as_char() == ':');
    let are_colons = |at: usize| is_colon(at) && is_colon(at + 1);
    let mut at = 0;
    while let Some(token) = tokens.get(at) {
        // `::a` is of another crate, `<T>::a` of a type
        let is_ours = at < 2 || !are_colons(at - 2);
        at += 1;
        let first = match token {
            TokenTree::Group(group) => {
                read(group.stream(), &[], paths);
                continue;
            }
            TokenTree::Ident(name) if is_ours => name,
            _ => continue,
        };
        let mut path = [before, &[first.to_string()]].concat();
        while are_colons(at) {
            match tokens.get(at + 2) {
                Some(TokenTree::Ident(name)) => path.push(name.to_string()),
                Some(TokenTree::Group(group)) if group.delimiter() == Delimiter::Brace => {
                    read(group.stream(), &path, paths);
                }
                _ => break,
            }
            at += 3;
        }
        paths.push(path);
    }
}

/// The paths that the strings in an attribute are, as `serde` is given modules and functions.
pub fn quoted_paths(tokens: TokenStream) -> Vec<Vec<String>> {
    let mut paths = Vec::new();
    for token in tokens {
        match token {
            TokenTree::Group(group) => paths.extend(quoted_paths(group.stream())),
            TokenTree::Literal(literal) => {
                let Lit::Str(text) = Lit::new(literal) else { continue };
                let Ok(path) = text.parse_with(Path::parse_mod_style) else { continue };
                let names = path.segments.iter().map(|segment| segment.ident.to_string());
                // a module that is given is used for what it holds
                paths.push(names.chain(["_".to_owned()]).collect());
            }
            TokenTree::Ident(_) | TokenTree::Punct(_) => {}
        }
    }
    paths
}
