#!/bin/sh
# Installs what etc/apt-packages.txt lists and this machine lacks: as root where apt is present, or
# when SDRLINK_APT=1 asks for it (with sudo). Else says in one line what will be skipped.
set -eu
missing=""
what=""
while read -r package command reason; do
    case "$package" in ''|'#'*) continue ;; esac
    { command -v "$command" >/dev/null 2>&1 || [ -e "$command" ]; } && continue
    missing="$missing $package"
    what="${what:+$what, }$reason"
done < "$(dirname "$0")/apt-packages.txt"
[ -n "$missing" ] || exit 0
run=""
if [ "$(id -u)" != 0 ]; then
    [ "${SDRLINK_APT:-0}" = 1 ] || run=no
    [ "$run" = no ] || run=sudo
fi
if [ "$run" = no ] || ! command -v apt-get >/dev/null 2>&1; then
    echo "skipping $what: needs$missing (apt-get install$missing, or SDRLINK_APT=1 make test)"
    exit 0
fi
echo "installing$missing for $what"
$run apt-get update -qq
# shellcheck disable=SC2086
DEBIAN_FRONTEND=noninteractive $run apt-get install -y -qq --no-install-recommends $missing >/dev/null
