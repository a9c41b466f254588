"""Bags with images: what a recorder keeps of a camera, what others keep, and images added to another bag."""

from __future__ import annotations

from pathlib import Path

from fulmar_bags.contents import Bag
from fulmar_bags.frame_codecs import compressed_depth
from fulmar_bags.frame_messages import COMPRESSED, IMAGE, packed
from fulmar_bags.writer import BagWriter
from tests.frames import COLOUR, DEPTH, ENCODINGS, NS, compressed, raw, scene

COUNT = 20


def packed_messages(
    count: int = COUNT, robot: str = "/robot", hz: float = 10.0
) -> dict[str, tuple[str, list[bytes]]]:
    """What a recorder keeps of a camera, by topic; the first at 1 s, as the odometry of reference bags."""
    found: dict[str, tuple[str, list[bytes]]] = {}
    for number in range(count):
        for name, pixels in scene(number).items():
            for topic, data in packed(raw(pixels, ENCODINGS[name], 1.0 + number / hz), f"{robot}/{name}"):
                found.setdefault(topic, (COMPRESSED, []))[1].append(data)
    return found


def theirs() -> dict[str, tuple[str, list[bytes]]]:
    """Topics of other programs: raw colours, depth to 10 m as image_transport packs it, and a raw pattern."""
    pixels = [scene(number) for number in range(COUNT)]
    depth = [compressed_depth(each[DEPTH], depth_max=10.0) for each in pixels]
    return {
        "/front/image_color": (
            IMAGE,
            [raw(each[COLOUR], "bgr8", 1.0 + 0.1 * i) for i, each in enumerate(pixels)],
        ),
        "/front/depth/compressedDepth": (
            COMPRESSED,
            [compressed(data, "32FC1; compressedDepth png", 1.0 + 0.1 * i) for i, data in enumerate(depth)],
        ),
        "/rear/image_raw": (IMAGE, [raw(each[COLOUR][:, :, 0], "bayer_rggb8") for each in pixels]),
    }


def with_images(
    source: Bag, folder: Path, messages: dict[str, tuple[str, list[bytes]]], hz: float = 2.0
) -> Path:
    """A bag with the messages of another one, and images from its begin on, stamped as its odometry."""
    bag = BagWriter(folder, run_info=source.info or {})
    every = [
        (log, t.name, bytes(d))
        for t in source.topics.values()
        for log, d in zip(t.log_ns, t.data, strict=True)
    ]
    begin = min(every)[0]
    for topic in source.topics.values():
        bag.add_topic(topic.name, topic.type, "stream")
    for name, (kind, data) in messages.items():
        bag.add_topic(name, kind, "stream")
        every += [(begin + round(i * NS / hz), name, each) for i, each in enumerate(data)]
    for log, name, data in sorted(every):
        bag.write(name, data, log_ns=log)
    bag.close()
    return folder
