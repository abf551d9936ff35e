"""The native kernels. One door for each subject (`raster`, `pose_field`, ...) checks shapes, dtypes and memory layout.

The work runs without the interpreter's lock. A ValueError names the argument, what is expected and what was given; the
kernels themselves check nothing. `variant` chooses the build for this machine's instruction set.
"""
