"""A run over sockets flown again in one process, in the bench's environment: `python -m tests.hil.memory_twin SCENARIO
FOLDER`. The operator is the record: every datagram comes in the tick in which it came over the link.

Prints as JSON the streams and the truth as a certificate names them, and for how many ticks every input and output byte
was the record's, to the first that was not.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable, Iterator
from dataclasses import asdict, replace
from pathlib import Path

from mcap.stream_reader import StreamReader

from hil.run.in_process import InMemory
from hil.scenarios.model import load_scenario
from onboard.record.reader import ticks_of
from onboard.record.schema import decode_inputs, encode_inputs, encode_outputs
from onboard.records import LinkMessage

COMPARED_ALSO = ("/in/can", "/in/lidar", "/in/link")


class RecordedOperator:
    """Speaks as the record heard it."""

    requests = ()

    def __init__(self, ticks: Iterator[tuple[int, dict[str, bytes]]]) -> None:
        self._ticks = ticks
        self.recorded: dict[str, bytes] = {}
        self.done = False
        self._next()

    def _next(self) -> None:
        number, self._coming = next(self._ticks, (0, {}))
        self.done = not number

    def messages(self, now_ns: int) -> tuple[LinkMessage, ...]:
        self.recorded = self._coming
        inputs, _ = decode_inputs(self.recorded)
        assert inputs.now_ns == now_ns
        return inputs.link_messages

    def hear(self, payloads: Iterable[tuple[int, bytes]], now_ns: int) -> None:
        self._next()


def twin(scenario: Path, folder: Path) -> dict[str, object]:
    same, first = 0, ""
    with (folder / "onboard.mcap").open("rb") as file:
        operator = RecordedOperator(ticks_of(StreamReader(file).records))
        bench = InMemory(replace(load_scenario(scenario), end_s=0.0), ())
        bench.operator = operator

        def compare(tick, inputs, outputs, rover, state):
            nonlocal same, first
            told = encode_inputs(inputs)
            made = encode_outputs(outputs, told) | {topic: told.get(topic, b"") for topic in COMPARED_ALSO}
            differ = [topic for topic, data in made.items() if data != operator.recorded.get(topic, b"")]
            first = first or (f"tick {tick}: {differ}" if differ else "")
            same += not first

        flight = bench.run(compare)
    row = asdict(flight)
    return {
        "streams": row["streams"],
        "states_sha256": flight.states_sha256,
        "faults": list(flight.faults),
        "ticks": same,
        "first_difference": first,
    }


if __name__ == "__main__":
    print(json.dumps(twin(Path(sys.argv[1]), Path(sys.argv[2]))))
