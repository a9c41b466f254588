"""What colcon installs; name, version and words come from package.xml."""

from pathlib import Path
from xml.etree import ElementTree

from setuptools import find_packages, setup

ABOUT = ElementTree.parse("package.xml").getroot()
NAME = ABOUT.findtext("name")
NODES = [
    path.stem
    for path in sorted(Path(NAME).glob("*_node.py"))
    if "def main(" in path.read_text(encoding="utf-8")
]

setup(
    name=NAME,
    version=ABOUT.findtext("version"),
    description=ABOUT.findtext("description"),
    license=ABOUT.findtext("license"),
    maintainer=ABOUT.findtext("maintainer"),
    maintainer_email=ABOUT.find("maintainer").get("email"),
    packages=find_packages(include=[NAME, f"{NAME}.*"]),
    package_data={NAME: ["fast_dds*.xml"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
    ],
    entry_points={"console_scripts": [f"{node} = {NAME}.{node}:main" for node in NODES]},
)
