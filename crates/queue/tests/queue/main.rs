//! The queue on a real PostgreSQL: everything that can go wrong, one sentence each.

mod death;
mod ends;
mod graph;
mod leases;
mod load;
mod locks;
mod order;
mod payloads;
mod shutdown;
mod states;
mod support;
