"""Maps of the page: the newest of the rover, the orbiter's, the rover's answers about paths; and previews of a goto."""

from __future__ import annotations

import threading
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

from ground.archive.read import newest_product, reading
from ground.archive.schema import ArchiveError
from ground.page.map import buffers, drawn, layers
from ground.products import preview
from ground.products.preview import Map, NoMapError
from onboard.records import Gdem
from protocol import WireError
from protocol.link.bulk import Product
from protocol.products import decode_ldem, poses_of
from protocol.products.height_std import HeightStd, decode_height_std
from protocol.products.scan import SCAN_CODEC


class _Scan(NamedTuple):
    """Newest scan product, decoded only when a browser draws it.

    onboard_ns: onboard time at its arrival; None: not known.
    """

    data: bytes
    utc_ns: int
    onboard_ns: int | None


class Maps:
    """Newest products that are drawn on the map. Written by the link's thread, read by the server's.

    revision: counts the rover's maps and deviations; a picture's address has it.
    gdem: the orbiter's map; None: none was named.
    """

    def __init__(self, gdem: Gdem | None, archive: Path | None) -> None:
        self.gdem, self._archive, self._lock = gdem, archive, threading.Lock()
        self.revision = 0
        self._seen: layers.Seen | None = None
        self._std: HeightStd | None = None
        self._drawn_trees: dict[str, Any] = dict.fromkeys(drawn.NAMES)
        self.trouble = ""
        self._scan: _Scan | None = None
        self._scans = 0
        self._picture = lru_cache(maxsize=16)(self._drawn)
        self._cloud = lru_cache(maxsize=2)(buffers.cloud_buffer)

    def load(self) -> None:
        """Read the newest products of the archive, if there is one."""
        if self._archive is None or not self._archive.is_file():
            return
        try:
            with reading(self._archive) as db:
                found = {name: newest_product(db, name) for name in ("ldem", "height_std", "scan", *drawn.NAMES)}
        except ArchiveError as error:
            self.trouble = str(error)
            return
        for name, one in found.items():
            if one is not None:
                self._add(name, one[1], one[2], one[0], None)

    def add(self, product: Product, utc_ns: int, onboard_ns: int | None = None) -> None:
        """Take a product of the link. onboard_ns: onboard time at its arrival; None: not known."""
        self._add(product.name, product.codec, product.data, utc_ns, onboard_ns)

    def _add(self, name: str, codec: str, data: bytes, utc_ns: int, onboard_ns: int | None) -> None:
        try:
            if name == "ldem":
                fresh = layers.seen(decode_ldem(data), poses_of(data), utc_ns, self._seen)
                fresh = fresh._replace(std=self._std)
                with self._lock:
                    self._seen, self.revision = fresh, self.revision + 1
            elif name == "height_std":
                std = decode_height_std(data)
                with self._lock:
                    self._std = std
                    if self._seen is not None:
                        self._seen, self.revision = self._seen._replace(std=std), self.revision + 1
            elif name == "scan" and codec == SCAN_CODEC:
                with self._lock:
                    self._scan, self._scans = _Scan(data, utc_ns, onboard_ns), self._scans + 1
            elif name in drawn.NAMES:
                self._drawn_trees = {**self._drawn_trees, name: drawn.tree_of(name, data, utc_ns)}
        except WireError as error:
            self.trouble = f"{name}: {error}"

    def tree(self) -> dict[str, Any]:
        """Return what the page draws: bounds and times of the maps, path, candidates."""
        with self._lock:
            found, revision, scan, scans = self._seen, self.revision, self._scan, self._scans
        ldem = (
            None
            if found is None
            else {
                "bounds": layers.bounds(found.grid),
                "revision": revision,
                "utc_s": found.at_utc_ns / 1e9 or None,
                "deviations": found.std is not None,
                "cells": list(found.product.heights_m.shape),
                "picture": f"/map/ldem.png?revision={revision}",
                "terrain": f"/map/terrain.bin?revision={revision}",
            }
        )
        orbit = None if self.gdem is None else {"bounds": layers.bounds(self.gdem.grid)}
        cloud = None if scan is None else {"utc_s": scan.utc_ns / 1e9 or None, "buffer": f"/map/cloud.bin?scan={scans}"}
        return {"ldem": ldem, "gdem": orbit, "scan": cloud, **self._drawn_trees, "trouble": self.trouble}

    def picture(self, revision: int, layer: str, now_utc_s: float) -> bytes:
        """Return a layer of the newest map as PNG. Raises LookupError without a map, ValueError for no such layer."""
        return self._picture(
            self.revision if revision <= self.revision else -1, layer, int(now_utc_s // 10) if layer == "age" else 0
        )

    def _drawn(self, revision: int, layer: str, tens_of_s: int) -> bytes:
        with self._lock:
            found = self._seen
        if found is None or revision < 0:
            raise LookupError("no map of the rover yet")
        return layers.ldem_picture(found, layer, tens_of_s * 10.0)

    def cloud(self) -> bytes:
        """Return the buffer of the newest scan. Raises LookupError without one, WireError for a damaged one."""
        with self._lock:
            scan = self._scan
        if scan is None:
            raise LookupError("no scan of the rover yet")
        return self._cloud(*scan)

    def terrain(self) -> bytes:
        """Return the buffer of the newest map's heights. Raises LookupError without one."""
        with self._lock:
            found = self._seen
        if found is None:
            raise LookupError("no map of the rover yet")
        return buffers.terrain_buffer(found.product)

    def gdem_picture(self) -> bytes:
        """Return the orbiter's map as PNG. Raises LookupError without one."""
        if self.gdem is None:
            raise LookupError("no orbiter's map was named (--gdem)")
        return layers.gdem_picture(self.gdem)

    def preview(self, x_m: float, y_m: float) -> dict[str, Any]:
        """Return what a goto would do, by the rover's own planner on the newest map. Takes up to some seconds.

        Raises NoMapError without a usable map, ConfigError for settings that cannot be read.
        """
        with self._lock:
            found = self._seen
        if found is None or found.poses is None:
            raise NoMapError("no map of the rover yet: fetch one (Fetch map)")
        goal_m = (x_m, y_m)
        seen = Map(found.product, found.poses, "the newest map", found.at_utc_ns)
        flown = preview.settings_for(seen, None, self._archive)
        made = preview.look_ahead(seen, goal_m, self.gdem, flown.config)
        told = preview.warnings(seen, goal_m, self.gdem, self._archive)
        return {
            "goal": list(goal_m),
            "words": made.words,
            "kind": made.kind,
            "rule": made.rule,
            "reason": made.reason,
            "leads": made.leads,
            "path": made.path.tolist(),
            "beyond": made.beyond.tolist(),
            "warnings": [*told, *([flown.warning] if flown.warning else [])],
        }
