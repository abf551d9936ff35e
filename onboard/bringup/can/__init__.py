"""`onboard can`: tools for a CAN bus without the flight program, for people at a bench: pure cores, thin shells."""
