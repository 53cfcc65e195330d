//! A law that nobody listed, where the library does not explain the gap.
//!
//! A plant offers quantities on which a force, or its friction, may depend ([`offer`], [`grid`]). For each of them the law is a Gaussian process over
//! that axis, with its values at the points of a grid as coefficients. Their derivatives are computed once, everything that is free is
//! projected out, and the evidence of each axis follows in closed form, its scale, its smoothness and its period marginalised ([`evidence`],
//! [`kernel`]). The best are fitted to the end together with the nuisances ([`fit`], [`fitted_law`]), and the one that predicts best what it was not fitted to is
//! the law ([`find`]). A formula of few terms takes its place in words where it predicts as well ([`formula`]).
//!
//! The law is held against the recalibrated model, with the discrepancy that every model has: what that allows for is no law.

pub(in crate::explain) mod evidence;
pub(in crate::explain) mod find;
pub(in crate::explain) mod fit;
pub(in crate::explain) mod fitted_law;
pub(in crate::explain) mod formula;
pub(in crate::explain) mod grid;
pub(in crate::explain) mod kernel;
pub(in crate::explain) mod offer;
pub(in crate::explain) mod shape;
