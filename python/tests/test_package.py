"""What a user finds: docstrings, types, and nothing undocumented."""

import ast
import inspect
from pathlib import Path

import pytest

import n3p

PACKAGE = Path(n3p.__file__).parent


def public(owner):
    return [name for name in vars(owner) if not name.startswith("_")]


def test_everything_has_a_docstring():
    for name in n3p.__all__:
        thing = getattr(n3p, name)
        if callable(thing):
            assert inspect.getdoc(thing), name
        if inspect.isclass(thing) and thing.__module__.startswith("n3p"):
            for member in public(thing):
                assert inspect.getdoc(getattr(thing, member)), f"{name}.{member}"


def test_stubs_say_what_there_is():
    from n3p import _n3p

    assert (PACKAGE / "py.typed").is_file()
    tree = ast.parse((PACKAGE / "_n3p.pyi").read_text())
    stubs = {
        node.name: node for node in tree.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))
    }
    for name in public(_n3p):
        thing = getattr(_n3p, name)
        if not callable(thing):
            continue
        node = stubs[name]
        if isinstance(node, ast.FunctionDef):
            check(thing, node)
            continue
        members = {item.name: item for item in node.body if isinstance(item, ast.FunctionDef)}
        for member in public(thing):
            assert member in members, f"{name}.{member}"
            if callable(getattr(thing, member)):
                check(getattr(thing, member), members[member])


def check(thing, node):
    """The stub's arguments are the function's."""
    arguments = [a.arg for a in node.args.posonlyargs + node.args.args + node.args.kwonlyargs]
    if node.args.kwarg:
        arguments.append(node.args.kwarg.arg)
    assert list(inspect.signature(thing).parameters) == arguments, thing


@pytest.mark.parametrize("name", ["plan", "speed"])
def test_examples_compile(name):
    file = Path(__file__).parents[2] / f"examples/python/{name}.py"
    compile(file.read_text(), file, "exec")


def test_the_example_of_a_plan_runs(capsys):
    import runpy

    runpy.run_path(str(Path(__file__).parents[2] / "examples/python/plan.py"), run_name="__main__")
    assert "among cells" in capsys.readouterr().out
