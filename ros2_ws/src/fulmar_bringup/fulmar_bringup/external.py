"""Settings of a run that an external controller, a node of the user's own, goes with. Pure."""

from __future__ import annotations

from fulmar_bringup.remapping import TOPIC
from fulmar_bringup.system import Guards, default_hardware
from fulmar_core.errors import ConfigError
from fulmar_core.paths import config_names
from fulmar_core.safety.geofence import NO_AREA
from hardware_drivers.settings import TOPIC_DRIVERS, load_hardware
from policy_server.controllers import EXTERNAL, controller_entry


def check_external(
    controller: str, guards: Guards, *, adapter: str | None, topic: str | None, lockstep: bool
) -> None:
    """Refuse guards that no node would carry out, and an adapter where a controller of ours commands.

    Args:
        controller: Name of the controller.
        guards: What watches over the run.
        adapter: Hardware file of an adapter, as it was written.
        topic: Topic that the adapter takes in the place of the file's.
        lockstep: Whether the plant waits for each command.

    Raises:
        ConfigError: On the first thing that would have no effect, or that cannot work.
    """
    external = controller_entry(controller).is_external
    if adapter and not external:
        raise ConfigError(
            f"--adapter passes on commands of another node, and '{controller}' commands itself: the plant obeys one. "
            f"Add --controller {EXTERNAL}, or leave --adapter out."
        )
    if topic and not adapter:
        raise ConfigError("--topic is the topic that --adapter takes. Add --adapter, or leave --topic out.")
    if topic and not TOPIC.fullmatch(topic):
        raise ConfigError(
            f"--topic = '{topic}' is no name of a topic; it takes letters, digits, _ and /, such as /cmd_vel_raw."
        )
    if adapter and lockstep:
        raise ConfigError(
            "in lock step each command carries the stamp of the odom that it answers, and commands through --adapter "
            "carry none. Leave --lockstep out; --rate makes a run faster."
        )
    if external:
        _check_guards(guards)


def _check_guards(guards: Guards) -> None:
    asked = {
        "fallback": guards.fallback is not None,
        "trusted_keys": guards.trusted_keys is not None,
        "max_run_time_s": guards.max_run_time_s > 0.0,
        "area": guards.area != NO_AREA,
    }
    without_effect = [name for name, is_asked in asked.items() if is_asked]
    if without_effect:
        raise ConfigError(
            f"{', '.join(without_effect)}: Fulmar's own controller node carries this out, and with controller "
            f"'{EXTERNAL}' there is none. Leave it out: your node has to do it."
        )


def adapter_path(robot: str, asked: str | None) -> str:
    """The hardware file of an adapter, as a path; empty where none is asked for.

    Args:
        robot: The robot.
        asked: A name of `configs/hardware`, or a path that ends in `.yaml`.

    Raises:
        ConfigError: There is no such file, it is another robot's, or its driver speaks no topic.
    """
    if not asked:
        return ""
    path = default_hardware(robot, asked)
    driver = load_hardware(path).driver
    if not isinstance(driver, TOPIC_DRIVERS):
        known = [name for name in config_names("hardware") if _is_topic_of(name, robot)]
        raise ConfigError(
            f"--adapter {asked}: driver '{driver.kind}' takes no topic. Files of '{robot}' whose driver does: "
            f"{', '.join(known) or 'none'}."
        )
    return path


def _is_topic_of(name: str, robot: str) -> bool:
    file = load_hardware(name)
    return file.robot == robot and isinstance(file.driver, TOPIC_DRIVERS)
