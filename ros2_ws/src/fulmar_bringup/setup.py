"""What colcon installs; name, version and words come from package.xml."""

from glob import glob
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
    package_data={
        NAME: [
            *(
                f"{package}/*"
                for package in (
                    "tf2_msgs",
                    "nav2_msgs",
                    "simulation_interfaces",
                    "control_msgs",
                    "px4_msgs",
                    "stars",
                )
            ),
            *(f"*_msgs/{kind}/*" for kind in ("msg", "action")),
            *(f"simulation_interfaces/{kind}/*" for kind in ("msg", "srv", "action")),
        ]
    },
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/launch", glob("launch/*.launch.py")),
    ],
)
