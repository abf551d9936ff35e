"""Registrations in a record: results of a library outside the tick whose last bits differ by the processor.

small_gicp calls the C library's sine, so a registration enters the core as an input: /in/registration contains it with
the job that made it. A replay computes it again, compares the two within FAR_M, FAR_RAD and FAR_RATIO, and continues
with the recorded one, bit for bit. All other results of jobs are the same on every processor (docs/determinism.md).
"""

from __future__ import annotations

import dataclasses
import json
import struct
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from onboard.records import F64, JobDone

FAR_M, FAR_RAD = 1e-6, 1e-6
FAR_RATIO = 1e-4  # of the covariance's sigmas, and of the other numbers
_HEAD = struct.Struct("<II")
_NUMBERS = ("inlier_ratio", "apart_m", "moved_m", "moved_rad")
_WORDS = ("accepted", "converged", "told", "degenerate", "reason")
_FIELDS = struct.Struct(f"<{16 + 16 + len(_NUMBERS)}d")


class RecordedRegistration(NamedTuple):
    """One recorded registration: its job, and its fields by name."""

    job_id: int
    fields: Mapping[str, Any]


def encode(jobs: Sequence[JobDone]) -> bytes:
    """Encode the registrations of the jobs whose results are taken; empty if none of them registered."""
    return b"".join(_row(job.job_id, found) for job in jobs if (found := _of(job)) is not None)


def decode(raw: bytes) -> Iterator[RecordedRegistration]:
    """Yield the registrations of a message."""
    at = 0
    while at < len(raw):
        job_id, size = _HEAD.unpack_from(raw, at)
        at += _HEAD.size
        numbers = _FIELDS.unpack_from(raw, at)
        words = json.loads(raw[at + _FIELDS.size : at + size])
        at += size
        fields = {
            "T_map_base": np.array(numbers[:16]).reshape(4, 4),
            "covariance": np.array(numbers[16:32]).reshape(4, 4),
            **dict(zip(_NUMBERS, numbers[32:], strict=True)),
            **dict(zip(_WORDS, words, strict=True)),
        }
        yield RecordedRegistration(job_id, {**fields, "degenerate": tuple(fields["degenerate"])})


def taken(jobs: Sequence[JobDone], raw: bytes) -> tuple[tuple[JobDone, ...], str]:
    """Replace the jobs' registrations by the recorded ones; return the jobs, and a text of too large differences."""
    recorded, out, words = {row.job_id: row.fields for row in decode(raw)}, [], []
    for job in jobs:
        found, fields = _of(job), recorded.pop(job.job_id, None)
        if (found is None) != (fields is None):
            before, now = _presence(fields is not None), _presence(found is not None)
            words.append(f"job {job.job_id}: recorded {before}, now {now}")
        elif found is not None and fields is not None:
            words += [f"job {job.job_id}: {word}" for word in _differences(found, fields)]
            job = job._replace(value=dataclasses.replace(job.value, registration=dataclasses.replace(found, **fields)))
        out.append(job)
    words += [f"job {job_id}: recorded a registration, not taken now" for job_id in recorded]
    return tuple(out), "; ".join(words)


def _presence(there: bool) -> str:
    return "a registration" if there else "none"


def _of(job: JobDone) -> Any:
    """RegistrationResult in a job's result, by attribute name: importing its class would load small_gicp."""
    return getattr(job.value, "registration", None)


def _row(job_id: int, found: Any) -> bytes:
    numbers = [*found.T_map_base.ravel(), *found.covariance.ravel(), *(getattr(found, name) for name in _NUMBERS)]
    body = _FIELDS.pack(*numbers) + json.dumps([getattr(found, name) for name in _WORDS]).encode()
    return _HEAD.pack(job_id, len(body)) + body


def _differences(found: Any, fields: Mapping[str, Any]) -> Iterator[str]:
    """Yield the differences of a repeated registration from the recorded one, as text."""
    for name in ("accepted", "converged", "told", "degenerate"):
        if getattr(found, name) != fields[name]:
            yield f"{name}: recorded {fields[name]}, now {getattr(found, name)}"
    apart = np.abs(found.T_map_base - fields["T_map_base"])
    if apart[:3, 3].max() > FAR_M or apart[:3, :3].max() > FAR_RAD:
        yield f"T_map_base: apart by {apart[:3, 3].max():.3g} m, {apart[:3, :3].max():.3g} rad"
    if not _alike(found.covariance, fields["covariance"]):
        yield f"covariance: apart by {np.abs(found.covariance - fields['covariance']).max():.3g}"
    for name in _NUMBERS:
        now, then = getattr(found, name), fields[name]
        if now != then and not abs(now - then) <= FAR_RATIO * max(1.0, abs(then)):
            yield f"{name}: recorded {then:.9g}, now {now:.9g}"


def _alike(a: F64, b: F64) -> bool:
    """True if two covariances differ by less than FAR_RATIO of their own sigmas."""
    sigmas = np.sqrt(np.maximum(b.diagonal(), 0.0))
    return bool((np.abs(a - b) <= FAR_RATIO * np.outer(sigmas, sigmas) + 1e-15).all())
