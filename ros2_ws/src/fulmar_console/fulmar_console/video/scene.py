"""The robots of one recording at a time of it, drawn with their plumes, trails, goals and figures."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from fulmar_console.bags.recording import Recording
from fulmar_console.bags.track import POSE, poses_at
from fulmar_console.exports.played import Played, played_robots
from fulmar_console.video.caption import Caption
from fulmar_console.video.decor import Decor
from fulmar_console.video.follow import Follower, View
from fulmar_console.video.stage import build_stage, own_color

TRAIL_S = 20.0  # how long a trail lasts [s]
SMOOTH = 9  # samples of a trail that are averaged
MOST_SHAPES = 3000  # of a scene
OFFSCREEN = mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value
EVERYTHING = mujoco.mjtCatBit.mjCAT_ALL.value


class Scene:
    """One recording. It belongs to the thread that made it, and is to be closed."""

    def __init__(self, recording: Recording, size: tuple[int, int], context: Any) -> None:
        """Build the stage and get ready to draw.

        Args:
            recording: What a bag holds.
            size: Of frames [px].
            context: Of OpenGL, as `sim_nodes.camera.opengl.context` gives it.
        """
        self._size, self._context = size, context
        self._robots = played_robots(recording)
        self._times = [played.column("t") for played in self._robots]
        self._things = _things(self._robots)
        records = [played.record for played in self._robots]
        floor = float(np.median(self._robots[0].poses[:, 2]))
        self._stage = build_stage(records, [name for _, name in self._things], size, floor)
        context.make_current()
        self._drawing = mujoco.MjrContext(self._stage.model, mujoco.mjtFontScale.mjFONTSCALE_100.value)
        mujoco.mjr_setBuffer(OFFSCREEN, self._drawing)
        self._scene = mujoco.MjvScene(self._stage.model, maxgeom=MOST_SHAPES)
        space = str((records[0].get("info") or {}).get("space", ""))
        self._scene.flags[mujoco.mjtRndFlag.mjRND_FOG] = space in ("water", "flight")
        self._scene.flags[mujoco.mjtRndFlag.mjRND_HAZE] = self._stage.ground is not None
        self._follower = Follower(records[0].get("info") or {}, self._stage.reach)
        self._caption = Caption(*size)
        self._title = str(recording.document["name"])
        self._pixels = np.empty((size[1], size[0], 3), dtype=np.uint8)
        self._before: float | None = None

    def frame(self, t_s: float) -> np.ndarray:
        """The frame at a time of the recording [s], uint8 (h, w, 3)."""
        dt = 0.0 if self._before is None else t_s - self._before
        self._before = t_s
        poses = [self._pose(number, t_s) for number in range(len(self._robots))]
        shares = [self._shares(number, t_s) for number in range(len(self._robots))]
        goals = [self._goal(played, t_s) for played in self._robots]
        for number, (pose, share) in enumerate(zip(poses, shares, strict=True)):
            self._stage.place(number, pose, share, dt)
        for (owner, name), poses_of in self._things.items():
            now = poses_at(np.array([t_s]), self._times[owner], poses_of)[0][0]
            self._stage.place_thing(name, now)
        aims = [np.array(goal[0][goal[1]][:3]) for goal in goals if goal and len(goal[0][goal[1]]) == 7]
        view = self._follower.look(np.array([pose[:3] for pose in poses]), aims if self._aims else [], dt)
        self._update(view)
        decor = Decor(self._scene)
        for number, played in enumerate(self._robots):
            self._decorate(decor, number, played, poses[number], shares[number], goals[number], t_s)
        return self._caption.write(self._drawn(), *self._words(t_s))

    def close(self) -> None:
        """Free what the driver holds."""
        self._context.make_current()
        self._drawing.free()

    @property
    def _aims(self) -> bool:
        """Whether goals are places of their own, and not a path that the robot is on."""
        goal = (self._robots[0].record.get("info") or {}).get("goal") or {}
        return not goal.get("moves") and self._robots[0].record["info"].get("space") != "flight"

    def _update(self, view: View) -> None:
        model, data = self._stage.model, self._stage.data
        mujoco.mj_kinematics(model, data)
        mujoco.mj_camlight(model, data)
        sun = data.light_xdir[0]
        data.light_xpos[0] = view.at - 12.0 * self._stage.reach * sun
        camera = mujoco.MjvCamera()
        camera.lookat[:], camera.distance = view.at, view.distance
        camera.azimuth, camera.elevation = view.azimuth, view.elevation
        mujoco.mjv_updateScene(model, data, mujoco.MjvOption(), None, camera, EVERYTHING, self._scene)

    def _drawn(self) -> np.ndarray:
        self._context.make_current()
        mujoco.mjr_setBuffer(OFFSCREEN, self._drawing)  # another scene may have drawn meanwhile
        rect = mujoco.MjrRect(0, 0, *self._size)
        mujoco.mjr_render(rect, self._scene, self._drawing)
        mujoco.mjr_readPixels(self._pixels, None, rect, self._drawing)
        return np.ascontiguousarray(self._pixels[::-1])

    def _decorate(
        self, decor: Decor, number: int, played: Played, pose: np.ndarray, shares: np.ndarray,
        goal: tuple[list[list[float]], int] | None, t_s: float,
    ) -> None:  # fmt: skip
        info = played.record.get("info") or {}
        radius = float(info.get("radius") or 0.3)
        times = self._times[number]
        ways = played.poses[(times > t_s - TRAIL_S) & (times <= t_s), :3].astype(float)
        ways = _smooth(ways)
        if info.get("space") == "plane" and self._stage.ground is not None:
            ways[:, 2] = self._stage.ground + 0.01
        decor.line(ways, 0.025 * radius, own_color(played.record)[:3], fades=True)
        if goal is not None:
            decor.goals(*goal, info, played.tolerance_m, self._stage.ground)
        decor.plumes(info, pose, shares)

    def _pose(self, number: int, t_s: float) -> np.ndarray:
        poses = self._robots[number].poses.astype(float)
        return poses_at(np.array([t_s]), self._times[number], poses)[0][0]

    def _row(self, number: int, t_s: float) -> int:
        times = self._times[number]
        return int(np.clip(np.searchsorted(times, t_s), 0, len(times) - 1))

    def _shares(self, number: int, t_s: float) -> np.ndarray:
        played = self._robots[number]
        row = played.table[self._row(number, t_s)]
        return np.nan_to_num([row[played.fields.index(field)] for field in played.shares])

    def _goal(self, played: Played, t_s: float) -> tuple[list[list[float]], int] | None:
        """The targets that count at a time, and which of them is next."""
        found = _health(played, t_s).get("goal") or {}
        if "targets" not in found:
            return None
        targets = played.targets[found["targets"]]
        return targets, int(found.get("done", 0)) % len(targets)

    def _words(self, t_s: float) -> tuple[list[str], list[str], str]:
        played = self._robots[0]
        info = played.record.get("info") or {}
        health = _health(played, t_s)
        level = str(health.get("level", "ok"))
        name = played.name if len(self._robots) == 1 else f"{len(self._robots)} robots"
        task = str(info.get("task_title") or info.get("task") or "")
        who = str(played.record.get("controller") or "")
        left = [name, " · ".join(each for each in (task, who) if each)]
        if level not in ("ok", ""):
            left.append(str(health.get("words", "")))
        right = [f"{t_s:.1f} s"]
        error = float(played.column("error")[self._row(0, t_s)])
        if np.isfinite(error) and info.get("space") != "flight":  # there the target is the end of a path
            label = str(played.record["error"])
            unit = "°" if "°" in label else "m/s" if "m/s" in label else "m"
            right.append(f"error {error:.2f} {unit}")
        return [each for each in left if each], right, level


def _smooth(ways: np.ndarray) -> np.ndarray:
    """Places without the noise of single measurements, each the mean of its neighbours, shape (n, 3)."""
    if len(ways) < 2 * SMOOTH:
        return ways
    sums = np.vstack((np.zeros(3), np.cumsum(ways, axis=0)))
    middle = (sums[SMOOTH:] - sums[:-SMOOTH]) / SMOOTH
    return np.vstack((middle, ways[-1:]))


def _health(played: Played, t_s: float) -> dict[str, Any]:
    """The newest health at a time."""
    found: dict[str, Any] = {}
    for since, health in played.changes:
        if since > t_s and found:
            break
        found = health
    return found


def _things(robots: list[Played]) -> dict[tuple[int, str], np.ndarray]:
    """Poses of the things of tasks by the number of their robot and their name, shape (n, 7)."""
    found = {}
    for number, played in enumerate(robots):
        ends = [field for field in played.fields if field.endswith(f":{POSE[0]}")]
        for field in ends:
            begin = played.fields.index(field)
            poses = played.table[:, begin : begin + len(POSE)].astype(float)
            found[number, field.removesuffix(f":{POSE[0]}")] = poses
    return found
