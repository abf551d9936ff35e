"""CCSDS bridge without I/O: news of the session become telemetry packets, telecommand packets become requests.

    news, receive(packet) --> Bridge --> session.request, send() -> packets

A telemetry packet is built when all items of its frame have arrived; a frame crosses the link whole. The command
dictionary checks each telecommand packet; the answer to a packet that cannot become a request is a report NOT_SENT.
"""

from __future__ import annotations

from collections import Counter

from ground.link.news import EventHeard, Item, News, ReportHeard
from ground.link.session import Session
from protocol import WireError
from protocol.ccsds import packet_table, space_packets
from protocol.ccsds.packet_table import NUMBERS, TelemetryPacket
from protocol.link.transactions import Code
from protocol.tables.commands import command
from protocol.tables.modes import SEVERITIES

LIFETIME_S = 60.0  # of a request, as of one typed by hand
_FORGET = 4096  # number of requests whose packet numbers are stored


class Bridge:
    """Bridge on one session. counts: packets sent, requested and refused, by kind."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._out: list[bytes] = []
        self._numbers: Counter[int] = Counter()  # packets so far, by APID
        self._part: dict[str, tuple[int, dict[str, float]]] = {}  # frame -> onboard time, items received so far
        self._packet_of: dict[int, int] = {}  # request id -> sequence count of its packet
        self.counts: Counter[str] = Counter()

    def receive(self, raw: bytes, now_ns: int) -> None:
        """Process one packet from the other system."""
        sequence = packet_table.NO_PACKET
        try:
            packet = space_packets.decode(raw)
            if (packet.kind, packet.apid) != (space_packets.TELECOMMAND, packet_table.COMMAND_APID):
                raise WireError(
                    "packet",
                    f"kind {packet.kind}, APID {packet.apid}: telecommands have "
                    f"{space_packets.TELECOMMAND} and {packet_table.COMMAND_APID}",
                )
            sequence = packet.sequence
            asked = packet_table.decode_command(packet.data)
            if not self._session.boot_id:
                raise ValueError(f"{asked.name}: the rover was not heard yet")
            lifetime_s = LIFETIME_S if command(asked.name).moves else 0.0
            request_id = self._session.request(
                asked.name, asked.arguments, now_ns, lifetime_s, asked.start_s, asked_by=f"bridge packet {sequence}"
            )
        except ValueError as error:  # includes WireError
            self.counts["refused"] += 1
            self._not_sent(sequence, str(error), now_ns)
            return
        self.counts["asked"] += 1
        self._packet_of[request_id] = sequence
        if len(self._packet_of) > _FORGET:
            del self._packet_of[next(iter(self._packet_of))]

    def turn(self, news: list[News], now_ns: int) -> None:
        """Convert the news of one turn into packets."""
        for one in news:
            match one:
                case Item():
                    self._item(one)
                case EventHeard():
                    self._event(one)
                case ReportHeard():
                    self._report(one, now_ns)

    def send(self) -> list[bytes]:
        """Return the packets that are ready, in order."""
        out, self._out = self._out, []
        return out

    def _item(self, item: Item) -> None:
        row = packet_table.OF_ITEM.get(item.name)
        if row is None:
            return
        at_ns, values = self._part.get(row.name, (item.onboard_ns, {}))
        if at_ns != item.onboard_ns:
            self.counts["incomplete"] += 1  # a frame from a program with fewer items
            values = {}
        values[item.name] = item.value
        self._part[row.name] = item.onboard_ns, values
        if len(values) == len(row.fields):
            del self._part[row.name]
            self._put(row, values, item.onboard_ns)

    def _event(self, event: EventHeard) -> None:
        self._put(
            packet_table.BY_APID[packet_table.EVENT_APID],
            {
                "event_serial": event.serial,
                "event_severity": SEVERITIES.index(event.severity),
                "event_name": event.name,
                "event_text": event.text,
            },
            event.onboard_ns,
        )

    def _report(self, heard: ReportHeard, now_ns: int) -> None:
        report = heard.report
        numbers = (*report.data[:NUMBERS], *[float("nan")] * (NUMBERS - len(report.data)))
        self._put(
            packet_table.BY_APID[packet_table.REPORT_APID],
            {
                "report_request": report.request_id,
                "report_command": command(heard.name).id,
                "report_packet": self._packet_of.get(report.request_id, packet_table.NO_PACKET),
                "report_state": report.state,
                "report_code": report.code,
                "report_serial": report.serial,
                "report_text": report.text,
                "report_numbers": len(report.data),
                **{f"report_number_{n}": number for n, number in enumerate(numbers)},
            },
            self._onboard_ns(now_ns),
        )

    def _not_sent(self, sequence: int, text: str, now_ns: int) -> None:
        nothing = dict.fromkeys((f"report_number_{n}" for n in range(NUMBERS)), float("nan"))
        self._put(
            packet_table.BY_APID[packet_table.REPORT_APID],
            {
                "report_request": 0,
                "report_command": 0,
                "report_packet": sequence,
                "report_serial": 0,
                "report_state": packet_table.NOT_SENT,
                "report_code": Code.NONE,
                "report_text": text,
                "report_numbers": 0,
                **nothing,
            },
            self._onboard_ns(now_ns),
        )

    def _onboard_ns(self, now_ns: int) -> int:
        """Return the reception time on the rover's clock, ns: reports carry no time of their own."""
        return max(0, self._session.far_clock.onboard_ns(now_ns) or 0)

    def _put(self, row: TelemetryPacket, values: packet_table.Values, onboard_ns: int) -> None:
        stamp = space_packets.stamp(onboard_ns, self._session.boot_id)
        data = stamp + packet_table.encode(row, values)
        packet = space_packets.Packet(space_packets.TELEMETRY, row.apid, self._numbers[row.apid], data, secondary=True)
        self._out.append(space_packets.encode(packet))
        self._numbers[row.apid] += 1
        self.counts["sent"] += 1
