#!/bin/sh
# make fresh: README's two commands in a minimal Debian, twice: as an ordinary user who has no apt, and
# as root who has. Needs root and mmdebstrap. Packages come from where this machine's own come from:
# its apt sources and its pip configuration are handed in.
#
#   sh etc/fresh.sh [user|root|both] [demo|test|both]
#
# FRESH_ROOT names a folder to keep and use again; else the system is thrown away.
set -eu
who=${1:-both}
what=${2:-both}
suite=bookworm
project=$(cd "$(dirname "$0")/.." && pwd)

if [ "${FRESH_INSIDE:-}" = "" ]; then
    [ "$(id -u)" = 0 ] || { echo "make fresh needs root: it makes a system and changes into it" >&2; exit 2; }
    command -v mmdebstrap >/dev/null || { echo "make fresh needs mmdebstrap: apt-get install mmdebstrap" >&2; exit 2; }
    root=${FRESH_ROOT:-$(mktemp -d)}
    [ -n "${FRESH_ROOT:-}" ] || trap 'rm -rf "$root"' EXIT
    # Mounts and processes end with these namespaces.
    FRESH_INSIDE=$root unshare --mount --pid --fork --kill-child --mount-proc sh "$0" "$who" "$what"
    exit
fi
root=$FRESH_INSIDE

# This machine's Debian sources of that suite, without those of other packagers.
sources() {
    for file in /etc/apt/sources.list /etc/apt/sources.list.d/*; do
        { [ -f "$file" ] && grep -Eq "(^Suites:.*|^deb .*) $suite(-[a-z]+)?( |\$)" "$file"; } || continue
        cat "$file"
        echo
    done
}

# What pip is told here, and the folders and files that this names.
pip_settings() { python3 -m pip config list 2>/dev/null | sed -n "s/^[a-z:]*\.\([a-z-]*\)='\(.*\)'\$/\1 = \2/p"; }
pip_places() { pip_settings | grep -Eo "(file://)?/[^ ,]+" | grep -v '^//' | sed 's|^file://\(.*\)/[^/]*$|\1|'; }

hand_in() {
    if [ -d "$1" ]; then mkdir -p "$root$1"; else mkdir -p "$root$(dirname "$1")"; : >> "$root$1"; fi
    mount --rbind "$1" "$root$1"
}

if [ ! -e "$root/usr/bin/make" ]; then
    echo "making a minimal Debian ($suite)"
    sources | mmdebstrap --quiet --variant=minbase --include=ca-certificates,git,make,python3-venv "$suite" "$root" -
    chroot "$root" useradd --create-home --shell /bin/sh robot
fi
mount --rbind /dev "$root/dev"
mount -t tmpfs tmpfs "$root/dev/shm"
mount -t proc proc "$root/proc"
mount --rbind /sys "$root/sys"
cp /etc/resolv.conf /etc/hosts "$root/etc/"
{ echo "[global]"; pip_settings | sort -u -t= -k1,1; } > "$root/etc/pip.conf"
pip_places | sort -u | while read -r place; do [ ! -e "$place" ] || hand_in "$place"; done

as_user() { chroot --userspec=robot:robot "$root" env -i HOME=/home/robot USER=robot "$@"; }
as_root() { chroot "$root" env -i HOME=/root USER=root SDRLINK_APT=1 "$@"; }

# One command as one of them: its last lines, its exit code, its time.
run() {
    echo "== $1: make $2"
    begin=$(date +%s)
    code=0
    "as_$1" PATH=/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8 TERM=dumb COLUMNS=100 \
        ${http_proxy:+http_proxy="$http_proxy"} ${https_proxy:+https_proxy="$https_proxy"} \
        sh -c "cd ~/sdrlinkd && make $2" > "$root/tmp/$1-$2.log" 2>&1 || code=$?
    tail -n 25 "$root/tmp/$1-$2.log"
    echo "== $1: make $2: exit code $code after $(($(date +%s) - begin)) s"
    [ "$code" = 0 ] || failed="$failed $1:$2"
}

failed=""
for each in user root; do
    [ "$who" = both ] || [ "$who" = "$each" ] || continue
    home=$([ "$each" = user ] && echo /home/robot || echo /root)
    rm -rf "$root$home/sdrlinkd"
    git clone --quiet --no-hardlinks "$project" "$root$home/sdrlinkd"
    [ "$each" = root ] || chroot "$root" chown -R robot:robot "$home/sdrlinkd"
    for target in demo test; do
        [ "$what" = both ] || [ "$what" = "$target" ] || continue
        run "$each" "$target"
    done
done
[ -z "$failed" ] || { echo "failed:$failed"; exit 1; }
