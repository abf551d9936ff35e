#!/bin/sh
# Names each missing system package with the command that installs it. Argument: the Python to use.
python=$1
missing=""
command -v g++ >/dev/null || missing="$missing g++"
command -v git >/dev/null || missing="$missing git"
if [ -z "$python" ] || ! command -v "$python" >/dev/null; then
    missing="$missing python3 python3-venv python3-dev"
else
    "$python" -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))' || {
        echo "Python 3.11 is needed (the bench's physics has wheels up to 3.11); $python is $("$python" -V 2>&1)." >&2
        echo "Name one: make PYTHON=/path/to/python3.11 ..." >&2
        exit 1
    }
    "$python" -c 'import ensurepip, venv' 2>/dev/null || missing="$missing python3-venv"
    header=$("$python" -c 'import sysconfig; print(sysconfig.get_path("include"))')/Python.h
    [ -f "$header" ] || missing="$missing python3-dev"
fi
if [ -n "$missing" ]; then
    echo "Missing on this machine:$missing. Install with: sudo apt-get install -y$missing" >&2
    exit 1
fi
