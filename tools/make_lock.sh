#!/bin/sh
# Makes requirements.lock from requirements.in: every version pinned, every hash named, no address in it.
# requirements-source.lock, the one package without a wheel, is maintained by hand (`pip hash` of its source).
# Needs a machine that reaches a package index; takes some minutes. Argument: a folder for the tool's own environment.
set -eu
home=${1:-build/lock}
python3.11 -m venv "$home" && "$home/bin/pip" install -q pip-tools
{
    echo "# Pinned and hashed: everything, build tools included. Made from requirements.in by tools/make_lock.sh."
    "$home/bin/pip-compile" -q --generate-hashes --allow-unsafe --no-header --no-annotate --strip-extras \
        --no-emit-index-url --no-emit-trusted-host --no-emit-find-links -o - requirements.in
} > requirements.lock
{
    echo "# What \`make site\` needs: pinned and hashed, made from requirements-site.in by tools/make_lock.sh; install with --no-deps."
    "$home/bin/pip-compile" -q --generate-hashes --allow-unsafe --no-header --no-annotate --strip-extras \
        --no-emit-index-url --no-emit-trusted-host --no-emit-find-links -c requirements.lock -o - requirements-site.in
} > requirements-site.lock
