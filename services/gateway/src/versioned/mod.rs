//! What is made, filled with files, built, and never changes from then on: motion databases and body models. One version of
//! one name is one row of a table. Making, finding, listing, filling and deleting are the same for all of them, and stand
//! here once; what is a noun's own (its columns, its request, its users) is its [`Versioned`].

mod body_model;
mod contents;
mod files;
mod life;
mod lookup;
mod motion_database;
mod noun;
mod sql;
mod users;

pub(crate) use body_model::{BodyModel, NewBodyModel};
pub(crate) use contents::{Augment, MotionDatabaseDetails, augment, details, gplvm};
pub(crate) use files::{delete_file, list_files, put_file};
pub(crate) use life::{create, delete, list};
pub(crate) use lookup::{Latest, find, look};
pub(crate) use motion_database::{Clip, MotionDatabase, NewMotionDatabase, clips, left_out};
pub(crate) use noun::{Version, Versioned, set_build};
