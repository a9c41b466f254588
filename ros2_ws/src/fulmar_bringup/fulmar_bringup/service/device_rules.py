"""Rules of udev for the devices of a hardware file: who may open them, and a name that stays."""

from __future__ import annotations

from fulmar_core.config.written_text import LINE, NAME, check_written
from hardware_drivers.hardware import Hardware
from hardware_drivers.settings import GpioValves, Kobuki

SERIAL_GROUP, GPIO_GROUP = "dialout", "gpio"
# Identification of the base's FTDI chip: kobuki_core, 60-kobuki.rules.
KOBUKI = (
    'SUBSYSTEM=="tty", ATTRS{{idVendor}}=="0403", ATTRS{{idProduct}}=="6001", ATTRS{{serial}}=="kobuki*", '
    'MODE="0660", GROUP="{serial}", SYMLINK+="kobuki"'
)
SERIAL = 'SUBSYSTEM=="tty", KERNEL=="{device}", MODE="0660", GROUP="{serial}"'
GPIO = 'SUBSYSTEM=="gpio", KERNEL=="{device}", MODE="0660", GROUP="{gpio}"'


def device_rules(hardware: Hardware) -> tuple[str, ...]:
    """One rule for each device below /dev that a hardware file names, and for a Kobuki base by its chip.

    Raises:
        ConfigError: `port` would mean more than one device in a rule.
    """
    port = str(getattr(hardware.driver, "port", "")).partition(",")[
        0
    ]  # an autopilot's baud rate stands behind it
    device = port.removeprefix("/dev/")
    if port.startswith("/dev/"):
        for part in check_written("port", device, LINE).split("/"):
            check_written("port", part, NAME)
    rules = []
    if isinstance(hardware.driver, Kobuki):
        rules.append(KOBUKI)
    if port.startswith("/dev/") and "/" not in device and device != "kobuki":
        rules.append(GPIO if isinstance(hardware.driver, GpioValves) else SERIAL)
    return tuple(rule.format(device=device, serial=SERIAL_GROUP, gpio=GPIO_GROUP) for rule in rules)


def device_groups(hardware: Hardware) -> tuple[str, ...]:
    """Groups whose members may open the devices."""
    return tuple(
        group
        for group in (SERIAL_GROUP, GPIO_GROUP)
        if f'GROUP="{group}"' in " ".join(device_rules(hardware))
    )
