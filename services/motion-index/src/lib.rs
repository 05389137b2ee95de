//! The motion-index service: builds motion databases and answers queries on them.
