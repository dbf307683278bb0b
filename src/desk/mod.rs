//! The pages on which people judge and correct a session: a report to send, and a page to paint on.
//!
//! The pages are plain modules of JavaScript that use WebGL 2; they load nothing from elsewhere. See `docs/desk.md`.

mod error;
mod html;
mod marks;
mod pack;
mod paint;
mod people;
mod pictures;
mod report;
mod scenes;
mod tables;

pub use error::DeskError;
pub use paint::Painting;
pub use people::people_page;
pub use report::report_page;
