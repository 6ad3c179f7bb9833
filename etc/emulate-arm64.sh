#!/bin/sh
# Runs a command where the kernel starts programs for 64-bit ARM, too, by qemu. Needs root and qemu-user-static.
# A user namespace of its own has the register of such programs, so the host's stays as it is (Linux 6.7).
#
#   sh etc/emulate-arm64.sh COMMAND…
set -eu
qemu=$(command -v qemu-aarch64-static) || { echo "qemu is missing: apt-get install qemu-user-static" >&2; exit 2; }
if [ "${EMULATE_INSIDE:-}" = "" ]; then
    EMULATE_INSIDE=1 unshare --user --mount --pid --fork --kill-child sh "$0" "$@" &
    other=$!
    while [ "$(readlink "/proc/$other/ns/user")" = "$(readlink /proc/self/ns/user)" ]; do sleep 0.05; done
    # Every user there is the same user here.
    echo "0 0 4294967295" > "/proc/$other/uid_map"
    echo "0 0 4294967295" > "/proc/$other/gid_map"
    wait "$other"
    exit
fi
unset EMULATE_INSIDE
while [ "$(id -u)" != 0 ]; do sleep 0.05; done
mount -t proc proc /proc
mount -t binfmt_misc binfmt_misc /proc/sys/fs/binfmt_misc
# The first octets of an executable for this machine and the mask of those that count. F: qemu is opened now,
# as it is not in the folders that are changed into.
magic='\x7fELF\x02\x01\x01\x00\x00\x00\x00\x00\x00\x00\x00\x00\x02\x00\xb7\x00'
mask='\xff\xff\xff\xff\xff\xff\xff\x00\xff\xff\xff\xff\xff\xff\xff\xff\xfe\xff\xff\xff'
printf '%s' ":qemu-aarch64:M::$magic:$mask:$qemu:F" > /proc/sys/fs/binfmt_misc/register
exec "$@"
