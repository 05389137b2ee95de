//! Motion database: invariant windows, neighbour search, the index file.
