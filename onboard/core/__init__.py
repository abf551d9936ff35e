"""Flight core: a deterministic function of configuration and inputs, tick by tick; no clock, no thread, no I/O."""
