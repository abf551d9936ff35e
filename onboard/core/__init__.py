"""The flight core: a deterministic function of configuration and inputs, tick by tick. No clock, thread, socket or disk."""
