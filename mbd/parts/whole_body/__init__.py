"""A whole person in space: segments, joints, poses, passive moments."""
