#!/bin/sh
# A minimal Debian in a folder, to try things in as on a new machine. Needs root and mmdebstrap.
# Packages come from where this machine's own come from: its apt sources and its pip configuration are
# handed in.
#
#   sh etc/minimal-debian.sh make FOLDER SUITE [PACKAGE…]
#       of the architecture $DEBIAN_ARCH; default: this machine's
#   sh etc/minimal-debian.sh run FOLDER USER COMMAND    a line for sh, at home; nothing outlives it
set -eu
action=$1 root=$2
shift 2

# This machine's Debian sources of a suite, without those of other packagers.
sources() {
    for file in /etc/apt/sources.list /etc/apt/sources.list.d/*; do
        { [ -f "$file" ] && grep -Eq "(^Suites:.*|^deb .*) $1(-[a-z]+)?( |\$)" "$file"; } || continue
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

make_it() {
    [ "$(id -u)" = 0 ] || { echo "it takes root to make a system and to change into it" >&2; exit 2; }
    command -v mmdebstrap >/dev/null || { echo "mmdebstrap is missing: apt-get install mmdebstrap" >&2; exit 2; }
    suite=$1
    shift
    sources "$suite" | mmdebstrap --quiet --variant=minbase \
        --architectures="${DEBIAN_ARCH:-$(dpkg --print-architecture)}" --include="$(echo "ca-certificates $*" | tr ' ' ,)" \
        "$suite" "$root" -
    chroot "$root" useradd --create-home --shell /bin/sh robot
}

enter() {
    mount --rbind /dev "$root/dev"
    mount -t tmpfs tmpfs "$root/dev/shm"
    mount -t proc proc "$root/proc"
    mount --rbind /sys "$root/sys"
    cp /etc/resolv.conf /etc/hosts "$root/etc/"
    { echo "[global]"; pip_settings | sort -u -t= -k1,1; } > "$root/etc/pip.conf"
    pip_places | sort -u | while read -r place; do [ ! -e "$place" ] || hand_in "$place"; done
    home=$([ "$1" = root ] && echo /root || echo "/home/$1")
    # root may install packages, and says so.
    apt=$([ "$1" = root ] && echo 1 || echo 0)
    exec chroot --userspec="$1:$1" "$root" env -i HOME="$home" USER="$1" PATH=/usr/sbin:/usr/bin:/sbin:/bin \
        LANG=C.UTF-8 TERM=dumb COLUMNS=100 DEBIAN_FRONTEND=noninteractive SDRLINK_APT="$apt" \
        ${http_proxy:+http_proxy="$http_proxy"} ${https_proxy:+https_proxy="$https_proxy"} \
        sh -e -c "cd 2>/dev/null || cd /; $2"
}

case $action in
    make) make_it "$@" ;;
    # Mounts and processes end with these namespaces.
    run) exec unshare --mount --pid --fork --kill-child --mount-proc sh "$0" enter "$root" "$@" ;;
    enter) enter "$@" ;;
    *) echo "make or run, not $action" >&2; exit 2 ;;
esac
