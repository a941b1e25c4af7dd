"""The compiled kernel's parts: one drive a lane, 128 drives a block, in single precision."""
