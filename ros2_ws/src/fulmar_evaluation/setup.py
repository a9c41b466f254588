"""What colcon installs; name, version and words come from package.xml."""

from xml.etree import ElementTree

from setuptools import find_packages, setup

ABOUT = ElementTree.parse("package.xml").getroot()
NAME = ABOUT.findtext("name")

setup(
    name=NAME,
    version=ABOUT.findtext("version"),
    description=ABOUT.findtext("description"),
    license=ABOUT.findtext("license"),
    maintainer=ABOUT.findtext("maintainer"),
    maintainer_email=ABOUT.find("maintainer").get("email"),
    packages=find_packages(include=[NAME, f"{NAME}.*"]),
    package_data={NAME: ["faults/*.c", "new_parts/templates/*.txt"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
    ],
)
