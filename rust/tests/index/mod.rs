//! Indices: exact derivatives against differences and against the oracle, one posture and many, doors.

mod batch;
mod derivatives;
mod doors;
mod oracle;
