"""A task of the user's own: loaded by its dotted path, tried before anything moves, and every mistake is one line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fulmar_core.config.errors import BundleError, ConfigError, TaskError
from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.loop.fallback import warm_up
from fulmar_core.loop.mission import Mission
from fulmar_core.loop.rollout import roll_out_in_batch
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.episode import draw_episodes
from fulmar_core.simulation.learning_step import observed_step
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.planar import at_rest
from fulmar_core.tasks import load_recorded_task, load_task
from fulmar_core.tasks.goal import goal_at
from fulmar_core.worlds.scenario import load_scenario
from sim_nodes.mock_backend import MockBackend
from tests.own_files import own_folder

ROBOT = load_robot("turtlebot2")
S = 1_000_000_000
NOMINAL, IDEAL = load_scenario("nominal"), load_scenario("ideal")
HEAD = """
import numpy as np
from dataclasses import replace
from fulmar_core.tasks.goal import Goal, goals_at
from fulmar_core.tasks import Task
from fulmar_core.tasks.terms import Errors, Start, Tolerance, pose_errors
"""
MEMBERS = """
    goal_topic, episode_s, tolerance = "goal_point", 4.0, Tolerance(position=0.1, hold_s=1.0)
    observation_names = ("distance", "east")
    def draw(self, draws, robot, *, training):
        state, places = Start((1.0, 2.0), (0.0, 2.0), 1.0).draw(draws, training=training)
        return state, goals_at(places)
    def observe(self, state, goal):
        return pose_errors(state, goal.current, heading=False).position, goal.current[..., 0] - state.x
    def errors(self, state, goal): return pose_errors(state, goal.current, heading=False)
    def reward(self, before, after, goal, ended): return -self.errors(after, goal).position
"""


@pytest.fixture
def own(tmp_path, monkeypatch):
    """Writes a class with the members of a task and some more, and gives its name."""
    with own_folder(tmp_path, monkeypatch):

        def write(more: str = "", *, base: str = "(Task)", members: str = MEMBERS, head: str = "") -> str:
            module = f"own_{len(list(tmp_path.glob('*.py')))}"
            (tmp_path / f"{module}.py").write_text(f"{HEAD}{head}class Mine{base}:\n{members}\n{more}\n")
            return f"{module}:Mine"

        yield write


def complaint(name: str) -> str:
    """What is said of a task that is loaded and tried."""
    with pytest.raises(ConfigError) as caught:
        load_task(name).check(ROBOT)
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith(f"task '{name}': ")
    return message.removeprefix(f"task '{name}': ")


class Still:
    """Stands where it is."""

    name, control_hz, estimator = "still", 10.0, None
    readings, observer = (), None

    def reset(self):
        pass

    def act(self, inputs):
        return np.zeros_like(inputs.previous)

    def metadata(self):
        return {}


@pytest.mark.parametrize("base", ["(Task)", ""])
def test_a_class_with_the_needed_members_is_a_task_whether_or_not_it_inherits(own, base):
    task = load_task(own(base=base))
    task.check(ROBOT)
    assert (task.name, task.kind, task.title) == ("own_0:Mine", "own_0:Mine", "Mine")
    assert (task.required, task.sees_obstacles, task.things) == (None, False, ())
    run = roll_out_in_batch(Still(), ROBOT, task, NOMINAL, episodes=3, seed=1)
    start = draw_episodes(ROBOT, task, NOMINAL, seed=1, numbers=np.arange(3))
    away = np.hypot(start.start.x - start.goal.current[:, 0], start.start.y - start.goal.current[:, 1])
    np.testing.assert_allclose(run.position_error[:, -1], away, atol=1e-3)


def test_settings_come_from_the_yaml_beside_the_module_where_the_class_takes_them(own, tmp_path):
    name = own("    def __init__(self, settings): self.radius = settings.get('radius', 1.0)")
    assert load_task(name).own.radius == 1.0
    (tmp_path / "own_0.yaml").write_text("radius: 2.5\n")
    assert load_task(name).own.radius == 2.5
    (tmp_path / "own_0.yaml").write_text("- 1\n")
    with pytest.raises(ConfigError, match=r"own_0\.yaml: must hold a mapping, found list\."):
        load_task(name)


def test_learners_get_its_reward_in_single_precision(own):
    simulation = BatchSimulation(ROBOT, load_task(own()), NOMINAL, worlds=4, seed=1, training=True)
    before = simulation.truth, simulation.goal
    reward, over, seen = observed_step(simulation, np.zeros((4, 2)), effort=0.0)
    away = np.hypot(before[1].current[:, 0] - before[0].x, before[1].current[:, 1] - before[0].y)
    np.testing.assert_allclose(reward, -away, atol=1e-3)
    assert (reward.dtype, seen.dtype, over.any()) == (np.float32, np.float32, False)


def test_targets_that_it_counts_make_an_episode_a_success(own):
    name = own(
        "    required = 3\n"
        "    def advance(self, goal, state, time_s): return replace(goal, done=goal.done + 1.0)\n"
    )
    run = roll_out_in_batch(Still(), ROBOT, load_task(name), NOMINAL, episodes=2, seed=1)
    assert (run.goals[:, -1] == 40.0).all()


@pytest.mark.parametrize("missing", ["draw", "observe", "reward", "errors"])
def test_a_missing_method_is_named(own, missing):
    lines = [line for line in MEMBERS.splitlines() if f"def {missing}" not in line]
    if missing in ("draw", "observe"):  # whose bodies stand in lines of their own
        lines = MEMBERS.replace(f"def {missing}", f"def not_{missing}").splitlines()
    message = complaint(own(members="\n".join(lines)))
    assert f"class 'Mine' lacks {missing}." in message


@pytest.mark.parametrize(
    ("more", "says"),
    [
        ("    tolerance = None", "lacks tolerance. A task needs: episode_s, tolerance, goal_topic, "),
        ("    tolerance = 0.1", "tolerance = 0.1 must be a fulmar_core.tasks.terms.Tolerance."),
        ("    episode_s = -1", "episode_s = -1 must be a number of seconds, greater than 0."),
        ("    goal_topic = 'goal_poin'", "'goal_poin' must be a topic of goals. Did you mean 'goal_point'?"),
        ("    observation_names = ('a', 'a')", "('a', 'a') must be a tuple of names, none of them twice."),
        ("    required = 'all'", "required = 'all' must be None or a number from 1 on."),
        ("    step_s = 1.0", "has 'step_s', which only shipped tasks can have. Leave it out."),
        ("    def __init__(self): 1 / 0", "Mine() raised ZeroDivisionError: division by zero (own_0.py:19)."),
    ],
)
def test_a_member_that_cannot_be_is_refused(own, tmp_path, more, says):
    assert says in complaint(own(more)).replace(f"{tmp_path}/", "")


@pytest.mark.parametrize(
    ("more", "says"),
    [
        ("observe(self, state, goal): return (state.x,)", "observe returned 1 terms, observation_names has 2."),
        ("observe(self, state, goal): return state.x", "observe returned a ndarray, it must be a tuple of terms."),
        (
            "observe(self, state, goal): return state.x, np.zeros(5)",
            "observe returned 'east' of shape (5,), it must be numbers of shape (3,).",
        ),
        (
            "observe(self, state, goal): return state.x, 'far'",
            "observe returned 'east' of a str, it must be numbers of shape (3,).",
        ),
        ("observe(self, state, goal): return state.x, state.x + np.nan", "observe returned 'east' that is not finite."),
        (
            "observe(self, state, goal): raise KeyError('far')",
            "observe raised KeyError: 'far' (own_0.py:19).",
        ),
        ("errors(self, state, goal): return state.x", "errors returned a ndarray, it must be a fulmar_core"),
        ("errors(self, state, goal): return Errors()", "errors returned no position, which the tolerance or"),
        (
            "errors(self, state, goal): return Errors(state.x, velocity=state.x)",
            "errors returned no yaw_rate, which the tolerance or the other velocity needs.",
        ),
        ("reward(self, *given): return np.inf", "reward returned the reward that is not finite."),
        ("draw(self, draws, robot, training): return 1", "draw returned a int, it must be a PlanarState and a Goal."),
        (
            "draw(self, *a, **k): return (lambda s, g: (s[0], g))(*Start((1, 2), (1, 2), 1).draw(*a[:1], **k))",
            "draw returned a tuple, it must be a PlanarState and a Goal.",
        ),
        ("advance(self, goal, state, time_s): pass", "advance returned a NoneType, it must be a Goal."),
        (
            "advance(self, goal, state, time_s): return replace(goal, done=np.zeros(7))",
            "advance returned a Goal with done of shape (7,), it must be (3).",
        ),
        ("counted(self, goal, *more): return replace(goal, done=goal.done + np.nan)", "Goal with done that are not"),
        ("begun(self, goal, state): return None", "begun returned a NoneType, it must be a Goal."),
        ("collides(self, state, goal, robot): return np.zeros(2)", "collides returned the result of shape (2,)"),
        ("penalty(self, state, goal, robot): 1 / 0", "penalty raised ZeroDivisionError: division by zero (own_0"),
        ("distance_from_goal(self, state, goal): return 'far'", "distance_from_goal returned the result of a str"),
    ],
)  # fmt: skip
def test_a_member_that_answers_nonsense_is_refused_before_anything_moves(own, tmp_path, more, says):
    assert says in complaint(own(f"    def {more}")).replace(f"{tmp_path}/", "")


def test_what_works_for_many_robots_and_not_for_one_is_refused(own):
    """A re-run of a bag asks for one state without a batch axis."""
    message = complaint(
        own("    def reward(self, before, after, goal, ended): return after.x[:, None][:, 0]")
    )
    assert message.startswith("reward raised IndexError: ")


def test_a_mistake_on_the_way_is_the_task_s_not_the_controller_s(own):
    name = own(
        "    def observe(self, state, goal): return goal.targets[..., 0, 0], 1.0 / (state.x - state.x[0] + 1)"
    )
    task = load_task(name)
    loop = ControlLoop(ROBOT, task, Still())
    episode = draw_episodes(ROBOT, task, NOMINAL, seed=0, numbers=np.zeros(1, dtype=int))
    loop.begin(episode.goal)
    loop.step(episode.start, {}, 0)
    task.own.observe = lambda *_: 1 / 0
    with pytest.raises(TaskError, match=rf"^task '{name}': observe raised ZeroDivisionError"):
        loop.step(episode.start, {}, 100_000_000)
    with pytest.raises(TaskError, match=rf"^task '{name}': observe raised ZeroDivisionError"):
        warm_up(Still(), ROBOT, task)


def test_a_class_that_only_a_bag_names_is_never_imported(own, tmp_path):
    own(members="    open('run', 'w')\n" + MEMBERS)
    (tmp_path / "own_0.py").rename(tmp_path / "own_of_a_bag.py")
    name, bag = "own_of_a_bag:Mine", Path("bags/from_elsewhere")
    with pytest.raises(ConfigError) as caught:
        load_recorded_task(name, bag)
    assert str(caught.value) == (
        f"{bag}: the task is '{name}', a class that only this bag names. To use it: --task {name}."
    )
    assert not (tmp_path / "run").exists()
    load_task(name)  # a user asked for it
    assert load_recorded_task(name, bag).name == name


GATE = """
    things = (Thing("gate"), Thing("box", Block(0.1, 0.3, 0.2, 0.3, 0.2)))
    def draw(self, draws, robot, *, training):
        state, places = Start((1.0, 2.0), (0.0, 2.0), 1.0).draw(draws, training=training)
        ahead = np.stack((state.x + np.cos(state.yaw), state.y + np.sin(state.yaw), state.yaw), axis=-1)
        return state, goals_at(places).among({"gate": places + 1.0, "box": ahead})
    def observe(self, state, goal):
        gate = goal.things["gate"]
        return pose_errors(state, gate, heading=False).position, gate[..., 2] + 0.0 * state.x
"""
OF_THINGS = "from fulmar_core.dynamics.things import Thing\nfrom fulmar_core.dynamics.contact import Block\n"


def test_things_of_its_own_are_observed_and_those_with_a_body_are_pushed_by_every_simulator_alike(own):
    task = load_task(own(GATE, head=OF_THINGS))
    task.check(ROBOT)
    assert [thing.wire.name for thing in task.things] == ["gate/pose", "box/pose"]
    assert task.subject == "box"
    simulation = BatchSimulation(ROBOT, task, IDEAL, worlds=3, seed=1, dtype=np.float64)
    before = {name: pose.copy() for name, pose in simulation.things.items()}
    alone = MockBackend(ROBOT, things=task.things)
    alone.reset(draw_episodes(ROBOT, task, IDEAL, seed=1, numbers=np.arange(1))[0], seed=1)
    command = np.tile([0.4, 0.0], (3, 1))
    for _ in range(40):
        simulation.step(command)
        sample = alone.step(simulation.command[0], simulation.substeps)
    np.testing.assert_array_equal(simulation.things["gate"], before["gate"])
    assert np.all(np.linalg.norm(simulation.things["box"] - before["box"], axis=1) > 0.1)
    np.testing.assert_allclose(sample.things["box"], simulation.things["box"][0], atol=1e-6)
    np.testing.assert_allclose(simulation.observe()[:, 1], before["gate"][:, 2], rtol=1e-6)


KEEPS = """
    def begun(self, goal, state):
        return goal.among({"start": np.stack((state.x, state.y, state.yaw), axis=-1)})
"""


def test_a_goal_counts_when_every_thing_is_seen_and_what_the_task_keeps_goes_on_until_one_is_lost(own):
    task = load_task(own(GATE + KEEPS, head=OF_THINGS))
    loop = ControlLoop(ROBOT, task, Still())
    mission, here = Mission(loop), at_rest(*np.ones((3, 1)))
    mission.give(goal_at((2.0, 0.0, 0.0)), 1)
    assert mission.lacking == "place of the gate"
    mission.see_thing("gate", np.array([1.0, 2.0, 0.5]), 2 * S)
    assert mission.lacking == "place of the box"
    assert loop.goal is None
    assert mission.lacks_something_of(2 * S)
    mission.see_thing("box", np.zeros(3), 2 * S)
    assert not mission.lacks_something_of(2 * S)
    loop.inputs(here, {}, 2 * S)
    mission.see_thing("gate", np.array([1.5, 2.0, 0.5]), 3 * S)
    kept = {name: pose.tolist() for name, pose in loop.goal.things.items()}
    assert kept == {"start": [[1.0] * 3], "gate": [[1.5, 2.0, 0.5]], "box": [[0.0] * 3]}
    mission.turn_to(3 * S + 1)
    assert mission.lacking == "place of the box"
    mission.see_thing("box", np.zeros(3), 4 * S)
    loop.inputs(here[np.array([0])], {}, 4 * S)  # it begins anew: what the task keeps is there
    assert set(loop.goal.things) == {"start", "gate", "box"}


@pytest.mark.parametrize(
    ("more", "says"),
    [
        ("    things = ('gate',)", "things = ('gate',) must be a tuple of fulmar_core.dynamics.things.Thing"),
        ("    things = (Thing('a'), Thing('a'))", "no name twice"),
        ("    things = (Thing('gate'),)", "draw returned a Goal without the pose of gate in its things."),
        (
            "    things = (Thing('gate'),)\n    def draw(self, draws, robot, *, training):\n"
            "        state, places = Start((1.0, 2.0), (0.0, 2.0), 1.0).draw(draws, training=training)\n"
            "        return state, goals_at(places).among({'gate': places[:, :2]})",
            "draw returned a Goal with things['gate'] of shape (3, 2), it must be (3, 3)",
        ),
        (
            "    def advance(self, goal, state, time_s): return replace(goal, things=goal.done)",
            "advance returned a Goal whose things are a ndarray, not a mapping",
        ),
    ],
)
def test_a_mistake_about_things_is_one_line(own, more, says):
    assert says in complaint(own(more, head=OF_THINGS))


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("Gate 1", "'Gate 1' is no name of a thing: use lower-case letters"),
        ("mocap", "'mocap' cannot be a thing: 'mocap/pose' is another topic."),
    ],
)
def test_a_name_that_no_thing_can_have_is_refused_with_the_line_of_the_user(own, name, says):
    with pytest.raises(ConfigError, match=rf"{says}.*own_0.py:\d+"):
        load_task(own(f"    things = (Thing('{name}'),)", head=OF_THINGS))


def test_no_law_no_excitation_and_no_shipped_bundle_knows_it(own):
    from fulmar_bringup.plan_checks import checked_policy
    from policy_server.controllers import controller_entry, shipped_policy

    task = load_task(own())
    with pytest.raises(
        BundleError, match="or use a controller of your own: --controller mypackage"
    ) as caught:
        checked_policy(None, ROBOT, task, 10.0)
    assert "train one with `fulmar train turtlebot2 own_0:Mine`" in str(caught.value)
    with pytest.raises(BundleError, match="was trained for task 'go_to_position', not 'own_0:Mine'"):
        checked_policy(shipped_policy("turtlebot2", "go_to_position"), ROBOT, task, 10.0)
    with pytest.raises(ConfigError, match=r"no classical law does 'own_0:Mine' on 'turtlebot2'"):
        controller_entry("classical").check(ROBOT, task)
    with pytest.raises(ConfigError, match=r"'own_0:Mine' has none"):
        controller_entry("excite").check(ROBOT, task)


IN_SPACE = """
    goal_topic, episode_s, tolerance = "goal_point", 4.0, Tolerance(position=0.1, hold_s=1.0)
    observation_names = ("distance",)
    def draw(self, draws, robot, *, training):
        start = SpaceStart((1.0, 2.0), (0.0, 2.0), 1.0)
        state, target = start.draw_in_space(draws, training=training)
        return state, goals_at(target)
    def observe(self, state, goal): return (self.errors(state, goal).position,)
    def errors(self, state, goal): return place_errors(state, goal.current, attitude=False)
    def reward(self, before, after, goal, ended): return -self.errors(after, goal).position
"""
OF_SPACE = """
from fulmar_core.states.planar import PlanarState
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks.space_terms import SpaceStart, place_errors
"""


def test_a_task_in_space_learns_and_is_evaluated_as_the_shipped_ones(own):
    craft, task = (
        load_robot("spacecraft_16"),
        load_task(own("    state_type = SpatialState", members=IN_SPACE, head=OF_SPACE)),
    )
    task.check(craft)
    simulation = BatchSimulation(craft, task, NOMINAL, worlds=4, seed=1, training=True)
    reward, *_ = observed_step(simulation, np.zeros((4, 16), dtype=np.float32), effort=0.0)
    assert np.asarray(reward) == pytest.approx(
        -np.asarray(simulation.truth.distance_to(simulation.goal.current))
    )
    still = Still()
    still.control_hz = craft.timing.control_hz
    found = roll_out_in_batch(still, craft, task, IDEAL, episodes=2, seed=1)
    assert found.position_error.shape == (2, 20)
    assert (found.position_error[:, -1] > 0.9).all()
    with pytest.raises(
        ConfigError,
        match="is for bodies that are pushed in space; 'turtlebot2' is one of the robots on wheels",
    ):
        task.check(ROBOT)


def test_a_state_type_that_is_none_is_one_line(own):
    with pytest.raises(
        ConfigError, match=r"state_type = 'space' must be fulmar_core\.states\.planar\.PlanarState or"
    ):
        load_task(own("    state_type = 'space'", members=IN_SPACE, head=OF_SPACE))


def test_a_task_in_space_without_its_state_type_says_what_is_missing(own):
    task = load_task(own("    state_type = PlanarState", members=IN_SPACE, head=OF_SPACE))
    with pytest.raises(TaskError, match="a task in space says state_type = SpatialState"):
        task.check(ROBOT)
