"""Programs of others: LabRecorder records our amplifier, and libxdf reads our files. Neither is part of this project.

``LABRECORDER`` names LabRecorder's program for the command line (App-LabRecorder, built with
``-DLABRECORDER_BUILD_GUI=OFF``), ``LIBXDF`` the folder of libxdf's source with ``build/libxdf.a`` in it.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from live_clocks import acquired, with_log
from live_lab import Lab, Row


def labrecorder(lab: Lab) -> Iterator[Row]:
    """What LabRecorder records of our amplifier and markers comes in by ``acquire``, each move on its sample."""
    program = os.environ.get("LABRECORDER", "")
    if not Path(program).is_file():
        yield "SKIPPED: LABRECORDER names no program: build App-LabRecorder without its window", True, ""
        return
    sent = with_log(lab)
    place = lab.folder / "recordings" / "s01" / "one" / "labrecorder.xdf"
    place.parent.mkdir()
    with lab.amplifier("--replay"):
        recorder = subprocess.Popen(
            [program, str(place), 'name="actiCHamp"', 'name="hrcneuro-moves"'],
            env=lab.environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        )  # fmt: skip
        time.sleep(45 if lab.brief else 120)
        out, _ = recorder.communicate("\n", timeout=60)
    yield f"LabRecorder wrote {place.stat().st_size / 1e6:.1f} MB", recorder.returncode == 0, out[-300:]
    yield from acquired(lab, sent, "from LabRecorder")


def libxdf(lab: Lab) -> Iterator[Row]:
    """libxdf, in C++, reads in our file what pyxdf reads."""
    folder = Path(os.environ.get("LIBXDF", ""))
    compiler = shutil.which("g++") or shutil.which("clang++")
    if not (folder / "build" / "libxdf.a").is_file() or compiler is None:
        yield "SKIPPED: LIBXDF names no built libxdf, or there is no C++ compiler", True, ""
        return
    lab.start("acquire", "s01").communicate()
    with lab.amplifier("--replay"):
        lab.record("--seconds", "25" if lab.brief else "60")
    source, program = lab.folder / "dump.cpp", lab.folder / "dump"
    source.write_text(_DUMP)
    words = [compiler, "-std=c++20", f"-I{folder}", str(source), str(folder / "build" / "libxdf.a"), "-o", str(program)]
    subprocess.run(words, check=True)
    done = subprocess.run([str(program), str(lab.parts()[0])], capture_output=True, text=True, check=False)
    yield "libxdf opens our file", done.returncode == 0, done.stderr[-300:]
    # It says more than that.
    lines = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
    read = {one["name"]: one for one in lines}
    ours = lab.streams()
    for name, stream in ours.items():
        stamps, other = np.asarray(stream["time_stamps"]), read[name]
        same = len(stamps) == other["samples"]
        if len(stamps) and stream["info"]["channel_format"] == ["float32"]:
            values = np.asarray(stream["time_series"], float)
            # libxdf adds what was measured of the clocks.
            same &= abs(other["first"] - stamps[0]) < 1e-3 and bool(np.isclose(other["sum"], values.sum(), rtol=1e-9))
        yield f"{name}: {other['samples']:,} samples, as pyxdf reads them", bool(same), str(other)


_DUMP = r"""
#include "xdf.h"
#include <cstdio>
int main(int, char **argv) {
  Xdf file;
  if (file.load_xdf(argv[1])) return 1;
  for (std::size_t i = 0; i < file.streams.size(); i++) {
    auto &one = file.streams[i];
    double sum = 0;
    for (auto &row : one.time_series) for (float value : row) sum += value;
    std::size_t n = one.time_series.empty() ? 0 : one.time_series[0].size();
    if (one.info.channel_format == "string") {
      for (auto &event : file.eventMap) n += std::size_t(event.second) == i;
    }
    double first = one.time_stamps.size() ? one.time_stamps.front() : 0;
    std::printf("{\"name\": \"%s\", \"samples\": %zu, \"first\": %.9f, \"sum\": %.17g}\n",
                one.info.name.c_str(), n, first, sum);
  }
}
"""
