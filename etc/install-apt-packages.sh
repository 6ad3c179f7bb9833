#!/bin/sh
# Installs what etc/apt-packages.txt lists and this machine lacks. A person at a terminal is asked first;
# SDRLINK_APT=1 says yes (with sudo, where it is not root), SDRLINK_APT=0 says no. Who may not, or has no
# apt, is told nothing here: the tests say in one line what they leave out.
set -eu
missing=""
while read -r package command _; do
    case "$package" in ''|'#'*) continue ;; esac
    { command -v "$command" >/dev/null 2>&1 || [ -e "$command" ]; } && continue
    missing="$missing $package"
done < "$(dirname "$0")/apt-packages.txt"
[ -n "$missing" ] && command -v apt-get >/dev/null 2>&1 || exit 0
sudo=""
if [ "$(id -u)" != 0 ]; then
    [ "${SDRLINK_APT:-0}" = 1 ] || exit 0
    sudo=sudo
fi
if [ -z "${SDRLINK_APT:-}" ] && [ -t 0 ] && [ -t 1 ]; then
    printf 'some tests need system packages:%s\ninstall them with apt-get? [y/N] ' "$missing"
    read -r SDRLINK_APT
fi
case "${SDRLINK_APT:-1}" in 1|y|Y|yes) ;; *) exit 0 ;; esac
echo "installing$missing"
$sudo apt-get update -qq
# shellcheck disable=SC2086
DEBIAN_FRONTEND=noninteractive $sudo apt-get install -y -qq --no-install-recommends $missing >/dev/null
