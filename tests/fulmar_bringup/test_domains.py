"""ROS domains: reserved for tests and evaluations, claimed by runs."""

from __future__ import annotations

import pytest

from fulmar_bringup.domains import claimed_domain, reserved_domains
from fulmar_core.config.errors import ConfigError


def test_two_runs_in_one_domain_are_refused_until_the_first_is_over(monkeypatch):
    with reserved_domains(1) as (domain,):
        monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
        with claimed_domain("alpha") as claimed:
            assert claimed == domain
            with pytest.raises(ConfigError, match=f"using ROS domain {domain} for .* set ROS_DOMAIN_ID"):
                claimed_domain("alpha").__enter__()
        with claimed_domain("alpha"):
            pass


def test_runs_of_two_names_share_a_domain_and_one_name_is_refused_in_one_line(monkeypatch):
    with reserved_domains(1) as (domain,):
        monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
        with claimed_domain("alpha"), claimed_domain("beta") as shared:
            assert shared == domain
            with pytest.raises(
                ConfigError, match=r"another `fulmar run` is using .* for 'beta', .* another --name"
            ):
                claimed_domain("beta").__enter__()


def test_a_domain_with_a_run_in_it_is_not_reserved(monkeypatch, tmp_path):
    # Locks of its own: another test may have this very domain.
    monkeypatch.setattr("fulmar_bringup.domains._lock_folder", lambda: tmp_path)
    monkeypatch.setattr("fulmar_bringup.domains.DOMAINS", range(101, 102))
    monkeypatch.setenv("ROS_DOMAIN_ID", "101")
    with (
        claimed_domain("alpha"),
        pytest.raises(ConfigError, match="1 free ROS domains are needed, 0 were found"),
    ):
        reserved_domains(1).__enter__()
    with reserved_domains(1) as domains:
        assert domains == [101]


@pytest.mark.parametrize("text", ["x", "-1", "233"])
def test_a_domain_that_is_none_is_refused(monkeypatch, text):
    monkeypatch.setenv("ROS_DOMAIN_ID", text)
    with pytest.raises(ConfigError, match=f"ROS_DOMAIN_ID = '{text}' must be a whole number from 0 to 232"):
        claimed_domain("alpha").__enter__()
