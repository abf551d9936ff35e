"""Build of the native kernels for this machine's instruction set, and arithmetic with the same bits on every processor.

It stands below the records, which it does not know. Calls of the kernels that take records are in `kernel_calls`.
"""
