#!/bin/sh
# The project in a fresh Debian, as a new user would have it: a root of its own with the packages of the README, an
# unprivileged user, a path with a space, LANG=C. Arguments: the release, then the targets to make; default
# .venv/.project and demo. Needs root (mounts in a namespace of its own) and mmdebstrap or debootstrap.
#
#   sh tools/fresh_root.sh bookworm .venv/.project demo test
#   sh tools/fresh_root.sh trixie             its Python is too new: 3.11 comes from Debian 12, as the message asks for
#
# Roots stay in build/roots/RELEASE; the certificate of a demo is stored as build/roots/RELEASE.certificate.json.
# ROOT_MIRROR is the mirror, by default that of this machine's apt. pip gets this machine's configuration.
set -eu
cd "$(dirname "$0")/.."
release=${1:?which release? sh tools/fresh_root.sh bookworm|trixie [TARGET ...]}
shift
[ $# -gt 0 ] || set -- .venv/.project demo
if [ "$(id -u)" != 0 ]; then
    echo "fresh_root: needs root for a root of its own: sudo sh tools/fresh_root.sh $release" >&2
    exit 77
fi

mirror=${ROOT_MIRROR:-$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Label: Debian' | head -n 1)}
if [ -z "$mirror" ]; then
    echo "fresh_root: apt names no Debian mirror: set ROOT_MIRROR=URL, or run apt-get update" >&2
    exit 69
fi
root=$(pwd)/build/roots/$release
place="/home/rover/el dorado"
packages="g++,make,git,ca-certificates"

make_root() {
    rm -rf "$root" "$root.new"
    mkdir -p "$(dirname "$root")"
    if command -v mmdebstrap >/dev/null; then
        mmdebstrap --quiet --variant=minbase --include="$packages,$python" "$first" "$root.new" "$mirror" \
            ${second:+"$second"}
    elif command -v debootstrap >/dev/null; then
        [ -z "$second" ] || { echo "fresh_root: $release needs mmdebstrap (two releases in one root)" >&2; exit 69; }
        debootstrap --variant=minbase --include="$packages,$python" "$first" "$root.new" "$mirror" >/dev/null
    else
        echo "fresh_root: neither mmdebstrap nor debootstrap: sudo apt-get install -y mmdebstrap" >&2
        exit 69
    fi
    chroot "$root.new" useradd --create-home --shell /bin/sh rover
    mv "$root.new" "$root"
}

case $release in
bookworm) first=bookworm python=python3,python3-venv,python3-dev second= ;;
*) first=$release python=python3.11,python3.11-venv,python3.11-dev second="deb $mirror bookworm main" ;;
esac
[ -d "$root" ] || make_root

# the sources as they are committed, without this machine's git settings and hooks; what was built before stays
export GIT_CONFIG_NOSYSTEM=1 GIT_CONFIG_GLOBAL=/dev/null GIT_CONFIG_COUNT=1
export GIT_CONFIG_KEY_0=safe.directory GIT_CONFIG_VALUE_0="*"
if [ -d "$root$place/.git" ]; then
    git -C "$root$place" fetch --quiet "$(pwd)" HEAD
    git -C "$root$place" reset --quiet --hard FETCH_HEAD
else
    git clone --quiet --no-hardlinks . "$root$place"
fi
chroot "$root" chown -R rover: /home/rover
for file in /etc/resolv.conf /etc/hosts /etc/pip.conf /etc/ssl/certs/ca-certificates.crt; do
    [ ! -f "$file" ] || cp -L "$file" "$root$file"
done
pip=$(env | grep -E '^PIP_(INDEX_URL|DEFAULT_TIMEOUT|CERT|EXTRA_INDEX_URL|TRUSTED_HOST)=' || true)

status=0
for target in "$@"; do
    echo "== $release: make $target"
    # shellcheck disable=SC2016,SC2086 # $1 to $3 are of the inner shell; each variable of pip is one word
    unshare --mount --pid --fork sh -ec '
        mount -t proc proc "$1/proc"; mount --rbind /dev "$1/dev"
        where=$2 target=$3 root=$1; shift 3
        exec chroot --userspec=rover:rover "$root" env -i HOME=/home/rover USER=rover LANG=C \
            PATH=/usr/local/bin:/usr/bin:/bin "$@" sh -c "cd \"\$1\" && make \"\$2\"" sh "$where" "$target"
    ' sh "$root" "$place" "$target" $pip || status=1
done
made="$root$place/build/demo/certificate.json"
[ ! -f "$made" ] || cp "$made" "build/roots/$release.certificate.json"
exit $status
