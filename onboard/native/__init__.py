"""The doors to the native kernels, whose sources are in `onboard/kernels`: one for each subject.

A door checks shapes, dtypes and memory layout; a ValueError names the argument, what is expected and what was given,
for the kernels themselves check nothing. They run without the interpreter's lock. `variant` chooses the build for this
machine's instruction set.
"""
