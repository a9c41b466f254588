"""Signed bundles: who is not trusted, or changes anything, does not get in."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from fulmar_core.config.errors import BundleError, ConfigError, FulmarError
from fulmar_core.loop.bundle_signature import make_keys, sign_bundle, verify_bundle
from fulmar_core.loop.policy_bundle import PASSPORT, SIGNATURE, read_bundle, read_passport
from policy_server.controllers import policies_directory

pytest.importorskip("cryptography")
SHIPPED = policies_directory() / "floating_platform_go_to_pose"


@pytest.fixture
def keys(tmp_path):
    make_keys(tmp_path / "private.pem", tmp_path / "lab.pem")
    return tmp_path / "private.pem", tmp_path / "lab.pem"


@pytest.fixture
def bundle(tmp_path, keys):
    folder = shutil.copytree(SHIPPED, tmp_path / "bundle")
    sign_bundle(folder, keys[0])
    return folder


def test_a_signed_bundle_is_known_by_the_key_that_signed_it(bundle, keys):
    assert verify_bundle(read_bundle(bundle), keys[1]) == "lab.pem"


def test_of_a_folder_of_keys_the_right_one_is_found(bundle, keys, tmp_path):
    folder = tmp_path / "trusted"
    folder.mkdir()
    make_keys(tmp_path / "other_private.pem", folder / "a_other.pem")
    shutil.copy(keys[1], folder / "b_lab.pem")
    assert verify_bundle(read_bundle(bundle), folder) == "b_lab.pem"


def test_a_bundle_without_a_signature_is_refused(bundle, keys):
    (bundle / SIGNATURE).unlink()
    with pytest.raises(BundleError, match="not signed"):
        verify_bundle(read_bundle(bundle), keys[1])


def test_a_signature_of_somebody_else_is_refused(bundle, tmp_path):
    make_keys(tmp_path / "p2.pem", tmp_path / "other.pem")
    with pytest.raises(BundleError, match="signed by none"):
        verify_bundle(read_bundle(bundle), tmp_path / "other.pem")


def test_a_passport_that_was_changed_and_sealed_anew_is_refused(bundle, keys):
    passport = read_passport(bundle)
    changed = replace(passport, training={**passport.training, "note": "trust me"}).sealed()
    (bundle / PASSPORT).write_text(json.dumps(changed.plain()))
    read_passport(bundle)  # every hash is in order
    with pytest.raises(BundleError, match="changed after it was signed"):
        verify_bundle(read_bundle(bundle), keys[1])


def test_a_network_that_was_exchanged_is_refused_by_its_hash(bundle):
    other = policies_directory() / "floating_platform_go_to_position"
    shutil.copy(other / "policy.onnx", bundle / "policy.onnx")
    with pytest.raises(BundleError, match="SHA-256"):
        read_passport(bundle)


def test_a_damaged_bundle_is_not_signed(bundle, keys):
    (bundle / "policy.onnx").write_bytes(b"nothing")
    with pytest.raises(BundleError):
        sign_bundle(bundle, keys[0])


def test_a_key_is_never_overwritten_and_the_private_one_is_for_its_owner_alone(keys):
    assert keys[0].stat().st_mode & 0o077 == 0
    with pytest.raises(ConfigError, match="exists already"):
        make_keys(*keys)


def test_a_file_without_a_key_is_rejected(bundle, tmp_path):
    (tmp_path / "no.pem").write_text("hello")
    for call in (
        lambda: verify_bundle(read_bundle(bundle), tmp_path / "no.pem"),
        lambda: sign_bundle(bundle, tmp_path / "no.pem"),
    ):
        with pytest.raises(ConfigError, match=r"no\.pem"):
            call()
    with pytest.raises(ConfigError, match="cannot be read"):
        verify_bundle(read_bundle(bundle), tmp_path / "missing.pem")


@given(st.binary(max_size=200))
@hypothesis_settings(max_examples=50, deadline=None)
def test_whatever_lies_in_the_place_of_a_signature_is_refused_in_words(tmp_path_factory, junk):
    folder = tmp_path_factory.mktemp("junk")
    make_keys(folder / "private.pem", folder / "public.pem")
    bundle = shutil.copytree(SHIPPED, folder / "bundle")
    (bundle / SIGNATURE).write_bytes(junk)
    with pytest.raises(FulmarError):
        verify_bundle(read_bundle(bundle), folder / "public.pem")
