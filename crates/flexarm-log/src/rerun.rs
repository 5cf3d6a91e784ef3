//! What the recordings need of Rerun, in one place. It is taken from the crates below the SDK: chunks, log messages, the
//! encoding of .rrd files and the archetypes. The crate `rerun` itself brings a viewer's query engine, importers and a
//! client for servers (TLS, HTTP/2, an async runtime) that a program which writes and reads files has no use for.

pub(crate) use re_chunk::Span;
pub(crate) use re_chunk::external::arrow;
pub(crate) use re_chunk::{Chunk, ChunkComponents, ChunkError, ChunkId, RowId, TimeColumn};
pub(crate) use re_log_encoding::external::lz4_flex;
pub(crate) use re_log_types::{EntityPath, LogMsg, StoreId, TimePoint, Timeline};
pub(crate) use re_sdk_types::archetypes::*;
pub(crate) use re_sdk_types::components::{AlbedoFactor, Color, LineStrip3D, Radius};
pub(crate) use re_sdk_types::datatypes::{Quaternion, Rgba32};
pub(crate) use re_sdk_types::{AsComponents, SerializationError, SerializedComponentColumn};
pub(crate) use re_sdk_types::{components, datatypes};
