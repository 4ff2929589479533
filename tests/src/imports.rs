//! Which file of a crate imports from which: read from the source, so that layers and cycles can be
//! tested.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use syn::visit::Visit;

/// The files of one crate and the imports between them, `#[cfg(test)]` left out.
pub struct Imports {
    /// Every file, relative to the crate's `src`, with its module path.
    modules: BTreeMap<Vec<String>, PathBuf>,
    /// Names that a module hands on: `pub use child::Name`.
    handed_on: BTreeMap<(Vec<String>, String), Vec<String>>,
    /// From a file to the files whose items it uses.
    pub edges: BTreeMap<PathBuf, BTreeSet<PathBuf>>,
}

impl Imports {
    /// Reads all files below `src`.
    ///
    /// # Panics
    /// If a file cannot be read or is no Rust.
    pub fn read(src: &Path) -> Self {
        let mut files = Vec::new();
        rust_files(src, &mut files);
        let mut modules = BTreeMap::new();
        let mut parsed = Vec::new();
        for file in files {
            let text = std::fs::read_to_string(&file).expect("a readable file");
            let relative = file.strip_prefix(src).expect("below src").to_path_buf();
            let syntax = syn::parse_file(&text)
                .unwrap_or_else(|why| panic!("{}: {why}", relative.display()));
            let module = module_path(&relative);
            modules.insert(module.clone(), relative);
            parsed.push((module, syntax));
        }
        let mut imports = Self {
            modules,
            handed_on: BTreeMap::new(),
            edges: BTreeMap::new(),
        };
        let mut used: Vec<(Vec<String>, Uses)> = parsed
            .into_iter()
            .map(|(module, syntax)| {
                let mut uses = Uses::default();
                uses.visit_file(&syntax);
                (module, uses)
            })
            .collect();
        let tests: Vec<Vec<String>> = used
            .iter()
            .flat_map(|(module, uses)| uses.test_modules.iter().map(|name| with(module, name)))
            .collect();
        used.retain(|(module, _)| !tests.iter().any(|test| module.starts_with(test)));
        for (module, uses) in &used {
            for (name, path) in &uses.handed_on {
                let path = imports.absolute(module, path);
                imports
                    .handed_on
                    .insert((module.clone(), name.clone()), path);
            }
        }
        for (module, uses) in &used {
            let from = imports.modules[module].clone();
            let targets: BTreeSet<PathBuf> = uses
                .paths
                .iter()
                .filter_map(|path| imports.file_of(&imports.absolute(module, path)))
                .filter(|to| *to != from)
                .collect();
            imports.edges.insert(from, targets);
        }
        imports
    }

    /// A path as written in `module`, from the crate's root; empty when it leads out of the crate.
    fn absolute(&self, module: &[String], path: &[String]) -> Vec<String> {
        let mut rest = path;
        let mut base = match rest.first().map(String::as_str) {
            Some("crate") => Vec::new(),
            Some("super" | "self") => module.to_vec(),
            Some(first) if self.modules.contains_key(&with(module, first)) => {
                return [module, path].concat();
            }
            _ => return Vec::new(),
        };
        while let Some(first) = rest.first() {
            match first.as_str() {
                "crate" | "self" => {}
                "super" => {
                    base.pop();
                }
                _ => break,
            }
            rest = &rest[1..];
        }
        base.extend_from_slice(rest);
        base
    }

    /// The file that defines what an absolute path names.
    fn file_of(&self, path: &[String]) -> Option<PathBuf> {
        if path.is_empty() {
            return None;
        }
        let depth = (0..=path.len())
            .rev()
            .find(|&n| self.modules.contains_key(&path[..n]))?;
        let module = &path[..depth];
        match path.get(depth) {
            Some(name) => match self.handed_on.get(&(module.to_vec(), name.clone())) {
                Some(to) if to.as_slice() != path => {
                    self.file_of(&[to.as_slice(), &path[depth + 1..]].concat())
                }
                _ => Some(self.modules[module].clone()),
            },
            None => Some(self.modules[module].clone()),
        }
    }

    /// Groups of files that import each other in a circle, each as a sorted list.
    pub fn cycles(&self) -> Vec<Vec<PathBuf>> {
        let reached: BTreeMap<&PathBuf, BTreeSet<&PathBuf>> = self
            .edges
            .keys()
            .map(|from| {
                let mut seen = BTreeSet::new();
                let mut open = vec![from];
                while let Some(file) = open.pop() {
                    for to in self.edges.get(file).into_iter().flatten() {
                        if seen.insert(to) {
                            open.push(to);
                        }
                    }
                }
                (from, seen)
            })
            .collect();
        let groups: BTreeSet<Vec<PathBuf>> = reached
            .iter()
            .filter(|(from, seen)| seen.contains(*from))
            .map(|(from, seen)| {
                seen.iter()
                    .filter(|to| reached.get(**to).is_some_and(|back| back.contains(*from)))
                    .map(|to| (*to).clone())
                    .collect()
            })
            .collect();
        groups.into_iter().collect()
    }
}

/// What one file uses, as it is written there.
#[derive(Default)]
struct Uses {
    paths: Vec<Vec<String>>,
    handed_on: Vec<(String, Vec<String>)>,
    /// Modules that only tests have.
    test_modules: Vec<String>,
}

impl Uses {
    fn tree(&mut self, tree: &syn::UseTree, mut path: Vec<String>, public: bool) {
        match tree {
            syn::UseTree::Path(step) => {
                path.push(step.ident.to_string());
                self.tree(&step.tree, path, public);
            }
            syn::UseTree::Group(group) => {
                for item in &group.items {
                    self.tree(item, path.clone(), public);
                }
            }
            syn::UseTree::Name(name) => {
                let name = name.ident.to_string();
                if name != "self" {
                    path.push(name.clone());
                }
                self.found(name, path, public);
            }
            syn::UseTree::Rename(renamed) => {
                path.push(renamed.ident.to_string());
                self.found(renamed.rename.to_string(), path, public);
            }
            syn::UseTree::Glob(_) => self.paths.push(path),
        }
    }

    fn found(&mut self, name: String, path: Vec<String>, public: bool) {
        if public {
            self.handed_on.push((name, path));
        } else {
            self.paths.push(path);
        }
    }
}

impl<'ast> Visit<'ast> for Uses {
    fn visit_item(&mut self, item: &'ast syn::Item) {
        let attributes = match item {
            syn::Item::Mod(module) => &module.attrs,
            syn::Item::Use(import) => &import.attrs,
            syn::Item::Fn(function) => &function.attrs,
            _ => return syn::visit::visit_item(self, item),
        };
        let test = attributes.iter().any(|attribute| {
            attribute.path().is_ident("cfg")
                && matches!(&attribute.meta, syn::Meta::List(list) if list.tokens.to_string() == "test")
        });
        match item {
            syn::Item::Mod(module) if test => self.test_modules.push(module.ident.to_string()),
            _ if test => {}
            _ => syn::visit::visit_item(self, item),
        }
    }

    fn visit_item_use(&mut self, import: &'ast syn::ItemUse) {
        let public = !matches!(import.vis, syn::Visibility::Inherited);
        self.tree(&import.tree, Vec::new(), public);
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        if path.segments.len() > 1 {
            self.paths
                .push(path.segments.iter().map(|s| s.ident.to_string()).collect());
        }
        syn::visit::visit_path(self, path);
    }
}

fn with(module: &[String], name: &str) -> Vec<String> {
    let mut path = module.to_vec();
    path.push(name.to_owned());
    path
}

/// `fit/network/mod.rs` is `fit::network`, `fit/ridge.rs` is `fit::polynomial::ridge`, `lib.rs` the
/// root.
fn module_path(file: &Path) -> Vec<String> {
    let mut path: Vec<String> = file
        .with_extension("")
        .iter()
        .map(|part| part.to_string_lossy().into_owned())
        .collect();
    if path.last().is_some_and(|l| l == "mod" || l == "lib") {
        path.pop();
    }
    path
}

fn rust_files(folder: &Path, files: &mut Vec<PathBuf>) {
    let entries = std::fs::read_dir(folder).expect("a readable folder");
    for path in entries.map(|entry| entry.expect("a readable folder").path()) {
        if path.is_dir() {
            rust_files(&path, files);
        } else if path.extension().is_some_and(|e| e == "rs") {
            files.push(path);
        }
    }
}
