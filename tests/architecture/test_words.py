"""Names and texts use the field's terms: none of the words below, in code, docs, configs and test names.

A line that needs one says why: `# word: reason` at its end, or `<!-- word: reason -->` in a page.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest

# Forms of a word, with what to write instead. A form counts alone, and as a part of a name: `told` is in `is_told`
# and in `ToldInputs`, but not in `untold`.
WORDS = {
    "told tells": "receives, is given; reports, publishes, states",
    "hear hears heard": "receives, received",
    "judge judges judged judging judgement judgements judgment": "evaluate, evaluated, evaluation, Evaluator",
    "verdict verdicts": "result, evaluation",
    "lesson lessons apprentice apprentices": "behaviour cloning: `cloning_updates`, `behavior_cloning`",
    "teacher teachers": "expert",
    "specialist specialists": "`fallback_policy`",
    "strand strands stranded stranding": "uncontrollable",
    "refinement refinements": "`annealing`",
    "suspicion suspicions": "actuator estimator, actuator estimate",
    "informer informers": "actuator estimator",
    "succession line_up": "fallback: primary and fallback controller",
    "conductor conductors": "`run_executor`",
    "witness witnesses": "`observer`",
    "spoiler spoilers": "`fault_injector`",
    "orphan orphans": "`parent_watch`; a process whose parent has ended",
    "picture pictures": "plot, figure",
}
# Words that have other meanings elsewhere: names only, below these folders only.
NAMES = {
    "gas": (
        "`valve_cost`",
        ("configs/training", "configs/controllers", "training", "ros2_ws", "policy_server"),
    ),
    "orders": ("`incremental_actions`", ("configs/training", "training")),
    "wrench": ("`action_space: wrench`", ("configs/training",)),
}
MODULES = {
    "carried": "embedded_configs",
    "cast": "replay_controllers",
    "conductor": "run_executor",
    "course": "received_messages, waypoint_tasks",
    "finding": "fault_result",
    "holding": "holdability",
    "informer": "actuator_estimator",
    "judge": "evaluator",
    "kept": "controller_timeline",
    "leaves": "pytree",
    "lessons": "behavior_cloning",
    "may": "the name of the rule",
    "moving": "mutable_state",
    "orphans": "parent_watch",
    "passing": "waypoint_tasks",
    "patience": "subscriber_wait",
    "phase": "phase_lock",
    "reach": "force_authority",
    "seen": "the name of the measurement",
    "situation": "the name of the inputs",
    "spoiler": "fault_injector",
    "still": "the name of the check",
    "succession": "fallback",
    "surroundings": "fault_environment",
    "suspicion": "actuator_estimator",
    "told": "disturbance_inputs",
    "upcoming": "episode_prefetch",
    "wants": "the name of the rule",
    "ways": "shortest_paths",
    "whole_files": "atomic_write",
    "witness": "observer",
    "worth": "the name of the number",
}
# Keys and values that readers of our JSON rely on; written in quotes or backticks they need no waiver.
PUBLIC = {"judged", "judged_figure", "judged_in_batch_on_mujocos_episodes", "verdicts"}
PLACES = (
    *("README.md", "CHANGELOG.md", "Makefile", "pyproject.toml", "configs", "docs", "hardware_drivers"),
    *("policy_server", "sim_nodes", "tests", "training"),
    *(
        f"ros2_ws/src/fulmar_{name}"
        for name in ("core", "bags", "ros", "bringup", "evaluation", "benchmarks", "cli")
    ),
)
ENDINGS = {"", ".py", ".md", ".yaml", ".toml", ".xml", ".cfg"}
WAIVER = re.compile(r"(?:#|<!--) word: \S.*")
OWN = Path(__file__).name


def pattern(form: str) -> str:
    """A form alone or as a part of a name; `pictures/` is a path and `--picture` an option."""
    capital, upper = form.capitalize(), form.upper()
    ending = r"(?![a-z/])" if form.startswith("picture") else r"(?![a-z])"
    return rf"(?:(?<![A-Za-z])(?<!--){form}{ending}|{capital}{ending}|(?<![A-Za-z]){upper}(?![A-Za-z]))"


FORMS = [
    (re.compile("|".join(pattern(form) for form in forms.split())), better) for forms, better in WORDS.items()
]
NAMED = [
    (re.compile(rf"[._\"'`]{name}\b|\b{name}(?:_|\"|'|`|\s*[:=](?!\s*$))"), better, places)
    for name, (better, places) in NAMES.items()
]
ANY = re.compile("|".join([*" ".join(WORDS).split(), *NAMES]), re.IGNORECASE)
QUOTED = re.compile("|".join(rf"(?<=[\"'`]){key}(?=[\"'`])" for key in sorted(PUBLIC, key=len, reverse=True)))


def words_in(line: str, place: str) -> list[tuple[str, str]]:
    """Words of a line that are not the field's, each with what to write instead."""
    if not ANY.search(line):
        return []
    line = QUOTED.sub("", line)
    found = [(match[0], better) for form, better in FORMS for match in form.finditer(line)]
    for name, better, places in NAMED:
        if place.startswith(places):
            found += [(match[0].strip("._\"'`:= "), better) for match in name.finditer(line)]
    return found


def files_of(repository: Path, place: str) -> list[Path]:
    """Text files of a folder, or the file itself."""
    root = repository / place
    files = sorted(root.rglob("*")) if root.is_dir() else [root]
    return [
        path
        for path in files
        if path.is_file() and path.suffix in ENDINGS and path.name != OWN and "__pycache__" not in path.parts
    ]


@pytest.mark.parametrize("place", PLACES)
def test_texts_and_names_use_the_terms_of_the_field(repository, place):
    hits = []
    for path in files_of(repository, place):
        name = str(path.relative_to(repository))
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            waived = " word: " in line and WAIVER.search(line)
            found = words_in(WAIVER.sub("", line) if waived else line, name)
            if not waived:
                hits += [f"{name}:{number}: '{word}' → {better}" for word, better in found]
            elif not found:
                hits.append(f"{name}:{number}: the waiver waives nothing; remove it")
        stem = path.stem.removeprefix("test_").removesuffix("_node")
        if path.suffix == ".py" and stem in MODULES:
            hits.append(f"{name}: call the module after {MODULES[stem]}")
        hits += [f"{name}: '{word}' in its name → {better}" for word, better in words_in(path.name, name)]
    assert not hits, f"{len(hits)} words are not the field's:\n" + "\n".join(hits)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("what it is told", ["told"]),
        ("untold = 1", []),
        ("is_told, ToldInputs, TOLD", ["told", "Told", "TOLD"]),
        ("def test_the_verdict_is_printed():", ["verdict"]),
        ('row["judged_figure"], `verdicts`', []),
        ("judged_figure = 1", ["judged"]),
        ("[a](pictures/b.png) by --picture", []),
        ("draw_picture(Picture)", ["picture", "Picture"]),
    ],
)
def test_a_word_is_found_alone_and_in_names(line, words):
    assert sorted(word for word, _ in words_in(line, "docs/x.md")) == sorted(words)


@pytest.mark.parametrize(
    ("place", "line", "count"),
    [
        ("training/a.py", "settings.gas", 1),
        ("training/a.py", "gas thrusters save gas", 0),
        ("configs/training/a.yaml", "gas: 1.15", 1),
        ("configs/training/a.yaml", "wrench: true", 1),
        ("training/a.py", "the network asks for a wrench", 0),
        ("training/a.py", "orders = 3", 1),
        ("hardware_drivers/a.py", "orders = 3", 0),
    ],
)
def test_a_name_is_found_where_it_is_one(place, line, count):
    assert len(words_in(line, place)) == count
