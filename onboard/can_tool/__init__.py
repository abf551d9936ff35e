"""`onboard can`: a CAN bus alone, for people at a bench: pure cores, thin shells."""
