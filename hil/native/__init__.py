"""The wheel-soil kernel (an extension of its own)."""
