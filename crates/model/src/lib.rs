//! The vocabulary: skeleton, joint, pose, motion, point trajectories.
