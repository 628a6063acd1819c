//! All datasets of a file.

use std::collections::HashMap;

use hdf5::{Dataset, Group, LinkType, LocationType};

use super::scope::Scopes;
use super::stated::{self, Here, Stated};
use crate::hdf5_files::links::require_own_values;
use crate::hdf5_files::read::Allowance;

/// No recorder nests its groups as deep.
const DEEPEST: usize = 32;

/// More objects are no recording.
const MOST_OBJECTS: usize = 20_000;

/// A dataset and where it lies.
#[derive(Debug)]
pub(super) struct Found {
    pub(super) dataset: Dataset,
    /// Path: `/group/name`.
    pub(super) location: String,
    /// Path of its group; empty for the file.
    pub(super) group: String,
    pub(super) name: String,
    /// What its group states of it.
    pub(super) stated: Option<Stated>,
}

/// Datasets of a file, in the order of their names, group by group; attributes of groups go to `scopes`.
pub(super) fn datasets(
    file: &Group,
    scopes: &mut Scopes,
    allowance: &Allowance,
    remarks: &mut Vec<String>,
) -> Vec<Found> {
    let mut walk = Walk { scopes, allowance, remarks, found: Vec::new(), seen: HashMap::new(), objects: 0, links: 0 };
    walk.is_new(file, "/");
    walk.group(file, "", 0);
    if walk.links > 0 {
        let links = walk.links;
        walk.remarks.push(format!("{links} soft or external links are not followed"));
    }
    if walk.objects >= MOST_OBJECTS {
        walk.remarks.push(format!("only the first {MOST_OBJECTS} objects are listed"));
    }
    walk.found
}

struct Walk<'a> {
    scopes: &'a mut Scopes,
    allowance: &'a Allowance,
    remarks: &'a mut Vec<String>,
    found: Vec<Found>,
    /// Groups that are listed, by what the library tells them apart with, and where: several hard links may lead to
    /// one, in circles too.
    seen: HashMap<String, String>,
    objects: usize,
    links: usize,
}

impl Walk<'_> {
    fn group(&mut self, group: &Group, path: &str, depth: usize) {
        let mut names = Vec::new();
        let most = MOST_OBJECTS.saturating_sub(self.objects);
        let listed = group.iter_visit_default(|name, link| {
            match link.link_type {
                LinkType::Hard if names.len() < most => names.push(name.to_owned()),
                // more than are looked at: a damaged index may have no end
                LinkType::Hard => return Err("only the first members are listed".into()),
                LinkType::Soft | LinkType::External if self.links < most => self.links += 1,
                LinkType::Soft | LinkType::External => return Err("only the first links are counted".into()),
            }
            Ok(())
        });
        if let Err(error) = listed {
            self.remarks.push(format!("the members of {path}/ cannot all be listed: {error}"));
        }
        // the library's own order is that of its index, not of the names
        names.sort_unstable();
        for name in names {
            if self.objects >= MOST_OBJECTS {
                return;
            }
            self.objects += 1;
            self.member(group, path, name, depth);
        }
    }

    fn member(&mut self, group: &Group, path: &str, name: String, depth: usize) {
        let location = format!("{path}/{name}");
        // indexes of PyTables over a table's columns: sorted copies of what is there
        if name.starts_with("_i_") {
            return self.remarks.push(format!("{location} is an index of PyTables, no recording"));
        }
        // where MATLAB keeps what its cells and objects refer to
        if path.is_empty() && matches!(name.as_str(), "#refs#" | "#subsystem#") {
            return self.remarks.push(format!("{location} holds parts of MATLAB's cells and objects, no channel"));
        }
        match group.loc_type_by_name(&name) {
            Ok(LocationType::Dataset) => match group.dataset(&name) {
                Ok(dataset) => match require_own_values(&dataset) {
                    Ok(()) => {
                        let (allowance, path_of, at) = (self.allowance, path, location.as_str());
                        let here =
                            Here { group, path: path_of, dataset: &dataset, name: &name, location: at, allowance };
                        let stated = stated::of(here);
                        self.found.push(Found { dataset, location, group: path.to_owned(), name, stated });
                    }
                    Err(error) => {
                        self.remarks.push(format!("{location} is left out: it is a dataset {}", error.problem));
                    }
                },
                Err(error) => self.remarks.push(format!("{location} cannot be opened: {error}")),
            },
            Ok(LocationType::Group) if depth < DEEPEST => match group.group(&name) {
                Ok(inner) => {
                    if !self.is_new(&inner, &location) {
                        return;
                    }
                    self.scopes.attributes(&inner, &location, self.allowance);
                    self.group(&inner, &location, depth + 1);
                }
                Err(error) => self.remarks.push(format!("{location} cannot be opened: {error}")),
            },
            Ok(LocationType::Group) => self.remarks.push(format!("{location} lies too deep: it is not looked into")),
            Ok(_) => {}
            Err(error) => self.remarks.push(format!("{location} cannot be opened: {error}")),
        }
    }

    /// Whether a group is met for the first time; if not, a remark says where it is listed.
    fn is_new(&mut self, group: &Group, location: &str) -> bool {
        let token = match group.loc_info() {
            Ok(info) => format!("{:?}", info.token),
            Err(error) => {
                self.remarks.push(format!("{location} cannot be opened: {error}"));
                return false;
            }
        };
        if let Some(first) = self.seen.get(&token) {
            self.remarks.push(format!("{location} is another name of {first}, where its members are listed"));
            return false;
        }
        self.seen.insert(token, location.to_owned());
        true
    }
}
