"""XML files from outside: of bounded size, and without entities, which could stand for any amount of text."""

from __future__ import annotations

from pathlib import Path
from xml.etree.ElementTree import Element, ParseError, XMLParser

from fulmar_core.config.bounded_file import read_bounded
from fulmar_core.config.errors import ConfigError

LARGEST_BYTES = 20_000_000


def read_xml(path: Path, tag: str, what: str) -> Element:
    """Read a file.

    Args:
        path: The file.
        tag: Of its outermost element.
        what: The kind of file, for messages.

    Raises:
        ConfigError: It cannot be read, is no XML, declares entities, or is of another kind.
    """
    try:
        data = read_bounded(path, LARGEST_BYTES)
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read ({error.strerror or error}).") from error
    if b"<!DOCTYPE" in data or b"<!ENTITY" in data:
        raise ConfigError(f"{path}: declares a document type, which is not read. Take '<!DOCTYPE ...>' out.")
    parser = XMLParser()
    try:
        parser.feed(data)
        root: Element = parser.close()
    except ParseError as error:
        raise ConfigError(f"{path}:{error.position[0]}: no XML: {error}.") from error
    if root.tag != tag:
        raise ConfigError(
            f"{path}: begins with <{root.tag}>, and a {what} begins with <{tag}>. --urdf reads <robot>, --mjcf "
            "<mujoco>."
        )
    macro = next((each.tag for each in root.iter() if "ros.org/wiki/xacro" in str(each.tag)), None)
    if macro is not None:
        raise ConfigError(f"{path}: is a xacro. Expand it first: xacro {path.name} > {path.stem}.urdf")
    return root
