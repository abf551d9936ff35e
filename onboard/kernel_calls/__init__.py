"""Calls of the native kernels, whose sources are in `onboard/kernels`: one module per subject.

Each module checks shapes, dtypes and memory layout, because the kernels check nothing; a ValueError names the argument,
the expected and the given value. The kernels run without the interpreter's lock.
"""
