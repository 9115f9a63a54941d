//! Tests of the core from outside, in one program so that its generic kernels are compiled once.

#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod allocation;
mod collision;
mod common;
mod index;
mod inverse;
mod linalg;
mod optimize;
mod plan;
mod planner;
mod qp;
mod resolve;
mod robustness;
mod volume;
