"""The stubs match the extension module, and everything public has a docstring."""

import ast
import subprocess
import sys
from pathlib import Path

import mge
import pytest
from mge import _mge

STUBS = ast.parse((Path(mge.__file__).parent / "_mge.pyi").read_text())


def public(names):
    return {name for name in names if not name.startswith("_")}


def test_stubs_name_everything():
    classes = {node.name: node for node in STUBS.body if isinstance(node, ast.ClassDef)}
    functions = {node.name: node for node in STUBS.body if isinstance(node, ast.FunctionDef)}
    assert set(classes) | set(functions) == public(dir(_mge))
    for name, node in classes.items():
        stubbed = {method.name for method in node.body if isinstance(method, ast.FunctionDef)}
        assert public(stubbed) == public(vars(getattr(_mge, name))), name


def test_everything_public_is_documented():
    for name in public(mge.__all__):
        thing = getattr(mge, name)
        assert thing.__doc__, name
        if isinstance(thing, type):
            for method in public(vars(thing)) - {"metadata"}:
                member = getattr(thing, method)
                assert not callable(member) or member.__doc__ or issubclass(thing, tuple), f"{name}.{method}"


def test_stubs_pass_the_type_checker():
    pytest.importorskip("mypy")
    for command in (["mypy.stubtest", "mge"], ["mypy", "--package", "mge"]):
        done = subprocess.run([sys.executable, "-m", *command], capture_output=True, text=True, timeout=600)
        assert done.returncode == 0, done.stdout + done.stderr
