"""Films as files: endings, what is there already, and frames that come back."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fulmar_cli.commands.film_options import size_of, span_of
from fulmar_console.video.film_file import check_film_path, write_film
from fulmar_core.config.errors import ConfigError


def frames(count: int = 5) -> list[np.ndarray]:
    """Frames of rising brightness with a bright bar that moves, 64 by 48 pixels."""
    made = []
    for number in range(count):
        pixels = np.full((48, 64, 3), 20 * number, dtype=np.uint8)
        pixels[:, 10 * number : 10 * number + 8] = 255
        made.append(pixels)
    return made


@pytest.mark.parametrize("ending", ["webp", "gif"])
def test_animated_images_hold_each_frame_and_repeat(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"film.{ending}"
    write_film(path, frames(), 12.5)
    with Image.open(path) as image:
        assert (image.n_frames, image.size, image.info["loop"]) == (5, (64, 48), 0)
        image.seek(3)
        shown = np.asarray(image.convert("RGB")).astype(int)
    assert shown[24, 34].min() > 200  # the bar is where it was drawn
    assert abs(int(shown[24, 5].mean()) - 60) < 25
    assert [each.name for each in tmp_path.iterdir()] == [path.name]


def test_an_mp4_holds_each_frame_at_its_rate(tmp_path: Path) -> None:
    av = pytest.importorskip("av")
    path = tmp_path / "film.mp4"
    write_film(path, frames(), 25.0)
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        assert (stream.width, stream.height, float(stream.average_rate)) == (64, 48, 25.0)
        assert sum(1 for _ in container.decode(stream)) == 5


def test_a_film_that_breaks_off_leaves_the_older_one_alone(tmp_path: Path) -> None:
    path = tmp_path / "film.webp"
    path.write_bytes(b"older")

    def broken() -> object:
        yield frames()[0]
        raise ConfigError("no more")

    with pytest.raises(ConfigError, match="no more"):
        write_film(path, broken(), 10.0)  # type: ignore[arg-type]
    assert path.read_bytes() == b"older"
    assert [each.name for each in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("film.mp5", r"must end in \.mp4, \.webp, \.gif.*Did you mean '\.mp4'"),
        ("film", "must end in"),
        ("none/film.gif", "there is no folder"),
        ("there.gif", "exists already; --force replaces it"),
    ],
)
def test_files_that_cannot_become_films_are_refused_at_once(tmp_path: Path, name: str, words: str) -> None:
    (tmp_path / "there.gif").touch()
    with pytest.raises(ConfigError, match=words):
        check_film_path(tmp_path / name, force=False)
    check_film_path(tmp_path / "there.gif", force=True)


def test_an_mp4_without_pyav_names_the_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda _name: None)
    with pytest.raises(ConfigError, match=r"fulmar\[video\]"):
        check_film_path(tmp_path / "film.mp4", force=False)
    check_film_path(tmp_path / "film.webp", force=False)


def test_sizes_and_spans_are_read_and_wrong_ones_refused() -> None:
    assert size_of("960x540") == (960, 540)
    assert span_of("") == (0.0, math.inf)
    assert span_of("5,20") == (5.0, 20.0)
    assert span_of("5") == (5.0, math.inf)
    for text in ("960", "ax5", "961x540", "9600x540", "32x32"):
        with pytest.raises(ConfigError, match="--size"):
            size_of(text)
    for text in ("a", "5,4", "-1,4", "1,2,3", "nan"):
        with pytest.raises(ConfigError, match="--span"):
            span_of(text)
