//! Undo, redo and branches restore an earlier state. Nothing is deleted; each appends a line to the journal.

use super::session::{Snapshot, Writer, recipe_path, state_path};
use super::templates;
use crate::session::error::SessionError;
use crate::session::recipe::Recipe;
use crate::session::store::{Branch, Entry, Move, State};

impl Writer {
    /// Undoes the last `count` changes of the branch and returns them, the last one first.
    ///
    /// **Errors** if there are fewer; then nothing changes.
    pub fn undo(&mut self, count: usize) -> Result<Vec<Entry>, SessionError> {
        let undoable = self.undoable();
        if count > undoable {
            return Err(SessionError::NothingToUndo { requested: count, there_are: undoable });
        }
        self.record_hand_edit()?;
        (0..count).map(|_| self.step_back()).collect()
    }

    /// Redoes the last `count` undone changes.
    ///
    /// **Errors** if fewer were undone; then nothing changes.
    pub fn redo(&mut self, count: usize) -> Result<Vec<Entry>, SessionError> {
        let there_are = if self.session.edited.is_some() { 0 } else { self.session.history.current().undone.len() };
        if count > there_are {
            return Err(SessionError::NothingToRedo { requested: count, there_are });
        }
        (0..count).map(|_| self.step_forth()).collect()
    }

    /// Switches to a branch; a new one starts at the current state. Returns whether it is new.
    pub fn branch(&mut self, name: &str) -> Result<bool, SessionError> {
        check_branch_name(name)?;
        let head = self.session.history.branch(name).map(|b| b.head().cloned());
        self.record_hand_edit()?;
        let to = match &head {
            Some(head) => head.clone(),
            None => self.session.history.current().head().cloned(),
        };
        let Some(to) = to else { return Err(SessionError::NoScans { dir: self.session.dir().to_path_buf() }) };
        if self.session.history.current().name != name {
            self.go_to(&to, &format!("branch {name}"), Move::Branch(name.into()))?;
        }
        Ok(head.is_none())
    }

    fn undoable(&self) -> usize {
        let by_hand = usize::from(self.session.edited.is_some() && self.session.last.is_some());
        self.session.history.current().done.len().saturating_sub(1) + by_hand
    }

    fn step_back(&mut self) -> Result<Entry, SessionError> {
        let branch: &Branch = self.session.history.current();
        let (Some(undone), Some(to)) = (branch.head().cloned(), branch.before().cloned()) else {
            return Err(SessionError::NothingToUndo { requested: 1, there_are: 0 });
        };
        self.go_to(&to, &format!("undo {}", undone.change), Move::Undo)?;
        Ok(undone)
    }

    fn step_forth(&mut self) -> Result<Entry, SessionError> {
        let Some(to) = self.session.history.current().undone.last().cloned() else {
            return Err(SessionError::NothingToRedo { requested: 1, there_are: 0 });
        };
        self.go_to(&to, &format!("redo {}", to.change), Move::Redo)?;
        Ok(to)
    }

    /// Restores an earlier recipe and state.
    fn go_to(&mut self, to: &Entry, change: &str, by: Move) -> Result<(), SessionError> {
        let session = &mut self.session;
        let texts = Snapshot { recipe: session.store.text(to.recipe)?, state: session.store.text(to.state)? };
        let mut recipe = Recipe::parse(&texts.recipe, &recipe_path(session.dir()))?;
        templates::recall(&mut recipe, &session.store);
        let state = State::parse(&texts.state, &state_path(session.dir()))?;
        (session.recipe, session.state, session.recipe_text) = (recipe, state, texts.recipe.clone());
        self.record(change, Some(by), &texts)?;
        let session = &self.session;
        templates::place_all(&session.recipe, session.dir(), &session.store)
    }
}

fn check_branch_name(name: &str) -> Result<(), SessionError> {
    /// Longest branch name, in characters: it must fit in a list.
    const LONGEST_NAME: usize = 64;
    let plain = |c: char| c.is_alphanumeric() || ['-', '_', '.', '/'].contains(&c);
    match !name.is_empty() && name.len() <= LONGEST_NAME && name.chars().all(plain) && !name.starts_with('-') {
        true => Ok(()),
        false => Err(SessionError::BadBranchName { name: name.into() }),
    }
}
