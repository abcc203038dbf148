"""Where a comparison with a peer runs: its packages, the binary, the assets and the outputs.

Standard library only, since it runs before the packages are there. Run by itself it installs them
and does nothing else.
"""

import argparse
import hashlib
import json
import os
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
ASSETS = ROOT.parent / "shared" / "assets"


def make_environment():
    """Makes a virtual environment with requirements.txt, unless it is there; returns its folder.

    It lies in $SEAMWISE_PEERS, or ~/.cache/seamwise-peers, under a name made of the pins and the
    interpreter, so a change of either makes a new one.
    """
    pins = (HERE / "requirements.txt").read_bytes()
    name = hashlib.sha256(pins + sys.version.encode()).hexdigest()[:16]
    default = Path.home() / ".cache" / "seamwise-peers"
    folder = Path(os.environ.get("SEAMWISE_PEERS") or default).absolute() / name
    python = folder / "bin" / "python"
    ready = folder / "ready"
    if not ready.exists():
        print(f"installing the peers into {folder}", file=sys.stderr)
        venv.create(folder, clear=True, with_pip=True)
        install = [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        subprocess.run([*install, "-r", HERE / "requirements.txt"], check=True)
        ready.touch()
    return folder


def enter_environment():
    """Starts the running script again in that environment; one that runs in it already goes on."""
    folder = make_environment()
    if Path(sys.prefix) == folder:
        return
    python = folder / "bin" / "python"
    # What the caller's own environment adds to the path would come before the pins.
    os.environ.pop("PYTHONPATH", None)
    os.execv(python, [str(python), *sys.argv])


def find_assets(names):
    """The paths of the named assets; none, with a message, where the folder is absent."""
    if not ASSETS.is_dir():
        print(f"skipped: {ASSETS} is absent")
        return []
    return [ASSETS / name for name in names]


class Tool:
    """The binary, and a folder for what it writes that goes when the script ends."""

    def __init__(self, description, add_options):
        """`add_options` adds a script's own to the parser; they are `options` then."""
        parser = argparse.ArgumentParser(
            description=description, formatter_class=argparse.RawDescriptionHelpFormatter
        )
        parser.add_argument("--seamwise", type=Path, help="the binary; built if not given")
        parser.add_argument("--keep", type=Path, help="leave what is written in this folder")
        add_options(parser)
        arguments = self.options = parser.parse_args()
        self._scratch = None
        if arguments.keep:
            arguments.keep.mkdir(parents=True, exist_ok=True)
            self.folder = arguments.keep
        else:
            self._scratch = tempfile.TemporaryDirectory(prefix="seamwise-peers-")
            self.folder = Path(self._scratch.name)
        self._binary = (arguments.seamwise or self._build()).resolve()

    @staticmethod
    def _build():
        subprocess.run(["cargo", "build", "--release", "--quiet"], cwd=ROOT, check=True)
        target = Path(os.environ.get("CARGO_TARGET_DIR") or "target")
        return ROOT / target / "release" / "seamwise"

    def run(self, *arguments):
        """Runs a subcommand and says nothing of it unless it fails."""
        command = [self._binary, "--quiet", *arguments]
        subprocess.run([str(word) for word in command], check=True)

    def bake(self, asset, levels):
        """These of the four levels of an asset."""
        self.run("bake", asset, "--no-evaluate", "-o", self.folder)
        levels = [self.folder / f"{asset.stem}_lod{level}.glb" for level in levels]
        assert all(level.is_file() for level in levels), levels
        return levels

    def evaluate(self, reference, candidates, *options):
        """The report of an evaluation."""
        report = self.folder / "report.json"
        self.run("evaluate", reference, *candidates, *options, "--json", report)
        return json.loads(report.read_text())


if __name__ == "__main__":
    make_environment()
