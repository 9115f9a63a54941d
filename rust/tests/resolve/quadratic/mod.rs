//! Control ticks as quadratic programmes: by closed forms, by Clarabel, and by what must hold at every posture.

mod closed_form;
mod guard;
mod index;
mod limits;
mod oracle;
mod path;
mod rows;
