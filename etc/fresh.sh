#!/bin/sh
# make fresh: README's two commands in a minimal Debian, twice: as an ordinary user who has no apt, and
# as root who has. Needs root and mmdebstrap.
#
#   sh etc/fresh.sh [user|root|both] [demo|test|both]
#
# FRESH_ROOT names a folder to keep and use again; else the system is thrown away.
set -eu
who=${1:-both}
what=${2:-both}
project=$(cd "$(dirname "$0")/.." && pwd)
root=${FRESH_ROOT:-$(mktemp -d)}
[ -n "${FRESH_ROOT:-}" ] || trap 'rm -rf "$root"' EXIT

debian() { sh "$project/etc/minimal-debian.sh" "$@"; }

if [ ! -e "$root/usr/bin/make" ]; then
    echo "making a minimal Debian"
    debian make "$root" bookworm git make python3-venv
fi

# One command as one of them: its last lines, its exit code, its time.
run() {
    echo "== $1: make $2"
    begin=$(date +%s)
    code=0
    debian run "$root" "$([ "$1" = user ] && echo robot || echo root)" "cd sdrlinkd && make $2" \
        > "$root/tmp/$1-$2.log" 2>&1 || code=$?
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
