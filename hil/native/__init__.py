"""Native kernels of the bench: wheel-soil forces and rays on heights and rocks."""
