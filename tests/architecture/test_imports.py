"""Modules do not import each other in a circle."""

from __future__ import annotations

import tomllib

import grimp
import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components


def circles(graph: grimp.ImportGraph) -> list[list[str]]:
    """Groups of modules that import each other, directly or through others."""
    modules = sorted(graph.modules)
    index = {name: number for number, name in enumerate(modules)}
    edges = [(index[a], index[b]) for a in modules for b in graph.find_modules_directly_imported_by(a)]
    rows, columns = np.array(edges).T
    matrix = coo_array((np.ones(len(edges)), (rows, columns)), shape=(len(modules), len(modules)))
    _, groups = connected_components(matrix, connection="strong")
    sizes = np.bincount(groups)
    return [
        [name for name, its in zip(modules, groups, strict=True) if its == group]
        for group in np.flatnonzero(sizes > 1)
    ]


def test_no_modules_import_each_other_in_a_circle(repository):
    """Also not inside functions; imports for type checkers alone do not count."""
    text = (repository / "pyproject.toml").read_text(encoding="utf-8")
    packages = tomllib.loads(text)["tool"]["importlinter"]["root_packages"]
    graph = grimp.build_graph(*packages, exclude_type_checking_imports=True, cache_dir=None)
    assert circles(graph) == []


@pytest.mark.parametrize(
    ("imports", "found"),
    [
        (["ab", "bc"], []),
        (["ab", "ba"], [["a", "b"]]),
        (["ab", "bc", "ca", "cd"], [["a", "b", "c"]]),
    ],
)
def test_a_circle_is_found(imports, found):
    graph = grimp.ImportGraph()
    for importer, imported in imports:
        graph.add_import(importer=importer, imported=imported)
    assert circles(graph) == found
