"""Start under `ros2 launch` the same nodes that `fulmar run` starts.

This file only translates. Which nodes there are is decided in `fulmar_bringup.system_rows`.
"""

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction, Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from fulmar_bringup.launch_check import refuse_living_plants
from fulmar_bringup.launched_system import ARGUMENTS, list_nodes
from fulmar_bringup.node_spec import RESTARTS, NodeSpec

RESPAWN_S = 1.0  # before a helper that has ended is started again [s]


def to_node(spec: NodeSpec) -> Node:
    """Translate one row of the node table: the end of a helper starts it again, that of any other ends the launch."""
    # Without its type, launch_ros would read a text such as "7" or "on" as YAML.
    parameters = {
        key: ParameterValue(value, value_type=str) if isinstance(value, str) else value
        for key, value in spec.parameters.items()
    }
    # An aircraft lands before its plant ends; a second Ctrl-C ends it at once.
    patience = {"sigterm_timeout": str(spec.ends_within_s)} if spec.ends_within_s else {}
    return Node(
        package=spec.package,
        executable=spec.executable,
        name=spec.name,
        namespace=spec.namespace,
        parameters=[parameters] if parameters else [],
        remappings=list(spec.remappings.items()),
        output="screen",
        on_exit=[] if spec.loss == RESTARTS else Shutdown(reason=f"{spec.name} ended"),
        respawn=spec.loss == RESTARTS,
        respawn_delay=RESPAWN_S,
        **patience,
    )


def start_nodes(context: LaunchContext) -> list[Node]:
    """Read the launch arguments, which are known only now, and list the nodes."""
    asked = {name: LaunchConfiguration(name).perform(context) or None for name in ARGUMENTS}
    specs = list_nodes(**asked)
    refuse_living_plants(specs)
    return [to_node(spec) for spec in specs]


def generate_launch_description() -> LaunchDescription:
    """Entry point of `ros2 launch`."""
    arguments = [
        DeclareLaunchArgument(name, default_value="", description=text) for name, text in ARGUMENTS.items()
    ]
    return LaunchDescription([*arguments, OpaqueFunction(function=start_nodes)])
