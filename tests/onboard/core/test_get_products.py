"""`get height_std`, `get scan`, `get nsp`, `get record`: what comes down is what was seen, decided and recorded."""

from dataclasses import replace

import numpy as np
import pytest
from mcap.reader import make_reader

from hil.devices.can.nodes import build_nodes
from onboard import config
from onboard.core.modes.product_orders import SLICE_BYTES
from onboard.core.rover import Rover
from onboard.core.tick import tick
from onboard.drivers.platform.workers import Inline
from onboard.perception.map import ldem
from onboard.perception.map.height_spread import height_std_m
from onboard.perception.scan.cloud import cloud
from onboard.record.reader import open_record
from onboard.record.replay import replay
from onboard.record.slice import SLIM_LEAVES_OUT, record_slice
from onboard.record.writer import Recorder
from onboard.records import Inputs, LinkMessage
from protocol.conventions import TICK_NS
from protocol.link import bulk
from protocol.link.datagrams import DatagramKind, payload_limit
from protocol.link.transactions import RequestState
from protocol.products.height_std import decode_height_std
from protocol.products.nsp import decode_nsp
from protocol.products.scan import decode_scan
from protocol.tables import commands
from protocol.tables.modes import Phase
from tests.onboard.core_bench import QUICK, STATION, CoreBench, quick
from tests.onboard.record_rig import standing

S = 1_000_000_000


def bench(**sections):
    made = CoreBench(settings=quick(**sections))
    made.settle()
    return made


def refused(rover, **arguments):
    request = rover.order("get", **arguments)
    rover.run(0.3)
    assert rover.states(request)[-1] is RequestState.FAILED
    return rover.text(request)


def delivered(rover, **arguments):
    """The object that a `get` brings, received as the ground does, and the text of its completion."""
    receiver, got = bulk.Receiver(payload_limit(QUICK.link.rate_bps)), []
    request = rover.order("get", **arguments)
    for _ in range(6000):
        for kind, payload in rover.step().link_payloads:
            if kind == DatagramKind.BULK_CHUNK:
                found = receiver.receive(payload, rover.now_ns)
                got += [found] if found and found.name == arguments["product"] else []  # a goto's way comes as well
        if got:
            break
        for bitmap in receiver.send(rover.now_ns):
            rover.hear(LinkMessage(rover.now_ns, True, "ok", STATION, DatagramKind.BULK_BITMAP, bitmap))
    assert rover.states(request)[-1] is RequestState.COMPLETED
    return got[-1].data, rover.text(request)


@pytest.fixture(scope="module")
def explorer():
    """A rover that explores and has taken its first decision."""
    rover = bench(mission=config.Mission(strategy="explore"))
    rover.goto(7.0, 0.5)
    rover.until_driving()
    return rover


def test_before_the_first_scan_each_product_says_what_it_comes_after():
    rover = bench()
    assert "goto" in refused(rover, product="scan")
    assert "goto" in refused(rover, product="nsp")
    assert "record.path" in refused(rover, product="record")


def test_a_time_for_what_has_none_is_refused():
    assert "these are of `get record`" in refused(bench(), product="ldem", from_s=1.0)


def test_the_scan_comes_down_within_its_error_with_the_pose_at_which_it_entered_the_map(explorer):
    swept = explorer.rover.executive.tasks.swept
    data, _ = delivered(explorer, product="scan")
    back = decode_scan(data)
    ranges_m = np.stack([scan.ranges_m for scan in swept.sweep.scans]).astype(np.float64)
    assert np.nanmax(np.abs(back.ranges_m - ranges_m)) <= 0.001
    assert np.array_equal(np.isnan(back.ranges_m), np.isnan(ranges_m))
    assert np.array_equal(back.T_map_base, swept.pose.matrix())
    assert back.T_base_scanner[:3, 3].tolist() == [QUICK.rover.lidar_x_m, 0.0, QUICK.rover.lidar_z_m]


def test_the_decision_comes_down_with_its_best_place_alternatives_and_counts(explorer):
    result = explorer.rover.executive.tasks.latest
    found = result.report.next_position
    told = decode_nsp(delivered(explorer, product="nsp")[0])
    assert (told.kind, told.rule, told.reason) == (result.decision.kind, result.decision.rule, result.decision.reason)
    assert [(p.row, p.column) for p in told.places] == [c.cell for c in (found.best, *found.alternatives)]
    assert told.places[0].score == pytest.approx(told.places[0].gain_term + told.places[0].distance_term)
    assert told.rejected == dict(found.rejections)
    assert told.scored + sum(told.rejected.values()) == told.cells
    assert told.strategy == "explore" and told.goal_m == (7.0, 0.5)


def test_the_deviations_come_down_on_the_grid_of_the_map_within_their_error(explorer):
    cells, pose = explorer.rover.executive.tasks.memory.cells, explorer.rover.localisation.pose
    data, _ = delivered(explorer, product="height_std")
    grid, std_m = decode_height_std(data)
    true_m = height_std_m(ldem.window(cells, pose.x_m, pose.y_m, grid.cell_m * grid.rows))
    known = np.isfinite(true_m)
    assert known.sum() > 1000
    assert np.array_equal(np.isfinite(std_m), known)
    assert np.all(np.abs(np.log(std_m[known] / np.maximum(true_m[known], 1e-3))) <= np.log(2) / 4 + 1e-6)


def test_a_sweep_whose_turns_changed_their_geometry_gives_the_turns_that_are_alike():
    from onboard.perception.scan.scan_product import pack

    rover = bench()
    rover.goto(3.0, 0.5)
    rover.until_phase(Phase.MAPPING)
    rover.run(0.2)
    swept = rover.rover.executive.tasks.swept
    scans = swept.sweep.scans
    odd = replace(scans[3], ranges_m=scans[3].ranges_m[:-1], status=scans[3].status[:-1])
    back = decode_scan(pack((*scans[:3], odd, *scans[4:]), swept.sweep.tilt, (swept.pose, 1), QUICK.rover))
    assert len(back.start_ns) == len(scans) - 1
    seen = cloud(scans, swept.sweep.tilt, np.eye(4), QUICK.rover, QUICK.scanning, 0.02)
    assert len(seen.ends_m) > 0


# -- the record ------------------------------------------------------------------------------------------------


class Recorded:
    """A standing rover whose record is on a real disk, as the shell has it: jobs get the record's files."""

    def __init__(self, path, ticks, orders=()):
        settings = config.load(None, {"record.path": str(path), "clock.mode": "lockstep"})
        rover, nodes = Rover(settings, None), build_nodes(3)
        self.payloads, self._orders = [], dict(orders)
        with Recorder(settings, None) as recorder:
            jobs = Inline({"onboard.record.slice:record_slice": (recorder.paths,)})
            for number in range(1, ticks + 1):
                now_ns = number * TICK_NS
                nodes.step(now_ns, standing(now_ns))
                inputs = Inputs(
                    number,
                    now_ns,
                    can_frames=tuple(nodes.send()),
                    record=recorder.status,
                    link_messages=self._message(number),
                    jobs=jobs.take(jobs.due(number)),
                )
                outputs = tick(rover, inputs)
                jobs.start(outputs.jobs, outputs.cancelled)
                for frame in outputs.can_frames:
                    nodes.receive(frame, now_ns)
                recorder.write(inputs, outputs)
                self.payloads += [(now_ns, *payload) for payload in outputs.link_payloads]

    def _message(self, number):
        if number not in self._orders:
            return ()
        order = commands.Telecommand(number, number * TICK_NS, 0, "get", self._orders[number])
        return (LinkMessage(number * TICK_NS, True, "ok", 3, DatagramKind.TELECOMMAND, commands.encode(order)),)

    @property
    def product(self):
        receiver = bulk.Receiver(payload_limit(QUICK.link.rate_bps))
        made = [receiver.receive(data, at_ns) for at_ns, kind, data in self.payloads if kind == DatagramKind.BULK_CHUNK]
        return next(product for product in made if product)


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """Ten seconds, of which seconds 1 to 3 are asked for at 4 s."""
    path = tmp_path_factory.mktemp("slice") / "run.mcap"
    return path, Recorded(path, 1000, [(400, {"product": "record", "from_s": 1.0, "to_s": 3.0})])


def test_a_slice_is_a_record_of_exactly_that_time_with_the_same_messages(flown, tmp_path):
    path, run = flown
    assert (run.product.name, run.product.codec) == ("record", "mcap")
    out = tmp_path / "slice.mcap"
    out.write_bytes(run.product.data)
    whole, part = dict(open_record(path).ticks()), dict(open_record(out).ticks())
    assert part == {number: messages for number, messages in whole.items() if 100 <= number <= 300}
    assert open_record(out).attachments.keys() == {"config.toml", "versions.json"}


def test_a_slice_opens_with_the_formats_own_reader_and_is_indexed(flown):
    import io

    reader = make_reader(io.BytesIO(flown[1].product.data), validate_crcs=True)
    assert reader.get_summary().statistics.chunk_count == 5  # whole half seconds, and the tick at the end
    times = [message.log_time for _, _, message in reader.iter_messages()]
    assert (min(times), max(times)) == (1 * S, 3 * S)


def test_a_run_in_which_a_slice_was_sent_replays_to_the_same_bytes(flown):
    verdict = replay(flown[0])
    assert verdict.identical, verdict.first_difference


def sliced(path, since_s, until_s, slim=False, limit=SLICE_BYTES):
    return record_slice(lambda: [path], round(since_s * S), round(until_s * S), slim, limit)


def ticks_of(data, folder):
    out = folder / "part.mcap"
    out.write_bytes(data)
    return dict(open_record(out).ticks())


@pytest.mark.parametrize("limit", [45_000, 70_000, 90_000])
def test_a_slice_ends_at_a_whole_half_second_that_fits_and_says_so(flown, tmp_path, limit):
    data, about = sliced(flown[0], 0, 10, limit=limit)
    ticks = ticks_of(data, tmp_path)
    assert len(data) <= limit
    assert min(ticks) == 1 and max(ticks) % 50 == 49
    assert f"does not fit {limit} bytes" in about and f"{max(ticks) / 100:.2f} s" in about


def test_half_a_second_that_does_not_fit_is_said(flown):
    assert sliced(flown[0], 0, 10, limit=1000) == (b"", "half a second of it does not fit 1000 bytes; slim takes less")


def test_a_slim_slice_leaves_out_what_is_large(flown, tmp_path):
    whole, _ = sliced(flown[0], 1, 9)
    slim, _ = sliced(flown[0], 1, 9, slim=True)
    topics = {topic for messages in ticks_of(slim, tmp_path).values() for topic in messages}
    assert topics and not topics.intersection(SLIM_LEAVES_OUT)
    assert len(slim) < 0.7 * len(whole)


def test_a_time_that_the_record_does_not_hold_is_said(flown):
    assert sliced(flown[0], 20, 30) == (b"", "the record holds nothing from 20.00 s to 30.00 s")


def test_a_record_that_is_cut_off_anywhere_gives_its_whole_chunks_or_says_why(flown, tmp_path):
    whole = flown[0].read_bytes()
    for share in np.linspace(0, 1, 23):
        cut = tmp_path / "cut.mcap"
        cut.write_bytes(whole[: int(share * len(whole))])
        data, about = sliced(cut, 0, 10)
        assert about
        if data:
            numbers = sorted(ticks_of(data, tmp_path))
            assert numbers == list(range(1, len(numbers) + 1))


def test_a_record_with_a_flipped_byte_is_told_and_never_raises(flown, tmp_path):
    whole = bytearray(flown[0].read_bytes())
    generator, told = np.random.default_rng(5), 0
    for at in generator.integers(len(whole), size=40):
        bad = whole.copy()
        bad[at] ^= 0x55
        (tmp_path / "bad.mcap").write_bytes(bad)
        data, about = sliced(tmp_path / "bad.mcap", 0, 10)
        told += not data
        assert about
    assert told > 10


def test_a_record_that_is_gone_is_told(tmp_path):
    data, about = sliced(tmp_path / "nowhere.mcap", 0, 1)
    assert data == b"" and "cannot be read" in about


@pytest.mark.parametrize(("asked", "why"), [
    ({"from_s": 3.0, "to_s": 2.0}, "there is nothing"), ({"from_s": 50.0}, "up to 3.00 s now"),
])  # fmt: skip
def test_a_time_that_is_none_is_refused_with_what_there_is(tmp_path, asked, why):
    from protocol.link.transactions import decode_report

    run = Recorded(tmp_path / "run.mcap", 420, [(400, {"product": "record", **asked})])
    reports = [decode_report(data) for _, kind, data in run.payloads if kind == DatagramKind.REPORT]
    assert reports[-1].state is RequestState.FAILED and why in reports[-1].text
