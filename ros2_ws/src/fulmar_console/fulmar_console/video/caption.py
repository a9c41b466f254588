"""Words over the frames of a film: which robot, what it does, time and error."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from PIL import Image, ImageDraw, ImageFont

TEXT, DIM = (245, 247, 250), (178, 188, 200)
BACK = (8, 12, 20, 150)
WARN = {"ok": TEXT, "warn": (255, 202, 40), "error": (255, 110, 100)}
SMALLEST_PX = 9


class Caption:
    """Writes on frames of one size."""

    def __init__(self, width: int, height: int) -> None:
        """Choose letters that can be read at that size [px]."""
        self._size = max(SMALLEST_PX, round(min(width / 40.0, height / 20.0)))
        self._font = ImageFont.load_default(self._size)

    def write(
        self, pixels: np.ndarray, left: Sequence[str], right: Sequence[str], level: str = "ok"
    ) -> np.ndarray:
        """A frame with words.

        Args:
            pixels: uint8 (h, w, 3).
            left: Lines at the top left, the first one bright.
            right: Lines at the top right, such as figures.
            level: Of health: the colour of the first line.
        """
        image = Image.fromarray(pixels)
        draw = ImageDraw.Draw(image, "RGBA")
        gap = round(0.35 * self._size)
        line = round(1.3 * self._size)
        wide = max((draw.textlength(text, font=self._font) for text in right), default=0.0)
        left = [self._cut(draw, text, image.width - wide - 7 * gap) for text in left]
        for lines, at_left in ((left, True), (right, False)):
            if not lines:
                continue
            width = max(draw.textlength(text, font=self._font) for text in lines)
            top = 2 * gap
            begin = gap if at_left else image.width - gap - width - 2 * gap
            box = (begin, gap, begin + width + 2 * gap, 3 * gap + line * len(lines))
            draw.rounded_rectangle(box, radius=gap, fill=BACK)
            for number, text in enumerate(lines):
                color = DIM if number else WARN.get(level, TEXT)
                at = (begin + gap, top + number * line)
                draw.text(at, text, font=self._font, fill=color)
        return np.asarray(image)

    def _cut(self, draw: ImageDraw.ImageDraw, text: str, width: float) -> str:
        """A text that is no wider than this [px], with an ellipsis where it ends early."""
        if draw.textlength(text, font=self._font) <= width:
            return text
        while text and draw.textlength(f"{text}…", font=self._font) > width:
            text = text[:-1]
        return f"{text.rstrip()}…"
