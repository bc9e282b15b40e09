"""What lies in native FMUs beside libraries: pages, licences, icon, terminals, references."""

from __future__ import annotations

import csv
import io
import math
import os
import shutil
import struct
import subprocess
import zipfile
from functools import lru_cache
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest
from fmpy.ssp.ssd import read_ssv

import kr16cli
import native_fmus as native
from kr16cli.fmi import choices, compiling
from kr16cli.fmi.native import build, library, references
from kr16cli.fmi.variables import Part, table

pytestmark = pytest.mark.skipif(
    compiling.find_compiler() is None and library.prebuilt() is None, reason="no C compiler"
)

KINDS = [(2, Part.ROBOT, False), (3, Part.ROBOT, False), (3, Part.ROBOT, True),
         (2, Part.CONTROLLER, False), (3, Part.CONTROLLER, False)]  # fmt: skip
_REF = references.FOLDER
_ROOT = Path(__file__).resolve().parent.parent
_SCHEMAS = Path(fmpy.__file__).parent
each_kind = pytest.mark.parametrize(("version", "part", "arrays"), KINDS)


@lru_cache
def _files(version: int, part: Part = Part.ROBOT, arrays: bool = False) -> dict[str, bytes]:
    with zipfile.ZipFile(io.BytesIO(native.content(version, part, arrays=arrays))) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


class _Page(HTMLParser):
    """Rows of tables, targets of links; tags that do not close are an error."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.rows: list[list[str]] = []
        self.links: list[str] = []
        self.text = ""
        self._open: list[str] = []
        self.feed(text)
        assert self._open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag != "meta":
            self._open.append(tag)
        self.links += [value or "" for name, value in attrs if name in ("href", "src")]
        if tag == "tr":
            self.rows.append([])
        elif tag in ("td", "th"):
            self.rows[-1].append("")

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data
        if self._open and self._open[-1] in ("td", "th"):
            self.rows[-1][-1] += data


@each_kind
def test_page_shows_every_variable_as_it_is(version: int, part: Part, arrays: bool) -> None:
    page = _Page(_files(version, part, arrays)["documentation/index.html"].decode())
    header, *rows = page.rows
    assert header[0] == "name"
    known = native.unpacked(native.file(version, part, arrays=arrays))[1].modelVariables
    assert len(rows) == len(known)
    for row, v in zip(rows, known, strict=True):
        name, causality, variability, unit, start, description = row
        assert name.partition(" (")[0] == v.name
        assert (causality, variability, description) == (v.causality, v.variability, v.description)
        assert unit == (v.declaredType.unit if v.declaredType and v.declaredType.unit else unit)
        if v.start is not None and v.type in ("Real", "Float64"):
            shown = [float(s) for s in start.split()]
            assert shown == pytest.approx([float(s) for s in v.start.split()], rel=1e-5)


def test_page_is_small_and_leads_to_what_is_there() -> None:
    for version in (2, 3):
        files = _files(version)
        text = files["documentation/index.html"].decode()
        page = _Page(text)
        assert len(text) < 40_000
        assert "{{" not in text
        assert page.links
        for link in page.links:
            place = Path(os.path.normpath(f"documentation/{link}")).as_posix()
            assert place in files
    heads = [_Page(_files(v)["documentation/index.html"].decode()).text.partition("Variables")[0]
             for v in (2, 3)]  # fmt: skip
    assert heads[0] == heads[1]


def test_licences_are_the_projects_and_those_of_the_headers_in_the_sources() -> None:
    for version in (2, 3):
        files = _files(version)
        own = files["documentation/licenses/license.txt"].decode()
        assert own == (_ROOT / "LICENSE").read_text(encoding="utf-8")
        others = files["documentation/licenses/fmi-headers.txt"].decode()
        headers = [n for n in files if n.startswith("sources/fmi") and n.endswith(".h")]
        assert len(headers) >= 6
        for header in headers:
            assert header.removeprefix("sources/") in others
        assert others.count("Redistributions in binary form must reproduce") == len(headers)
        assert others.count("POSSIBILITY OF SUCH DAMAGE") == len(headers)


@pytest.mark.parametrize(
    ("version", "place"), [(2, "model.png"), (3, "terminalsAndIcons/icon.png")]
)
def test_icon_is_a_small_png(version: int, place: str) -> None:
    icon = _files(version)[place]
    assert icon[:8] == b"\x89PNG\r\n\x1a\n"
    assert struct.unpack(">2I", icon[16:24]) == (128, 128)
    assert len(icon) < 4096


def _check(name: str, content: bytes) -> None:
    etree = pytest.importorskip("lxml.etree")
    schema = etree.XMLSchema(etree.parse(str(_SCHEMAS / name)))
    schema.assertValid(etree.fromstring(content))


@each_kind
def test_documents_follow_their_schemas(version: int, part: Part, arrays: bool) -> None:
    files = _files(version, part, arrays)
    _check("ssp/schema/SystemStructureParameterValues.xsd", files[f"{_REF}/parameters.ssv"])
    if version == 3:
        place = "terminalsAndIcons/terminalsAndIcons.xml"
        _check("schema/fmi3/fmi3TerminalsAndIcons.xsd", files[place])
        _check("schema/fmi3/fmi3BuildDescription.xsd", files["sources/buildDescription.xml"])


# The manifest of FMI-LS-REF: its root with the attributes that FMI 3.0 gives every manifest.
_MANIFEST = """<xs:schema xmlns:xs="http://www.w3.org/2001/XMLSchema"
    xmlns:fmi-ls="http://fmi-standard.org/fmi-ls-manifest">
  <xs:import namespace="http://fmi-standard.org/fmi-ls-manifest" schemaLocation="{common}"/>
  <xs:element name="fmiReferences">
    <xs:complexType>
      <xs:sequence>
        <xs:element name="Related" maxOccurs="unbounded">
          <xs:complexType>
            <xs:attribute name="type" type="xs:string"/>
            <xs:attribute name="source" type="xs:anyURI" use="required"/>
            <xs:attribute name="role" type="xs:string" use="required"/>
            <xs:attribute name="description" type="xs:string"/>
          </xs:complexType>
        </xs:element>
      </xs:sequence>
      <xs:attributeGroup ref="fmi-ls:ALayeredStandardManifest"/>
    </xs:complexType>
  </xs:element>
</xs:schema>"""


@each_kind
def test_manifest_names_the_reference_files(version: int, part: Part, arrays: bool) -> None:
    etree = pytest.importorskip("lxml.etree")
    files = _files(version, part, arrays)
    content = files[f"{_REF}/fmi-ls-manifest.xml"]
    common = _SCHEMAS / "schema/fmi3/fmi3LayeredStandardManifest.xsd"
    schema = etree.XMLSchema(etree.fromstring(_MANIFEST.format(common=common.as_uri())))
    schema.assertValid(etree.fromstring(content))
    root = ElementTree.fromstring(content)
    name = "{http://fmi-standard.org/fmi-ls-manifest}fmi-ls-name"
    assert root.get(name) == "org.fmi-standard.fmi-ls-ref"
    related = {element.get("source"): element.get("role") for element in root}
    assert related == {"reference.csv": "result", "parameters.ssv": "parameter"}
    assert all(f"{_REF}/{source}" in files for source in related)


def _members(part: Part, *, arrays: bool = False) -> dict[str, dict[str, tuple[str, str]]]:
    """Variable and kind of each member by name, of each terminal."""
    text = _files(3, part, arrays)["terminalsAndIcons/terminalsAndIcons.xml"]
    return {
        terminal.get("name", ""): {
            m.get("memberName", ""): (m.get("variableName", ""), m.get("variableKind", ""))
            for m in terminal
        }
        for terminal in ElementTree.fromstring(text).iter("Terminal")
    }


@pytest.mark.parametrize("arrays", [False, True])
def test_terminals_of_robot_and_controller_fit(arrays: bool) -> None:
    plugs = {part: _members(part, arrays=arrays) for part in Part}
    robot, law = plugs[Part.ROBOT], plugs[Part.CONTROLLER]
    for part, terminals in plugs.items():
        path = native.file(3, part, arrays=arrays)
        known = {v.name: v.causality for v in native.unpacked(path)[1].modelVariables}
        used = [variable for plug in terminals.values() for variable, _ in plug.values()]
        assert set(used) <= set(known)
        assert len(used) == len(set(used))
    joints = [name for name in robot if name.startswith("joint")]
    assert len(joints) == (1 if arrays else 6)
    for name in joints:
        assert set(robot[name]) == set(law[name]) == {"tau", "q", "qd"}
        assert (robot[name]["tau"][1], law[name]["tau"][1]) == ("inflow", "outflow")
    assert set(robot["reference"]) == set(law["reference"])
    assert "flange" in robot
    assert "flange" not in law


def _reference(version: int, part: Part, arrays: bool) -> tuple[list[str], np.ndarray]:
    text = _files(version, part, arrays)[f"{_REF}/reference.csv"].decode()
    header, *rows = list(csv.reader(io.StringIO(text)))
    return header, np.array(rows, dtype=float)


@each_kind
def test_fmu_reproduces_its_reference_results(version: int, part: Part, arrays: bool) -> None:
    names, rows = _reference(version, part, arrays)
    path = native.file(version, part, arrays=arrays)
    description = native.unpacked(path)[1]
    stop = float(description.defaultExperiment.stopTime)
    assert names[0] == "time"
    assert rows[0, 0] == 0.0
    assert rows[-1, 0] == pytest.approx(stop)
    assert len(rows) <= 51
    known = {v.name for v in description.modelVariables}
    stems = {name.partition("[")[0]: 0 for name in names[1:]} if arrays else names[1:]
    wanted = [name for name in stems if name in known]
    assert len(wanted) == len(stems)
    result = fmpy.simulate_fmu(str(path), stop_time=stop, output_interval=0.01, output=wanted)
    columns = {name: result[name] for name in wanted}
    for k, name in enumerate(names[1:], 1):
        stem, _, index = name.rstrip("]").partition("[")
        column = columns[stem][:, int(index) - 1] if arrays and index else columns[name]
        found = np.interp(rows[:, 0], result["time"], column)
        gap = found - rows[:, k]
        if name in ("pose.a", "pose.c"):
            gap = np.array([math.remainder(v, 2.0 * math.pi) for v in gap])
        assert np.abs(gap).max() <= 1e-6 * max(1.0, np.abs(rows[:, k]).max()), name


@pytest.mark.parametrize("version", [2, 3])
def test_parameter_set_holds_the_start_values(version: int, tmp_path: Path) -> None:
    path = tmp_path / "parameters.ssv"
    path.write_bytes(_files(version)[f"{_REF}/parameters.ssv"])
    found = {p.name: (p.type, p.value, p.unit) for p in read_ssv(str(path)).parameters}
    usual, _ = choices.options(kr16cli.load_data(), None, Part.ROBOT, None)
    wanted = {
        v.name: v for v in table(kr16cli.load_data(), usual.start) if v.causality == "parameter"
    }
    assert set(found) == set(wanted)
    for name, v in wanted.items():
        kind, value, _ = found[name]
        words = {"true": 1.0, "false": 0.0}
        assert kind == v.base
        assert (words[value] if value in words else float(value)) == float(v.start)
    assert found["q_start[2]"][2] == "rad"


def test_arrays_leave_only_scalars_in_the_parameter_set(tmp_path: Path) -> None:
    path = tmp_path / "parameters.ssv"
    path.write_bytes(_files(3, arrays=True)[f"{_REF}/parameters.ssv"])
    names = {p.name for p in read_ssv(str(path)).parameters}
    assert {"payload.mass", "control.mode", "solver.step"} <= names
    assert not [name for name in names if "[" in name]


def test_all_kinds_hold_the_same_things() -> None:
    wanted = {name for name in _files(3) if not name.startswith("binaries")}
    assert {name for name in _files(3, arrays=True) if not name.startswith("binaries")} == wanted
    own = {"model.png": "terminalsAndIcons/icon.png"}
    two = {own.get(n, n) for n in _files(2) if not n.startswith("binaries")}
    assert wanted - two == {"sources/buildDescription.xml",
                            "terminalsAndIcons/terminalsAndIcons.xml"}  # fmt: skip
    assert two <= wanted


def test_long_experiments_are_cut_so_that_a_build_stays_quick() -> None:
    data = kr16cli.load_data()
    usual, _ = choices.options(data, None, Part.ROBOT, None)
    known = build.started(table(data, usual.start), {"tau[1]": 5.0})
    found = references.results(data, known, Part.ROBOT, stop=10.0, step=0.01)
    assert found.stop == pytest.approx(2.5)
    assert "the first 2.5 s" in found.told()
    assert found.rows[-1][1] > 0.01  # the torque acted


def test_samples_are_whole_steps_apart() -> None:
    assert references.sample_places(0.05, 0.01) == [0, 1, 2, 3, 4, 5]
    many = references.sample_places(3.01, 0.01)
    assert len(many) <= 52
    assert many[-1] == 301
    assert set(np.diff(many)[:-1]) == {7}


def test_run_that_fails_is_kept_to_where_it_failed() -> None:
    data = kr16cli.load_data()
    usual, _ = choices.options(data, None, Part.ROBOT, None)
    wild = build.started(table(data, usual.start), {"tau[1]": 1e6})
    found = references.results(data, wild, Part.ROBOT, stop=2.0, step=0.01)
    assert 0.0 < found.stop < 1.5
    assert "the first" in found.told()
    assert np.isfinite(found.rows).all()


def _fmutool() -> str | None:
    python = os.environ.get("KR16_HOSTS")
    beside = shutil.which("fmutool", path=str(Path(python).parent)) if python else None
    return beside or shutil.which("fmutool")


@pytest.mark.skipif(_fmutool() is None, reason="no fmutool (PyPI fmu-manipulation-toolbox)")
@each_kind
def test_fmutool_finds_nothing(version: int, part: Part, arrays: bool, tmp_path: Path) -> None:
    path = tmp_path / "KR16.fmu"
    path.write_bytes(native.content(version, part, arrays=arrays))
    done = subprocess.run(
        [str(_fmutool()), "-input", str(path), "-check"], cwd=tmp_path, capture_output=True,
        text=True, check=False, timeout=120,
    )  # fmt: skip
    told = done.stdout + done.stderr
    assert done.returncode == 0
    assert f"compliant with FMI-{version}.0" in told
    assert f"No semantic error against the FMI-{version} standard" in told
    assert "ERROR" not in told
