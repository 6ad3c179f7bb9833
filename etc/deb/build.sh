#!/bin/sh
# make deb: dist/sdrlinkd_VERSION_ARCH.deb, for the Debian or Ubuntu and the architecture that it runs on.
#
# The package brings an environment of its own in /opt/sdrlinkd, made with the system's Python and with the
# versions in constraints.txt. Plain dpkg-deb does it: debhelper and dh-virtualenv need a source package,
# and would not shorten this.
#
# It needs gcc and python3-venv.
#
#   DEB_PYTHON     the system's Python that the environment is bound to; default: /usr/bin/python3
#   DEB_BUILD      folder to build in, made anew; default: build/deb
#   DEB_OUT        folder for the package; default: dist
set -eu
umask 022
cd "$(dirname "$0")/../.."
python=${DEB_PYTHON:-/usr/bin/python3}
home=/opt/sdrlinkd
build=${DEB_BUILD:-$PWD/build/deb}
root=$build/root
env=$root$home
command -v dpkg-deb >/dev/null || { echo "make deb needs dpkg-deb: it runs on Debian and Ubuntu" >&2; exit 2; }
version=$(sed -n 's/^__version__ = "\(.*\)"$/\1/p' sdrlinkd/__init__.py)
arch=$(dpkg --print-architecture)
# Files are as old as the last commit, so the same source makes the same package.
SOURCE_DATE_EPOCH=$(git log -1 --format=%ct 2>/dev/null || date +%s)
export SOURCE_DATE_EPOCH

rm -rf "$build"
mkdir -p "$root" "$build/wheels"

# The environment: its files lie below $root, and say that they lie in /opt/sdrlinkd.
environment() {
    "$python" -m venv "$build/tools"
    tools=$build/tools/bin/python3
    pip="$tools -m pip --quiet --disable-pip-version-check"
    $pip install -c constraints.txt hatchling
    "$tools" -m hatchling build -t wheel -d "$build/wheels"
    "$python" -m venv --without-pip "$env"
    $pip --python "$env/bin/python3" install --no-compile --no-warn-script-location -c constraints.txt \
        "$(echo "$build"/wheels/sdrlinkd-*.whl)[plots,metrics,zenoh,web,foxglove]"
    site=$(echo "$env"/lib/python3.*/site-packages)
    # The modem for any machine of this architecture; a library for this one alone is of no use elsewhere.
    rm -rf "$site/phy/engine/libraries"
    mkdir "$site/phy/engine/libraries"
    families=$(here -c 'from phy.engine import targets
print(*(each.name for each in targets.FAMILIES if each.is_of_this_machine))')
    for each in $families; do
        here -m sdrlinkd.cli phy compile --for "$each"
        library=$(here -c "from phy import engine; print(engine.place(engine.TARGETS['$each']))")
        cp "$library" "$site/phy/engine/libraries/"
    done
    # Only our own programs are for people; scripts that activate an environment would name this folder.
    for each in "$env"/bin/*; do
        case "$(basename "$each")" in python*|sdrlinkd|sdrlinkctl|sdrlink-*) ;; *) rm "$each" ;; esac
    done
    rm -f "$site"/*.dist-info/direct_url.json "$site"/*.dist-info/REQUESTED
    grep -rIl "$root" "$env/bin" "$env/pyvenv.cfg" | xargs sed -i "s|$root||g"
    # Bytecode, as nobody who runs this may write it: else each start of the daemon took a second more.
    "$python" -m compileall -q -j0 -s "$root" -p / --invalidation-mode unchecked-hash "$site"
}

# The environment's Python with the modules of this folder, where compiled libraries are kept.
here() { PYTHONDONTWRITEBYTECODE=1 "$env/bin/python3" "$@"; }

# What the rest of the system sees: programs, pages, completions, units, configuration.
system() {
    mkdir -p "$root/usr/bin" "$root/usr/lib/systemd/system" "$root/etc/sdrlinkd"
    for each in sdrlinkd sdrlinkctl sdrlink-ether sdrlink-gateway; do
        ln -s "$home/bin/$each" "$root/usr/bin/$each"
    done
    for each in docs/man/*.[1-8]; do
        install -D -m 644 "$each" "$root/usr/share/man/man${each##*.}/$(basename "$each")"
    done
    completion bash usr/share/bash-completion/completions/%
    completion zsh usr/share/zsh/vendor-completions/_%
    completion fish usr/share/fish/vendor_completions.d/%.fish
    install -m 644 systemd/*.service "$root/usr/lib/systemd/system/"
    install -D -m 644 etc/deb/sysusers.conf "$root/usr/lib/sysusers.d/sdrlinkd.conf"
    install -m 644 etc/sdrlinkd.toml etc/registry.csv "$root/etc/sdrlinkd/"
    doc=$root/usr/share/doc/sdrlinkd
    install -D -m 644 etc/deb/copyright "$doc/copyright"
    install -m 644 CHANGELOG.md "$doc/"
    SBOM_PYTHON=$python sh etc/sbom.sh "$env/bin/python3" "$doc/sbom.cdx.json"
    printf 'sdrlinkd (%s) stable; urgency=medium\n\n  * See CHANGELOG.md.gz.\n\n -- %s  %s\n' "$version" \
        "$(sed -n 's/^Maintainer: //p' etc/deb/control)" "$(date -uRd "@$SOURCE_DATE_EPOCH")" > "$doc/changelog"
    install -D -m 644 etc/deb/lintian-overrides "$root/usr/share/lintian/overrides/sdrlinkd"
    gzip -9n "$doc"/CHANGELOG.md "$doc/changelog" "$root"/usr/share/man/man*/*
}

# A shell finds them by their names. zsh reads the first line, and calls the file as the completion itself.
completion() {
    for each in sdrlinkctl sdrlink-ether sdrlink-gateway; do
        to=$root/$(echo "$2" | sed "s/%/$each/")
        mkdir -p "$(dirname "$to")"
        variable="_$(echo "$each" | tr 'a-z-' 'A-Z_')_COMPLETE"
        env "$variable=source_$1" "$env/bin/python3" "$env/bin/$each" | sed '/./,$!d' > "$to"
        [ "$1" != zsh ] || echo "_$(echo "$each" | tr - _)_completion" >> "$to"
    done
}

control() {
    mkdir -p "$root/DEBIAN"
    install -m 755 etc/deb/postinst etc/deb/prerm etc/deb/postrm "$root/DEBIAN/"
    (cd "$root" && find etc -type f -printf '/%p\n' | sort) > "$root/DEBIAN/conffiles"
    (cd "$root" && find opt usr -type f -print0 | sort -z | xargs -0 md5sum) > "$root/DEBIAN/md5sums"
    minor=$("$python" -c 'import sys; print(sys.version_info[1])')
    sed -e "s/@VERSION@/$version/" -e "s/@ARCH@/$arch/" \
        -e "s/@SIZE@/$(du -sk --exclude=DEBIAN "$root" | cut -f1)/" \
        -e "s/@MINOR@/$minor/" -e "s/@NEXT@/$((minor + 1))/" etc/deb/control > "$root/DEBIAN/control"
}

environment
system
control
mkdir -p "${DEB_OUT:-dist}"
# zstd: every system that the package is for reads it, and a small computer unpacks it in seconds.
dpkg-deb --root-owner-group -Zzstd -z9 --build "$root" "${DEB_OUT:-dist}/sdrlinkd_${version}_$arch.deb"
