"""`onboard gdem import` asks nobody: whatever an elevation file says, no byte goes over the network."""

import socket
import subprocess
import sys
from contextlib import contextmanager

import numpy as np
import pytest

from tests.onboard.elevation_files import geotiff

VRT = """<VRTDataset rasterXSize="4" rasterYSize="4"><GeoTransform>0,80,0,320,0,-80</GeoTransform>
<VRTRasterBand dataType="Float32" band="1"><SimpleSource><SourceFilename>/vsicurl/http://127.0.0.1:{port}/x.tif
</SourceFilename><SourceBand>1</SourceBand></SimpleSource></VRTRasterBand></VRTDataset>"""
WMS = """<GDAL_WMS><Service name="TMS"><ServerUrl>http://127.0.0.1:{port}/${{z}}/${{x}}/${{y}}.png</ServerUrl></Service>
<DataWindow><UpperLeftX>0</UpperLeftX><UpperLeftY>4</UpperLeftY><LowerRightX>4</LowerRightX><LowerRightY>0</LowerRightY>
<SizeX>256</SizeX><SizeY>256</SizeY><TileLevel>0</TileLevel></DataWindow><BandsCount>1</BandsCount></GDAL_WMS>"""
PDS = """PDS_VERSION_ID = PDS3
RECORD_TYPE = FIXED_LENGTH
^IMAGE = "heights.img"
OBJECT = COMPRESSED_FILE
 FILE_NAME = "inner.tif"
 ENCODING_TYPE = "JP2"
END_OBJECT = COMPRESSED_FILE
OBJECT = UNCOMPRESSED_FILE
 ^IMAGE = "inner.img"
 OBJECT = IMAGE
  LINES = 4
  LINE_SAMPLES = 4
  SAMPLE_TYPE = LSB_UNSIGNED_INTEGER
  SAMPLE_BITS = 8
 END_OBJECT = IMAGE
END_OBJECT = UNCOMPRESSED_FILE
END
"""


@contextmanager
def listening():
    """A server that nobody should call."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.setblocking(False)
        yield server


def calls(server):
    try:
        server.accept()[0].close()
    except BlockingIOError:
        return 0
    return 1 + calls(server)


def imported(*words):
    """In a process of its own: what GDAL knows it learns once. A call to the network would last the limit of 2 s."""
    code = "import os; os.environ['GDAL_HTTP_TIMEOUT'] = '2'; from onboard.__main__ import main; main()"
    command = [sys.executable, "-c", code, "gdem", "import", *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("text", [VRT, WMS], ids=["VRT", "WMS"])
def test_a_list_of_addresses_that_is_named_like_a_geotiff_is_no_elevation_file(tmp_path, text):
    with listening() as server:
        path = tmp_path / "heights.tif"
        path.write_text(text.format(port=server.getsockname()[1]))
        done = imported(path, "--source-cell", 80, "--out", tmp_path / "gdem.npz")
        assert calls(server) == 0
    assert done.returncode == 65 and "is no whole elevation file" in done.stderr and done.stderr.count("\n") == 1


def test_a_pds_label_that_names_another_file_reaches_no_network_through_it(tmp_path):
    with listening() as server:
        (tmp_path / "inner.tif").write_text(VRT.format(port=server.getsockname()[1]))
        (tmp_path / "heights.lbl").write_text(PDS)
        done = imported(tmp_path / "heights.lbl", "--source-cell", 80, "--out", tmp_path / "gdem.npz")
        assert calls(server) == 0
    assert done.returncode == 65 and done.stderr.count("\n") == 1


AUX = """<PAMDataset><SRS>http://127.0.0.1:{port}/crs.wkt</SRS><Metadata domain="OVERVIEWS">
<MDI key="OVERVIEW_FILE">/vsi{kind}/http://127.0.0.1:{port}/o.tif</MDI></Metadata></PAMDataset>"""


@pytest.mark.parametrize("kind", ["curl", "curl_streaming"])
def test_files_beside_a_geotiff_reach_no_network(tmp_path, kind):
    with listening() as server:
        port = server.getsockname()[1]
        path = geotiff(tmp_path / "a.tif", np.full((20, 20), 5.0))
        for ending in ("ovr", "msk"):
            (tmp_path / f"a.tif.{ending}").write_text(VRT.replace("/vsicurl", f"/vsi{kind}").format(port=port))
        (tmp_path / "a.tif.aux.xml").write_text(AUX.format(port=port, kind=kind))
        done = imported(path, "--out", tmp_path / "gdem.npz")
        assert calls(server) == 0
    assert done.returncode in (0, 65)


@pytest.mark.parametrize("before", ["http://", "/vsicurl/http://"])
def test_a_projection_is_a_name_or_a_text_and_no_address(tmp_path, before):
    with listening() as server:
        crs = f"{before}127.0.0.1:{server.getsockname()[1]}/crs.wkt"
        path = geotiff(tmp_path / "a.tif", np.full((20, 20), 5.0))
        done = imported(path, "--crs", crs, "--out", tmp_path / "gdem.npz")
        assert calls(server) == 0
    assert done.returncode == 65 and f"no projection called {crs!r}" in done.stderr
