#!/bin/sh
# Downloads Debian's kernel (70 MB; it has CAN) into build/vcan, for the guest of `make test-vcan`. Installs nothing.
set -eu
cd "$(dirname "$0")/.."
mkdir -p build/vcan && cd build/vcan
kernel=$(apt-cache depends linux-image-amd64 2>/dev/null | sed -n 's/.*Depends: \(linux-image-.*-amd64\)$/\1/p' | head -1)
if [ -z "$kernel" ]; then
    echo "apt knows no kernel: run \`sudo apt-get update\` first; on a system other than Debian put a linux-image-*.deb" \
        "of Debian 12 into build/vcan" >&2
    exit 1
fi
ls "$kernel"_*.deb >/dev/null 2>&1 || apt-get download -qq "$kernel"
