"""Gate before a controller that sees: only images that are the camera's own and young enough are acted on."""

from __future__ import annotations

from fulmar_core.estimators.images import IMAGE_LASTS_S
from fulmar_core.wires.reading import BACK_NS


class ImageWatch:
    """Why no image is usable now, from what came of one reading.

    Attributes:
        name: Of the reading.
    """

    def __init__(self, name: str) -> None:
        """Begin without any."""
        self.name = name
        self._newest_ns: int | None = None
        self._refusal = ""
        self._stands = False

    def refused(self, why: str) -> None:
        """An image was refused: none is acted on before a good one comes."""
        self._refusal = why

    def came(self, stamp_ns: int) -> bool:
        """A good image with a stamp came; whether it is newer than those before [ns]."""
        self._refusal = ""
        # Much earlier stamps are those of a camera that began anew, and one wrong stamp must not shut it out for ever.
        self._stands = self._newest_ns is not None and 0 <= self._newest_ns - stamp_ns <= BACK_NS
        if not self._stands:
            self._newest_ns = stamp_ns
        return not self._stands

    def problem(self, time_ns: int) -> str:
        """Why a controller cannot act on a state of a time; empty if there is an image that is young enough [ns]."""
        if self._refusal:
            return f"{self.name}: {self._refusal}"
        if self._newest_ns is None:
            return f"{self.name}: no image yet. Does the camera run?"
        age_s = (time_ns - self._newest_ns) / 1e9
        if abs(age_s) <= IMAGE_LASTS_S:
            return ""
        cause = " (its stamps do not advance: the camera is stuck)" if self._stands else ""
        if age_s < 0.0:
            cause = " (it is ahead of odom: two clocks)"
        return f"{self.name}: no usable image for {abs(age_s) * 1e3:.0f} ms (limit {IMAGE_LASTS_S * 1e3:.0f} ms){cause}"
