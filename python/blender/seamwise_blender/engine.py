"""Seamwise as the Python package or as the program: files in, files and figures out.

Nothing here touches Blender's data, so that it may run in a thread of its own.
"""

import json
import os
import shutil
import subprocess
import tempfile
from pathlib import Path


class Failed(Exception):
    """What the user is told."""


class Canceled(Exception):
    """The user has had enough."""


class Watch:
    """How far the work is; once canceled, the next step of it ends it."""

    def __init__(self):
        self.stage, self.done, self.total = "starting", 0, 0
        self.canceled = False

    def __call__(self, stage, done, total):
        if self.canceled:
            raise Canceled
        self.stage, self.done, self.total = stage, done, total


def find(program=""):
    """The engine to use: the program that was named, the package, or the program on the path."""
    if program:
        if not os.access(program, os.X_OK):
            raise Failed(f"{program}, named in the add-on's preferences, is no program")
        return Program(program)
    try:
        import seamwise
    except ImportError:
        found = shutil.which("seamwise")
        if not found:
            raise Failed(
                "Seamwise is not there: install the add-on with the Python package in it, "
                "or name the program in the add-on's preferences"
            ) from None
        return Program(found)
    return Package(seamwise)


class Package:
    """The Python package."""

    def __init__(self, package):
        self.package = package

    def bake(self, source, folder, options, watch):
        return self._call(self.package.bake, source, folder, **options, progress=watch).report

    def repair(self, image, output, mesh, role, watch):
        watch("repair", 0, 1)
        return self._call(self.package.repair_file, image, output, mesh=mesh, role=role)

    def evaluate(self, reference, candidates, watch):
        watch("evaluate", 0, 1)
        return self._call(self.package.evaluate, reference, candidates)

    def _call(self, function, *arguments, **keywords):
        try:
            return function(*arguments, **keywords)
        except self.package.Error as error:
            raise Failed(str(error)) from error


class Program:
    """The program."""

    def __init__(self, path):
        self.path = path

    def bake(self, source, folder, options, watch):
        arguments = ["bake", source, "-o", folder]
        arguments += ["--ratios", ",".join(str(ratio) for ratio in options["ratios"])]
        arguments += ["--textures", options["textures"]]
        arguments += [] if options["evaluate"] else ["--no-evaluate"]
        arguments += ["--reach-target"] if options["reach_target"] else []
        self._run("bake", arguments, watch)
        return json.loads((Path(folder) / f"{Path(source).stem}.json").read_bytes())

    def repair(self, image, output, mesh, role, watch):
        return self._figures(["repair", image, "-o", output, "--mesh", mesh, "--role", role], watch)

    def evaluate(self, reference, candidates, watch):
        told = self._figures(["evaluate", reference, *candidates], watch)
        return [own["metrics"] for own in told["candidates"]]

    def _figures(self, arguments, watch):
        with tempfile.TemporaryDirectory() as folder:
            figures = Path(folder) / "figures.json"
            self._run(arguments[0], [*arguments, "--json", figures], watch)
            return json.loads(figures.read_bytes())

    def _run(self, stage, arguments, watch):
        command = [self.path, "--quiet", *map(str, arguments)]
        with tempfile.TemporaryFile() as said:
            with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=said) as process:
                while True:
                    try:
                        process.wait(0.2)
                        break
                    except subprocess.TimeoutExpired:
                        try:
                            watch(stage, 0, 0)
                        except Canceled:
                            process.terminate()
                            raise
            if process.returncode:
                said.seek(0)
                text = said.read().decode(errors="replace").strip()
                raise Failed(text or f"{self.path} ended with {process.returncode}")
