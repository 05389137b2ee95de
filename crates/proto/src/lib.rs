//! The gRPC contracts of `proto/marey/v1`: generated code, conversions between wire and model, and the one
//! place where errors become status codes.
//!
//! Handlers see only the model's types: what comes in goes through [`points`] and [`poses`], which check
//! it; what goes out is made there too.

mod error;
pub mod points;
pub mod poses;

pub use error::{CallError, Error, ErrorCode, status};

/// Generated messages, clients and servers of package `marey.v1`.
pub mod v1 {
    #![expect(
        missing_docs,
        clippy::allow_attributes_without_reason,
        reason = "generated; the .proto files are documented"
    )]
    tonic::include_proto!("marey.v1");
}

/// The encoded `FileDescriptorSet` of the contracts, for server reflection.
pub const FILE_DESCRIPTOR_SET: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/marey_descriptors.bin"));

/// Reads a UUID field.
///
/// # Errors
/// [`Error::BadId`].
pub fn id(field: &'static str, text: &str) -> Result<uuid::Uuid, Error> {
    text.parse().map_err(|_| Error::BadId { field, found: text.chars().take(64).collect() })
}
