//! The changes of a session on each branch, for `undo` and `redo`.
//!
//! The journal is append-only. `undo`, `redo` and `branch` append lines too, with the recipe and the state that they
//! restore. The lines in order determine what can be undone and redone now.

use super::hash::ContentHash;
use super::journal::{Change, Move};
use serde::Serialize;

/// The branch of a new session.
pub const MAIN_BRANCH: &str = "main";

/// A change that can be undone: all lines with one recipe. The results of building a recipe are undone with it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Entry {
    /// Number over the whole session, from 1: the journal's line that first had this recipe.
    pub number: usize,
    /// Description of the change.
    pub change: String,
    /// The recipe's text.
    pub recipe: ContentHash,
    /// The latest state of that recipe.
    pub state: ContentHash,
}

/// A branch.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Branch {
    /// Its name.
    pub name: String,
    /// The changes that were not undone, oldest first; the last is the current state of the branch.
    pub done: Vec<Entry>,
    /// The undone changes that can be redone, the next one last.
    pub undone: Vec<Entry>,
}

/// All branches of a session.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct History {
    branches: Vec<Branch>,
    current: usize,
}

impl Default for History {
    fn default() -> Self {
        let main = Branch { name: MAIN_BRANCH.into(), done: Vec::new(), undone: Vec::new() };
        Self { branches: vec![main], current: 0 }
    }
}

impl History {
    /// Reads the lines. The error is the index of a line that is inconsistent with those before it, and the reason.
    pub(in crate::session) fn of(changes: &[Change]) -> Result<Self, (usize, &'static str)> {
        let mut history = Self::default();
        for (i, change) in changes.iter().enumerate() {
            history.follow(i + 1, change).map_err(|why| (i, why))?;
        }
        Ok(history)
    }

    /// Applies one more line.
    pub(in crate::session) fn follow(&mut self, number: usize, change: &Change) -> Result<(), &'static str> {
        let branch = &mut self.branches[self.current];
        match &change.moves {
            None => match branch.done.last_mut() {
                Some(top) if top.recipe == change.recipe => top.state = change.state,
                _ => {
                    let Change { change, recipe, state, .. } = change.clone();
                    branch.done.push(Entry { number, change, recipe, state });
                    branch.undone.clear();
                }
            },
            Some(Move::Undo) => {
                let undone = branch.done.pop().ok_or("it undoes what was never done")?;
                branch.undone.push(undone);
            }
            Some(Move::Redo) => {
                let redone = branch.undone.pop().ok_or("it redoes what was never undone")?;
                branch.done.push(redone);
            }
            Some(Move::Branch(name)) => self.switch(name),
        }
        match self.current().done.last() {
            Some(top) if (top.recipe, top.state) == (change.recipe, change.state) => Ok(()),
            _ => Err("it names another recipe or state than the lines before it lead to"),
        }
    }

    fn switch(&mut self, name: &str) {
        self.current = match self.branches.iter().position(|b| b.name == name) {
            Some(at) => at,
            None => {
                let done = self.current().done.clone();
                self.branches.push(Branch { name: name.into(), done, undone: Vec::new() });
                self.branches.len() - 1
            }
        };
    }

    /// All branches, in the order of their creation.
    pub fn branches(&self) -> &[Branch] {
        &self.branches
    }

    /// The current branch.
    pub fn current(&self) -> &Branch {
        &self.branches[self.current]
    }

    /// The branch of that name.
    pub fn branch(&self, name: &str) -> Option<&Branch> {
        self.branches.iter().find(|b| b.name == name)
    }
}

impl Branch {
    /// The current state of the branch.
    pub fn head(&self) -> Option<&Entry> {
        self.done.last()
    }

    /// The change that `undo` restores. The first change of a session cannot be undone.
    pub fn before(&self) -> Option<&Entry> {
        self.done.len().checked_sub(2).map(|at| &self.done[at])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(change: &str, recipe: &str, state: &str, moves: Option<Move>) -> Change {
        let hash = |text: &str| ContentHash::of(text.as_bytes());
        Change { change: change.into(), recipe: hash(recipe), state: hash(state), moves }
    }

    fn names(entries: &[Entry]) -> Vec<&str> {
        entries.iter().map(|e| e.change.as_str()).collect()
    }

    #[test]
    fn a_build_belongs_to_what_was_asked_and_is_undone_with_it() {
        let lines = [
            line("new", "r0", "s0", None),
            line("scan body", "r1", "s1", None),
            line("build", "r1", "s2", None),
            line("mask shirt", "r2", "s2", None),
            line("build", "r2", "s3", None),
            line("undo", "r1", "s2", Some(Move::Undo)),
            line("build", "r1", "s4", None),
        ];
        let history = History::of(&lines).unwrap();
        assert_eq!(names(&history.current().done), ["new", "scan body"]);
        assert_eq!(names(&history.current().undone), ["mask shirt"], "a build is no reason to forget what was undone");
        assert_eq!(history.current().head().unwrap().state, ContentHash::of(b"s4"));
        assert_eq!(history.current().undone[0].state, ContentHash::of(b"s3"));
    }

    #[test]
    fn a_new_change_forgets_what_was_undone_on_its_branch_only() {
        let lines = [
            line("new", "r0", "s0", None),
            line("a", "r1", "s1", None),
            line("branch b", "r1", "s1", Some(Move::Branch("b".into()))),
            line("undo", "r0", "s0", Some(Move::Undo)),
            line("branch main", "r1", "s1", Some(Move::Branch("main".into()))),
            line("c", "r3", "s3", None),
            line("branch b", "r0", "s0", Some(Move::Branch("b".into()))),
        ];
        let history = History::of(&lines).unwrap();
        assert_eq!(history.current().name, "b");
        assert_eq!(names(&history.current().undone), ["a"]);
        assert_eq!(names(&history.branch("main").unwrap().done), ["new", "a", "c"]);
    }

    #[test]
    fn lines_that_contradict_those_before_them_are_named() {
        let new = line("new", "r0", "s0", None);
        let undo = line("undo", "r9", "s9", Some(Move::Undo));
        assert_eq!(History::of(&[new.clone(), undo]).unwrap_err().0, 1);
        let redo = line("redo", "r0", "s0", Some(Move::Redo));
        assert_eq!(History::of(&[new, redo]).unwrap_err(), (1, "it redoes what was never undone"));
    }
}
