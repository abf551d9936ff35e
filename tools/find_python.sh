#!/bin/sh
# Prints the Python to build .venv from. The distribution's own comes first where it is complete: it is built with
# profile-guided optimisation, which a Python that was compiled by hand often is not, and flies a fifth faster.
for python in /usr/bin/python3.11 python3.11 python3; do
    "$python" - 2>/dev/null <<'PY' && { command -v "$python"; exit 0; }
import ensurepip, os, sys, sysconfig, venv
sys.exit(sys.version_info[:2] != (3, 11) or not os.path.isfile(os.path.join(sysconfig.get_path("include"), "Python.h")))
PY
done
command -v python3.11 || command -v python3  # incomplete: tools/check_system.sh says what is missing
