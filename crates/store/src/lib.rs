//! Object store and artefact naming.
