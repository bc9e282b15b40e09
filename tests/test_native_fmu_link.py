"""Native FMUs: several in one program, and both ways to the accelerations."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

import kr16cli
import native_fmus as native
from kr16cli.fmi import compiling
from kr16cli.fmi.native import generate, sources, stepped, table
from kr16cli.fmi.variables import Part, Start, six

COMPILER = compiling.find_compiler()
pytestmark = pytest.mark.skipif(COMPILER is None, reason="no C compiler")

_PROGRAM = """
#include <stdio.h>
#include <stddef.h>
#define DECLARED(p) \\
    void *p##fmi2Instantiate(const char *, int, const char *, const char *, const void *, int, \\
                             int); \\
    int p##fmi2SetupExperiment(void *, int, double, double, int, double); \\
    int p##fmi2EnterInitializationMode(void *); \\
    int p##fmi2ExitInitializationMode(void *); \\
    int p##fmi2DoStep(void *, double, double, int); \\
    int p##fmi2GetReal(void *, const unsigned *, size_t, double *); \\
    void p##fmi2FreeInstance(void *); \\
    static double p##run(double step) \\
    { \\
        const unsigned reference = ANGLE; \\
        double sum = 0.0, value; \\
        void *c = p##fmi2Instantiate("one", 1, "", NULL, NULL, 0, 0); \\
        if (!c || p##fmi2SetupExperiment(c, 0, 0.0, 0.0, 0, 0.0) || \\
            p##fmi2EnterInitializationMode(c) || p##fmi2ExitInitializationMode(c)) \\
            return -1.0; \\
        for (int k = 0; k < 10; k++) { \\
            if (p##fmi2DoStep(c, k * step, step, 1) || p##fmi2GetReal(c, &reference, 1, &value)) \\
                return -2.0; \\
            sum += value; \\
        } \\
        p##fmi2FreeInstance(c); \\
        return sum; \\
    }
DECLARED(first_)
DECLARED(second_)
int main(void)
{
    printf("%.17g %.17g %.17g\\n", first_run(0.01), second_run(0.01), second_run(0.02));
    return 0;
}
"""


def test_two_fmus_link_into_one_program(tmp_path: Path) -> None:
    assert COMPILER is not None
    files = sources.complete(generate.generic())
    for name, text in files.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    known = table.variables(kr16cli.load_data(), Start(q=(0.0,) * 6), Part.ROBOT, version=2)
    angle = 1 + [v.name for v in known].index("q[2]")
    (tmp_path / "main.c").write_text(_PROGRAM.replace("ANGLE", str(angle)), encoding="utf-8")
    units = sources.units(files)
    for prefix in ("first_", "second_"):
        folder = tmp_path / prefix
        folder.mkdir()
        given = ["-c", "-O0", "-std=c11", "-I..", f"-DFMI2_FUNCTION_PREFIX={prefix}"]
        subprocess.run(
            [COMPILER, *given, *(f"../{name}" for name in units)], cwd=folder, check=True
        )
    objects = [str(path) for path in tmp_path.glob("*_/*.o")]
    subprocess.run(
        [COMPILER, "main.c", *objects, "-lm", "-o", "both"],
        cwd=tmp_path, check=True,
    )  # fmt: skip
    done = subprocess.run([tmp_path / "both"], capture_output=True, text=True, check=True)
    first, second, other = map(float, done.stdout.split())
    assert first == second
    assert first != 0.0
    assert other != first


_BITS = """
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "kr16_names.h"
#include "kr16_fmu.h"
#include "kr16_math.h"
int main(void)
{
    const double reach[] = {KR16_FARTHEST, 7.0, 1e-3, 0.0};
    long differing = 0;
    srand(1);
    for (int k = 0; k < 200000; k++) {
        double q[6], cs[12], sine, cosine;
        for (int i = 0; i < 6; i++)
            q[i] = (2.0 * rand() / RAND_MAX - 1.0) * reach[k % 4];
        kr16_trig(q, cs);
        for (int i = 0; i < 6; i++) {
            kr16_sincos(q[i], &sine, &cosine);
            differing += memcmp(&sine, cs + 6 + i, 8) || memcmp(&cosine, cs + i, 8);
        }
    }
    printf("%ld\\n", differing);
    return 0;
}
"""


def test_two_angles_at_once_give_the_same_bits_as_one(tmp_path: Path) -> None:
    assert COMPILER is not None
    for name, text in {**sources.complete(generate.generic()), "main.c": _BITS}.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    command = [COMPILER, "-O2", "-std=c11", "-ffp-contract=off", "main.c", "trig.c", "-lm"]
    subprocess.run([*command, "-o", "bits"], cwd=tmp_path, check=True)
    done = subprocess.run([tmp_path / "bits"], capture_output=True, text=True, check=True)
    assert done.stdout == "0\n"


def test_a_load_off_the_axis_goes_the_general_way_to_the_same_accelerations() -> None:
    assert {6, 7} <= set(stepped.zeros())  # gravity's x and y
    load = {"payload__mass": 8.0, "payload__com__z": 0.1}
    start = {"qd_start[1]": 0.5, "qd_start[4]": -1.0, "qd_start[6]": 2.0, "tau[5]": 30.0}
    found = []
    for off in (0.0, 1e-20):
        instance = native.Instance(native.file(2))
        instance.set([*start], [*start.values()])
        instance.begin(**load, payload__com__y=off)
        found.append(instance.get(six("qdd")))
        instance.close()
    assert found[0] != found[1]
    assert found[0] == pytest.approx(found[1], rel=1e-10, abs=1e-10)
