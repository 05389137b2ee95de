//! Local regression of the next pose on windows of motion.
