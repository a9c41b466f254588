"""What a robot's file says of an event camera: optics and mounting, and what its pixels do."""

from __future__ import annotations

from dataclasses import dataclass

from fulmar_core.robots.sensors.star_camera import StarCamera


@dataclass(frozen=True)
class EventSensorSpec:
    """What pixels do."""

    threshold: float = 0.25  # mean change of ln brightness that makes an event [-]
    threshold_std: float = 0.03  # from pixel to pixel, and between brighter and darker [-]
    refractory_s: float = 1e-4  # after an event a pixel is blind for so long [s]
    noise_hz: float = 0.1  # of each pixel, without any change [Hz]
    hot_pixels: int = 0  # that report far more noise
    hot_hz: float = 100.0  # each of them [Hz]
    jitter_s: float = 1e-4  # standard deviation of time stamps [s]
    bandwidth_hz: float = 300.0  # of a pixel's first-order lag; 0: none [Hz]
    background: float = 0.2  # brightness of the dark sky, in peaks of the faintest star [-]

    def __post_init__(self) -> None:
        if self.threshold <= 0.0 or self.background <= 0.0:
            raise ValueError("threshold and background must be greater than 0.")
        rest = (
            self.threshold_std,
            self.refractory_s,
            self.noise_hz,
            self.hot_pixels,
            self.hot_hz,
            self.jitter_s,
        )
        if min(*rest, self.bandwidth_hz) < 0.0:
            raise ValueError("noise, hot pixels, times and bandwidth must not be negative.")


@dataclass(frozen=True)
class EventCamera:
    """One event camera of a robot."""

    camera: StarCamera = StarCamera()
    pixels: EventSensorSpec = EventSensorSpec()
