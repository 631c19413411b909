"""Builds the Python module's library with CMake; everything else is in pyproject.toml."""

import os
import re
import subprocess
import sys
from pathlib import Path

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

source = Path(__file__).resolve().parent


class BuildWithCMake(build_ext):
    def build_extension(self, extension):
        # A folder that `./dev build` made may be given: then nothing is compiled twice.
        folder = Path(os.environ.get("ENSONIFY_BUILD", self.build_temp)).resolve()
        if not (folder / "CMakeCache.txt").exists():
            subprocess.run(["cmake", "-S", source, "-B", folder, "-G", "Ninja",
                            "-D", "CMAKE_BUILD_TYPE=Release", "-D", "BUILD_TESTING=OFF",
                            "-D", f"Python_EXECUTABLE={sys.executable}"], check=True)
        subprocess.run(["cmake", "--build", folder, "--target", "ensonify_python"], check=True)
        module, = (folder / "python" / "ensonify").glob("_ensonify*.so")
        self.copy_file(module, self.get_ext_fullpath(extension.name))


version, = re.findall(r"project\(ensonify VERSION ([0-9.]+)", (source / "CMakeLists.txt").read_text())
setup(version=version, ext_modules=[Extension("ensonify._ensonify", [])],
      cmdclass={"build_ext": BuildWithCMake})
