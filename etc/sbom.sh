#!/bin/sh
# etc/sbom.sh PYTHON FILE: what is installed for PYTHON, as a bill of materials in CycloneDX (JSON).
#
# The same packages give the same file. The program that writes it gets an environment of its own below
# build/, with SBOM_PYTHON, by default python3.
set -eu
tools=$(dirname "$0")/../build/sbom
if [ ! -x "$tools/bin/cyclonedx-py" ]; then
    "${SBOM_PYTHON:-python3}" -m venv "$tools"
    "$tools/bin/python3" -m pip --quiet --disable-pip-version-check install 'cyclonedx-bom==7.5.0'
fi
"$tools/bin/cyclonedx-py" environment --output-reproducible --of JSON -o "$2" "$1"
