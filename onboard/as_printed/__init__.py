"""The chapter's algorithms and equations exactly as printed, faults included: for tests and docs, never for flight.

Nothing in onboard, hil, ground or pictures imports this package (a test says so). Where several faults of one algorithm
hide each other a `Mended` record takes them out one by one; without it all are in. `docs/as-printed.md` shows what each
fault does and where its correction lives.
"""
