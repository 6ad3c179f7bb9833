#!/bin/sh
# In namespaces of its own: a SoapySDRServer with the avahi and D-Bus that it wants, and then "$@".
set -eu
ip link set lo up
mount -t tmpfs tmpfs /run
mkdir -p /run/dbus
dbus-daemon --system --fork
avahi-daemon --daemonize --no-drop-root --no-chroot --no-rlimits 2>/dev/null || true
SoapySDRServer --bind=127.0.0.1:55132 >/dev/null 2>&1 &
server=$!
for _ in 1 2 3 4 5 6 7 8 9 10; do
    # It ends at once when avahi is not there.
    kill -0 $server || exit 77
    ss -ltn | grep -q ':55132 ' && break
    sleep 0.5
done
"$@"
