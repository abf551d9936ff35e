"""Tests that need a real CAN interface or a drive over it are collected where `make test-vcan` says there is one."""

import os

collect_ignore_glob = [
    *(() if os.environ.get("EL_DORADO_CAN") else ("test_real_*.py",)),
    *(() if os.environ.get("EL_DORADO_DRIVES") else ("test_drive.py",)),
]
