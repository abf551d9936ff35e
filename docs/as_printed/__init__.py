"""The chapter's algorithms and equations exactly as printed, faults included: for tests and docs, never for flight.

Nothing in onboard, hil, ground or pictures imports this package (a test checks it). Where several faults of one
algorithm hide each other, a `Mended` record corrects them one by one; without it all are present. `docs/as-printed.md`
shows the effect of each fault and the place of its correction.
"""
