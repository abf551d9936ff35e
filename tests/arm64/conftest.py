"""The tests over two drives are collected where `make test-arm64` says that there are any."""

import os

collect_ignore_glob = [] if os.environ.get("EL_DORADO_ARM64") else ["test_flight.py"]
