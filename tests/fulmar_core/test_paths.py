"""Where configuration lies, and what its names are."""

from __future__ import annotations

import pytest

from fulmar_core.errors import ConfigError, UnknownNameError
from fulmar_core.paths import config_directory, config_names, config_path


@pytest.fixture
def own_configs(tmp_path, monkeypatch):
    (tmp_path / "robots").mkdir()
    for name in ("zebra", "ant"):
        (tmp_path / "robots" / f"{name}.yaml").write_text("name: x\n")
    (tmp_path / "robots" / "notes.txt").write_text("no robot\n")
    monkeypatch.setenv("FULMAR_CONFIGS", str(tmp_path))
    return tmp_path


def test_the_environment_variable_names_the_configuration_folder(own_configs):
    assert config_directory() == own_configs


def test_without_it_the_checkout_s_own_configs_are_found(monkeypatch):
    monkeypatch.delenv("FULMAR_CONFIGS", raising=False)
    assert (config_directory() / "robots" / "floating_platform.yaml").is_file()


def test_a_folder_without_robots_is_refused_by_name(tmp_path, monkeypatch):
    monkeypatch.setenv("FULMAR_CONFIGS", str(tmp_path))
    with pytest.raises(ConfigError, match=str(tmp_path)):
        config_directory()


def test_names_are_sorted_and_only_yaml_files_count(own_configs):
    assert config_names("robots") == ["ant", "zebra"]


def test_a_family_without_a_folder_has_no_names(own_configs):
    assert config_names("tasks") == []


def test_an_unknown_name_gets_the_nearest_one(own_configs):
    with pytest.raises(UnknownNameError, match=r"^unknown robot 'zebar'\. Did you mean 'zebra'\?$") as caught:
        config_path("robots", "zebar")
    assert caught.value.known == ["ant", "zebra"]


@pytest.mark.parametrize("name", ["../robots/ant", "./ant", "", "ant.yaml"])
def test_a_name_is_a_name_and_never_a_path(own_configs, name):
    with pytest.raises(UnknownNameError):
        config_path("robots", name)


def test_paths_are_printed_relative_to_the_working_folder(own_configs, monkeypatch):
    monkeypatch.chdir(own_configs)
    assert str(config_path("robots", "ant")) == "robots/ant.yaml"
    monkeypatch.chdir("/")
    assert config_path("robots", "ant").is_file()
