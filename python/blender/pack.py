#!/usr/bin/env python3
"""Packs the add-on for Blender, with the wheels of the package `seamwise` that it is to bring.

    python3 pack.py OUTPUT.zip [WHEEL.whl…]

A wheel for each system that Blender is to run on; without one the add-on uses the program.
"""

import pathlib
import sys
import zipfile

ADDON = pathlib.Path(__file__).parent / "seamwise_blender"
# Wheels are named for systems as Python knows them, extensions as Blender does.
PLATFORMS = {"manylinux": "linux-x64", "macosx": "macos-arm64", "win": "windows-x64"}


def main():
    output, *wheels = map(pathlib.Path, sys.argv[1:])
    manifest = (ADDON / "blender_manifest.toml").read_text()
    if wheels:
        names = ", ".join(f'"./wheels/{own.name}"' for own in wheels)
        systems = sorted({PLATFORMS[part] for part in PLATFORMS for own in wheels if f"-{part}" in own.name})
        platforms = ", ".join(f'"{own}"' for own in systems)
        head, table, rest = manifest.partition("\n[permissions]")
        manifest = f"{head}wheels = [{names}]\nplatforms = [{platforms}]\n{table}{rest}"
    with zipfile.ZipFile(output, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("blender_manifest.toml", manifest)
        for own in sorted(ADDON.glob("*.py")):
            archive.write(own, own.name)
        for own in wheels:
            archive.write(own, f"wheels/{own.name}")


main()
