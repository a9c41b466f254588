"""Where configuration lies, and what its names are."""

from __future__ import annotations

import os

import pytest

from fulmar_core.config.errors import ConfigError, UnknownNameError
from fulmar_core.config.paths import config_directories, config_directory, config_names, config_path


@pytest.fixture
def own_configs(tmp_path, monkeypatch):
    (tmp_path / "robots").mkdir()
    for name in ("zebra", "ant"):
        (tmp_path / "robots" / f"{name}.yaml").write_text("name: x\n")
    (tmp_path / "robots" / "notes.txt").write_text("no robot\n")
    monkeypatch.setenv("FULMAR_CONFIGS", str(tmp_path))
    return tmp_path


def test_the_environment_variable_names_a_folder_that_comes_before_what_fulmar_comes_with(own_configs):
    assert config_directories() == (own_configs, config_directory())
    assert {"ant", "zebra", "floating_platform"} <= set(config_names("robots"))
    assert "go_to_pose" in config_names("tasks")
    assert config_path("robots", "ant").resolve() == own_configs / "robots" / "ant.yaml"


def test_of_two_files_of_one_name_the_one_of_the_first_folder_counts(
    own_configs, tmp_path_factory, monkeypatch
):
    second = tmp_path_factory.mktemp("second")
    (second / "robots").mkdir()
    for name in ("ant", "bee", "floating_platform"):
        (second / "robots" / f"{name}.yaml").write_text("name: x\n")
    monkeypatch.setenv("FULMAR_CONFIGS", f"{own_configs}{os.pathsep}{second}")
    found = {
        name: config_path("robots", name).resolve().parents[1] for name in ("ant", "bee", "floating_platform")
    }
    assert found == {"ant": own_configs, "bee": second, "floating_platform": second}


def test_without_it_only_the_checkout_s_own_configs_are_found(monkeypatch):
    monkeypatch.delenv("FULMAR_CONFIGS", raising=False)
    assert config_directories() == (config_directory(),)
    assert (config_directory() / "robots" / "floating_platform.yaml").is_file()


def test_a_folder_without_any_family_is_refused_by_name(tmp_path, monkeypatch):
    (tmp_path / "robot").mkdir()
    monkeypatch.setenv("FULMAR_CONFIGS", str(tmp_path))
    with pytest.raises(ConfigError, match=f"^{tmp_path}: .* it has none of .*robots/.*Set FULMAR_CONFIGS"):
        config_names("robots")


def test_names_are_sorted_and_only_yaml_files_count(own_configs):
    names = config_names("robots")
    assert names == sorted(names)
    assert "notes" not in names


def test_a_family_without_a_folder_has_no_names(own_configs):
    assert config_names("ants") == []


def test_an_unknown_name_gets_the_nearest_one(own_configs):
    with pytest.raises(UnknownNameError, match=r"^unknown robot 'zebar'\. Did you mean 'zebra'\?$") as caught:
        config_path("robots", "zebar")
    assert {"ant", "zebra"} <= set(caught.value.known)


@pytest.mark.parametrize("name", ["../robots/ant", "./ant", "", "ant.yaml"])
def test_a_name_is_a_name_and_never_a_path(own_configs, name):
    with pytest.raises(UnknownNameError):
        config_path("robots", name)


def test_paths_are_printed_relative_to_the_working_folder(own_configs, monkeypatch):
    monkeypatch.chdir(own_configs)
    assert str(config_path("robots", "ant")) == "robots/ant.yaml"
    monkeypatch.chdir("/")
    assert config_path("robots", "ant").is_file()
